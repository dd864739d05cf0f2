"""Placement after a handover: places on the table in front of the second arm, and the motion to one of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from manitwin.episodes.pick_place_tasks import MIN_GAP_M, footprint_at
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.placement import Placement, goals_after_slip
from manitwin.episodes.planning.problem import Grasp, Phase, PickPlaceProblem
from manitwin.geometry.boxes import separation_m
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject, StaticBox
from manitwin.robots.robot import Workspace

PLACES, DRAWS = 32, 400
MOST_PLANNED = 4  # places planned with one grasp, beyond the check of the hand alone
TABLE_M = 0.001  # tolerance of a table top at z = 0


@dataclass(frozen=True)
class HeldGrasp:
    """A grasp of the hand that puts the target down, with its pose as used, ``gripper_to_object (4, 4)``."""

    grasp: Grasp
    gripper_to_object: np.ndarray


class PlacementChoice:
    """Goals of one problem for one arm, and the choice among them for a grasp; deterministic for the problem's seed."""

    def __init__(self, arm: PickPlacePlanner, problem: PickPlaceProblem, goals: Sequence[np.ndarray]):
        """Take resting poses ``(4, 4)`` of the target, best first; the other arm, at home, is an obstacle of ``problem``."""
        self._arm, self._problem, self._goals = arm, problem, tuple(goals)
        self._found: dict[tuple[str, bytes], np.ndarray | None] = {}

    def first_feasible_goal(self, held: HeldGrasp) -> np.ndarray | None:
        """Return the first goal ``(4, 4)`` at which a grasp can put the target down, starting from home; or None."""
        key = held.grasp.grasp_id, held.gripper_to_object.tobytes()
        if key not in self._found:
            home = self._arm.arm.home
            found = self.plan(self._problem, held, home, held.gripper_to_object)
            self._found[key] = None if found is None else found[0]
        return self._found[key]

    def plan(
        self,
        problem: PickPlaceProblem,
        held: HeldGrasp,
        joints_rad: np.ndarray,
        gripper_to_object: np.ndarray,
        most: int = MOST_PLANNED,
    ) -> tuple[np.ndarray, Placement] | None:
        """Plan from the current joints for the measured pose in the hand ``(4, 4)``; return the goal and the motions.

        Returns None if none of the first ``most`` goals with room for the hand alone is feasible.
        """
        for goal in islice(self._with_room(problem, held, gripper_to_object), most):
            found = self._arm.plan_place(problem, held, joints_rad, gripper_to_object, goal, True)
            if found is not None:
                return goal, found
        return None

    def _with_room(
        self, problem: PickPlaceProblem, held: HeldGrasp, gripper_to_object: np.ndarray
    ) -> Iterator[np.ndarray]:
        """Yield the goals at which the hand alone is free at release, above it, and after its retreat.

        For a target that has turned in the hand, the release poses are those of ``goals_after_slip``.
        """
        parts, body = self._arm.parts, problem.target.body
        for goal in self._goals:
            if parts.known.is_out_of_reach(goal @ gripper_to_object):
                continue
            world = parts.problem_world(problem, goal)
            world.shape_hand(held.grasp)
            world.hold(gripper_to_object)
            for let_go in goals_after_slip(body, goal, held.gripper_to_object, gripper_to_object):
                there = let_go @ gripper_to_object
                lowers = world.is_hand_free(Phase.LOWER, there, parts.ends.lift_end(there))
                if lowers and world.is_hand_free(Phase.RETREAT, there, parts.ends.approach_start(there)):
                    yield goal
                    break


def put_down_poses(
    target: PlacedObject,
    at_rest: Sequence[np.ndarray],
    workspace: Workspace,
    base_to_world: np.ndarray,
    boxes: Sequence[StaticBox],
    others: Sequence[PlacedObject],
    release_height_m: float,
    rng: np.random.Generator,
) -> tuple[np.ndarray, ...]:
    """Sample poses of a target on the table, in the workspace in front of an arm's base, in given resting orientations.

    ``at_rest`` are stable poses ``(4, 4)`` anywhere; poses are rotated randomly about the vertical, and sorted by the order
    of ``at_rest``. Each is clear of obstacles and ``release_height_m`` above the table. Empty if no table has its top at z =
    0.
    """
    tables = [box for box in boxes if box.box_to_world[2, 2] > 1 - 1e-9 and abs(_top_m(box)) < TABLE_M]
    if not tables:
        return ()
    table = max(tables, key=lambda box: float(np.prod(box.half_extents_m[:2])))
    standing = [box for box in boxes if box is not table and _top_m(box) > TABLE_M]
    taken = [footprint_at(each.body, each.object_to_world) for each in others] + [_footprint(box) for box in standing]
    points, found = np.concatenate(target.body.hulls), list[tuple[int, np.ndarray]]()
    for number in range(DRAWS):
        place = number % len(at_rest)
        angle_rad = rng.uniform(-workspace.half_angle_rad, workspace.half_angle_rad)
        radius_m, yaw_rad = rng.uniform(workspace.min_radius_m, workspace.max_radius_m), rng.uniform(-np.pi, np.pi)
        at_m = transform_points(base_to_world, radius_m * np.array([[np.cos(angle_rad), np.sin(angle_rad), 0]]))[0]
        cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
        rotation = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]]) @ at_rest[place][:3, :3]
        corners = points @ rotation.T
        offset = np.array([*(rotation @ target.body.center_of_mass_m)[:2], corners[:, 2].min()])
        pose = transform(rotation, np.array([*at_m[:2], release_height_m]) - offset)
        covered = footprint_at(target.body, pose)
        local = transform_points(inverse(table.box_to_world), np.column_stack([covered, np.zeros(len(covered))]))
        on_table = bool((np.abs(local[:, :2]) <= table.half_extents_m[:2]).all())
        if on_table and all(separation_m(covered, each) >= MIN_GAP_M for each in taken):
            found.append((place, pose))
            if len(found) == PLACES:
                break
    return tuple(pose for _, pose in sorted(found, key=lambda each: each[0]))


def _top_m(box: StaticBox) -> float:
    return float(box.box_to_world[2, 3] + np.abs(box.box_to_world[2, :3]) @ box.half_extents_m)


def _footprint(box: StaticBox) -> np.ndarray:
    signs = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    return transform_points(box.box_to_world, signs * box.half_extents_m)[:, :2]
