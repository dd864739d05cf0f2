"""Mapping of ImageNet classes to the vocabulary of the priors: ``imagenet_classes.csv`` beside this module, one row per class.

``name`` is the everyday name of the object, which is in the priors; it is empty for classes that are no such objects
(animals, vehicles, rooms) or say nothing about the object. ``general`` is a more general term for several such names: a water
bottle and a wine bottle are bottles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from manitwin.errors import ManiTwinError
from manitwin.formats.csv_file import read_csv

TABLE, LIMITS = "imagenet_classes.csv", "name_limits.csv"
CLASSES = 1000


@dataclass(frozen=True)
class ImageNetNames:
    """Names in alphabetical order with the classes that each covers, ``members (N, 1000) bool``; likewise for general terms."""

    names: tuple[str, ...]
    members: np.ndarray
    general: tuple[str, ...]
    general_members: np.ndarray


@cache
def load_names() -> ImageNetNames:
    """Read the table; raises ManiTwinError unless it has each class once, in order."""
    rows = [row for _, row in read_csv(Path(__file__).with_name(TABLE), ManiTwinError, name=TABLE)]
    if [row["class"] for row in rows] != [str(number) for number in range(CLASSES)]:
        raise ManiTwinError(f"{TABLE}: not the classes 0 to {CLASSES - 1} in order; install the package again")
    names = tuple(sorted({row["name"] for row in rows} - {""}))
    general = tuple(sorted({row["general"] for row in rows} - {""}))
    members = np.array([[row["name"] == name for row in rows] for name in names])
    wider = np.array([[name in (row["general"], row["name"]) for row in rows] for name in general])
    return ImageNetNames(names, members, general, wider)


@cache
def load_limits() -> dict[str, float]:
    """Return for each name the highest probability that a picture of another object has given it (benchmarks/naming.py).

    Raises ManiTwinError if the names are not those of the table.
    """
    rows = (row for _, row in read_csv(Path(__file__).with_name(LIMITS), ManiTwinError, name=LIMITS))
    limits = {row["name"]: float(row["highest_wrong"]) for row in rows}
    table = load_names()
    if limits.keys() != {*table.names, *table.general}:
        raise ManiTwinError(f"{LIMITS}: not the names of {TABLE}; write it again with benchmarks/naming.py --limits")
    return limits
