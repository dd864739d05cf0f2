"""Grasps that an imported asset gives, brought among the proposals: they are tried like all others."""

from __future__ import annotations

import numpy as np

from manitwin.models.graspers.protocol import GraspProposals, GraspRequest, Screen
from manitwin.physics.grasp_selection import Merits
from manitwin.pipeline.association import distances_to_grasps
from manitwin.pipeline.proposal_rounds import Kept
from manitwin.robots.grippers.gripper import Gripper
from manitwin.twin.import_record import ImportRecord

CONTACTS = "parallel"
"""The kind of gripper that a contact frame, with an approach and a closing direction, is enough for."""


def given_proposals(given: ImportRecord, gripper: Gripper, most: int) -> GraspProposals | None:
    """Return the given grasps of a gripper, those said to hold first, at most ``most``; None where there are none.

    Contact frames that say how to approach and close are grasps of any parallel gripper, its fingertips at the frame.
    Hands with more joints have none: an asset does not give their joints.
    """
    if gripper.kind == "multi_finger":
        return None
    poses: list[np.ndarray] = []
    widths: list[float] = []
    depths: list[float] = []
    scores: list[float] = []
    for grasps in given.grasps:
        if grasps.gripper == gripper.name:
            order = np.argsort(~np.array(grasps.held), kind="stable")
            poses += [np.array(grasps.gripper_to_object[i]) for i in order]
            widths += [grasps.width_m[i] for i in order]
            depths += [grasps.depth_m[i] for i in order]
            scores += [float(grasps.held[i]) for i in order]
    if gripper.kind == CONTACTS:
        frames = [p for p in given.grasp_points if p.approach is not None and p.closing is not None]
        poses += [_at_contact(np.array(p.position_m), p.approach, p.closing, gripper.tip_depth_m) for p in frames]
        widths += [gripper.opening_m] * len(frames)
        depths += [gripper.tip_depth_m] * len(frames)
        scores += [1.0] * len(frames)
    if not poses:
        return None
    some = slice(0, most)
    return GraspProposals(np.array(poses[some]), np.array(widths[some]), np.array(depths[some]), np.array(scores[some]))


def with_given(
    kept: Kept, given: ImportRecord | None, gripper: Gripper, screen: Screen, request: GraspRequest, most: int
) -> tuple[Kept, list[str]]:
    """Put the given grasps that pass the filters before the proposed ones; return all, and the proposers of the given."""
    proposals = None if given is None else given_proposals(given, gripper, most)
    if given is None or proposals is None:
        return kept, []
    left = screen(proposals)
    some = left.proposals
    if not len(some):
        return kept, []
    distance_m = distances_to_grasps(request.focus_points_m, some.gripper_to_object, some.depth_m, some.width_m)
    counts = {name: count + left.counts.get(name, 0) for name, count in kept.counts.items()}
    joined = Kept(
        GraspProposals.joined([some, kept.proposals]),
        Merits.joined([left.merits, kept.merits]),
        np.concatenate([distance_m, kept.distance_m]),
        kept.raw,
        counts,
    )
    return joined, [given.source] * len(some)


def _at_contact(
    position_m: np.ndarray, approach: list[float] | None, closing: list[float] | None, tip_depth_m: float
) -> np.ndarray:
    """Return ``gripper_to_object`` with the fingertips at a contact frame: Z along the approach, X along the closing."""
    z = np.array(approach)
    x = np.array(closing) - (np.array(closing) @ z) * z
    if np.linalg.norm(x) < 1e-6:  # closing along the approach is no grasp: any closing lets the filters refuse it
        x = np.eye(3)[int(np.abs(z).argmin())] - z * z[int(np.abs(z).argmin())]
    x = x / np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    pose[:3, 3] = position_m - tip_depth_m * z
    return pose
