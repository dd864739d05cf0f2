"""The command line: commands, progress, summaries, checks of the machine."""
