"""GRA rules on annotated contacts: whether a gripper can execute them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from manitwin.assets.asset import AnnotatedFrame
from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.convex_shapes import ConvexShapes
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.assets.audit.rules.collision import has_graspable_collision
from manitwin.assets.audit.rules.frames import is_rigid_transform
from manitwin.assets.audit.rules.scale import is_of_wrong_size
from manitwin.geometry.poses import transform_points
from manitwin.robots.grippers.gripper import Gripper, load_gripper

REACH_M = 0.02
"""Largest distance of the point between the fingertips from the surface: the length of a pad."""

BELOW_M = 0.005
"""How far a contact frame may be below the lowest point of the object, and a palm below the support plane."""

SLACK_M = 0.002
"""Tolerance of a gripper's opening for clearance and rounding."""

PAD_M = 0.009
"""Half of a fingertip pad (Panda: 8.75 by 9.25 mm): its edge may touch what its centre misses."""

_CLEAR_M = 0.0002


@dataclass(frozen=True)
class Contacts:
    """The valid contact frames of an asset, with points between the fingertips ``(N, 3)`` and measurements ``(N,)``.

    ``below`` marks frames below the lowest point of the object, ``distance_m`` is the distance to the surface, and ``closings``
    the result of closing the default gripper.
    """

    frames: tuple[AnnotatedFrame, ...]
    points_m: np.ndarray
    below: np.ndarray
    distance_m: np.ndarray
    closings: Closings


@cache
def default_gripper() -> Gripper:
    """Return the gripper for contact frames that name none: the one of the paper."""
    return load_gripper("panda")


def measure_contacts(measured: MeasuredAsset) -> Contacts | None:
    """Measure the contact frames; None if there are none, or no geometry of plausible size to measure them against."""
    frames = tuple(
        f for f in measured.asset.frames if f.kind == "contact" and is_rigid_transform(np.asarray(f.frame_to_asset))
    )
    if not frames or not len(measured.samples) or is_of_wrong_size(measured):
        return None
    points = np.array([frame.frame_to_asset[:3, 3] for frame in frames], float)
    heights = points @ measured.up - measured.lowest_m
    below = heights < -max(BELOW_M, 0.02 * measured.longest_m)
    closings = Closings(np.ones(len(frames), bool), np.zeros(len(frames)))
    closing_frames = [i for i, f in enumerate(frames) if f.closing is not None and f.approach is not None]
    if closing_frames and has_graspable_collision(measured):
        found = close_fingers(
            measured.shapes,
            points[closing_frames],
            np.array([frames[i].closing for i in closing_frames], float),
            np.array([frames[i].approach for i in closing_frames], float),
            default_gripper().opening_m,
        )
        closings.meets[closing_frames] = found.meets
        closings.least_opening_m[closing_frames] = found.least_opening_m
    return Contacts(frames, points, below, distance_to_matter(measured, points, REACH_M), closings)


def distance_to_matter(measured: MeasuredAsset, points: np.ndarray, exact_beyond_m: float) -> np.ndarray:
    """Return the distances of points ``(N, 3)`` to the surface, 0 inside the object."""
    outside = ~measured.shapes.is_within(points)
    distance = np.zeros(len(points))
    if outside.any():
        distance[outside] = measured.distance_m(points[outside], exact_beyond_m)
    return distance


