"""What a served model is given, and its answer as proposals like those of any other grasper."""

from __future__ import annotations

from typing import Any

import numpy as np

from manitwin.errors import BadReply
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import sample_surface
from manitwin.models.graspers.base_link_frames import gripper_poses
from manitwin.models.graspers.grasp_server import GraspServer, ServerError
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest
from manitwin.physics.grasp_filters import pad_contacts
from manitwin.robots.grippers.parallel import ParallelGripper

ASKED_FOR = 4000  # paper, implementation details
# What both servers say where the model yields no grasp at all: they join empty lists as if they were tensors.
NOTHING_FOUND = "expected Tensor as element"


def point_cloud(request: GraspRequest, count: int) -> np.ndarray:
    """Sample the object's surface: points ``(count, 3) float32`` m in the object frame, the same for the same seed."""
    points, _, _ = sample_surface(request.solid, count, np.random.default_rng(request.seed))
    return points.astype(np.float32)


def ask_for_proposals(
    server: GraspServer,
    question: dict[str, Any],
    request: GraspRequest,
    gripper: ParallelGripper,
    base_link_z_m: float = 0.0,
) -> GraspProposals:
    """Return the grasps that a server answers, best first and at most as many as asked for; none where it finds none.

    Widths are where the open pads, closed, would meet the object; the full opening where there is nothing between them.
    Raises what ``GraspServer.ask`` does, and BadReply for grasps that cannot be used.
    """
    try:
        answer = server.ask(question)
    except ServerError as error:
        if NOTHING_FOUND in error.detail:
            return GraspProposals(np.empty((0, 4, 4)), np.empty(0), np.empty(0), np.empty(0))
        raise
    try:
        poses = gripper_poses(np.asarray(answer["grasps"]), base_link_z_m)
        score = np.array(answer["confidences"], dtype=float)
        if score.shape != (len(poses),) or not np.isfinite(score).all():
            raise ValueError(f"scores of the shape {score.shape} for {len(poses)} poses, or not finite")
    except KeyError as error:
        raise BadReply(f"{server.what}: the answer has no field {error}") from error
    except (ValueError, TypeError) as error:
        raise BadReply(f"{server.what}: the answer holds {error}") from error
    best = np.argsort(-score, kind="stable")[: request.max_proposals]
    poses, score = poses[best], score[best].clip(0, 1)
    contacts = pad_contacts(gripper, poses, RayCaster(request.solid), request.center_of_mass_m)
    width_m = contacts.width_m.clip(0, gripper.opening_m)
    return GraspProposals(poses, width_m, np.full(len(poses), gripper.tip_depth_m), score)
