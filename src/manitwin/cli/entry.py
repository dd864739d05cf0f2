"""Entry point of the command ``manitwin``: an interrupt is answered before anything that takes time is imported."""

from __future__ import annotations

from manitwin.cli.interrupt import leave_when_interrupted


def main() -> None:
    """Import the command line and run it."""
    leave_when_interrupted()
    from manitwin.cli.main import main as run_command_line

    run_command_line()
