"""Grasps of a multi-finger hand: a posture of its fingertips around two opposite surface points; no weights, no GPU."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from manitwin.config import Resource
from manitwin.geometry.antipodal import AntipodalPairs, antipodal_pairs, tangents
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest
from manitwin.models.graspers.surface_sampling import (
    CONE_SAFETY,
    HALF_LEVER_M,
    LEVER_SLOPE_M,
    MIN_WIDTH_M,
    ROLLS,
    starting_points,
)
from manitwin.robots.grippers.gripper import require_kind
from manitwin.robots.grippers.multi_finger import MultiFingerGripper, Posture

OPENING_STEP_M = 0.004  # openings are multiples of this, which limits the number of collision shapes
SQUEEZE_M = 0.03  # depth of each fingertip's target below the surface
PALM_GAP_M = 0.003
SUITED_SHARE = 0.75  # share of the grasps that take a posture that suits the nearest grasp point's type


class PostureGrasper:
    """Propose grasps with thumb and fingers on opposite sides, by the fingertips only or with the object inside the hand."""

    name = "postures"
    model: str | None = None
    needs: Resource = "cpu"
    rounds: int | None = None

    def propose(self, request: GraspRequest) -> GraspProposals:
        """Return up to ``max_proposals`` grasps; none if no pair of points fits between thumb and fingers.

        The approach depth is, at random, the deepest that the palm allows or a value between that and the fingertips.
        """
        hand = require_kind(request.gripper, MultiFingerGripper)
        rng = np.random.default_rng(request.seed)
        points, normals = starting_points(request, max(1, request.max_proposals // ROLLS), rng)
        caster = request.surface
        pairs = antipodal_pairs(
            caster,
            points,
            normals,
            friction=(hand.finger_friction + request.object_friction) / 2 / CONE_SAFETY,
            max_width_m=hand.opening_m,
            rng=rng,
        )
        pairs = pairs.take(np.flatnonzero(pairs.width_m >= MIN_WIDTH_M))
        pairs = pairs.take(np.repeat(np.arange(len(pairs)), ROLLS))
        poses = _frames(pairs, rng)
        posture = _postures(hand, request, poses, rng)
        depth_m, joints_rad = np.empty(len(pairs)), np.empty((len(pairs), 2, len(hand.joints)))
        reach_m = _palm_distance(caster, poses, request)
        for number, some in enumerate(hand.postures):
            index = np.flatnonzero(posture == number)
            depth_m[index] = _depth(hand, some, reach_m[index], rng)
            joints_rad[index] = _joints(hand, some, pairs.width_m[index])
        poses[:, :3, 3] -= depth_m[:, None] * poses[:, :3, 2]
        lever_m = np.linalg.norm(np.cross(request.center_of_mass_m - pairs.first_m, poses[:, :3, 0]), axis=1)
        score = 1 / (1 + np.exp((lever_m - HALF_LEVER_M) / LEVER_SLOPE_M))
        proposals = GraspProposals(poses, pairs.width_m, depth_m, score, joints_rad)
        return proposals.take(rng.permutation(len(poses))[: request.max_proposals])


def _frames(pairs: AntipodalPairs, rng: np.random.Generator) -> np.ndarray:
    """Return frames ``(N, 4, 4)`` at the midpoints of the pairs: X from the thumb's side to the fingers', Z at a random angle."""
    count = len(pairs)
    x = (pairs.second_m - pairs.first_m) / pairs.width_m[:, None]
    x *= rng.choice([-1.0, 1.0], count)[:, None]
    first, second = tangents(x)
    roll = rng.uniform(0, 2 * np.pi, count)[:, None]
    z = np.cos(roll) * first + np.sin(roll) * second
    frames = np.tile(np.eye(4), (count, 1, 1))
    frames[:, :3, 0], frames[:, :3, 1], frames[:, :3, 2] = x, np.cross(z, x), z
    frames[:, :3, 3] = (pairs.first_m + pairs.second_m) / 2
    return frames


def _postures(
    hand: MultiFingerGripper, request: GraspRequest, poses: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Return the posture index ``(N,)`` of each grasp: mostly one that suits the nearest grasp point's type, else any."""
    chosen = rng.integers(len(hand.postures), size=len(poses))
    if not len(request.grasp_types) or not len(poses):
        return chosen
    suiting = [[n for n, p in enumerate(hand.postures) if kind in p.grasp_types] for kind in request.grasp_types]
    suited = np.array([rng.choice(numbers) if numbers else -1 for numbers in suiting])
    nearest = suited[cKDTree(request.grasp_points_m).query(poses[:, :3, 3])[1]]
    take = (rng.random(len(poses)) < SUITED_SHARE) & (nearest >= 0)
    return np.where(take, nearest, chosen)


def _palm_distance(caster: RayCaster, poses: np.ndarray, request: GraspRequest) -> np.ndarray:
    """Return the distance ``(N,)`` in m from each frame's origin to the object's outermost surface in direction -Z."""
    far_m = float(np.linalg.norm(request.solid.extents))
    distance_m, _ = caster.first_hits(poses[:, :3, 3] - far_m * poses[:, :3, 2], poses[:, :3, 2])
    return np.clip(far_m - distance_m, 0.0, far_m)


def _depth(hand: MultiFingerGripper, posture: Posture, reach_m: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    low, high = posture.depth_m
    nearest = np.clip(reach_m + hand.palm_front_m + PALM_GAP_M, low, high)
    return nearest + (high - nearest) * np.maximum(0.0, rng.uniform(-1, 1, len(reach_m)))


def _joints(hand: MultiFingerGripper, posture: Posture, width_m: np.ndarray) -> np.ndarray:
    """Return joint angles ``(N, 2, J)``: of the hand opened wider than the object, and of fingertip targets inside it."""
    opening_m = np.ceil((width_m + 2 * hand.clearance_m) / OPENING_STEP_M) * OPENING_STEP_M
    return np.stack(
        [posture.joints_at(opening_m), posture.joints_at(opening_m - 2 * (hand.clearance_m + SQUEEZE_M))], axis=1
    )
