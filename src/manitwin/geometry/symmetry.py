"""The symmetries of a solid by its surface: mirror planes, turns by a half to a 36th, bodies of revolution, and balls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from manitwin.geometry.boxes import oriented_bounding_box
from manitwin.geometry.sampling import sample_surface

_TESTED, _SURFACE = 1500, 30_000  # samples that are moved, and those that they are to fall on
_OFF_SHARE = 0.015  # of the box's diagonal: how far nearly all of a moved surface may be from the surface
_KEPT_SHARE = 0.99
_MOST_SIDES, _MOST_TEETH = 8, 36  # a prism of more sides is round, by ``_OFF_SHARE``; a gear is not
_EVEN = 0.05  # of the spread across an axis: how far it may differ by direction where many turns are symmetries
_ODD_TURNS = (0.61, 1.87, 0.137, 2.71)  # radians: of up to 50 teeth one of them is off by a sixth of a tooth or more
_MOST_MOTIONS, _ONE_MOTION = 4 * _MOST_TEETH, 1e-3  # a cube has 48; of two matrices that differ by less one is kept


@dataclass(frozen=True)
class Symmetries:
    """Motions ``(K, 3, 3)`` about ``center_m (3,)`` that move a solid onto itself; ``axis (3,)`` of a body of revolution.

    The first motion is the identity; two of them after each other are one of them too. ``ball``: so is any turn.
    """

    center_m: np.ndarray
    motions: np.ndarray
    axis: np.ndarray | None
    ball: bool = False

    def apart_m(self, first_m: np.ndarray, second_m: np.ndarray) -> float:
        """Return the least distance (m) of two places ``(3,)``, where symmetric places are one."""
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
    """Find the mirrors and turns about the axes of the oriented box, of inertia and of the frame that keep a solid as it is.

    A motion counts that leaves 99 % of the surface within 1.5 % of the box's diagonal: dents and seams of scans do not count, a
    small handle does. All symmetries of a solid leave the centroid of its surface where it is.
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
    """Return the turns about an axis that are kept, the least first; of what is round a quarter turn."""
    if _is_round(axis, kept):
        return [_turned(axis, np.pi / 2)]
    most = _MOST_TEETH if _is_even(axis, points) else _MOST_SIDES
    turns = (_turned(axis, 2 * np.pi / fold) for fold in range(most, 1, -1))
    return [turn for turn in turns if kept(turn)]


def _is_even(axis: np.ndarray, points: np.ndarray) -> bool:
    """Whether points spread alike in all directions across an axis, as those do that a third of a turn or less leaves as is."""
    spread = np.linalg.eigvalsh(np.cov((points - np.outer(points @ axis, axis)).T))
    return bool(spread[1] >= (1 - _EVEN) * spread[2])


def _group(generators: list[np.ndarray], kept: Callable[[np.ndarray], bool]) -> np.ndarray:
    """Return the motions ``(K, 3, 3)`` that generators make after each other, the identity first.

    A generator counts only if all that it makes with those before it are kept: a leaning stem may fall on itself within the
    tolerance after one small turn, and not after two.
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
    """Return the identity and all motions that generators make after each other; None of more than ``_MOST_MOTIONS``."""
    motions = [np.eye(3)]
    for motion in motions:  # which grows meanwhile
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
