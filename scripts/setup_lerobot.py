"""Set up ``.venv-lerobot``: LeRobot itself, which a slow test asks to load the data sets that this package writes.

Run by ``make lerobot-real``, with the Python of ``.venv``. LeRobot has an environment of its own because it wants other versions
than this package, and 7 GB (its torch brings NVIDIA's libraries). A second run takes no time: a stamp in the environment holds
the digest of the lock.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv-lerobot"
PYTHON = VENV / "bin" / "python"
LOCK = ROOT / "tests" / "apps" / "trajectories" / "real_lerobot.lock"
STAMP = VENV / "manitwin-lerobot.sha256"
# measured: 6.8 GB installed; uv links to its cache where that is on the same disk
NEEDED_BYTES = 9 << 30

PROBE = "from lerobot.datasets.lerobot_dataset import LeRobotDataset"


def say(text: str) -> None:
    print(f"lerobot: {text}", flush=True)


def stop(text: str) -> None:
    sys.exit(f"lerobot: {text}")


def uv(*arguments: str) -> None:
    """Run the uv of ``.venv``; what it says of a failure is shown."""
    if subprocess.run([str(Path(sys.executable).parent / "uv"), *arguments]).returncode != 0:
        stop("it could not be installed, for the reason above; mend it, then run the same command again")


def main() -> None:
    digest = hashlib.sha256(LOCK.read_bytes() + sys.version.encode()).hexdigest()
    if STAMP.is_file() and STAMP.read_text() == digest:
        return
    free = shutil.disk_usage(ROOT).free
    if free < NEEDED_BYTES:
        stop(f"it needs {NEEDED_BYTES >> 30} GB of disk, {free >> 30} GB are free; make room, then run this again")
    say("installing it in .venv-lerobot (7 GB, a minute or some, once)")
    began = time.monotonic()
    uv("venv", "--quiet", "--clear", "--python", sys.executable, str(VENV))
    uv("pip", "sync", "--quiet", "--python", str(PYTHON), "--require-hashes", str(LOCK))
    if subprocess.run([str(PYTHON), "-c", PROBE]).returncode != 0:
        stop("it is installed, but does not run here, for the reason above")
    STAMP.write_text(digest)
    say(f"installed in {time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
