"""Measure the accuracy of roughly drawn outlines after fitting them to edges (``manitwin review cutouts --draw``).

    python benchmarks/outline_fit.py [--part held-out] [--count 120]

The pictures are composites (``composites.py``), including cut and doubtful ones. A hand-drawn outline is simulated by a polygon
of the true contour with few corners, each displaced by some pixels.
"""

from __future__ import annotations

import argparse
import time

import cv2
import numpy as np
from composites import SEEDS, composite

from manitwin.models.matting.fitted_outline import fit_outline

CORNER_SHARE, OFF_SHARE = 0.012, 0.008
"""Relative to the diagonal of the object: tolerance of the polygon, and standard deviation of its corners."""
LEAST_SHARE = 0.005
RIGHT_IOU = 0.95


def drawn(truth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the largest component of a mask ``(H, W) bool`` as a person would draw it, with holes filled."""
    found, _ = cv2.findContours(truth.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    outline = max(found, key=cv2.contourArea)
    diagonal_px = float(np.hypot(*np.ptp(outline[:, 0], axis=0)))
    corners = cv2.approxPolyDP(outline, CORNER_SHARE * diagonal_px, True)[:, 0].astype(float)
    corners += rng.normal(0, OFF_SHARE * diagonal_px, corners.shape)
    mask = np.zeros(truth.shape, np.uint8)
    cv2.fillPoly(mask, [np.rint(corners).astype(np.int32)], 1)
    return np.asarray(mask.astype(bool))


def iou(one: np.ndarray, other: np.ndarray) -> float:
    """Return the intersection over union of two masks."""
    return float((one & other).sum() / max((one | other).sum(), 1))


def main() -> None:
    """Draw the outlines, fit them and compare them with the truth."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", choices=sorted(SEEDS), default="held-out")
    parser.add_argument("--count", type=int, default=120)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    rows = []
    for number in range(options.count):
        picture = composite(options.part, number)
        if picture.truth.mean() < LEAST_SHARE:
            continue
        rough = drawn(picture.truth, np.random.default_rng(number))
        begun = time.process_time()
        fitted = fit_outline(picture.rgb, rough)
        rows.append((iou(rough, picture.truth), iou(fitted, picture.truth), time.process_time() - begun))
    found = np.array(rows)
    print(f"{len(rows)} outlines: IoU, median (share above {RIGHT_IOU})")
    for name, column in (("drawn", 0), ("fitted", 1)):
        print(f"  {name}: {np.median(found[:, column]):.3f} ({(found[:, column] > RIGHT_IOU).mean():.0%})")
    print(f"worse than drawn: {(found[:, 1] < found[:, 0]).mean():.0%}; CPU-s, median: {np.median(found[:, 2]):.2f}")


if __name__ == "__main__":
    main()
