"""Built-in graspers that sample the surface: antipodal pairs for parallel grippers, and suction cups; no weights, no GPU."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from manitwin.config import Resource
from manitwin.geometry.antipodal import AntipodalPairs, antipodal_pairs, grasp_frames, tangents
from manitwin.geometry.sampling import sample_surface
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest
from manitwin.physics.suction import seal
from manitwin.robots.grippers.gripper import require_kind
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.grippers.suction import SuctionGripper

POOL = 20_000  # surface samples from which starting points are drawn; the paper's number of candidate points
FOCUS_SPREAD_M, FOCUS_WEIGHT = 0.02, 8.0  # starting points are denser around the selected points ...
CENTER_SPREAD, CENTER_WEIGHT = 0.2, 2.0  # ... and around the centre of mass (as a share of the diagonal)
FEW = 16  # up to this many points, brute force is faster than a k-d tree
ROLLS = 8  # approach directions per pair
CONE_SAFETY = (
    1.5  # the friction coefficient is divided by this, because contacts are patches and hulls differ from the surface
)
MIN_WIDTH_M = 0.0005
CLEARANCE_M = 0.0005  # between open finger and object on each side
MAX_DEPTH_OFFSET_M = 0.007  # keeps the midpoint of the pair on pads of 18.5 mm
# Lever arm at which the score falls to one half, from 1,799 trials of 18 objects: grasps beyond 80 mm held in 47 % of them.
HALF_LEVER_M, LEVER_SLOPE_M = 0.08, 0.02
CUP_ROLLS = 2  # rotations of the tool about the approach axis per point
CUP_HALF_LEVER_M, CUP_LEVER_SLOPE_M = 0.04, 0.02
"""Lever arm at which the score of a cup is one half, and its slope; a lip of 15 mm then bears half of the vacuum force."""


def starting_points(request: GraspRequest, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw up to ``count`` surface points ``(N, 3)`` and their outward normals ``(N, 3)``."""
    points, normals, _ = sample_surface(request.solid, POOL, rng)
    density = _density(request, points)
    reached = np.flatnonzero(density)
    if not len(reached):
        return points[:0], normals[:0]
    chosen = rng.choice(reached, min(len(reached), count), replace=False, p=density[reached] / density[reached].sum())
    return points[chosen], normals[chosen]


def _density(request: GraspRequest, points: np.ndarray) -> np.ndarray:
    """Return the relative probability ``(N,)`` of drawing each surface point; zero beyond ``within_m`` of the focus points."""
    weight, reached = np.ones(len(points)), np.ones(len(points), bool)
    if len(request.focus_points_m):
        distance = _nearest_distance_m(points, request.focus_points_m)
        weight += FOCUS_WEIGHT * np.exp(-0.5 * (distance / FOCUS_SPREAD_M) ** 2)
        reached = distance <= (np.inf if request.within_m is None else request.within_m)
    spread_m = CENTER_SPREAD * float(np.linalg.norm(request.solid.extents))
    distance = np.linalg.norm(points - request.center_of_mass_m, axis=1)
    weight += CENTER_WEIGHT * np.exp(-0.5 * (distance / spread_m) ** 2)
    weight[~reached] = 0.0
    return weight


def _nearest_distance_m(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the distance ``(N,)`` of each of ``points (N, 3)`` to the nearest of ``others (M, 3)``."""
    if len(others) > FEW:
        return np.asarray(cKDTree(others).query(points)[0])
    x, y, z = points.T.copy()
    squares = np.full(len(points), np.inf)
    for a, b, c in others:
        np.minimum(squares, (x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2, out=squares)
    return np.sqrt(squares, out=squares)


class AntipodalGrasper:
    """Propose grasps at pairs of opposite surface points."""

    name = "antipodal"
    model: str | None = None
    needs: Resource = "cpu"
    rounds: int | None = None

    def propose(self, request: GraspRequest) -> GraspProposals:
        """Return up to ``max_proposals`` grasps in random order; none if no pair fits between the fingers.

        The score is the product of how well the contacts face each other and how close the closing axis passes to the centre
        of mass.
        """
        rng = np.random.default_rng(request.seed)
        gripper = require_kind(request.gripper, ParallelGripper)
        friction = (gripper.finger_friction + request.object_friction) / 2 / CONE_SAFETY
        points, normals = starting_points(request, max(1, request.max_proposals // ROLLS), rng)
        pairs = antipodal_pairs(
            request.surface,
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


class SuctionGrasper:
    """Propose suction grasps on surface points, approaching along the inward normal of the plane in which the lip rests."""

    name = "suction"
    model: str | None = None
    needs: Resource = "cpu"
    rounds: int | None = None

    def propose(self, request: GraspRequest) -> GraspProposals:
        """Return up to ``max_proposals`` grasps in random order; the score decreases with the lever arm of the centre of mass."""
        cup = require_kind(request.gripper, SuctionGripper)
        rng = np.random.default_rng(request.seed)
        points, normals = starting_points(request, max(1, request.max_proposals // CUP_ROLLS), rng)
        rolls = rng.uniform(0, 2 * np.pi, (len(points), CUP_ROLLS))
        first = _frames(cup, points, -normals, rolls[:, 0])
        # a single normal of a scanned surface is noisy, so the plane of the lip's contacts gives the direction
        inward = seal(cup, first, request.surface).inward
        poses = np.concatenate([_frames(cup, points, inward, rolls[:, number]) for number in range(CUP_ROLLS)])
        count = len(poses)
        lever_m = np.linalg.norm(np.cross(request.center_of_mass_m - points, inward), axis=1)
        score = 1 / (1 + np.exp((lever_m - CUP_HALF_LEVER_M) / CUP_LEVER_SLOPE_M))
        proposals = GraspProposals(poses, np.zeros(count), np.full(count, cup.tip_depth_m), np.tile(score, CUP_ROLLS))
        return proposals.take(rng.permutation(count)[: request.max_proposals])


def _frames(cup: SuctionGripper, points_m: np.ndarray, inward: np.ndarray, roll_rad: np.ndarray) -> np.ndarray:
    """Return grasp poses ``(N, 4, 4)`` whose lips are centred on points and approach along ``inward (N, 3)``."""
    first, second = tangents(inward)
    x = np.cos(roll_rad)[:, None] * first + np.sin(roll_rad)[:, None] * second
    poses = np.tile(np.eye(4), (len(points_m), 1, 1))
    poses[:, :3, 0], poses[:, :3, 1], poses[:, :3, 2] = x, np.cross(inward, x), inward
    poses[:, :3, 3] = points_m - cup.tip_depth_m * inward
    return poses
