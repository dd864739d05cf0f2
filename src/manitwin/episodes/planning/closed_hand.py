"""The closed hand as a tool: the corners of its fingertips, which of them comes first, and where they are when it holds."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.planning.arm_planning import ArmPlanning
from manitwin.episodes.planning.convex_shapes import corners_of

TIP_M = 0.004  # corners no farther than this from the farthest along the approach are the tips'


def fingertip_corners(parts: ArmPlanning) -> np.ndarray:
    """Return the corners ``(N, 3)`` of the fingers' ends in the grasp frame, as far apart as the hand's model has them."""
    hand = parts.hand
    corners = np.concatenate(
        [points for i in sorted(hand.fingers) if (points := corners_of(hand.geometry.geometryObjects[i])) is not None]
    )
    return np.asarray(corners[corners[:, 2] > corners[:, 2].max() - TIP_M])


def open_fingertips(corners_m: np.ndarray, width_m: float) -> np.ndarray:
    """Return the corners ``(N, 3)`` of closed fingertips where they are with ``width_m`` between the pads.

    Corners in the plane in which pads meet are on both sides.
    """
    left, right = (corners_m[side * corners_m[:, 0] > -1e-4] + [side * width_m / 2, 0, 0] for side in (-1.0, 1.0))
    return np.concatenate([left, right])


def first_corner(corners_m: np.ndarray, hand_to_world: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the corner ``(3,)`` that is first in a direction of the world, and by how much it leads the others.

    ``hand_to_world (3, 3)`` is the hand's rotation. Corners within 3 mm of it count as the same.
    """
    along = corners_m @ (hand_to_world.T @ direction)
    first = corners_m[int(along.argmax())]
    others = along[np.linalg.norm(corners_m - first, axis=1) > 0.003]
    return first, float(along.max() - others.max()) if len(others) else np.inf
