"""Ground-truth labels of objects: a CSV file with one row per object; empty cells are not scored."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

from manitwin.errors import UsageError, unknown_name_message
from manitwin.formats.csv_file import read_csv
from manitwin.twin.point_records import GraspType

LIST_COLUMNS = (
    "category_synonyms", "colors", "materials", "functional_parts", "good_grasp_regions", "bad_grasp_regions",
    "typical_grasp_type",
)  # fmt: skip
NUMBER_COLUMNS = (
    "plausible_mass_low_kg", "plausible_mass_high_kg", "longest_side_low_m", "longest_side_high_m",
)  # fmt: skip
COLUMNS = ("file", "twin_id", "kind", "category", *LIST_COLUMNS, *NUMBER_COLUMNS, "hollow", "stands_upright", "notes")
MOST_ROWS = 1_000_000
GRASP_TYPES: tuple[str, ...] = get_args(GraspType)


@dataclass(frozen=True)
class Interval:
    """A plausible interval; ``middle`` is the geometric mean of its ends."""

    low: float
    high: float

    @property
    def middle(self) -> float:
        """The geometric mean, used for comparison."""
        return math.sqrt(self.low * self.high)


@dataclass(frozen=True)
class Label:
    """The ground truth of one object; empty lists and None are not scored. ``file`` is the input, ``twin_id`` the
    twin if known.
    """

    file: str
    twin_id: str | None
    categories: tuple[str, ...]
    colors: tuple[str, ...]
    materials: tuple[str, ...]
    parts: tuple[str, ...]
    good_regions: tuple[str, ...]
    bad_regions: tuple[str, ...]
    grasp_types: tuple[str, ...]
    mass_kg: Interval | None
    longest_side_m: Interval | None

    @property
    def named_parts(self) -> tuple[str, ...]:
        """All parts named by the label: functional parts, and good and bad grasp regions."""
        return tuple(dict.fromkeys((*self.parts, *self.good_regions, *self.bad_regions)))


def read_labels(path: Path) -> list[Label]:
    """Read a label file; raises UsageError, naming the line, for an unknown column or grasp type or an invalid number."""
    labels: list[Label] = []
    for line, row in read_csv(path, UsageError):
        for name in row:
            if name not in COLUMNS:
                raise UsageError(f"{path}: {unknown_name_message('column', name, COLUMNS)}")
        if len(labels) == MOST_ROWS:
            raise UsageError(f"{path}: more than {MOST_ROWS:,} rows; split the file")
        said = {name: (row.get(name) or "").strip() for name in COLUMNS}
        if not (said["file"] or said["twin_id"]):
            raise UsageError(f"{path}:{line}: file and twin_id are missing; give one of them")
        labels.append(_label(said, f"{path}:{line}"))
    if not labels:
        raise UsageError(f"{path}: the file has no labels; give a header with some of {', '.join(COLUMNS)}, and rows")
    return labels


def _label(said: Mapping[str, str], where: str) -> Label:
    lists = {name: _list(said[name]) for name in LIST_COLUMNS}
    return Label(
        file=said["file"],
        twin_id=said["twin_id"] or None,
        categories=(said["category"], *lists["category_synonyms"]) if said["category"] else (),
        colors=lists["colors"],
        materials=lists["materials"],
        parts=tuple(part.partition("=")[0].strip() for part in lists["functional_parts"]),
        good_regions=lists["good_grasp_regions"],
        bad_regions=lists["bad_grasp_regions"],
        grasp_types=tuple(_grasp_type(said, where) for said in lists["typical_grasp_type"]),
        mass_kg=_interval(said, "plausible_mass_low_kg", "plausible_mass_high_kg", where),
        longest_side_m=_interval(said, "longest_side_low_m", "longest_side_high_m", where),
    )


def _grasp_type(said: str, where: str) -> str:
    """Return a grasp type by its identifier; spellings such as "parallel jaw" are accepted."""
    name = "_".join(said.lower().replace("-", " ").split())
    if name not in GRASP_TYPES:
        raise UsageError(f"{where}: {unknown_name_message('typical_grasp_type', said, GRASP_TYPES)}")
    return name


def _list(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(";") if part.strip())


def _interval(said: Mapping[str, str], low: str, high: str, where: str) -> Interval | None:
    if not said[low] and not said[high]:
        return None
    try:
        interval = Interval(float(said[low]), float(said[high]))
    except ValueError:
        raise UsageError(
            f"{where}: {low} and {high} are {said[low]!r} and {said[high]!r}, not two numbers; give both as numbers"
        ) from None
    if not 0 < interval.low <= interval.high < math.inf:
        raise UsageError(
            f"{where}: {low} {interval.low:g} to {high} {interval.high:g} is not an interval above 0; give two"
            f" numbers above 0, the lower first"
        )
    return interval
