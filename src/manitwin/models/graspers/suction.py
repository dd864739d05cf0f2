"""Suction grasps: a cup against the surface, along its normal. No weights, no GPU."""

from __future__ import annotations

import numpy as np

from manitwin.config import Resource
from manitwin.geometry.antipodal import tangents
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest
from manitwin.models.graspers.starting_points import starting_points
from manitwin.physics.suction import seal
from manitwin.robots.grippers.gripper import of_kind
from manitwin.robots.grippers.suction import SuctionGripper

ROLLS = 2  # angles of the tool about the approach a point
HALF_LEVER_M, LEVER_SLOPE_M = 0.04, 0.02  # the tilt that a lip of 15 mm carries: at 40 mm half of the vacuum's force


class SuctionGrasper:
    """Propose cups on surface points, pointing against the surface's normal as the lip finds it."""

    name = "suction"
    model: str | None = None
    needs: Resource = "cpu"
    rounds: int | None = None

    def propose(self, request: GraspRequest) -> GraspProposals:
        """Return ``max_proposals`` grasps; the score falls with the lever of the centre of mass about the lip."""
        cup = of_kind(request.gripper, SuctionGripper)
        rng = np.random.default_rng(request.seed)
        points, normals = starting_points(request, max(1, request.max_proposals // ROLLS), rng)
        rolls = rng.uniform(0, 2 * np.pi, (len(points), ROLLS))
        first = _frames(cup, points, -normals, rolls[:, 0])
        # one normal of a scanned surface is noise: where the lip seals, its plane tells the direction
        inward = seal(cup, first, RayCaster(request.solid)).inward
        poses = np.concatenate([_frames(cup, points, inward, rolls[:, number]) for number in range(ROLLS)])
        count = len(poses)
        lever_m = np.linalg.norm(np.cross(request.center_of_mass_m - points, inward), axis=1)
        score = 1 / (1 + np.exp((lever_m - HALF_LEVER_M) / LEVER_SLOPE_M))
        proposals = GraspProposals(poses, np.zeros(count), np.full(count, cup.tip_depth_m), np.tile(score, ROLLS))
        return proposals.take(rng.permutation(count)[: request.max_proposals])


def _frames(cup: SuctionGripper, points_m: np.ndarray, inward: np.ndarray, roll_rad: np.ndarray) -> np.ndarray:
    """Return grasps ``(N, 4, 4)`` whose lips are centred on points, approaching along ``inward (N, 3)``."""
    first, second = tangents(inward)
    x = np.cos(roll_rad)[:, None] * first + np.sin(roll_rad)[:, None] * second
    poses = np.tile(np.eye(4), (len(points_m), 1, 1))
    poses[:, :3, 0], poses[:, :3, 1], poses[:, :3, 2] = x, np.cross(inward, x), inward
    poses[:, :3, 3] = points_m - cup.tip_depth_m * inward
    return poses
