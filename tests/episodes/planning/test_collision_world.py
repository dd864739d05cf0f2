"""What is free, by coal with bounding boxes first, against every single distance in MuJoCo."""

from dataclasses import replace

import numpy as np
import pytest
from mujoco_witness import Witness
from planning_problems import TABLE, above, body, box_hull, brick, problem, standing, wall

from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.episodes.planning.collision_world import ProblemWorld
from manitwin.episodes.planning.convex_shapes import ShapeStore
from manitwin.episodes.planning.kinematic_body import floating_hand_of
from manitwin.episodes.planning.problem import Phase, PlannerSettings
from manitwin.geometry.poses import inverse, transform
from manitwin.geometry.rigid_body import PlacedObject, StaticBox, is_plane_equivalent
from manitwin.robots.load import load_robot

SETTINGS = PlannerSettings()


@pytest.fixture(scope="module")
def robot():
    return load_robot("panda")


@pytest.fixture(scope="module")
def arm(robot):
    return ArmKinematics(robot)


def world_of(arm, some, settings=SETTINGS):
    return ProblemWorld(some, some.goal_object_to_world, arm.body, floating_hand_of(arm.body), ShapeStore(), settings)


@pytest.mark.parametrize("margin_m", [0.0, 0.01])
def test_free_states_are_those_that_mujoco_finds_free(robot, arm, margin_m):
    others = tuple(
        PlacedObject(f"other {i}", "ab" * 8, brick(), standing(x, y, yaw))
        for i, (x, y, yaw) in enumerate([(0.4, 0.3, 0.2), (0.6, -0.3, 1.0), (0.35, -0.15, 2.0)])
    )
    some = problem(standing(0.5, 0.1), standing(0.5, -0.1), obstacles=others)
    world, witness, grasp = world_of(arm, some), Witness(robot, some), above(0.08)
    world.hold(grasp)
    world.arm.enter(Phase.CARRY, margin_m)
    rng, agreed = np.random.default_rng(3), {True: 0, False: 0}
    for _ in range(200):
        near_home = np.clip(arm.home + rng.normal(0, 0.8, arm.joints), arm.lower, arm.upper)
        gaps = witness.gaps(near_home, arm.gripper_pose(near_home) @ inverse(grasp))
        least = min(gaps.robot_to_surroundings, gaps.arm_to_target, gaps.target_to_surroundings) - margin_m
        least = min(least, gaps.robot_to_itself)
        if abs(least) > 0.003:  # fingers are planned for as the hulls of their pieces
            assert world.arm.is_free(near_home) == (least > 0), (least, world.arm.touching(near_home))
            agreed[least > 0] += 1
    assert min(agreed.values()) > 20


def test_target_may_leave_what_it_stands_on_and_may_not_be_pushed_into_it(arm):
    some = problem(standing(0.5, 0.1), standing(0.5, -0.1))
    world, grasp = world_of(arm, some), above(0.08)
    for height_m, is_free in ((0.0, True), (0.02, True), (-0.001, True), (-0.005, False)):
        world.hold(grasp)
        assert world.is_hand_free(Phase.LIFT, standing(0.5, 0.1, z_m=height_m) @ grasp) is is_free
    assert not world.is_hand_free(Phase.CARRY, standing(0.5, 0.1) @ grasp)


def test_hand_may_hold_the_target_and_not_run_into_it(arm):
    some = problem(standing(0.5, 0.1), standing(0.5, -0.1))
    world = world_of(arm, some)
    around, aside = standing(0.5, 0.1) @ above(0.08), standing(0.54, 0.1) @ above(0.08)
    assert world.is_hand_free(Phase.APPROACH, around)
    assert not world.is_hand_free(Phase.APPROACH, aside)
    assert world.is_hand_free(Phase.RETREAT, aside)


