"""GRA: can a gripper do what the annotated contacts say?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from manitwin.assets.asset import AnnotatedFrame
from manitwin.assets.audit.closing import Closings, close_on
from manitwin.assets.audit.finding import Complaint, Rule
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.assets.audit.rules.collision import stands_for_object
from manitwin.assets.audit.rules.frames import is_sound
from manitwin.assets.audit.rules.scale import is_of_wrong_size
from manitwin.geometry.poses import transform_points
from manitwin.robots.grippers.gripper import Gripper, load_gripper

REACH_M = 0.02
"""How far from the surface the point between the fingertips may be: a pad's length."""

BELOW_M = 0.005
"""How far below the object's lowest point a contact frame may be, and a palm below the plane."""

SLACK_M = 0.002
"""Of a gripper's opening: what its own clearance and rounding explain."""


@dataclass(frozen=True)
class Contacts:
    """The contact frames of an asset that are frames: points between the fingertips ``(N, 3)``, heights above the lowest."""

    frames: tuple[AnnotatedFrame, ...]
    points_m: np.ndarray
    below: np.ndarray
    distance_m: np.ndarray
    closings: Closings


@cache
def default_gripper() -> Gripper:
    """Return the gripper that contact frames are held against where they name none: the paper's."""
    return load_gripper("panda")


def contacts(measured: MeasuredAsset) -> Contacts | None:
    """Measure the contact frames; None where there are none, or nothing to hold them against."""
    frames = tuple(f for f in measured.asset.frames if f.kind == "contact" and is_sound(np.asarray(f.frame_to_asset)))
    if not frames or not len(measured.samples) or is_of_wrong_size(measured):
        return None
    points = np.array([frame.frame_to_asset[:3, 3] for frame in frames], float)
    heights = points @ measured.up - measured.lowest_m
    below = heights < -max(BELOW_M, 0.02 * measured.longest_m)
    closings = Closings(np.ones(len(frames), bool), np.zeros(len(frames)))
    closing_frames = [i for i, f in enumerate(frames) if f.closing is not None and f.approach is not None]
    if closing_frames and stands_for_object(measured):
        found = close_on(
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
    """Return the distance of points ``(N, 3)`` to the surface, 0 inside the object."""
    outside = ~measured.shapes.within(points)
    distance = np.zeros(len(points))
    if outside.any():
        distance[outside] = measured.distance_m(points[outside], exact_beyond_m)
    return distance


def below_object(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Complain of contact frames below the object's lowest point."""
    found = measured.once(contacts)
    if found is not None and found.below.any():
        deepest = float((measured.lowest_m - found.points_m @ measured.up).max())
        yield _complaint(found, found.below, f"up to {1000 * deepest:.3g} mm below the object's lowest point")


def out_of_reach(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Complain of contact frames beside the object, where fingers close on nothing."""
    found = measured.once(contacts)
    if found is None:
        return
    has_lines = np.array([f.closing is not None and f.approach is not None for f in found.frames])
    has_lines &= stands_for_object(measured)
    off = ~found.below & (found.distance_m > REACH_M) & ~(has_lines & found.closings.meets)
    if off.any():
        away = float(found.distance_m[off].max())
        yield _complaint(found, off, f"up to {1000 * away:.3g} mm away from the surface: fingers close on nothing")


def too_wide(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Complain of contact frames about which the object is wider than the gripper opens."""
    found = measured.once(contacts)
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
    """Complain where every contact frame comes from below at rest: the palm would be in the table."""
    found = measured.once(contacts)
    blocked, directed = measured.once(blocked_contacts)
    if found is not None and len(directed) and blocked.sum() == len(directed):
        yield _complaint(found, blocked, "the gripper comes from below, its palm would be in the table")


def some_through_table(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Note contact frames that come from below at rest, where others do not."""
    found = measured.once(contacts)
    blocked, directed = measured.once(blocked_contacts)
    if found is not None and 0 < blocked.sum() < len(directed):
        yield _complaint(found, blocked, f"from below at rest; {len(directed) - int(blocked.sum())} others are not")


def blocked_contacts(measured: MeasuredAsset) -> tuple[np.ndarray, np.ndarray]:
    """Return which contact frames ``(N,) bool`` have their palm in the table, and the indices of those with an approach."""
    found = measured.once(contacts)
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
    """Tell which palms ``(N, 3)`` are below the plane in every declared pose at rest; as it stands where none is declared."""
    heights = [palms @ measured.up - measured.lowest_m]
    rests = [rest for rest in measured.asset.rests if is_sound(np.asarray(rest, float))]
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
