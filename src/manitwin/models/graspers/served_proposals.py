"""Requests to served grasp models, and conversion of their answers to proposals in the grasp frame.

GraspGen's convention (github.com/NVlabs/GraspGen, docs/GRIPPER_DESCRIPTION.md v1.0.0, read 2026-11): origin at the hand's
base link, +Z the approach direction, fingers close along X. That is the grasp frame, up to the position of the base link
along Z in our gripper file.

For ``franka_panda`` the base link is the origin of ``panda_hand``, as in ``panda.toml``: GraspGen's mesh of the hand and that
of the Franka description have the same extents about it, up to a rotation of 90 degrees about Z. GraspGen's ``depth`` of
0.10527 m is a control point of its training loss (that of ACRONYM), 1.9 mm closer to the fingertip than the pads' centre at
0.1034 m. Shifting grasps by the difference would move the hand 1.9 mm away from the pose that the model predicts, so poses
are not shifted.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from manitwin.errors import BadReply
from manitwin.geometry.sampling import sample_surface
from manitwin.models.graspers.grasp_server import GraspServer, ServerError, said
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest
from manitwin.physics.grasp_filters import pad_contacts
from manitwin.robots.grippers.parallel import ParallelGripper

BASE_LINK_Z_M = {"franka_panda": 0.0}
"""Position of a GraspGen hand's base link along +Z of the grasp frame of our gripper."""

HANDS = {"panda": "franka_panda"}
"""GraspGen hand that corresponds to a gripper of ours, by gripper name."""

MAX_SKEW = 1e-2  # maximum deviation from a rotation; float32 rotations of a network deviate by 1e-6
FARTHEST_M = 100.0
ASKED_FOR = 4000  # paper, implementation details
# Error message of both servers if the model yields no grasp: they concatenate empty lists as tensors.
NOTHING_FOUND = "expected Tensor as element"


def gripper_poses(base_link_to_object: np.ndarray, base_link_z_m: float = 0.0) -> np.ndarray:
    """Return ``gripper_to_object (N, 4, 4)`` in double precision with exact rotations, from poses of a base link.

    The last row is reset, because both servers leave rounding errors in it. Raises ValueError for poses that are not rigid.
    """
    poses = np.array(base_link_to_object, dtype=float)
    if poses.ndim != 3 or poses.shape[1:] != (4, 4):
        raise ValueError(f"poses of the shape {poses.shape}, not (N, 4, 4)")
    if not np.isfinite(poses).all():
        raise ValueError("poses that are not finite")
    if np.abs(poses).max(initial=0.0) > FARTHEST_M:
        raise ValueError(f"poses of more than {FARTHEST_M:g} m")
    left, _, right = np.linalg.svd(poses[:, :3, :3])
    rotation = left @ right
    if len(poses) and (np.linalg.det(rotation).min() < 0 or np.abs(rotation - poses[:, :3, :3]).max() > MAX_SKEW):
        raise ValueError("poses that are no rigid motions")
    poses[:, :3, :3] = rotation
    poses[:, :3, 3] -= base_link_z_m * rotation[:, :, 2]
    poses[:, 3] = [0.0, 0.0, 0.0, 1.0]
    return poses


def point_cloud(request: GraspRequest, count: int) -> np.ndarray:
    """Sample the object's surface: points ``(count, 3) float32`` in m in the object frame, deterministic for a seed."""
    points, _, _ = sample_surface(request.solid, count, np.random.default_rng(request.seed))
    return points.astype(np.float32)


def ask_for_proposals(
    server: GraspServer,
    question: dict[str, Any],
    request: GraspRequest,
    gripper: ParallelGripper,
    base_link_z_m: float = 0.0,
) -> GraspProposals:
    """Return the grasps in a server's answer, best first, at most ``max_proposals``; an empty result if it finds none.

    Widths are the distances of the contacts when the pads close, or the full opening if nothing is between them. Raises the
    errors of ``GraspServer.ask``, and BadReply for unusable grasps.
    """
    try:
        answer = server.ask(question)
    except ServerError as error:
        if NOTHING_FOUND in error.detail:
            return GraspProposals(np.empty((0, 4, 4)), np.empty(0), np.empty(0), np.empty(0))
        raise
    try:
        poses = gripper_poses(np.asarray(answer["grasps"]), base_link_z_m)
        score = np.asarray(answer["confidences"]).astype(float, casting="same_kind")
        if score.shape != (len(poses),) or not np.isfinite(score).all():
            raise ValueError(f"scores of the shape {score.shape} for {len(poses)} poses, or not finite")
    except KeyError as error:
        raise BadReply(f"{server.what}: the answer has no field {error}") from error
    except (ValueError, TypeError, OverflowError) as error:
        raise BadReply(f"{server.what}: the answer holds {said(error)}") from error
    best = np.argsort(-score, kind="stable")[: request.max_proposals]
    poses, score = poses[best], score[best].clip(0, 1)
    contacts = pad_contacts(gripper, poses, request.surface, request.center_of_mass_m)
    width_m = contacts.width_m.clip(0, gripper.opening_m)
    return GraspProposals(poses, width_m, np.full(len(poses), gripper.tip_depth_m), score)
