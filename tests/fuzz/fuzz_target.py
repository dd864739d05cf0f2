"""What is fuzzed: a reader, and good samples of what it reads.

A target is added in five lines::

    @samples
    def png(folder: Path) -> None:
        Image.new("RGB", (48, 40), (200, 20, 20)).save(folder / "red.png")


    target("png", png, lambda case: read_image(case.file))

``fuzz_targets`` imports the modules that do so.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

TESTS = Path(__file__).resolve().parent.parent
MAKERS = ("fuzz", ".", "episodes", "robots", "models/vlm", "models/vlm_annotator")
"""Folders of tests whose modules make samples."""

sys.path[:0] = [str(TESTS / name) for name in MAKERS if str(TESTS / name) not in sys.path]


@dataclass(frozen=True)
class Case:
    """A folder with one mutated file: ``file`` lies in ``folder``, which holds copies of all samples."""

    folder: Path
    file: Path


@dataclass(frozen=True)
class Target:
    """A reader and its samples.

    ``make`` writes them into a folder; files that match one of the ``files`` are mutated, one a case; ``read`` reads a
    case. ``fresh``: the reader writes, so that each case is a new copy of all samples. ``weight`` scales the number of cases:
    below 1 for a reader that takes long. ``shared`` are names below the shared data that are samples as well.
    ``links``: something else may stand in a file's place. ``named``: a person named the file; a link
    out of its folder is followed, and a file of gigabytes is read.
    """

    name: str
    make: Callable[[Path], object]
    read: Callable[[Case], object]
    files: tuple[str, ...] = ("*",)
    fresh: bool = False
    weight: float = 1.0
    shared: tuple[str, ...] = ()
    links: bool = True
    named: bool = False


TARGETS: dict[str, Target] = {}


def target(name: str, make: Callable[[Path], object], read: Callable[[Case], object], **more: object) -> None:
    """Add a target; see ``Target``."""
    assert name not in TARGETS, name
    TARGETS[name] = Target(name, make, read, **more)  # type: ignore[arg-type]
