"""The built-in grasper: antipodal pairs of the mesh, taken from several sides. No weights, no GPU."""

from __future__ import annotations

import numpy as np

from manitwin.config import Resource
from manitwin.geometry.antipodal import AntipodalPairs, antipodal_pairs, grasp_frames
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest
from manitwin.models.graspers.starting_points import starting_points
from manitwin.robots.grippers.gripper import of_kind
from manitwin.robots.grippers.parallel import ParallelGripper

ROLLS = 8  # approach directions a pair
CONE_SAFETY = 1.5  # the friction cone is narrowed by this: contacts are patches, and hulls are not the surface
MIN_WIDTH_M = 0.0005
CLEARANCE_M = 0.0005  # between open finger and object, on each side
MAX_DEPTH_OFFSET_M = 0.007  # the middle of the pair stays on pads of 18.5 mm
# The score falls to one half at this lever: measured on 1,799 trials of 18 objects, where grasps beyond 80 mm held in
# 47 %.
HALF_LEVER_M, LEVER_SLOPE_M = 0.08, 0.02


class AntipodalGrasper:
    """Propose grasps at pairs of opposite surface points."""

    name = "antipodal"
    model: str | None = None
    needs: Resource = "cpu"
    rounds: int | None = None

    def propose(self, request: GraspRequest) -> GraspProposals:
        """Return up to ``max_proposals`` grasps, best-spread first come; none where no pair fits between the fingers.

        Scores are the product of how well the contacts face each other and how near the closing axis passes the centre
        of mass.
        """
        rng = np.random.default_rng(request.seed)
        gripper = of_kind(request.gripper, ParallelGripper)
        friction = (gripper.finger_friction + request.object_friction) / 2 / CONE_SAFETY
        points, normals = starting_points(request, max(1, request.max_proposals // ROLLS), rng)
        pairs = antipodal_pairs(
            RayCaster(request.solid),
            points,
            normals,
            friction=friction,
            max_width_m=gripper.opening_m - 2 * CLEARANCE_M,
            rng=rng,
        )
        pairs = pairs.take(np.flatnonzero(pairs.width_m >= MIN_WIDTH_M))
        poses = grasp_frames(
            pairs, rolls=ROLLS, tip_depth_m=gripper.tip_depth_m, max_depth_offset_m=MAX_DEPTH_OFFSET_M, rng=rng
        )
        proposals = GraspProposals(
            poses,
            np.repeat(pairs.width_m, ROLLS),
            np.full(len(poses), gripper.tip_depth_m),
            np.repeat(_score(pairs, request.center_of_mass_m, friction), ROLLS),
        )
        return proposals.take(rng.permutation(len(poses))[: request.max_proposals])


def _score(pairs: AntipodalPairs, center_of_mass_m: np.ndarray, friction: float) -> np.ndarray:
    closing = (pairs.second_m - pairs.first_m) / pairs.width_m[:, None]
    lever = np.linalg.norm(np.cross(center_of_mass_m - pairs.first_m, closing), axis=1)
    cosine = 1 / np.hypot(1, friction)
    facing = np.clip((pairs.alignment - cosine) / (1 - cosine), 0, 1)
    return (0.5 + 0.5 * facing) / (1 + np.exp((lever - HALF_LEVER_M) / LEVER_SLOPE_M))
