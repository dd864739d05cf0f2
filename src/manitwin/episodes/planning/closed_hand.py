"""The closed hand as a tool: vertices of its fingertips, the leading vertex, and fingertip positions when open."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.planning.arm_planning import ArmPlanning
from manitwin.episodes.planning.convex_shapes import corners_of

TIP_M = 0.004  # vertices within this distance of the farthest along the approach belong to the tips


def fingertip_corners(parts: ArmPlanning) -> np.ndarray:
    """Return the vertices ``(N, 3)`` of the fingertips in the grasp frame, at the opening of the hand's model."""
    hand = parts.hand
    corners = np.concatenate(
        [points for i in sorted(hand.fingers) if (points := corners_of(hand.geometry.geometryObjects[i])) is not None]
    )
    return np.asarray(corners[corners[:, 2] > corners[:, 2].max() - TIP_M])


def open_fingertips(corners_m: np.ndarray, width_m: float) -> np.ndarray:
    """Return the vertices ``(N, 3)`` of closed fingertips moved apart to ``width_m`` between the pads.

    Vertices in the plane between the pads are duplicated to both sides.
    """
    left, right = (corners_m[side * corners_m[:, 0] > -1e-4] + [side * width_m / 2, 0, 0] for side in (-1.0, 1.0))
    return np.concatenate([left, right])


def first_corner(corners_m: np.ndarray, hand_to_world: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the vertex ``(3,)`` that leads in a world direction, and its lead over the others (m).

    ``hand_to_world (3, 3)`` is the hand's rotation. Vertices within 3 mm of the leading one count as the same.
    """
    along = corners_m @ (hand_to_world.T @ direction)
    first = corners_m[int(along.argmax())]
    others = along[np.linalg.norm(corners_m - first, axis=1) > 0.003]
    return first, float(along.max() - others.max()) if len(others) else np.inf
