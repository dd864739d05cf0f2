"""The kinds of grippers, each a small table of numbers read from a TOML file."""
