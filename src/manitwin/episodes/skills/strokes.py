"""Push strokes of the closed hand over the table: contact of fingertips and object, and the path of the hand."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from manitwin.episodes.planning.collision_world import STANDING
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.geometry.boxes import footprint
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.rigid_body import PlacedObject

HEIGHT_SHARE, HEIGHTS_M = 0.35, (0.012, 0.04)  # share of the object's height, and limits, at which it is pushed
LEANS_RAD = np.radians([30.0, 15, 45, 0])  # the palm is behind the fingertips, not above the object
ROLLS_RAD = np.radians([0.0, 180, 90, -90, 45, -45, 135, -135])  # the broad side of the fingertips first
BEHIND_M, BEYOND_M, KNOT_M = 0.025, 0.015, 0.025
# of an arc that ends level: a corner would make the joint spline overshoot downwards
DOWN = np.array([1.0, 0.7, 0.4, 0.2])
DOWN_M, DOWN_BACK_M = 0.10, 0.06
# height above the fingertips' lower edge; tolerance behind the object's start; start of the rays
MET_M, LATE_M, FAR_M = 0.002, 0.02, 0.5
BAND_M = 0.012  # to either side of the line: half the width of the closed fingertips


def strokes(moved: PlacedObject, place_m: np.ndarray, fingertips_m: np.ndarray, level_m: float) -> tuple[HeldPath, ...]:
    """Return paths of the closed hand that push an object through its centre of mass towards a place, for several tilts.

    Each goes down behind the object, then along the line slightly beyond what brings the centre of mass to ``place_m (3,)``;
    the course stops there. ``fingertips_m (N, 3)`` are the vertices of the closed fingertips in the grasp frame, ``level_m``
    the height of the supporting surface.
    """
    center = transform_points(moved.object_to_world, moved.body.center_of_mass_m[None])[0]
    way = place_m[:2] - center[:2]
    along = way / max(float(np.linalg.norm(way)), 1e-9)
    points = transform_points(moved.object_to_world, np.concatenate(moved.body.hulls))
    height_m = _push_height_m(points)
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
    """Return hand poses that descend from behind to the pose ``low``, level at the end."""
    return [transform(None, np.array([*(-along * DOWN_BACK_M * each), DOWN_M * each**2])) @ low for each in DOWN]


def touches_near_edge(moved: PlacedObject, along: np.ndarray) -> bool:
    """Tell whether fingertips that move along ``(2,)`` towards an object's centre of mass touch it at its near edge.

    Checked over the middle of the band: the fingertips would pass over the handle of a spoon.
    """
    points = transform_points(moved.object_to_world, np.concatenate(moved.body.hulls))
    level_m, height_m = float(points[:, 2].min()), _push_height_m(points)
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


def _push_height_m(points_m: np.ndarray) -> float:
    """Return the height above the support at which the fingertips push an object with vertices ``(N, 3)``."""
    return float(np.clip(HEIGHT_SHARE * np.ptp(points_m[:, 2]), *HEIGHTS_M))


def _behind(points_m: np.ndarray, center_m: np.ndarray, along: np.ndarray, below_m: float) -> float:
    """Return how far an object extends behind its centre of mass, at the fingertips' height and within their width."""
    flat = footprint(points_m[points_m[:, 2] <= below_m] if (points_m[:, 2] <= below_m).sum() > 3 else points_m)
    corners = (flat - center_m[:2]) @ np.column_stack([along, [-along[1], along[0]]])
    sides = np.concatenate([np.linspace(a, b, 20) for a, b in pairwise([*corners, corners[0]])])
    in_band = np.abs(sides[:, 1]) <= BAND_M
    return float(-(sides[in_band] if in_band.any() else sides)[:, 0].min())


def _hand(along: np.ndarray, lean_rad: float, roll_rad: float) -> np.ndarray:
    """Return the hand's rotation ``(3, 3)``: pointing down and forward, closing across the direction of motion, then rolled."""
    forward, down = np.array([*along, 0.0]), np.array([0.0, 0.0, -1.0])
    z = np.cos(lean_rad) * down + np.sin(lean_rad) * forward
    across = np.array([-along[1], along[0], 0.0])
    x = np.cos(roll_rad) * across + np.sin(roll_rad) * np.cross(z, across)
    return np.column_stack([x, np.cross(z, x), z])
