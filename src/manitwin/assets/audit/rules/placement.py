"""PLC rules: consistency of declared resting poses with the geometry."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.assets.audit.rules.frames import is_rigid_transform
from manitwin.geometry.poses import transform_points

SLACK_M, SLACK_SHARE = 0.002, 0.01
"""Allowed distance of the lowest point from the plane: the larger of a length and a share of the longest side."""

PATCH_M, PATCH_SHARE = 0.003, 0.02
"""Points this close to the plane, by the larger value, support the object: real surfaces and settled poses are not exact."""

TIPS_M = 0.003
"""How far the centre of mass may be outside the support region."""


def rest_off_plane(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a declared rest whose lowest point is not on the plane."""
    if measured.body is None:
        return
    off = {
        number: low
        for number, points in _declared_rests(measured)
        if abs(low := float(points[:, 2].min())) > _slack(measured)
    }
    for number, low in off.items():
        where = "above" if low > 0 else "below"
        yield Complaint(
            f"rest {number}: the lowest point is {1000 * abs(low):.3g} mm {where} the plane",
            values={"rest": number, "lowest_m": low},
        )


def origin_not_at_bottom(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report an origin that is not at the bottom, for formats that place objects by their origin."""
    if measured.bounds is None or measured.asset.format not in ("twin", "robotwin", "manitwin100k"):
        return
    if abs(measured.lowest_m) > _slack(measured):
        where = "below" if measured.lowest_m < 0 else "above"
        yield Complaint(
            f"the lowest point is {1000 * abs(measured.lowest_m):.3g} mm {where} the origin, on which it is put down",
            values={"lowest_m": measured.lowest_m},
        )


def tips_over(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a declared rest in which the centre of mass is not above the support region."""
    center = measured.asset.inertial.center_of_mass_m
    if center is None or not np.isfinite(center).all() or measured.body is None:
        return
    for number, points in _declared_rests(measured):
        low = float(points[:, 2].min())
        if abs(low) > _slack(measured):
            continue
        bearing = points[points[:, 2] < low + max(PATCH_M, PATCH_SHARE * measured.longest_m)][:, :2]
        rest = np.asarray(measured.asset.rests[number], float)
        over = _outside_polygon(transform_points(rest, center[None])[0, :2], bearing)
        if over > TIPS_M:
            yield Complaint(
                f"rest {number}: the centre of mass is {1000 * over:.3g} mm beside what it stands on, it tips over",
                values={"rest": number, "beside_m": over},
            )


def _declared_rests(measured: MeasuredAsset) -> Iterator[tuple[int, np.ndarray]]:
    assert measured.body is not None
    hull = measured.hull
    corners = hull.triangles.reshape(-1, 3) if len(hull) else np.asarray(measured.body.vertices, float)
    for number, rest in enumerate(measured.asset.rests):
        pose = np.asarray(rest, float)
        if is_rigid_transform(pose):
            yield number, transform_points(pose, corners)


def _slack(measured: MeasuredAsset) -> float:
    return max(SLACK_M, SLACK_SHARE * measured.longest_m)


def _outside_polygon(point: np.ndarray, polygon: np.ndarray) -> float:
    """Return the distance of a point ``(2,)`` outside the convex hull of points ``(N, 2)``, or to their segment if collinear."""
    try:
        equations = ConvexHull(polygon).equations
    except (QhullError, ValueError):
        center = polygon.mean(0)
        along = np.linalg.svd(polygon - center)[2][0]
        reach = (polygon - center) @ along
        nearest = center + np.clip((point - center) @ along, reach.min(), reach.max()) * along
        return float(np.linalg.norm(point - nearest))
    return max(0.0, float((equations[:, :2] @ point + equations[:, 2]).max()))


RULES = (
    Rule(
        "PLC001",
        "rest-off-plane",
        "error",
        why="An object that is put down above the table drops, one below it is thrown out by the solver. DexVerse lifts every"
        " object of ManiTwin-100K by its rotated box, since `place.position` is off the true lowest point.",
        remedy="Take the lowest vertex in the rotated pose, not a corner of a box.",
        check=rest_off_plane,
    ),
    Rule(
        "PLC002",
        "origin-not-at-bottom",
        "warning",
        why="These formats put an object's origin on the table: RoboTwin spawns at table height with no offset.",
        remedy="Move the origin to the bottom centre, and all annotations along; this is not done by `--fix`, since files"
        " elsewhere may refer to the old origin.",
        check=origin_not_at_bottom,
    ),
    Rule(
        "PLC003",
        "rest-tips-over",
        "warning",
        why="A pose whose centre of mass is beside its bearing points does not last: scenes are rendered with an object that"
        " falls over a moment later (RoboTwin checks by 2000 steps, and only the rotation).",
        remedy="Choose a stable pose; `manitwin build` finds and settles them.",
        check=tips_over,
    ),
)
