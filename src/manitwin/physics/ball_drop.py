"""Ball-drop test of a vessel: start pose, ball radius, and the criterion for a ball that ends inside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import rotation_between

BALL_KG = 0.01
BALL_SECONDS = 2.0


@dataclass(frozen=True)
class BallDrop:
    """A vessel rotated by ``turn (3, 3)`` so that its opening points up (+Z), and a ball of ``radius_m`` at ``start_m``.

    The radius is a third of the rim radius or of the depth, whichever is smaller. The ball starts above the centre of the
    rim, ``rim_m (3,)``. ``depth_m`` is the depth of the opening, ``widest_m`` the largest horizontal distance of a hull
    vertex from the rim's centre. Positions are in the frame of the rotated vessel.
    """

    turn: np.ndarray
    radius_m: float
    start_m: np.ndarray
    rim_m: np.ndarray
    depth_m: float
    widest_m: float

    @classmethod
    def of(cls, hulls: Sequence[np.ndarray], opening: Opening) -> BallDrop:
        """Build the test from the hulls of a vessel, each ``(V, 3)`` m, and its opening in the same frame."""
        axis, up = opening.axis, np.array([0.0, 0, 1])
        turn = rotation_between(axis, up)
        radius_m = min(opening.rim_radius_m, opening.depth_m) / 3
        rim_m = turn @ opening.center_m
        highest_m = max(float((hull @ axis).max()) for hull in hulls)
        start_m = rim_m + up * (highest_m - float(opening.center_m @ axis) + 1.5 * radius_m)
        widest_m = max(float(np.linalg.norm((hull @ turn.T - rim_m)[:, :2], axis=1).max()) for hull in hulls)
        return cls(turn, radius_m, start_m, rim_m, opening.depth_m, widest_m)

    def is_inside(self, end_m: np.ndarray) -> bool:
        """Tell whether a ball that came to rest with its centre at ``end_m (3,)`` is in the vessel.

        The centre must be below the rim by at most the depth, and closer to the opening's axis than ``widest_m``.
        """
        below_brim_m = float(self.rim_m[2] - end_m[2])
        beside_m = float(np.linalg.norm((end_m - self.rim_m)[:2]))
        return 0 < below_brim_m <= self.depth_m and beside_m < self.widest_m