def test_two_objects_become_one_hull_each_but_a_bowl_around_the_goal_keeps_its_walls(arm):
    walls = [box_hull((0.1, 0.005, 0.02), (0, side * 0.1, 0.02)) for side in (-1, 1)]
    walls += [box_hull((0.005, 0.1, 0.02), (side * 0.1, 0, 0.02)) for side in (-1, 1)]
    bowl = PlacedObject("bowl", "cd" * 8, body(box_hull((0.1, 0.1, 0.002), (0, 0, 0.002)), *walls), standing(0.5, -0.2))
    into = problem(standing(0.5, 0.2), standing(0.5, -0.2, z_m=0.004), obstacles=(bowl,))
    beside = problem(standing(0.5, 0.2), standing(0.3, 0.3), obstacles=(bowl,))
    grasp = above(0.08)
    for some, is_free in ((into, True), (beside, False)):
        world = world_of(arm, some)
        world.hold(grasp)
        lowered = standing(0.5, -0.2, z_m=0.005) @ grasp
        assert world.is_hand_free(Phase.LOWER, lowered) is is_free


def test_what_stands_between_open_and_closed_jaws_is_in_the_way_of_what_they_hold(arm):
    through, beside = (wall(0.5 + off_m, -0.1, (0.001, 0.05, 0.045)) for off_m in (0.03, 0.09))
    grasp = above(0.08)
    for box, is_free in ((through, False), (beside, True)):
        world = world_of(arm, problem(standing(0.5, 0.1), standing(0.5, -0.1), boxes=(TABLE, box)))
        world.hold(grasp)
        there = standing(0.5, -0.1, z_m=0.001) @ grasp
        assert world.is_hand_free(Phase.RETREAT, there)
        assert world.is_hand_free(Phase.LOWER, there) is is_free
        assert world.is_hand_free(Phase.CARRY, standing(0.5, -0.1, z_m=0.1) @ grasp)


def test_what_is_lifted_stays_a_centimetre_from_the_arm(arm):
    """A plate beside the hand reaches up to the wrist, farther and farther away from it."""
    offsets_m = np.arange(0.04, 0.2, 0.002)

    def first_free_m(phase: Phase) -> float:
        for off_m in offsets_m:
            plate = body(box_hull((0.002, 0.03, 0.15), (off_m, 0, 0.15)))
            lying = PlacedObject("object_00", "ef" * 8, plate, standing(0.5, 0.1))
            world = world_of(arm, replace(problem(standing(0.5, 0.1), standing(0.5, -0.1)), target=lying))
            world.hold(above(0.02))
            world.arm.enter(phase, SETTINGS.clearance_m)
            if world.arm.is_free(arm.home):
                return float(off_m)
        raise AssertionError("never free")

    assert first_free_m(Phase.LIFT) - first_free_m(Phase.CARRY) == pytest.approx(0.009, abs=0.0031)


def test_the_plane_that_a_table_stands_for_goes_on_beside_it(arm):
    small = StaticBox("table", np.array([0.35, 0.35, 0.05]), transform(translation=np.array([0.35, 0, -0.05])))
    raised = StaticBox("shelf", np.array([0.35, 0.35, 0.05]), transform(translation=np.array([0.35, 0, 0.05])))
    narrow = StaticBox("board", np.array([0.35, 0.2, 0.05]), transform(translation=np.array([0.35, 0, -0.05])))
    assert [is_plane_equivalent(box) for box in (small, raised, narrow, TABLE)] == [True, False, False, True]
    beside = transform(np.diag([1.0, -1, -1]), np.array([0.45, 0.55, 0.0834]))  # the fingertips 3 cm below the top
    for boxes, is_free in (((small,), False), ((raised,), True), ((narrow,), True)):
        world = world_of(arm, problem(standing(0.5, 0.1), standing(0.5, -0.1), boxes=boxes))
        world.hold(above(0.08))
        assert world.is_hand_free(Phase.REACH, beside) is is_free
