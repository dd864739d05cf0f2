"""Symmetries of a solid from its surface: mirror planes, rotations up to 36-fold, bodies of revolution, and balls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from manitwin.geometry.boxes import oriented_bounding_box
from manitwin.geometry.sampling import sample_surface

_TESTED, _SURFACE = 1500, 30_000  # number of samples that are transformed, and of samples they are compared with
_OFF_SHARE = 0.015  # fraction of the box's diagonal: tolerated distance of the transformed surface
_KEPT_SHARE = 0.99
_MOST_SIDES, _MOST_TEETH = 8, 36  # a prism with more sides is round within ``_OFF_SHARE``; a gear is not
_EVEN = 0.05  # relative anisotropy of the spread across an axis that high-order rotational symmetry still allows
_ODD_TURNS = (0.61, 1.87, 0.137, 2.71)  # radians; for up to 50 teeth one of them is off by a sixth of a tooth or more
_MOST_MOTIONS, _ONE_MOTION = 4 * _MOST_TEETH, 1e-3  # a cube has 48; matrices that differ by less are duplicates


@dataclass(frozen=True)
class Symmetries:
    """Orthogonal maps ``(K, 3, 3)`` about ``center_m (3,)`` that map a solid to itself; ``axis (3,)`` of a body of revolution.

    The maps form a group with the identity first. ``ball``: every rotation is a symmetry.
    """

    center_m: np.ndarray
    motions: np.ndarray
    axis: np.ndarray | None
    ball: bool = False

    def apart_m(self, first_m: np.ndarray, second_m: np.ndarray) -> float:
        """Return the least distance (m) between two positions ``(3,)`` under all symmetries."""
        if self.ball:
            return float(abs(np.linalg.norm(first_m - self.center_m) - np.linalg.norm(second_m - self.center_m)))
        first, moved = first_m - self.center_m, self.motions @ (second_m - self.center_m)
        apart = np.linalg.norm(moved - first, axis=1)
        if self.axis is not None:
            along, others = first @ self.axis, moved @ self.axis
            radius = np.linalg.norm(first - along * self.axis)
            radii = np.linalg.norm(moved - others[:, None] * self.axis, axis=1)
            apart = np.minimum(apart, np.hypot(along - others, radius - radii))
        return float(apart.min())


def find_symmetries(mesh: trimesh.Trimesh, rng: np.random.Generator) -> Symmetries:
    """Find the mirror and rotational symmetries of a solid about the axes of its frame, oriented box and inertia.

    A map is a symmetry if it leaves 99 % of the surface within 1.5 % of the box's diagonal: dents and scan seams are tolerated,
    a small handle breaks it. All symmetries fix the centroid of the surface.
    """
    surface, _, _ = sample_surface(mesh, _SURFACE, rng)
    extents, box_to_object = oriented_bounding_box(mesh.vertices)
    off_m = _OFF_SHARE * float(np.linalg.norm(extents))
    center = np.average(mesh.triangles_center, axis=0, weights=mesh.area_faces)
    tree, local = cKDTree(surface - center), (surface - center)[:_TESTED]
    inertia_axes = np.linalg.svd(surface - center, full_matrices=False)[2]

    def kept(motion: np.ndarray) -> bool:
        distance, _ = tree.query(local @ motion.T, distance_upper_bound=off_m)
        return bool(np.isfinite(distance).mean() >= _KEPT_SHARE)

    found: list[Symmetries] = []
    for axes in (np.eye(3), box_to_object[:3, :3].T, inertia_axes):
        mirrors = [-np.eye(3), *(np.eye(3) - 2 * np.outer(axis, axis) for axis in axes)]
        round_about = [axis for axis in axes if _is_round(axis, kept)]
        turns = [turn for axis in axes for turn in _turns_about(axis, surface - center, kept)]
        motions = _group([*turns, *(mirror for mirror in mirrors if kept(mirror))], kept)
        found.append(Symmetries(center, motions, round_about[0] if round_about else None, len(round_about) > 1))
    return max(found, key=lambda some: (some.ball, some.axis is not None, len(some.motions)))


def _is_round(axis: np.ndarray, kept: Callable[[np.ndarray], bool]) -> bool:
    return all(kept(_turned(axis, angle)) for angle in _ODD_TURNS)


def _turns_about(axis: np.ndarray, points: np.ndarray, kept: Callable[[np.ndarray], bool]) -> list[np.ndarray]:
    """Return the rotations about an axis that are symmetries, smallest angle first; a quarter turn for a round object."""
    if _is_round(axis, kept):
        return [_turned(axis, np.pi / 2)]
    most = _MOST_TEETH if _is_even(axis, points) else _MOST_SIDES
    turns = (_turned(axis, 2 * np.pi / fold) for fold in range(most, 1, -1))
    return [turn for turn in turns if kept(turn)]


def _is_even(axis: np.ndarray, points: np.ndarray) -> bool:
    """Return whether points spread equally in all directions across an axis, as under 3-fold or higher symmetry."""
    spread = np.linalg.eigvalsh(np.cov((points - np.outer(points @ axis, axis)).T))
    return bool(spread[1] >= (1 - _EVEN) * spread[2])


def _group(generators: list[np.ndarray], kept: Callable[[np.ndarray], bool]) -> np.ndarray:
    """Return the group ``(K, 3, 3)`` generated by the maps, with the identity first.

    A generator is used only if all products with the previous ones are symmetries too: a leaning stem may be within tolerance
    after one small rotation but not after two.
    """
    group = [np.eye(3)]
    for generator in generators:
        if _is_among(generator, group):
            continue
        made = _closed([*group, generator])
        if made is not None and all(_is_among(motion, group) or kept(motion) for motion in made):
            group = made
    return np.array(group)


def _closed(generators: list[np.ndarray]) -> list[np.ndarray] | None:
    """Return all products of generators, including the identity; None if there are more than ``_MOST_MOTIONS``."""
    motions = [np.eye(3)]
    for motion in motions:  # the list grows during the iteration
        for product in (each @ motion for each in generators):
            if not _is_among(product, motions):
                motions.append(product)
        if len(motions) > _MOST_MOTIONS:
            return None
    return motions


def _is_among(motion: np.ndarray, motions: list[np.ndarray]) -> bool:
    return bool(np.abs(np.array(motions) - motion).max((1, 2)).min() <= _ONE_MOTION)


def _turned(axis: np.ndarray, angle_rad: float) -> np.ndarray:
    """Return the rotation ``(3, 3)`` about a unit axis (Rodrigues)."""
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.asarray(np.eye(3) + np.sin(angle_rad) * cross + (1 - np.cos(angle_rad)) * cross @ cross)
