"""A second, closer look: functional points move from their candidates to the features that they mean.

42 candidates are some 2 to 4 cm apart on a thing of a hand's size, so the nearest to a face's middle may lie at its border.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np

from manitwin.geometry.distance import closest_points_on_triangles
from manitwin.geometry.frames.closer import REACH_SHARE, around
from manitwin.geometry.frames.feature import FramedMesh
from manitwin.geometry.frames.words import is_end, means_place
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.geometry.sampling import farthest_point_sampling
from manitwin.twin.point_records import FunctionalFrame, FunctionalPoint, RefinedCandidate

CLOSER = 12
"""How many places around a candidate are looked at."""
_LEAST_MOVE_M = 0.002  # less is not worth another place than the one that the views show
_LEAST_LEVEL_M, _LEVEL_SHARE = 0.0005, 0.003
"""M, of the longest side: a point farther off a face's plane is on another part."""
_BESIDE = -0.1  # cosine: a face's border is beside it, what looks away is another side
_ON_FRAME_M = 0.005  # the feature's own place is where the surface is this near to the frame's origin


def refined_points(
    points: Sequence[FunctionalPoint], surface: FramedMesh, kept: Collection[int], is_seen: Callable[[np.ndarray], bool]
) -> tuple[list[FunctionalPoint], list[RefinedCandidate]]:
    """Return the points, each at the place of a closer set around its candidate that is nearest to its frame's feature.

    The set is eleven places of the surface around the candidate, as far apart as can be and on its side of the matter, and the
    feature's own. The refined place takes the candidate's row; the second list says where the views have marked it. Candidates
    in ``kept`` stay where they are, as others lie on them; so do points without a frame, and those whose label means more than
    the frame's feature: a handle is not the wall of its hole, an inside not the rim, bristles not their end, and of a base or a
    front any place is as good. ``is_seen`` tells of a place ``(3,)`` whether it lies on the surface that is seen.
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
    """Return what says of a point that is about to move where the views have marked its candidate."""
    return RefinedCandidate(candidate=point.candidate, marked_position_m=point.position_m, marked_normal=point.normal)


def _closer(
    point: FunctionalPoint, frame: FunctionalFrame, surface: FramedMesh
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the position and normal of the place nearest to a feature, None where that is hardly nearer than the point."""
    if not means_place(point.label, frame.kind):
        return None
    positions, normals = surface.samples
    at, out = np.array(point.position_m), np.array(point.normal)
    if frame.kind in ("face", "button"):
        z = rotation_from_quaternion_wxyz(np.array(frame.quaternion_wxyz))[:, 2]
        level = abs(float((at - frame.position_m) @ z)) < max(_LEAST_LEVEL_M, _LEVEL_SHARE * surface.size_m)
        if z @ out < _BESIDE or not (level or is_end(point.label)):
            return None
    near = around(surface, at, out)
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
    """Return how far places ``(N, 3)`` are from a feature: of an opening and a hole from the circle of its rim or wall."""
    local = (places_m - np.array(frame.position_m)) @ rotation_from_quaternion_wxyz(np.array(frame.quaternion_wxyz))
    if frame.kind in ("opening", "hole"):
        return np.hypot(np.hypot(local[:, 0], local[:, 1]) - frame.size_m, local[:, 2])
    if frame.kind == "edge":
        beyond = np.maximum(np.abs(local[:, 0]) - frame.size_m / 2, 0.0)
        return np.sqrt(beyond**2 + local[:, 1] ** 2 + local[:, 2] ** 2)
    return np.asarray(np.linalg.norm(local, axis=1))


def _own_place(frame: FunctionalFrame, surface: FramedMesh, at: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the place of the surface at a feature, of one that is as wide as long as it is that nearest to the point."""
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
