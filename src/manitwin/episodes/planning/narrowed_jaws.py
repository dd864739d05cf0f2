"""Jaws that are opened no wider than a grasp needs, where fully open ones have no room beside what stands near."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from manitwin.episodes.planning.problem import Grasp
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.parallel import ParallelGripper

SPARE_M = 0.016  # between the pads and what they hold, both sides together
STEP_M = 0.02  # openings are multiples: each has a model of the arm of its own


def narrowed(grasps: Sequence[Grasp], gripper: Gripper) -> list[tuple[Grasp, ...]]:
    """Return grasps by the opening that they need, the narrowest first, each in their order; of other grippers than jaws none.

    Left out are those that need the jaws as wide as they open, less one step.
    """
    if not isinstance(gripper, ParallelGripper):
        return []
    found: dict[float, list[Grasp]] = {}
    for grasp in grasps:
        opening_m = STEP_M * float(np.ceil((grasp.width_m + SPARE_M) / STEP_M))
        if opening_m <= gripper.opening_m - STEP_M + 1e-9:
            found.setdefault(opening_m, []).append(replace(grasp, opening_m=opening_m))
    return [tuple(found[opening_m]) for opening_m in sorted(found)]
