"""What ``build``, ``run``, ``layout``, ``trajectories`` and ``render`` show while they work, and the log that they leave."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from manitwin.cli.console import err_console, out_console
from manitwin.cli.progress import RunProgress, ShownProgress
from manitwin.cli.run_log import log_into


class WatchedRun(ShownProgress):
    """The progress of a run on the consoles of this command, whose log lies at ``log()`` unless ``--log`` says otherwise.

    ``what`` names the items in the plural.
    """

    def __init__(self, what: str, log: Callable[[], Path]):
        super().__init__(RunProgress(what), out_console, err_console)
        self._log = log

    def start(self, total: int, opened: int | None = None) -> None:
        """Begin a run, and its log: what was refused before leaves none behind."""
        log_into(self._log())
        self.progress.start(total, opened)
        if opened is not None:
            out_console.print(f"{total} {self.progress.what}, {opened} to do", markup=False)
