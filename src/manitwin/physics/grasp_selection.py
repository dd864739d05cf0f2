"""Selection of the grasps to try in simulation: likely to hold, and diverse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.geometry.grasp_diversity import approach_octants, farthest_grasps

LOW_COST_SHARE = 0.3
MIN_OCTANTS = 4


@dataclass(frozen=True)
class Merits:
    """Ratings of N grasps before the trial: ``fit (N,)`` bool, ``weak (N,)`` bool, ``cost (N,)``.

    A grasp is likely to hold if it is ``fit`` and its ``cost`` is at most ``good_cost``. The remaining grasps are
    ordered by ``weak`` (weak ones last), then by increasing cost.
    """

    fit: np.ndarray
    weak: np.ndarray
    cost: np.ndarray
    good_cost: float

    def likely(self) -> np.ndarray:
        """Return which grasps are likely to hold, ``(N,)`` bool."""
        return self.fit & (self.cost <= self.good_cost)

    def take(self, index: np.ndarray) -> Merits:
        """Return the ratings of the grasps at ``index``."""
        return Merits(self.fit[index], self.weak[index], self.cost[index], self.good_cost)

    @staticmethod
    def joined(parts: list[Merits]) -> Merits:
        """Concatenate the ratings of several sets of grasps; ``good_cost`` is that of the first."""
        return Merits(
            np.concatenate([p.fit for p in parts]),
            np.concatenate([p.weak for p in parts]),
            np.concatenate([p.cost for p in parts]),
            parts[0].good_cost,
        )


def select_likely(gripper_to_object: np.ndarray, depth_m: np.ndarray, merits: Merits, count: int) -> np.ndarray:
    """Choose up to ``count`` diverse grasps among those that are likely to hold, and return their sorted indices.

    Likely grasps are fit, and cost at most ``good_cost`` or the 30 % quantile of all costs, whichever is larger. If
    there are fewer than ``count``, the best-ranked others are added. If the approach directions cover fewer than
    ``MIN_OCTANTS`` octants, the best-ranked grasps of the missing octants are added. Farthest-point sampling then picks
    ``count`` of them.
    """
    good_cost = max(merits.good_cost, float(np.quantile(merits.cost, LOW_COST_SHARE)))
    likely = merits.fit & (merits.cost <= good_cost)
    rank = np.lexsort((merits.cost, merits.weak, ~likely))
    chosen = rank[: max(count, int(likely.sum()))]
    octants = approach_octants(gripper_to_object)
    missing = [octant for octant in np.unique(octants) if octant not in octants[chosen]]
    if len(np.unique(octants[chosen])) < MIN_OCTANTS and missing:
        share = max(1, count // (2 * MIN_OCTANTS))
        more = np.concatenate([rank[octants[rank] == octant][:share] for octant in missing])
        chosen = np.concatenate([chosen, more])
    picked = farthest_grasps(gripper_to_object[chosen], depth_m[chosen], count)
    return np.sort(chosen[picked])
