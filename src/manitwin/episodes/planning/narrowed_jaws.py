"""Grasps with partially opened jaws, for places where fully open jaws have no room beside obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from manitwin.episodes.planning.problem import Grasp
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.parallel import ParallelGripper

SPARE_M = 0.016  # additional opening over the object's width, both sides together
STEP_M = 0.02  # openings are multiples of this, because each needs its own arm model


def group_by_opening(grasps: Sequence[Grasp], gripper: Gripper) -> list[tuple[Grasp, ...]]:
    """Group grasps by the opening that they need, narrowest first, in their order; empty unless the gripper has jaws.

    Grasps that need more than the full opening less one step are omitted.
    """
    if not isinstance(gripper, ParallelGripper):
        return []
    found: dict[float, list[Grasp]] = {}
    for grasp in grasps:
        opening_m = STEP_M * float(np.ceil((grasp.width_m + SPARE_M) / STEP_M))
        if opening_m <= gripper.opening_m - STEP_M + 1e-9:
            found.setdefault(opening_m, []).append(replace(grasp, opening_m=opening_m))
    return [tuple(found[opening_m]) for opening_m in sorted(found)]
