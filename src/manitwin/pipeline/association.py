"""Which grasps belong to which selected point (paper, "Spatial Filtering and Semantic Association")."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.geometry.grasp_diversity import fingertips

GROWTH = 1.5


def distances_to_grasps(
    points_m: np.ndarray, gripper_to_object: np.ndarray, depth_m: np.ndarray, width_m: np.ndarray
) -> np.ndarray:
    """Return the distances ``(N, P)`` of points ``(P, 3)`` from the lines, contact to contact, of grasps ``(N, 4, 4)``.

    Selected points lie on the surface and so do the contacts, but the fingertips' centre lies inside the object:
    measured from there a wide body would be far from its own faces.
    """
    closing = gripper_to_object[:, :3, 0]
    offset = points_m[None] - fingertips(gripper_to_object, depth_m)[:, None]
    along = np.einsum("npi,ni->np", offset, closing)
    nearest = np.clip(along, -width_m[:, None] / 2, width_m[:, None] / 2)
    return np.linalg.norm(offset - nearest[..., None] * closing[:, None], axis=2)


@dataclass(frozen=True)
class Association:
    """The radius that was needed, whether it had to grow, and the indices of the grasps within it."""

    radius_m: float
    widened: bool
    index: np.ndarray


def associate(distance_m: np.ndarray, *, radius_m: float, enough: int, object_size_m: float) -> Association:
    """Keep the grasps near a point; where they are too few, let the radius grow by half up to the object's size.

    ``distance_m (N,)`` is each grasp's distance from its nearest point.
    """
    used = radius_m
    while (distance_m <= used).sum() < enough and used < object_size_m:
        used = min(used * GROWTH, object_size_m)
    return Association(used, used > radius_m, np.flatnonzero(distance_m <= used))
