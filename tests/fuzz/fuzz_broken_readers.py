"""Readers with one fault each, which the harness has to find."""

from __future__ import annotations

import ctypes
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from fuzz_numbers import OUTSIDE
from fuzz_target import Case, Target

from manitwin.errors import UsageError

GOOD = b"good"


def make(folder: Path) -> None:
    (folder / "sample.txt").write_bytes(GOOD)


def broken(fault: Callable[[Case], object]) -> Callable[[Case], None]:
    """Return a reader that reads the sample, and does as the fault does with all else."""

    def read(case: Case) -> None:
        if case.file.read_bytes() != GOOD:
            fault(case)

    return read


def hang(case: Case) -> None:
    while True:
        pass


def refuse(case: Case) -> None:
    raise UsageError("a message\nof two lines")


FAULTS: dict[str, Callable[[Case], object]] = {
    "raises": lambda case: {}["nothing"],
    "exits": lambda case: sys.exit(3),
    "crashes": lambda case: ctypes.string_at(0),
    "hangs": hang,
    "waits": lambda case: time.sleep(600),
    "hoards": lambda case: np.ones(1 << 28),
    "looks": lambda case: (case.folder.parent / OUTSIDE).read_bytes(),
    "lines": refuse,
}
BROKEN = {
    f"broken-{name}": Target(f"broken-{name}", make, broken(fault), links=False) for name, fault in FAULTS.items()
}
