"""Shape-blind baselines that a model of affordances or parts has to exceed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from manitwin.dataset.affordances.heat_maps import POSITIVE, area_under_curve, similarity
from manitwin.dataset.affordances.maps import SurfaceMaps
from manitwin.twin.part_records import NO_PART


@dataclass(frozen=True)
class BaselineScores:
    """Scores of two shape-blind maps: a constant, and a map that decreases with the distance to the centroid of the points.

    ``uniform_sim`` and ``middle_sim`` are SIM values. ``middle_auc`` is the area under the ROC curve of the second map for the
    positive points, NaN if all or none are positive; the constant has an AUC of one half.
    """

    uniform_sim: float
    middle_sim: float
    middle_auc: float


def baseline_scores(maps: SurfaceMaps) -> dict[str, BaselineScores]:
    """Return the baseline scores of a twin's maps, by name."""
    distance_m = np.linalg.norm(maps.points_m - maps.points_m.mean(0), axis=1)
    near = 1 - distance_m / max(float(distance_m.max()), 1e-12)
    return {
        name: BaselineScores(
            similarity(np.ones(len(values)), values),
            similarity(near, values),
            area_under_curve(near, values >= POSITIVE),
        )
        for name, values in maps.maps.items()
    }


def part_shares(maps: SurfaceMaps) -> dict[str, float]:
    """Return the share of each part, by name, among the points with a known part."""
    known = maps.parts[maps.parts != NO_PART]
    if not len(known):
        return {}
    names = [part.name for part in maps.twin.record.parts]
    shares: dict[str, float] = defaultdict(float)
    for place, count in zip(*np.unique(known, return_counts=True), strict=True):
        shares[names[place]] += float(count) / len(known)
    return dict(shares)


def baseline_part_accuracy(rows: Sequence[Mapping[str, Any]]) -> tuple[float | None, int]:
    """Return the mean accuracy of labelling all points with the largest part of the category's other twins, and the number of
    twins.

    ``rows`` have ``category`` and ``part_shares``. Only twins with another twin of their category count; the accuracy is None if
    there are none.
    """
    of_category: dict[str, list[Mapping[str, float]]] = defaultdict(list)
    for row in rows:
        if row["part_shares"]:
            of_category[row["category"]].append(row["part_shares"])
    right = []
    for alike in of_category.values():
        total: dict[str, float] = defaultdict(float)
        for shares in alike:
            for name, share in shares.items():
                total[name] += share
        for shares in alike if len(alike) > 1 else ():
            others = {name: share - shares.get(name, 0.0) for name, share in total.items()}
            right.append(shares.get(max(sorted(others), key=others.__getitem__), 0.0))
    return (float(np.mean(right)) if right else None), len(right)
