"""Questions about rendered scenes with computed answers, for training and evaluating vision-language models."""
