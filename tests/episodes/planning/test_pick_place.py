"""Whole plans: what moves where, what is refused and why, the same for the same seed."""

from itertools import pairwise

import numpy as np
import pytest
from mujoco_witness import Witness
from planning_problems import (
    TABLE,
    TIP_DEPTH_M,
    above,
    body,
    box_hull,
    brick,
    grasps_from_above,
    problem,
    standing,
    wall,
)

from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Grasp, PlannerSettings
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.robots.load import load_robot

MOTIONS = ("reach", "approach", "lift", "carry", "lower", "retreat")


@pytest.fixture(scope="module")
def planners():
    return {name: PickPlacePlanner(load_robot(name)) for name in ("panda", "ur5_panda")}


@pytest.fixture(scope="module")
def planner(planners):
    return planners["panda"]


@pytest.fixture(scope="module")
def among_others():
    others = [(0.4, 0.3, 0.2), (0.62, -0.3, 1.0), (0.35, -0.15, 2.0), (0.65, 0.1, 0.5), (0.4, 0.05, 0.1)]
    obstacles = tuple(PlacedObject(f"other {i}", "ab" * 8, brick(), standing(*pose)) for i, pose in enumerate(others))
    return problem(standing(0.5, 0.2, 0.3), standing(0.5, -0.2, 1.2), obstacles=obstacles)


