"""A data set served by ``manitwin view`` in a process of its own."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class Served:
    """A running ``manitwin view``: its link of one use, its address, and what else it printed."""

    def __init__(self, process: subprocess.Popen[str]):
        self.process = process
        assert process.stdout is not None
        self.link = self.next_link()
        self.address = self.link.split("/enter")[0]

    def next_link(self) -> str:
        """Return the next link that it prints."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if found := re.search(r"http://\S+/enter\?\S+", line):
                return found[0]
        raise AssertionError("it ended without a link")


@contextmanager
def serving(place: Path, *more: str) -> Iterator[Served]:
    """Serve a data set or a twin; it must end in order when it is interrupted."""
    command = [sys.executable, "-m", "manitwin", "view", str(place), "--no-browser", *more]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=dict(os.environ)) as process:
        try:
            yield Served(process)
            process.send_signal(signal.SIGINT)
            assert process.wait(20) == 0
        finally:
            process.kill()
