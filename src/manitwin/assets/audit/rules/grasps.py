"""GRA rules on grasp sets: whether grasps held, and whether they belong to this object."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from manitwin.assets.asset import AnnotatedGrasps
from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.assets.audit.rules.contacts import REACH_M, SLACK_M, distance_to_matter, under_table
from manitwin.assets.audit.rules.frames import check_frames
from manitwin.assets.audit.rules.scale import is_of_wrong_size
from manitwin.robots.grippers.gripper import Gripper, load_gripper, shipped_grippers

PALM_REACH_M = 0.08
"""Largest distance of the fingertips from the surface for hands that also hold with other parts than the fingertips."""

TRIED = 64
"""Grasps of a set that are examined, evenly spread over it."""

SHARE_OFF = 0.1
"""Largest share of held grasps off the object; above it, the set belongs to another mesh, scale or frame."""


def none_held(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report an asset whose grasps were tried and none held."""
    counts = {grasps.gripper: (int(np.sum(grasps.held)), len(grasps.held)) for grasps in measured.asset.grasps}
    tried = {gripper: count for gripper, (_, count) in counts.items() if count}
    if tried and not any(held for held, _ in counts.values()):
        said = ", ".join(f"{count} of {gripper}" for gripper, count in tried.items())
        yield Complaint(f"none of the grasps held ({said})", values={"tried": tried})


def sample_held_grasps(measured: MeasuredAsset) -> list[tuple[AnnotatedGrasps, np.ndarray, np.ndarray, Gripper | None]]:
    """Return, for each set, a sample of its valid held grasps: indices, points between the fingertips, and the gripper."""
    found = []
    for grasps in measured.asset.grasps:
        held = np.flatnonzero(np.asarray(grasps.held, bool))
        held = held[np.linspace(0, len(held) - 1, min(TRIED, len(held))).round().astype(int)]
        poses = np.asarray(grasps.gripper_to_asset, float)
        held = held[check_frames(list(poses[held])).is_rigid]
        if len(held):
            points = poses[held, :3, 3] + np.asarray(grasps.depth_m, float)[held, None] * poses[held, :3, 2]
            found.append((grasps, held, points, _bundled_gripper(grasps.gripper)))
    return found


@cache
def _bundled_gripper(gripper: str) -> Gripper | None:
    return load_gripper(gripper) if gripper in shipped_grippers() else None


def grasps_off_object(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report sets of held grasps whose fingertips are away from the object."""
    if not len(measured.samples) or is_of_wrong_size(measured):
        return
    for grasps, held, points, gripper in measured.measure_once(sample_held_grasps):
        reach = REACH_M if gripper is not None and gripper.kind != "multi_finger" else PALM_REACH_M
        poses, widths = np.asarray(grasps.gripper_to_asset, float)[held], np.asarray(grasps.width_m, float)[held]
        aside = poses[:, :3, 0] * np.nan_to_num(widths, posinf=0.0)[:, None] / 2
        off = np.ones(len(points), bool)
        # the point between the fingers around a mug is in its hollow
        for fingers in (points, points + aside, points - aside):
            off[off] = distance_to_matter(measured, fingers[off], reach) > reach
        if off.mean() > SHARE_OFF:
            yield Complaint(
                f"{off.mean():.0%} of {len(held)} grasps of {grasps.gripper} that are said to hold have their fingertips more"
                f" than {1000 * reach:.3g} mm away from the object",
                values={"gripper": grasps.gripper, "share_off": float(off.mean())},
            )


def grasps_too_wide(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report held grasps that are wider than the opening of their gripper."""
    for grasps, held, _, gripper in measured.measure_once(sample_held_grasps):
        if gripper is None or gripper.kind != "parallel":
            continue
        widths = np.asarray(grasps.width_m, float)[held]
        wide = ~(widths <= gripper.opening_m + SLACK_M)
        if wide.any():
            yield Complaint(
                f"{wide.sum()} of {len(held)} grasps that are said to hold need up to {1000 * widths.max():.3g} mm,"
                f" {gripper.name} opens {1000 * gripper.opening_m:.3g} mm",
                values={"gripper": gripper.name, "widest_m": float(widths.max())},
            )


def all_through_table(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report sets of held grasps that all approach from below at rest."""
    if measured.bounds is None or is_of_wrong_size(measured):
        return
    for grasps, held, _, _ in measured.measure_once(sample_held_grasps):
        palms = np.asarray(grasps.gripper_to_asset, float)[held, :3, 3]
        if under_table(measured, palms).all():
            yield Complaint(
                f"every one of {len(held)} grasps of {grasps.gripper} comes from below the table",
                values={"gripper": grasps.gripper},
            )


RULES = (
    Rule(
        "GRA005",
        "no-grasp-held",
        "error",
        why="Zero is a failure, not a skip: sets that keep only successes lose such objects without a word (RoboTwin #486).",
        remedy="Look at the outcomes: too wide, unreachable and slips ask for different things.",
        check=none_held,
    ),
    Rule(
        "GRA006",
        "grasps-off-object",
        "error",
        why="Grasps in another frame convention (base, fingertip, panda_hand) or scale miss the object by a hand's length"
        " (GraspGen #20, #41).",
        remedy="State the frame: +Z approach, X closing, the base link's origin, depth to the fingertips.",
        check=grasps_off_object,
    ),
    Rule(
        "GRA007",
        "grasps-too-wide",
        "error",
        why="A grasp wider than the gripper that it names was made for another one (GraspGen #6, #27: my gripper is not"
        " covered).",
        remedy="Name the gripper that they were made for, or take those out that it cannot do.",
        check=grasps_too_wide,
    ),
    Rule(
        "GRA008",
        "grasps-through-table",
        "warning",
        why="Where every grasp comes from below, none can be done while the object stands on a table.",
        remedy="Propose more grasps, from above and from the sides.",
        check=all_through_table,
    ),
)