@pytest.mark.parametrize("name", ["panda", "ur5_panda"])
def test_motions_join_and_keep_everything_apart_but_what_is_meant_to_touch(planners, among_others, name):
    planner = planners[name]
    plan = planner.plan(among_others).plan
    motions = [getattr(plan, motion) for motion in MOTIONS]
    assert (motions[0].positions_rad[0] == planner.robot.home_rad).all()
    for before, after in pairwise(motions):
        assert after.positions_rad[0] == pytest.approx(before.positions_rad[-1], abs=1e-9)
    witness = Witness(planner.robot, among_others)
    for name_of_motion, motion in zip(MOTIONS, motions, strict=True):
        assert not motion.velocities_rad_s[[0, -1]].any()
        held = name_of_motion in ("lift", "carry", "lower")
        stands_at = among_others.target.object_to_world
        if name_of_motion == "retreat":
            stands_at = among_others.goal_object_to_world
        for position in motion.positions_rad[:: len(motion.positions_rad) // 12]:
            hand = planner.tip_pose(position)
            gaps = witness.gaps(position, hand @ inverse(plan.gripper_to_object) if held else stands_at)
            assert gaps.robot_to_surroundings > 0.0015
            assert gaps.arm_to_target > 0.0015
            assert gaps.robot_to_target > -0.001
            assert gaps.target_to_surroundings > -0.0005


def test_target_is_lifted_straight_up_and_put_down_where_it_should(planner, among_others):
    plan = planner.plan(among_others).plan
    in_hand = inverse(plan.gripper_to_object)
    start, goal = among_others.target.object_to_world, among_others.goal_object_to_world
    for position in plan.lift.positions_rad:
        pose = planner.tip_pose(position) @ in_hand
        assert pose[:2, 3] == pytest.approx(start[:2, 3], abs=5e-4)
        assert pose[:3, :3] == pytest.approx(start[:3, :3], abs=3e-3)
    lifted = planner.tip_pose(plan.lift.positions_rad[-1]) @ in_hand
    assert lifted[2, 3] - start[2, 3] == pytest.approx(planner.settings.lift_m, abs=5e-4)
    assert planner.tip_pose(plan.lower.positions_rad[-1]) @ in_hand == pytest.approx(goal, abs=5e-4)
    back = planner.tip_pose(plan.retreat.positions_rad[-1])
    along = inverse(planner.tip_pose(plan.retreat.positions_rad[0])) @ back
    assert along[:3, 3] == pytest.approx([0, 0, -planner.settings.approach_m], abs=5e-4)


def test_same_seed_gives_the_same_bytes_whatever_was_planned_before(among_others):
    first = PickPlacePlanner(load_robot("panda"))
    one = first.plan(among_others).plan
    second = PickPlacePlanner(load_robot("panda"))
    second.plan(problem(standing(0.4, 0.3), standing(0.6, 0.1), seed=7))
    other = second.plan(among_others).plan
    for motion in MOTIONS:
        assert getattr(one, motion).positions_rad.tobytes() == getattr(other, motion).positions_rad.tobytes()
        assert getattr(one, motion).velocities_rad_s.tobytes() == getattr(other, motion).velocities_rad_s.tobytes()


def test_plan_goes_over_a_wall_and_none_goes_through(planner):
    start, goal = standing(0.5, 0.25), standing(0.5, -0.25)
    low = problem(start, goal, boxes=(TABLE, wall(0.5, 0, (0.15, 0.01, 0.16))))
    plan = planner.plan(low).plan
    witness = Witness(planner.robot, low)
    for position in plan.carry.positions_rad[::8]:
        gaps = witness.gaps(position, planner.tip_pose(position) @ inverse(plan.gripper_to_object))
        assert min(gaps.robot_to_surroundings, gaps.target_to_surroundings) > 0.002
    high = problem(start, goal, boxes=(TABLE, wall(0.5, 0, (1.5, 0.01, 2.0))), grasps=grasps_from_above(0.08))
    report = planner.plan(high)
    assert report.plan is None and report.tried == 1 and sum(report.failures.values()) == 1


@pytest.mark.parametrize(
    ("start", "goal", "reason"),
    [
        (standing(1.4, 0.0), standing(0.5, -0.2), "outside_workspace"),
        (standing(0.5, 0.2), standing(0.0, -1.4), "place_unreachable"),
    ],
)
def test_what_cannot_be_reached_is_said(planner, start, goal, reason):
    report = planner.plan(problem(start, goal))
    assert report.plan is None and report.tried == 3
    assert report.failures == {reason: 3}


def test_grasp_from_below_and_goal_in_a_pit_are_said(planner):
    below = Grasp("below", transform(np.eye(3), np.array([0, 0, -0.05])), 0.04)
    report = planner.plan(problem(standing(0.5, 0.2), standing(0.5, -0.2), grasps=(below,)))
    assert report.failures == {"approach_blocked": 1}
    pit = tuple(
        wall(0.5 + dx, -0.2 + dy, (0.03, 0.03, 0.1)) for dx, dy in ((0.07, 0), (-0.07, 0), (0, 0.07), (0, -0.07))
    )
    report = planner.plan(problem(standing(0.5, 0.2), standing(0.5, -0.2), boxes=(TABLE, *pit)))
    assert report.failures == {"lower_blocked": 3}


def test_first_grasp_that_can_be_is_taken_and_the_turn_is_told(planner):
    bad = Grasp("inside the table", above(-0.02), 0.04)
    good = Grasp("good", above(0.08), 0.04)
    report = planner.plan(problem(standing(0.5, 0.2), standing(0.5, -0.2), grasps=(bad, good)))
    assert report.plan.grasp.grasp_id == "good" and report.tried == 2
    assert report.failures == {"approach_blocked": 1}
    turned = inverse(good.gripper_to_object) @ report.plan.gripper_to_object
    assert np.abs(turned) == pytest.approx(np.eye(4), abs=1e-9) and turned[2, 2] == pytest.approx(1)


def test_grasp_of_a_thin_thing_that_leaves_no_room_for_the_table_is_blocked(planner):
    card = body(box_hull((0.01, 0.06, 0.004), (0, 0, 0.004)))
    flat = (Grasp("at mid-height", above(0.004), 0.02),)
    report = planner.plan(problem(standing(0.5, 0.2), standing(0.5, -0.2), grasps=flat, target=card))
    assert report.plan is None and report.failures == {"approach_blocked": 1}


def test_costly_grasps_are_capped(among_others):
    capped = PickPlacePlanner(load_robot("panda"), settings=PlannerSettings(max_grasps=2, iterations=0))
    high = wall(0.5, 0, (0.2, 0.01, 0.6))
    report = capped.plan(problem(standing(0.5, 0.25), standing(0.5, -0.25), boxes=(TABLE, high)))
    assert report.plan is None and report.failures == {"no_path": 2}


def slipped(plan) -> np.ndarray:
    """The object turned by 8 degrees about the closing axis, and 6 mm aside."""
    c, s = np.cos(0.14), np.sin(0.14)
    return plan.gripper_to_object @ transform(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), np.array([0, 0.006, 0.003]))


