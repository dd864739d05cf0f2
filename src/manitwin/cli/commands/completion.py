"""``manitwin completion``: what a shell needs to complete commands, options and names."""

from __future__ import annotations

import sys
from typing import Annotated

from typer.completion import completion_init, get_completion_script

from manitwin.cli import choices

__all__ = ["COMPLETION_VARIABLE", "PROGRAM", "completion", "completion_init"]

PROGRAM = "manitwin"
COMPLETION_VARIABLE = f"_{PROGRAM.upper()}_COMPLETE"
"""Where a shell's script asks for completions instead of a command to be run: typer's convention."""


def completion(
    shell: Annotated[str, choices.SHELLS.argument(help="bash, zsh or fish.", metavar="SHELL")],
) -> None:
    """Print the script with which a shell completes commands, options and names."""
    script = get_completion_script(prog_name=PROGRAM, complete_var=COMPLETION_VARIABLE, shell=shell)
    sys.stdout.write(f"{script.strip()}\n")
