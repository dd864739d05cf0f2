"""Annotator that asks a vision-language model, and checks its answers against geometry and priors."""
