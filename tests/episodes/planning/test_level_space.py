"""Carrying something level: what is tilted is not free, and free motions stay level where there is a way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planning_problems import TABLE, above, body, box_hull, brick, problem, standing, wall
from scipy.spatial.transform import Rotation

from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.episodes.planning.collision_world import ProblemWorld
from manitwin.episodes.planning.convex_shapes import ShapeStore
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.held_path import HeldPathPlanner, HeldPlan
from manitwin.episodes.planning.kinematic_body import floating_hand_of
from manitwin.episodes.planning.level_space import LEVEL_RAD, LevelSpace, must_stay_level
from manitwin.episodes.planning.motions import Motions
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Motion, Phase, PlannerSettings
from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import inverse, transform
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.robots.load import load_robot

SETTINGS = PlannerSettings()
MOST_RAD = np.radians(20)


@pytest.fixture(scope="module")
def carried():
    """A brick that is carried over a wall of 32 cm, from one side of the arm to the other: arm, world, level space, ends."""
    robot = load_robot("panda")
    arm, grasp = ArmKinematics(robot), above(0.08)
    some = problem(standing(0.45, 0.35), standing(0.45, -0.35), boxes=(TABLE, wall(0.5, 0, (0.15, 0.01, 0.16))))
    world = ProblemWorld(some, some.goal_object_to_world, arm.body, floating_hand_of(arm.body), ShapeStore(), SETTINGS)
    world.hold(grasp)
    space = LevelSpace(world.arm, arm.gripper_pose, some.target.object_to_world[:3, :3] @ grasp[:3, :3], MOST_RAD)
    ends = [arm.inverse(standing(0.45, y, z_m=0.12) @ grasp, arm.home) for y in (0.35, -0.35)]
    return Motions(robot, arm, 1 / 120, SETTINGS), arm, world.arm, space, ends, grasp


def tilts_rad(arm: ArmKinematics, positions: np.ndarray, grasp: np.ndarray) -> np.ndarray:
    """How far the brick's +Z is from the vertical."""
    return np.array([np.arccos(np.clip((arm.gripper_pose(q) @ inverse(grasp))[2, 2], -1, 1)) for q in positions])


def test_what_is_tilted_too_far_is_not_level_whatever_its_heading(carried) -> None:
    _, arm, world, space, (start, _), grasp = carried
    space.enter(Phase.CARRY, 0.0)
    assert space.is_free(start)
    for joint, turned_rad, level in ((6, -0.5, True), (5, MOST_RAD - 0.05, True), (5, MOST_RAD + 0.05, False)):
        turned = start.copy()
        turned[joint] += turned_rad  # the last joint turns about the vertical, the one before tilts
        assert tilts_rad(arm, turned[None], grasp)[0] == pytest.approx(turned_rad if joint == 5 else 0.0, abs=0.02)
        assert space.is_level(turned) == level
        world.enter(Phase.CARRY, 0.0)
        assert world.is_free(turned)
        assert space.is_free(turned) == level


def test_a_motion_through_it_stays_level_where_another_one_does_not(carried) -> None:
    motions, arm, world, space, (start, goal), grasp = carried
    tilted = 0
    for seed in range(6):
        free = motions.plan_free(world, Phase.CARRY, start, goal, np.random.default_rng(seed))
        level = motions.plan_free(space, Phase.CARRY, start, goal, np.random.default_rng(seed))
        assert isinstance(free, Motion)
        assert isinstance(level, Motion), level
        tilted += tilts_rad(arm, free.positions_rad, grasp).max() > MOST_RAD
        assert tilts_rad(arm, level.positions_rad, grasp).max() <= MOST_RAD + np.radians(1)
    assert tilted


def test_what_is_to_be_carried_level_is_where_another_way_would_tilt_it() -> None:
    planner = PickPlacePlanner(load_robot("panda"))
    boxes = (TABLE, wall(0.5, 0, (0.15, 0.01, 0.16)))
    asked = problem(standing(0.45, 0.35), standing(0.45, -0.35), boxes=boxes, seed=7)

    def most_rad(level: frozenset[str], goal: np.ndarray = asked.goal_object_to_world) -> float:
        plan = planner.plan(replace(asked, level=level, goal_object_to_world=goal)).plan
        assert plan is not None
        return float(tilts_rad(planner.arm, plan.carry.positions_rad, plan.gripper_to_object).max())

    assert most_rad(frozenset()) > np.radians(30)
    assert most_rad(frozenset({asked.target.name})) <= LEVEL_RAD
    assert most_rad(frozenset({"another"})) > np.radians(30)


def test_what_is_used_is_tilted_little_more_on_its_way_there_than_where_it_is_used_and_on_its_way_back() -> None:
    planner = PickPlacePlanner(load_robot("panda"))
    boxes = (TABLE, wall(0.5, 0, (0.15, 0.01, 0.16)))
    asked = problem(standing(0.45, 0.35), standing(0.45, -0.35), boxes=boxes, seed=7)
    path = HeldPath(np.array([standing(0.45, -0.35, z_m=height_m) for height_m in (0.15, 0.12)]))

    def plan(level: frozenset[str]) -> HeldPlan:
        found, _ = HeldPathPlanner(planner.parts).plan(
            replace(asked, level=level), [path], as_hulls=False, longest_s=6.0
        )
        assert found is not None
        return found

    def most_rad(there: HeldPlan, motion: Motion) -> float:
        return float(tilts_rad(planner.arm, motion.positions_rad, there.gripper_to_object).max())

    freely, level = plan(frozenset()), plan(frozenset({asked.target.name}))
    assert most_rad(freely, freely.carry) > np.radians(40)
    assert most_rad(level, level.carry) <= LEVEL_RAD
    used_rad = 0.8  # tilted so far it is brought back
    hand = standing(0.45, -0.35, z_m=0.25) @ transform(Rotation.from_euler("y", used_rad).as_matrix())
    used = planner.arm.inverse(hand @ level.gripper_to_object, level.carry.positions_rad[-1])
    assert used is not None
    goal = asked.target.object_to_world
    back = planner.plan_place(
        replace(asked, level=frozenset({asked.target.name}), goal_object_to_world=goal),
        level, used, level.gripper_to_object, goal, True,
    )  # fmt: skip
    assert back is not None
    assert back[0] is not None
    assert most_rad(level, back[0]) <= used_rad + np.radians(6)


def test_what_is_carried_level_stands_tall_or_opens_upward() -> None:
    bowl = Opening(np.array([0.0, 0, 1]), np.array([0.0, 0, 0.05]), 0.06, 4e-4, 0.04)
    flat = body(box_hull((0.08, 0.08, 0.025), (0, 0, 0.025)))
    over = transform(np.diag([1.0, -1, -1]), np.array([0, 0, 0.05]))
    stands, turned = PlacedObject("bowl", "t", flat, standing(0.4, 0.1, 0.7)), PlacedObject("bowl", "t", flat, over)
    assert must_stay_level(stands, bowl)
    assert not must_stay_level(turned, bowl)
    assert not must_stay_level(stands, None)
    lying = transform(np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]), np.array([0.4, 0, 0.02]))
    assert must_stay_level(PlacedObject("brick", "t", brick(), standing(0.4, 0.1)), None)
    assert not must_stay_level(PlacedObject("brick", "t", brick(), lying), None)
