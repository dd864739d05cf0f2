"""What a person types: one module a command, registered in ``manitwin.cli``."""
