"""The symmetries of a solid by its surface: mirror planes, half and quarter turns, and bodies of revolution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from manitwin.geometry.boxes import oriented_bounding_box
from manitwin.geometry.sampling import sample_surface

_TESTED, _SURFACE = 1500, 30_000  # samples that are moved, and those that they are to fall on
_OFF_SHARE = 0.015  # of the box's diagonal: how far nearly all of a moved surface may be from the surface
_KEPT_SHARE = 0.99
_TURNS = (np.pi, np.pi / 2, -np.pi / 2)
_ODD_TURNS = (0.61, 1.87)  # radians: no share of a turn that a prism or a flower has


@dataclass(frozen=True)
class Symmetries:
    """Motions ``(K, 3, 3)`` about ``center_m (3,)`` that move a solid onto itself; ``axis (3,)`` of a body of revolution.

    The first motion is the identity.
    """

    center_m: np.ndarray
    motions: np.ndarray
    axis: np.ndarray | None

    def apart_m(self, first_m: np.ndarray, second_m: np.ndarray) -> float:
        """Return the least distance (m) of two places ``(3,)``, where symmetric places are one."""
        first, moved = first_m - self.center_m, self.motions @ (second_m - self.center_m)
        apart = np.linalg.norm(moved - first, axis=1)
        if self.axis is not None:
            along, others = first @ self.axis, moved @ self.axis
            radius = np.linalg.norm(first - along * self.axis)
            radii = np.linalg.norm(moved - others[:, None] * self.axis, axis=1)
            apart = np.minimum(apart, np.hypot(along - others, radius - radii))
        return float(apart.min())


def find_symmetries(mesh: trimesh.Trimesh, rng: np.random.Generator) -> Symmetries:
    """Find the mirrors and turns about the axes of the oriented box, of inertia and of the frame that keep a solid as it is.

    A motion counts that leaves 99 % of the surface within 1.5 % of the box's diagonal: dents and seams of scans do not count, a
    small handle does. All symmetries of a solid leave the centroid of its surface where it is.
    """
    surface, _, _ = sample_surface(mesh, _SURFACE, rng)
    extents, box_to_object = oriented_bounding_box(mesh.vertices)
    off_m = _OFF_SHARE * float(np.linalg.norm(extents))
    center = surface.mean(0)
    tree, local = cKDTree(surface - center), (surface - center)[:_TESTED]
    inertia_axes = np.linalg.svd(surface - center, full_matrices=False)[2]

    def kept(motion: np.ndarray) -> bool:
        distance, _ = tree.query(local @ motion.T, distance_upper_bound=off_m)
        return bool(np.isfinite(distance).mean() >= _KEPT_SHARE)

    found: list[Symmetries] = []
    for axes in (np.eye(3), box_to_object[:3, :3].T, inertia_axes):
        tried = [-np.eye(3), *(np.eye(3) - 2 * np.outer(axis, axis) for axis in axes)]
        tried += [_turned(axis, angle) for axis in axes for angle in _TURNS]
        motions = np.array([np.eye(3), *(motion for motion in tried if kept(motion))])
        round_about = [axis for axis in axes if all(kept(_turned(axis, angle)) for angle in _ODD_TURNS)]
        found.append(Symmetries(center, motions, round_about[0] if round_about else None))
    return max(found, key=lambda some: (some.axis is not None, len(some.motions)))


def _turned(axis: np.ndarray, angle_rad: float) -> np.ndarray:
    """Return the rotation ``(3, 3)`` about a unit axis (Rodrigues)."""
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.asarray(np.eye(3) + np.sin(angle_rad) * cross + (1 - np.cos(angle_rad)) * cross @ cross)
