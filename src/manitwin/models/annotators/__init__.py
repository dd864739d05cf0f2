"""What an object is, weighs and is for: a VLM's work in the paper; the built-in ``rules`` reads priors and geometry."""