@pytest.mark.parametrize("name", ["panda", "ur5_panda"])
def test_placement_planned_anew_puts_a_slipped_object_where_it_should(planners, among_others, name):
    planner = planners[name]
    plan = planner.plan(among_others).plan
    measured, goal = slipped(plan), among_others.goal_object_to_world
    lifted, above_goal = plan.lift.positions_rad[-1], plan.carry.positions_rad[-1]
    carry, lower, retreat = planner.plan_place(among_others, plan, lifted, measured, goal, True)
    assert carry.positions_rad[0] == pytest.approx(lifted)
    assert lower.positions_rad[0] == pytest.approx(carry.positions_rad[-1])
    placed = planner.tip_pose(lower.positions_rad[-1]) @ inverse(measured)
    assert placed == pytest.approx(goal, abs=5e-4)
    nothing, lower, retreat = planner.plan_place(among_others, plan, above_goal, measured, goal, False)
    assert nothing is None
    assert lower.positions_rad[0] == pytest.approx(above_goal)
    assert planner.tip_pose(lower.positions_rad[-1]) @ inverse(measured) == pytest.approx(goal, abs=5e-4)
    assert retreat.positions_rad[0] == pytest.approx(lower.positions_rad[-1])


def test_object_that_turned_in_the_hand_is_let_go_with_some_tilt_where_the_hand_has_no_room(planner):
    goal, turn_rad = standing(0.5, -0.2), 0.5
    c, s = np.cos(turn_rad), np.sin(turn_rad)
    turn = transform(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]))
    at_tips = transform(translation=np.array([0, 0, TIP_DEPTH_M]))
    measured = above(0.08) @ at_tips @ turn @ inverse(at_tips)
    palm_leans_to = -np.sign((goal @ measured)[1, 2])
    beside = wall(0.5, -0.2 + 0.13 * palm_leans_to, (0.1, 0.005, 0.14))
    some = problem(standing(0.5, 0.25), goal, boxes=(TABLE, beside))
    plan = planner.plan(some).plan
    lower = planner.plan_place(some, plan, plan.carry.positions_rad[-1], measured, some.goal_object_to_world, False)[1]
    placed = planner.tip_pose(lower.positions_rad[-1]) @ inverse(measured)
    assert np.arccos(placed[2, 2]) == pytest.approx(turn_rad / 2, abs=0.01)
    assert transform_points(placed, brick().hulls[0])[:, 2].min() == pytest.approx(0.001, abs=5e-4)
    gaps = Witness(planner.robot, some).gaps(lower.positions_rad[-1], placed)
    assert min(gaps.robot_to_surroundings, gaps.target_to_surroundings) > 0


def test_placement_into_another_object_is_refused(planner, among_others):
    plan = planner.plan(among_others).plan
    taken = among_others.obstacles[1].object_to_world
    above_goal = plan.carry.positions_rad[-1]
    assert planner.plan_place(among_others, plan, above_goal, plan.gripper_to_object, taken, False) is None


def test_reachable_share_counts_grasps_and_not_turns(planner):
    bad = Grasp("inside the table", above(-0.02), 0.04)
    some = problem(standing(0.5, 0.2), standing(0.5, -0.2), grasps=(bad, *grasps_from_above(0.08, 0.075, 0.07)))
    assert planner.reachable_share(some) == 0.75
    assert planner.reachable_share(problem(standing(1.5, 0.2), standing(0.5, -0.2))) == 0.0
