"""Figures published in the paper, and their comparability with figures measured here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

CLAY = (
    "the paper takes these figures from CLAY (Zhang et al. 2024); neither names the CLIP model, the views or the ground"
)
GENERATION_QUALITY: dict[str, dict[str, float]] = {
    "ULIP": {"text": 0.1705, "image": 0.2140},
    "CLIP(N-I/T)": {"text": 0.1948, "image": 0.6848},
    "CLIP(I-I/T)": {"text": 0.2324, "image": 0.7769},
}
"""Table 2 of the paper, by metric and input."""
GENERATION_TIME_S = 45.0

GENERATION_SUCCESS, CANDIDATES, VERIFIED, VERIFICATION = 0.6967, 81.63, 62.14, 0.7613
"""Table 4: success rate of generation, grasp candidates and verified grasps per object, success rate of verification."""
GRASPS, OBJECTS, CATEGORIES, SMALLEST_M, LARGEST_M = 5_000_000, 100_000, 512, 0.02, 0.37


def comparison_row(
    metric: str,
    here: float | None,
    paper: float,
    comparable: str,
    why: str,
    *,
    interval: tuple[float | None, float | None] = (None, None),
    objects: int | None = None,
) -> dict[str, Any]:
    """Return a table row with a local figure, its 95 % interval and the paper's figure; ``comparable`` is yes, in part or no."""
    return {
        "metric": metric,
        "here": here,
        "low": interval[0],
        "high": interval[1],
        "objects": objects,
        "paper": float(paper),
        "comparable": comparable,
        "why": why,
    }


def grasp_rows(twins: dict[str, Any], rate: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the paper's grasp figures (tables 4 and 3) beside those of a data set.

    ``twins`` has ``objects``, ``simulated``, ``verified`` (means) and ``total``; ``rate`` has the rows of ``verification_rate``.
    """
    first = next((row for row in rate if row["proposals"].startswith("filtered")), None)
    share = None if first is None else first["rate"]
    interval = (None, None) if first is None else (first["low"], first["high"])
    count = twins["objects"]
    return [
        comparison_row(
            *("grasp candidates per object", twins["simulated"], CANDIDATES, "in part"),
            "both are proposals near a chosen point, thinned for diversity; there GraspGen proposes, here what the twins' "
            "records say; other objects",
            objects=count,
        ),
        comparison_row(
            *("verified grasps per object", twins["verified"], VERIFIED, "in part"),
            "the paper also says 10-50 an object (section 4), and 5M in all of 100K objects is 50; both count accepted objects",
            objects=count,
        ),
        comparison_row(
            *("grasp verification success rate", share, VERIFICATION, "in part"),
            "SAPIEN, lift and slide in both; proposer, thresholds and objects differ, and objects of which no grasp held are "
            "rejected here and not counted",
            interval=interval,
            objects=count,
        ),
        comparison_row(
            *("verified grasps in all", twins["total"], GRASPS, "no"),
            "a matter of how many objects were built",
            objects=count,
        ),
    ]
