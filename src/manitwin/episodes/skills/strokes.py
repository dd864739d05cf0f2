"""Strokes of the closed hand behind an object, over the table: where its fingertips meet it, and how they go."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from manitwin.episodes.planning.collision_world import STANDING
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.geometry.boxes import footprint
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.rigid_body import PlacedObject

HEIGHT_SHARE, HEIGHTS_M = 0.35, (0.012, 0.04)  # of the object's height: where it is pushed
LEANS_RAD = np.radians([30.0, 15, 45, 0])  # the palm is behind the fingertips, not over the object
ROLLS_RAD = np.radians([0.0, 180, 90, -90, 45, -45, 135, -135])  # the broad side of the fingertips first
BEHIND_M, BEYOND_M, KNOT_M = 0.025, 0.015, 0.025
DOWN = np.array([1.0, 0.7, 0.4, 0.2])  # of an arc that ends level: a corner would make the joints' spline dip
DOWN_M, DOWN_BACK_M = 0.10, 0.06
MET_M, LATE_M, FAR_M = 0.002, 0.02, 0.5  # over the fingertips' lower edge; after where an object begins; of rays
BAND_M = 0.012  # to either side of the line: half of what the closed fingertips are wide


def strokes(moved: PlacedObject, place_m: np.ndarray, fingertips_m: np.ndarray, level_m: float) -> tuple[HeldPath, ...]:
    """Return ways of the closed hand from behind an object through its centre of mass towards a place, by how it leans.

    Down behind the object, then along the line a little beyond what brings the centre of mass ``(3,)`` to the place: whoever
    follows it stops there. ``fingertips_m (N, 3)`` are the corners of the closed fingers in the grasp frame.
    """
    center = transform_points(moved.object_to_world, moved.body.center_of_mass_m[None])[0]
    way = place_m[:2] - center[:2]
    along = way / max(float(np.linalg.norm(way)), 1e-9)
    points = transform_points(moved.object_to_world, np.concatenate(moved.body.hulls))
    height_m = _pushed_at_m(points)
    behind_m = _behind(points, center, along, level_m + 2 * height_m)
    first_m, last_m = -behind_m - BEHIND_M, float(np.linalg.norm(way)) - behind_m + BEYOND_M
    knots = np.linspace(first_m, last_m, max(4, int(np.ceil((last_m - first_m) / KNOT_M)) + 1))
    paths = []
    for roll in ROLLS_RAD:
        for lean in LEANS_RAD:
            turn = _hand(along, lean, roll)
            tips = fingertips_m @ turn.T
            front = np.array([*along, 0.0]) * float((tips[:, :2] @ along).max())
            across = tips.mean(0)
            across[:2] -= (across[:2] @ along) * along
            origin = np.array([*center[:2], level_m + height_m - tips[:, 2].min()]) - front
            origin[:2] -= across[:2]
            line = [transform(turn, origin + np.array([*(along * each), 0.0])) for each in knots]
            arc = arc_to(line[0], along)
            meant = frozenset({STANDING, moved.name})
            paths.append(HeldPath(np.array([*arc, *line]), meant, meant_from=len(arc) + 1))
    return tuple(paths)


def arc_to(low: np.ndarray, along: np.ndarray) -> list[np.ndarray]:
    """Return poses that come down to a low one of the hand from behind, level at the end."""
    return [transform(None, np.array([*(-along * DOWN_BACK_M * each), DOWN_M * each**2])) @ low for each in DOWN]


def is_met(moved: PlacedObject, along: np.ndarray) -> bool:
    """Tell whether fingertips that come along ``(2,)`` to an object's centre of mass meet it where it begins.

    All over the middle of the band: they would pass over the handle of a spoon.
    """
    points = transform_points(moved.object_to_world, np.concatenate(moved.body.hulls))
    level_m, height_m = float(points[:, 2].min()), _pushed_at_m(points)
    center = transform_points(moved.object_to_world, moved.body.center_of_mass_m[None])[0]
    behind_m = _behind(points, center, along, level_m + 2 * height_m)
    sideways = np.linspace(-BAND_M / 2, BAND_M / 2, 3)[:, None] * [-along[1], along[0], 0.0]
    way = np.array([*along, 0.0])
    from_m = np.array([*center[:2], level_m + height_m + MET_M]) - (behind_m + FAR_M) * way + sideways
    to_object = inverse(moved.object_to_world)
    hits_m, _ = RayCaster.of_hulls(moved.body.hulls).first_hits(
        transform_points(to_object, from_m), np.repeat((to_object[:3, :3] @ way)[None], len(from_m), axis=0)
    )
    return bool((hits_m <= FAR_M + LATE_M).all())


def _pushed_at_m(points_m: np.ndarray) -> float:
    """Return how high over what bears an object of corners ``(N, 3)`` the fingertips push it."""
    return float(np.clip(HEIGHT_SHARE * np.ptp(points_m[:, 2]), *HEIGHTS_M))


def _behind(points_m: np.ndarray, center_m: np.ndarray, along: np.ndarray, below_m: float) -> float:
    """Return how far an object reaches behind its centre of mass at the fingertips, in the band that these are wide."""
    flat = footprint(points_m[points_m[:, 2] <= below_m] if (points_m[:, 2] <= below_m).sum() > 3 else points_m)
    corners = (flat - center_m[:2]) @ np.column_stack([along, [-along[1], along[0]]])
    sides = np.concatenate([np.linspace(a, b, 20) for a, b in pairwise([*corners, corners[0]])])
    in_band = np.abs(sides[:, 1]) <= BAND_M
    return float(-(sides[in_band] if in_band.any() else sides)[:, 0].min())


def _hand(along: np.ndarray, lean_rad: float, roll_rad: float) -> np.ndarray:
    """Return the hand's rotation ``(3, 3)``: pointing down and forward, closing across the way and turned from there."""
    forward, down = np.array([*along, 0.0]), np.array([0.0, 0.0, -1.0])
    z = np.cos(lean_rad) * down + np.sin(lean_rad) * forward
    across = np.array([-along[1], along[0], 0.0])
    x = np.cos(roll_rad) * across + np.sin(roll_rad) * np.cross(z, across)
    return np.column_stack([x, np.cross(z, x), z])
