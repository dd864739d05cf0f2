"""Download of one published file with a package manager's client, using its own registry and proxy settings."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path

from manitwin.errors import Unavailable
from manitwin.formats.printable import printable_line

FETCH_SECONDS = 1800


def fetch_package_file(command: Sequence[str], folder: Path, *, suffix: str, called: str, by_hand: str) -> Path:
    """Run a client's ``command`` in ``folder`` and return the file with ``suffix`` that it wrote there.

    ``called`` names the command in messages, and ``by_hand`` is the alternative that they suggest. Raises Unavailable if no
    file arrives.
    """
    try:
        done = subprocess.run(command, capture_output=True, stdin=subprocess.DEVNULL, timeout=FETCH_SECONDS, cwd=folder)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise Unavailable(f"{called}: {printable_line(str(error))}; {by_hand}") from error
    files = sorted(folder.glob(f"*{suffix}"))
    if done.returncode or not files:
        said = printable_line(done.stderr.decode("utf-8", "replace").strip()[-300:] or f"no {suffix} file came")
        raise Unavailable(f"{called} failed ({said}); look at the network, or {by_hand}")
    return files[0]