def below_object(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report contact frames below the lowest point of the object."""
    found = measured.measure_once(measure_contacts)
    if found is not None and found.below.any():
        deepest = float((measured.lowest_m - found.points_m @ measured.up).max())
        yield _complaint(found, found.below, f"up to {1000 * deepest:.3g} mm below the object's lowest point")


def out_of_reach(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report contact frames beside the object, where fingers close on nothing."""
    found = measured.measure_once(measure_contacts)
    if found is None:
        return
    has_lines = np.array([f.closing is not None and f.approach is not None for f in found.frames])
    has_lines &= has_graspable_collision(measured)
    off = ~found.below & (found.distance_m > REACH_M) & ~(has_lines & found.closings.meets)
    if off.any():
        away = float(found.distance_m[off].max())
        yield _complaint(found, off, f"up to {1000 * away:.3g} mm away from the surface: fingers close on nothing")


def too_wide(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report contact frames at which the object is wider than the opening of the gripper."""
    found = measured.measure_once(measure_contacts)
    if found is None:
        return
    gripper = default_gripper()
    wide = ~found.below & found.closings.meets & (found.closings.least_opening_m > gripper.opening_m + SLACK_M)
    if wide.any():
        widths = found.closings.least_opening_m[wide]
        most = float(widths[np.isfinite(widths)].max(initial=0.0))
        size = (
            f"up to {1000 * most:.3g} mm wide along the closing axis" if most else "no opening leaves the fingers free"
        )
        yield _complaint(found, wide, f"{size}, {gripper.name} opens {1000 * gripper.opening_m:.3g} mm")


def through_table(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report if every contact frame approaches from below at rest, so that the palm would be in the table."""
    found = measured.measure_once(measure_contacts)
    blocked, directed = measured.measure_once(blocked_contacts)
    if found is not None and len(directed) and blocked.sum() == len(directed):
        yield _complaint(found, blocked, "the gripper comes from below, its palm would be in the table")


def some_through_table(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Note contact frames that approach from below at rest, if others do not."""
    found = measured.measure_once(measure_contacts)
    blocked, directed = measured.measure_once(blocked_contacts)
    if found is not None and 0 < blocked.sum() < len(directed):
        yield _complaint(found, blocked, f"from below at rest; {len(directed) - int(blocked.sum())} others are not")


def blocked_contacts(measured: MeasuredAsset) -> tuple[np.ndarray, np.ndarray]:
    """Return which contact frames have their palm in the table ``(N,) bool``, and the indices of those with an approach."""
    found = measured.measure_once(measure_contacts)
    if found is None:
        return np.zeros(0, dtype=bool), np.zeros(0, dtype=int)
    blocked = np.zeros(len(found.frames), dtype=bool)
    directed = [i for i, f in enumerate(found.frames) if f.approach is not None and not found.below[i]]
    if directed:
        approach = np.array([found.frames[i].approach for i in directed], float)
        palms = found.points_m[directed] - default_gripper().tip_depth_m * approach
        blocked[directed] = under_table(measured, palms)
    return blocked, np.array(directed, dtype=int)


def under_table(measured: MeasuredAsset, palms: np.ndarray) -> np.ndarray:
    """Return which palms ``(N, 3)`` are below the plane in every declared resting pose, or as the asset stands if it has none."""
    heights = [palms @ measured.up - measured.lowest_m]
    rests = [rest for rest in measured.asset.rests if is_rigid_transform(np.asarray(rest, float))]
    if rests:
        heights = [transform_points(np.asarray(rest, float), palms)[:, 2] for rest in rests]
    return np.max(heights, axis=0) < -BELOW_M


def _complaint(found: Contacts, which: np.ndarray, what: str) -> Complaint:
    numbers = [found.frames[i].number for i in np.flatnonzero(which)]
    return Complaint(
        f"contact {', '.join(map(str, numbers[:8]))}{' ...' if len(numbers) > 8 else ''}: {what}",
        values={"contacts": numbers, "of": len(found.frames)},
    )


RULES = (
    Rule(
        "GRA001",
        "contact-out-of-reach",
        "error",
        why="Contact points beside the object come from another scale or variant; only successes are kept, so nobody sees it:"
        " RoboTwin #486, a phone with 0 of 43 episodes.",
        remedy="Annotate on this variant's mesh; multiply translations by its scale.",
        check=out_of_reach,
    ),
    Rule(
        "GRA002",
        "contact-too-wide",
        "error",
        why="RoboTwin #482: the object is wider at the contact point than the gripper opens, so that every attempt fails. Fingers"
        " are closed on the collision shapes along the closing axis; the Panda's 80 mm count where no gripper is named.",
        remedy="Move the contact to a narrower place, or turn its closing axis.",
        check=too_wide,
    ),
    Rule(
        "GRA003",
        "approach-through-table",
        "error",
        why="A hand that comes from below goes through the table: RoboTwin #486, contact poses upside down. The palm is held"
        " against the plane in every pose at rest that is declared, or as the object stands. It is an error where no contact"
        " frame is left: planners choose among them, and some are for objects that are held already (GRA009).",
        remedy="Turn the frame's approach so that it comes from above or from the side.",
        check=through_table,
    ),
    Rule(
        "GRA004",
        "contact-below-object",
        "error",
        why="RoboTwin #486: contact points below the table's surface. They stay from a mesh whose origin was moved.",
        remedy="Annotate again after the origin has moved, or move the frames along.",
        check=below_object,
    ),
    Rule(
        "GRA009",
        "some-approaches-through-table",
        "warning",
        why="Contact frames that come from below are of use only after the object was lifted; a planner that takes one at"
        " random fails with it.",
        remedy="Let the planner choose by reach, or take them out where nothing is handed over.",
        check=some_through_table,
    ),
)


@dataclass(frozen=True)
class Closings:
    """For each grasp, whether a line between the open fingers meets the object, and the least opening ``(N,)`` m.

    ``least_opening_m`` is infinite if no opening leaves both fingertips free with the object between them.
    """

    meets: np.ndarray
    least_opening_m: np.ndarray


def close_fingers(
    shapes: ConvexShapes, points: np.ndarray, closing: np.ndarray, approach: np.ndarray, opening_m: float
) -> Closings:
    """Close two fingers on shapes, about ``points (N, 3)`` between the fingertips along ``closing (N, 3)``.

    Five lines for each grasp are tested, at the centre of the pad and at its edges; the best one counts.
    """
    lateral = np.cross(approach, closing)
    ahead = np.cross(closing, lateral)
    offsets = [np.zeros_like(points), *(side * PAD_M * way for way in (lateral, ahead) for side in (1, -1))]
    meets = np.zeros(len(points), dtype=bool)
    least = np.full(len(points), np.inf)
    for offset in offsets:
        enter, leave = shapes.line_intervals(points + offset, closing)
        line_meets, line_least = _line(enter, leave, opening_m)
        meets |= line_meets
        least = np.minimum(least, line_least)
    return Closings(meets, least)


def _line(enter: np.ndarray, leave: np.ndarray, opening_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return whether matter lies between the fingers, and the least opening at which they are free with matter between them.

    The fingertips are at +s and -s. Candidates for s are just beyond the ends of the intervals, where a finger first becomes
    free.
    """
    hit = enter < leave
    enter, leave = np.where(hit, enter, np.inf), np.where(hit, leave, np.inf)
    meets = np.any(hit & (enter < opening_m / 2) & (leave > -opening_m / 2), axis=1)
    tried = np.concatenate([-np.where(hit, enter, -np.inf), np.where(hit, leave, np.inf)], axis=1) + _CLEAR_M
    tried = np.where(np.isfinite(tried) & (tried > 0), tried, np.inf)
    blocked = np.zeros_like(tried, dtype=bool)
    between = np.zeros_like(tried, dtype=bool)
    for start, end in zip(enter.T[:, :, None], leave.T[:, :, None], strict=True):
        blocked |= ((start < tried) & (tried < end)) | ((start < -tried) & (-tried < end))
        between |= (start > -tried) & (end < tried)
    free = np.isfinite(tried) & ~blocked & between
    return np.asarray(meets), 2 * np.where(free, tried, np.inf).min(1)
