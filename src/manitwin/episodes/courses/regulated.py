"""Moving under force: how slowly to go until a force is there, and an admittance from the measured force to the hand's height.

The height moves at a speed in proportion to what the force lacks (Villani and De Schutter 2016, Springer Handbook of
Robotics, section 9.2: indirect force control, here with damping alone), so that it follows a slope and
settles at the force that is asked for. The arm's own stiffness, 20 to 40 N/mm as measured, closes the loop within 0.3 s.
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
RISE_M = 0.005  # from which the joints' change with the height is taken


@dataclass
class Admittance:
    """Keeps a height (m) over a path such that ``force_n`` is near ``wanted_n``: lower where it is less."""

    force_n: Callable[[], float]
    wanted_n: float
    timestep_s: float
    height_m: float = 0.0

    def next_change(self, per_metre: np.ndarray) -> np.ndarray:
        """Move on by a timestep; returns what it adds to positions ``(n,)``, given the change for a metre."""
        speed_m_s = GAIN_M_S_N * (self.force_n() - self.wanted_n)
        moved_m = self.height_m + float(np.clip(speed_m_s, -FASTEST_M_S, FASTEST_M_S)) * self.timestep_s
        self.height_m = float(np.clip(moved_m, -FARTHEST_M, FARTHEST_M))
        return self.height_m * per_metre


def pace_of_press(watch: EventWatch, stop_n: float, creeps: int) -> Callable[[int], float]:
    """Return the share of a row by which a press goes on from a sample, see ``Execution.follow``.

    The less, the nearer the watched force is to ``stop_n``; from the sample ``creeps`` on one sample a row. What the arm is told
    in a row in which it touches can no longer be changed: a whole row at 4 mm/s pressed stiff things with up to 18 N.
    """
    return lambda first: 0.0 if first >= creeps else max(0.0, 1 - watch.force_n / stop_n)


def with_heights(joints: CubicSpline, arm: ArmKinematics, normal: np.ndarray) -> CubicSpline | None:
    """Return the path of ``(2 n)`` values: the joints, and their change for a metre along ``normal (3,)``; None: no way.

    Both are exact at the knots. The change is that for 5 mm up, or down where an arm near its limits cannot go up.
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
