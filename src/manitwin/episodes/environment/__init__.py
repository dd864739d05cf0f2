"""A task as a Gymnasium environment."""
