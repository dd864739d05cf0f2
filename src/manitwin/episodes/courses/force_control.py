"""Force control: approach speed until contact, and an admittance from the measured force to the hand's height.

The speed of the height is proportional to the force error (Villani and De Schutter 2016, Springer Handbook of Robotics,
section 9.2: indirect force control, here with damping alone), so that the hand follows a slope and settles at the commanded
force. The measured stiffness of the arm, 20 to 40 N/mm, closes the loop within 0.3 s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from manitwin.episodes.events import EventWatch
from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.geometry.poses import transform

GAIN_M_S_N = 1.5e-4
FASTEST_M_S, FARTHEST_M = 0.02, 0.02
RISE_M = 0.005  # step over which the joints' change with height is computed


@dataclass
class Admittance:
    """Adjusts a height (m) above a path so that ``force_n`` approaches ``wanted_n``: lower if the force is too small."""

    force_n: Callable[[], float]
    wanted_n: float
    timestep_s: float
    height_m: float = 0.0

    def next_change(self, per_metre: np.ndarray) -> np.ndarray:
        """Advance by a time step and return the offset of the positions ``(n,)``, given their change per metre."""
        speed_m_s = GAIN_M_S_N * (self.force_n() - self.wanted_n)
        moved_m = self.height_m + float(np.clip(speed_m_s, -FASTEST_M_S, FASTEST_M_S)) * self.timestep_s
        self.height_m = float(np.clip(moved_m, -FARTHEST_M, FARTHEST_M))
        return self.height_m * per_metre


def pace_of_press(watch: EventWatch, stop_n: float, creeps: int) -> Callable[[int], float]:
    """Return the pace of a press, the share of a row to advance from a sample (see ``Execution.follow``).

    The pace decreases linearly with the watched force and is 0 at ``stop_n``; from sample ``creeps`` on it is one sample per
    row. Commands of the row in which contact occurs cannot be changed any more: a whole row at 4 mm/s pressed stiff objects
    with up to 18 N.
    """
    return lambda first: 0.0 if first >= creeps else max(0.0, 1 - watch.force_n / stop_n)


def with_heights(joints: CubicSpline, arm: ArmKinematics, normal: np.ndarray) -> CubicSpline | None:
    """Return a spline of ``(2 n)`` values: the joints, and their change per metre along ``normal (3,)``; None if unsolvable.

    Both are exact at the knots. The change is computed for 5 mm up, or down if an arm near its limits cannot move up.
    """
    changes = []
    for place in joints.x:
        here = joints(place)
        for rise_m in (RISE_M, -RISE_M):
            there = arm.inverse(transform(None, rise_m * normal) @ arm.gripper_pose(here), here)
            if there is not None:
                break
        if there is None:
            return None
        changes.append((there - here) / rise_m)
    return CubicSpline(joints.x, np.column_stack([joints(joints.x), np.array(changes)]))
