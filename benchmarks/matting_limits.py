"""Print the limits of the doubts about a cut-out, and what acceptance by them is worth on things and grounds left out.

    python benchmarks/matting_limits.py [--first 400] [--count 211] [--share 0.97]

Composites of the calibration part (``composites.py``), whose grounds and numbers are neither those that rules were made on nor
the held-out ones. A limit is what a share of the right cut-outs (one whole thing, IoU above 0.95) stays below, of those that the
other scores believe: wrong ones do not set it. With limits set without an eighth of the categories, or without a ground, the rest
is judged on what was left out.
"""

from __future__ import annotations

import argparse
import zlib
from dataclasses import asdict, dataclass

import cv2
import numpy as np
from composites import composite
from matting import RIGHT_IOU, share

from manitwin.models.matting.confidence import MOST_ZOOM, below
from manitwin.models.matting.doubts import LIMITS, doubts_of
from manitwin.models.matting.matte import study_photo

OF_DOUBTS = ("thick", "undivided", "entire", "known_to_colours")
BELIEVED = 0.5
FOLDS = 8


@dataclass(frozen=True)
class Measured:
    """One composite: its category and ground, whether it is one whole thing, found right, what other scores say, its doubts."""

    category: str
    ground: str
    single: bool
    right: bool
    others: float
    doubts: dict[str, float]


def measured(number: int) -> Measured | None:
    """Make one composite of the calibration part and measure what was found; None of nothing."""
    picture = composite("calibration", number)
    study = study_photo(picture.rgb)
    if study.scores is None:
        return None
    zoom = max(picture.rgb.shape[:2]) / max(study.found.mask.shape)
    found = study.alpha > 127
    iou = (found & picture.truth).sum() / (found | picture.truth).sum()
    single = picture.kind == "single"
    others = float(np.prod([value for name, value in asdict(study.scores).items() if name not in OF_DOUBTS]))
    doubts = asdict(doubts_of(study.found, zoom=min(zoom, MOST_ZOOM)))
    ground = picture.setting.split(",")[0]
    return Measured(picture.category, ground, single, bool(single and iou > RIGHT_IOU), others, doubts)


def limits_of(some: list[Measured], quantile: float) -> dict[str, float]:
    """Return the limit of each doubt."""
    believed = [each.doubts for each in some if each.right and each.others >= BELIEVED]
    return {name: float(np.quantile([doubts[name] for doubts in believed], quantile)) for name in asdict(LIMITS)}


def accepted(each: Measured, limits: dict[str, float]) -> bool:
    """Return whether one is believed by these limits."""
    return bool(each.others * np.prod([below(each.doubts[name], limits[name]) for name in limits]) >= BELIEVED)


def left_out(some: list[Measured], groups: list[int], quantile: float) -> str:
    """Say what is accepted of each group by the limits of the others."""
    taken = []
    for group in sorted(set(groups)):
        limits = limits_of([each for each, of in zip(some, groups, strict=True) if of != group], quantile)
        taken += [each for each, of in zip(some, groups, strict=True) if of == group and accepted(each, limits)]
    whole = [each for each in taken if each.single]
    right = sum(each.right for each in whole)
    return (
        f"accepted {len(whole)}, right {right} ({share(right, len(whole))}), others accepted {len(taken) - len(whole)}"
    )


def main() -> None:
    """Print the limits and what they are worth."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=400)
    parser.add_argument("--count", type=int, default=211)
    parser.add_argument("--share", type=float, default=0.97)
    given = parser.parse_args()
    cv2.setNumThreads(1)
    every = [measured(number) for number in range(given.first, given.first + given.count)]
    some = [each for each in every if each is not None]
    for name, limit in limits_of(some, given.share).items():
        print(f"{name:<20} {limit:.3f}   in the code {asdict(LIMITS)[name]:.3f}")
    print(f"{sum(each.single for each in some)} of one whole thing, {sum(each.right for each in some)} found right")
    print("categories left out:", left_out(some, [zlib.crc32(e.category.encode()) % FOLDS for e in some], given.share))
    grounds = sorted({each.ground for each in some})
    print("grounds left out:", left_out(some, [grounds.index(each.ground) for each in some], given.share))


if __name__ == "__main__":
    main()
