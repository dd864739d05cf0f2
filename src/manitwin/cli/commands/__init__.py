"""The commands: one module each, registered in ``manitwin.cli.main``."""
