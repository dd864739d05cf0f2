"""The choice of grasps to try: those that are likely to hold, and different from each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.geometry.grasp_diversity import approach_octants, farthest_grasps

LOW_COST_SHARE = 0.3
MIN_OCTANTS = 4


@dataclass(frozen=True)
class Merits:
    """The prospects of N grasps before the trial.

    A grasp is likely to hold where it is ``fit`` and its ``cost`` at most ``good_cost``. Of the others those that are not
    ``weak`` come first, then those that cost less.
    """

    fit: np.ndarray
    weak: np.ndarray
    cost: np.ndarray
    good_cost: float

    def likely(self) -> np.ndarray:
        """Tell which grasps are likely to hold, ``(N,)`` bool."""
        return self.fit & (self.cost <= self.good_cost)

    def take(self, index: np.ndarray) -> Merits:
        """Return the merits at ``index``."""
        return Merits(self.fit[index], self.weak[index], self.cost[index], self.good_cost)

    @staticmethod
    def joined(parts: list[Merits]) -> Merits:
        """Return the merits of all parts, one after the other."""
        return Merits(
            np.concatenate([p.fit for p in parts]),
            np.concatenate([p.weak for p in parts]),
            np.concatenate([p.cost for p in parts]),
            parts[0].good_cost,
        )


def select_likely(gripper_to_object: np.ndarray, depth_m: np.ndarray, merits: Merits, count: int) -> np.ndarray:
    """Choose ``count`` diverse grasps among those that are likely to hold: indices into the N grasps.

    The likely ones are fit and cost little, or are among the cheapest 30 %. Where they are too few, the cheapest join;
    where they point into less than four octants, the cheapest of the other octants join. Then the farthest grasps are
    chosen.
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
