"""Start placements of a target with room for the hand above its support."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from manitwin.episodes.grasp_stability import LEAST_APART_M, any_orientation_loads, bears_weight, pad_distances_m
from manitwin.episodes.planning.grasp_candidates import CLOSED
from manitwin.episodes.planning.placement import DROP_M
from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.skill import Skill
from manitwin.geometry.boxes import box_corners
from manitwin.geometry.rigid_body import PlacedObject, RigidBody
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.scenes.layouts.pool import PoolTwin, StandingPose

CLEARANCE_M = 0.002
LEAST_LIKELY = 0.03


def placement_with_room(
    placements: Sequence[StandingPose], grasps: Sequence[Grasp], gripper: MultiFingerGripper
) -> StandingPose | None:
    """Return the likeliest placement, preferably upright, in which some grasp's hand stays above the plane while it closes.

    None if there is none; very unlikely placements are ignored.
    """
    has_room = _room_over_plane(grasps, gripper)
    likely = [pose for pose in placements if pose.probability >= LEAST_LIKELY]
    for placement in sorted(likely, key=lambda pose: (pose.upright, pose.probability), reverse=True):
        if any(has_room(placement, number) for number in range(len(grasps))):
            return placement
    return None


def feasible_start_placements(
    skill: Skill, target: PoolTwin, body: RigidBody, grasps: Callable[[], Sequence[Grasp]], gripper: Gripper
) -> Sequence[StandingPose]:
    """Return the placements in which a target may start with a skill.

    If the skill ends in a placement, those of ``start_placements_with_room``; if it needs two arms, those of
    ``handover_start_placements``. ``grasps`` is only called in these cases.
    """
    begins, ends = skill.begins_in(target), skill.ends_in(target)
    if skill.arms == 2:
        return handover_start_placements(begins, target.poses, grasps(), gripper, body)
    return start_placements_with_room(begins, ends, target.poses, grasps(), gripper, body) if ends else begins


def start_placements_with_room(
    begins: Sequence[StandingPose],
    ends: Sequence[StandingPose],
    ways: Sequence[StandingPose],
    grasps: Sequence[Grasp],
    gripper: Gripper,
    body: RigidBody,
) -> list[StandingPose]:
    """Return the start placements from which the object can be brought to one of ``ends``.

    Either one grasp has room in both and carries the weight of the ``body`` during the lift, or two grasps do with one of
    ``ways`` in between. Only the plane is considered, not the arm.
    """
    has_room = _room_over_plane(grasps, gripper)

    def put_down(placement: StandingPose) -> set[int]:
        return {number for number in range(len(grasps)) if has_room(placement, number)}

    def lifted(placement: StandingPose) -> set[int]:
        there = PlacedObject("", "", body, placement.object_to_plane)
        return {number for number in put_down(placement) if bears_weight(grasps[number], there, gripper)}

    at_ends = set[int]().union(*map(put_down, ends))
    half_way = set[int]().union(*(put_down(way) for way in ways if lifted(way) & at_ends))
    return [begin for begin in begins if lifted(begin) & (at_ends | half_way)]


def handover_start_placements(
    begins: Sequence[StandingPose],
    ends: Sequence[StandingPose],
    grasps: Sequence[Grasp],
    gripper: Gripper,
    body: RigidBody,
) -> list[StandingPose]:
    """Return the start placements from which one hand can lift the object and another, apart from it, can put it down.

    Both carry its weight in any orientation (``steady_grasps.loads_any_way_up``) and their pads are at least 4 cm apart. The
    first has room in the start placement, the second there or in one of ``ends`` (from 3 mm higher, where it may release).
    Only the plane is considered, neither the arms nor the clearance between the hands.
    """
    loads = any_orientation_loads(grasps, body, gripper)
    bearing = [number for number, load in enumerate(loads) if load is not None]
    has_room, lets_go = _room_over_plane(grasps, gripper), _room_over_plane(grasps, gripper, CLEARANCE_M - DROP_M)
    likely = [pose for pose in ends if pose.probability >= LEAST_LIKELY]

    def serves(begin: StandingPose) -> bool:
        givers = [grasps[number] for number in bearing if has_room(begin, number)]
        takers = [grasps[number] for number in bearing if any(lets_go(end, number) for end in (begin, *likely))]
        return any((pad_distances_m(giver, takers, gripper) >= LEAST_APART_M).any() for giver in givers)

    return [begin for begin in begins if serves(begin)]


def _room_over_plane(
    grasps: Sequence[Grasp], gripper: Gripper, clearance_m: float = CLEARANCE_M
) -> Callable[[StandingPose, int], bool]:
    """Return a test whether the hand of a grasp, by number, is above the plane of a placement."""
    corners_of = cache(lambda number: _corners(gripper, grasps[number]))

    def has_room(placement: StandingPose, number: int) -> bool:
        up = (placement.object_to_plane @ grasps[number].gripper_to_object)[2]
        return bool(up[3] > 0 and float((corners_of(number) @ up[:3]).min() + up[3]) >= clearance_m)

    return has_room


def _corners(gripper: Gripper, grasp: Grasp) -> np.ndarray:
    """Return the vertices ``(N, 3)`` of the hand's boxes before and during closing, in the grasp frame."""
    boxes = gripper.boxes(gripper.opening_m)
    if isinstance(gripper, MultiFingerGripper):
        assert grasp.joints_rad is not None
        before, to = grasp.joints_rad
        boxes = [box for closed in (0.0, *CLOSED) for box in gripper.boxes_at(before + closed * (to - before))]
    return np.concatenate([box_corners(half, pose) for pose, half in boxes])
