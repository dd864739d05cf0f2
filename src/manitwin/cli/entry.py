"""Entry point of the command ``manitwin``: an interrupt is answered before anything that takes time is imported."""

from __future__ import annotations

import os
import sys

from manitwin.cli.interrupt import exit_before_teardown, exit_on_interrupt
from manitwin.cli.machine_limits import USAGE_STATUS, memory_limit_message


def main() -> None:
    """Import the command line and run it; say so where there is too little memory to import it."""
    exit_on_interrupt()
    said = memory_limit_message(sys.argv[1:])
    if said is not None:
        os.write(2, f"{said}\n".encode(errors="backslashreplace"))
        sys.exit(USAGE_STATUS)
    from manitwin.cli.main import interrupted
    from manitwin.cli.main import main as run_command_line

    try:
        run_command_line()
    except SystemExit as end:
        if interrupted() and isinstance(end.code, int):
            exit_before_teardown(end.code)
        raise
