"""Set up a separate environment for a program that tests use and that needs conflicting package versions.

    python scripts/setup_side_environment.py vlm | usd-validate | simready | lerobot

Run by make with the Python of ``.venv``. A second run returns at once: a stamp in the environment holds the digest of its lock.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Side:
    """A side environment: description, lock file, a Python statement that verifies it, and its measured size in ``gigabytes``."""

    what: str
    lock: str
    probe: str
    gigabytes: float
    x86_64_linux_only: bool = False
    environment: dict[str, str] = field(default_factory=dict)


SIDES = {
    "vlm": Side(
        "the inference engine (vLLM on a processor) that the tests marked vlm_real ask",
        "tests/vlm_real/engine.lock",
        # vLLM loads kernels by processor features; there are none without AVX2.
        "from vllm.platforms import current_platform as here; here.import_kernels(); import torch; torch.ops._C.rms_norm",
        5.2,
        x86_64_linux_only=True,
        environment={"VLLM_TARGET_DEVICE": "cpu"},
    ),
    "usd-validate": Side(
        "NVIDIA's validator of USD assets, which the slow tests ask about exported stages; it wants numpy below 2",
        "tests/assets/writers/usd_validator.lock",
        "from pxr import Usd; import usd_validation_nvidia",
        0.3,
    ),
    "simready": Side(
        "NVIDIA's SimReady validator with its profiles, which a slow test asks about exported stages",
        "tests/assets/writers/simready.lock",
        "import simready.validate, simready.foundation.tier_core",
        0.3,
    ),
    "lerobot": Side(
        "LeRobot itself, which a slow test has load the data sets that this package writes; its torch brings NVIDIA's libraries",
        "tests/episodes/real_lerobot.lock",
        "from lerobot.datasets.lerobot_dataset import LeRobotDataset",
        6.8,
    ),
}
SPARE = 1.5  # during the installation


def stop(text: str) -> None:
    sys.exit(f"set-up: {text}")


def uv(*arguments: str) -> None:
    """Run the uv of ``.venv``; its error messages are shown."""
    if subprocess.run([str(Path(sys.executable).parent / "uv"), *arguments]).returncode != 0:
        stop("it could not be installed, for the reason above; mend it, then run the same command again")


def check_machine(side: Side) -> None:
    """Stop if there is no wheel for this platform, or not enough disk space."""
    if side.x86_64_linux_only and (sys.platform, platform.machine()) != ("linux", "x86_64"):
        stop(f"it runs on x86-64 Linux, this is {platform.machine()} {sys.platform}")
    free, needed = shutil.disk_usage(ROOT).free / 1e9, SPARE * side.gigabytes
    if free < needed:
        stop(f"it needs {needed:.1f} GB of disk, {free:.1f} GB are free; make room, then run this again")


def main() -> None:
    if len(sys.argv) != 2 or sys.argv[1] not in SIDES:
        stop(f"say which: {', '.join(SIDES)}")
    name = sys.argv[1]
    side, venv = SIDES[name], ROOT / f".venv-{name}"
    lock, stamp, python = ROOT / side.lock, venv / "manitwin-set-up.sha256", venv / "bin" / "python"
    digest = hashlib.sha256(lock.read_bytes() + sys.version.encode()).hexdigest()
    if stamp.is_file() and stamp.read_text() == digest:
        return
    check_machine(side)
    print(f"set-up: {side.what}: {side.gigabytes} GB in {venv.name}, once", flush=True)
    began = time.monotonic()
    uv("venv", "--quiet", "--clear", "--python", sys.executable, str(venv))
    uv("pip", "sync", "--quiet", "--python", str(python), "--require-hashes", str(lock))
    if subprocess.run([str(python), "-c", side.probe], env={**os.environ, **side.environment}).returncode != 0:
        stop("it is installed, but does not run here, for the reason above")
    stamp.write_text(digest)
    print(f"set-up: installed in {time.monotonic() - began:.0f} s", flush=True)


if __name__ == "__main__":
    main()
