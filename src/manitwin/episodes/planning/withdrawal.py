"""Withdrawal of the open hand from an object released in the air, such as on a peg or in a holder."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.planning.arm_planning import ArmPlanning
from manitwin.episodes.planning.problem import Motion, Phase, PickPlaceProblem
from manitwin.episodes.planning.straight_lines import straight_line
from manitwin.geometry.poses import transform

WAYS_M = (0.10, 0.05, 0.025)
BLIND_M = 0.05


def plan_withdrawal(
    parts: ArmPlanning,
    problem: PickPlaceProblem,
    object_to_world: np.ndarray,
    joints_rad: np.ndarray,
    *,
    blind: bool = True,
) -> Motion | None:
    """Plan a straight motion back along the approach, from an object at ``object_to_world (4, 4)``.

    The distance is 10 cm, or less if that is blocked. If every distance is blocked, ``blind`` plans 5 cm without collision
    checks, because a hand that stays keeps holding the object. Returns None if no motion is found.
    """
    world = parts.problem_world(problem, object_to_world, as_hulls=True)
    start = np.asarray(joints_rad, float)
    here = parts.arm.gripper_pose(start)

    def back(way_m: float) -> np.ndarray:
        return here @ transform(translation=np.array([0.0, 0, -way_m]))

    for way_m in WAYS_M:
        line = parts.motions.plan_line(world.arm, Phase.RETREAT, start, back(way_m))
        if line is not None:
            return parts.motions.time_path(Phase.RETREAT, line)
    if not blind:
        return None
    line = straight_line(parts.arm, start, back(BLIND_M))
    return None if line is None else parts.motions.time_path(Phase.RETREAT, line)
