"""Questions about drawn scenes with computed answers, for training and judging vision-language models."""
