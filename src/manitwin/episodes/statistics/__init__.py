"""The statistics of a folder of episodes: what was attempted, planned, executed, succeeded and kept, and of what it failed."""
