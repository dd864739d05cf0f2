"""Refinement of functional points: they move from their candidates to the features that they mean.

The 42 candidates are about 2 to 4 cm apart on a hand-sized object, so that the nearest to a face's centre may lie at its
border.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np

from manitwin.geometry.distance import closest_points_on_triangles
from manitwin.geometry.frames.feature import FramedMesh
from manitwin.geometry.frames.label_keywords import denotes_feature_itself, is_end_face_label
from manitwin.geometry.frames.nearby_samples import REACH_SHARE, find_nearby_samples
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.geometry.sampling import farthest_point_sampling
from manitwin.twin.point_records import FunctionalFrame, FunctionalPoint, RefinedCandidate

CLOSER = 12
"""Number of positions tried around a candidate."""
_LEAST_MOVE_M = 0.002  # a smaller improvement does not justify moving the point from its marked position
_LEAST_LEVEL_M, _LEVEL_SHARE = 0.0005, 0.003
"""Metres, and share of the longest side: a point farther from a face's plane is on another part."""
_BESIDE = -0.1  # cosine: excludes other sides, but not the border of a face
_ON_FRAME_M = 0.005  # largest distance of the surface from the frame's origin for the feature's own position


def refined_points(
    points: Sequence[FunctionalPoint], surface: FramedMesh, kept: Collection[int], is_seen: Callable[[np.ndarray], bool]
) -> tuple[list[FunctionalPoint], list[RefinedCandidate]]:
    """Return the points, each moved to the position near its candidate that is closest to its frame's feature.

    The positions tried are eleven surface samples around the candidate, as far apart as possible and on the same side, and the
    feature's own position. A moved point replaces its candidate; the second list has the positions marked in the views.
    Candidates in ``kept`` are not moved, as other points use them. Neither are points without a frame, or with a label that
    means more than the feature: a handle is not the wall of its hole, an inside not the rim, bristles not their end, and any
    position on a base or front is as good. ``is_seen`` tests whether a position ``(3,)`` lies on the visible surface.
    """
    moved: list[FunctionalPoint] = []
    rows: list[RefinedCandidate] = []
    for point in points:
        place = None if point.frame is None or point.candidate in kept else _closer(point, point.frame, surface)
        if place is not None and is_seen(place[0]):
            rows.append(marked_at(point))
            point = point.model_copy(update={"position_m": place[0].tolist(), "normal": place[1].tolist()})
        moved.append(point)
    return moved, rows


def marked_at(point: FunctionalPoint) -> RefinedCandidate:
    """Return the record of a candidate's marked position, before its point moves."""
    return RefinedCandidate(candidate=point.candidate, marked_position_m=point.position_m, marked_normal=point.normal)


def _closer(
    point: FunctionalPoint, frame: FunctionalFrame, surface: FramedMesh
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the position and normal closest to a feature; None if the improvement is negligible."""
    if not denotes_feature_itself(point.label, frame.kind):
        return None
    positions, normals = surface.samples
    at, out = np.array(point.position_m), np.array(point.normal)
    if frame.kind in ("face", "button"):
        z = rotation_from_quaternion_wxyz(np.array(frame.quaternion_wxyz))[:, 2]
        level = abs(float((at - frame.position_m) @ z)) < max(_LEAST_LEVEL_M, _LEVEL_SHARE * surface.size_m)
        if z @ out < _BESIDE or not (level or is_end_face_label(point.label)):
            return None
    near = find_nearby_samples(surface, at, out)
    if not len(near):
        return None
    closer = near[farthest_point_sampling(positions[near], CLOSER - 1, 0)]
    places, outward = positions[closer], normals[closer]
    own = _own_place(frame, surface, at)
    if own is not None:
        places, outward = np.concatenate([places, own[0][None]]), np.concatenate([outward, own[1][None]])
    away = away_from_feature_m(frame, places)
    best = int(away.argmin())
    gain = float(away_from_feature_m(frame, at[None])[0] - away[best])
    return (places[best], outward[best]) if gain > _LEAST_MOVE_M else None


def away_from_feature_m(frame: FunctionalFrame, places_m: np.ndarray) -> np.ndarray:
    """Return the distances of positions ``(N, 3)`` from a feature; for openings and holes, from the circle of the rim or wall."""
    local = (places_m - np.array(frame.position_m)) @ rotation_from_quaternion_wxyz(np.array(frame.quaternion_wxyz))
    if frame.kind in ("opening", "hole"):
        return np.hypot(np.hypot(local[:, 0], local[:, 1]) - frame.size_m, local[:, 2])
    if frame.kind == "edge":
        beyond = np.maximum(np.abs(local[:, 0]) - frame.size_m / 2, 0.0)
        return np.sqrt(beyond**2 + local[:, 1] ** 2 + local[:, 2] ** 2)
    return np.asarray(np.linalg.norm(local, axis=1))


def _own_place(frame: FunctionalFrame, surface: FramedMesh, at: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the surface position at a feature; for an extended feature, the one nearest to the point."""
    goal = np.array(frame.position_m)
    rotation = rotation_from_quaternion_wxyz(np.array(frame.quaternion_wxyz))
    local = (at - goal) @ rotation
    if frame.kind in ("opening", "hole"):
        across = float(np.hypot(local[0], local[1]))
        if across < 1e-6:
            return None
        goal = goal + rotation[:, :2] @ local[:2] / across * frame.size_m
    elif frame.kind == "edge":
        goal = goal + rotation[:, 0] * float(np.clip(local[0], -frame.size_m / 2, frame.size_m / 2))
    corners = surface.mesh.triangles
    nearest, _ = closest_points_on_triangles(np.repeat(goal[None], len(corners), 0), corners)
    away = np.linalg.norm(nearest - goal, axis=1)
    face = int(away.argmin())
    if away[face] > _ON_FRAME_M or np.linalg.norm(nearest[face] - at) > REACH_SHARE * surface.size_m:
        return None
    return nearest[face], np.asarray(surface.mesh.face_normals)[face]
