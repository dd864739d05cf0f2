"""Single motions of the Panda, judged by MuJoCo."""

import numpy as np
import pytest
from mujoco_witness import Witness
from planning_problems import TABLE, above, problem, standing, wall

from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.episodes.planning.collision_world import ProblemWorld
from manitwin.episodes.planning.convex_shapes import ShapeStore
from manitwin.episodes.planning.joint_paths import is_segment_free
from manitwin.episodes.planning.kinematic_body import floating_hand_of
from manitwin.episodes.planning.motions import Motions
from manitwin.episodes.planning.problem import Motion, Phase, PlannerSettings
from manitwin.episodes.planning.straight_lines import straight_line
from manitwin.geometry.poses import inverse, rotation_angle_rad, transform
from manitwin.robots.load import load_robot

SETTINGS = PlannerSettings()


@pytest.fixture(scope="module")
def robot():
    return load_robot("panda")


@pytest.fixture(scope="module")
def arm(robot):
    return ArmKinematics(robot)


def world_of(arm, some):
    return ProblemWorld(some, some.goal_object_to_world, arm.body, floating_hand_of(arm.body), ShapeStore(), SETTINGS)


def test_gripper_moves_on_a_straight_line_and_turns_evenly(arm):
    start_pose = transform(np.diag([1.0, -1, -1]), np.array([0.45, -0.1, 0.3]))
    turn = standing(0, 0, 0.4)[:3, :3]
    end_pose = transform(turn @ start_pose[:3, :3], np.array([0.5, 0.05, 0.25]))
    start = arm.inverse(start_pose, arm.home)
    path = straight_line(arm, start, end_pose)
    for place in np.linspace(0, 1, 60):
        pose = arm.gripper_pose(path(place))
        on_line = start_pose[:3, 3] + place * (end_pose[:3, 3] - start_pose[:3, 3])
        assert np.linalg.norm(pose[:3, 3] - on_line) < 5e-4
        assert rotation_angle_rad(pose[:3, :3] @ start_pose[:3, :3].T) == pytest.approx(0.4 * place, abs=2e-3)


def test_line_to_beyond_the_reach_is_none(arm):
    beyond = transform(np.diag([1.0, -1, -1]), np.array([1.1, 0, 0.3]))
    assert straight_line(arm, arm.home, beyond) is None


@pytest.fixture(scope="module")
def over_the_wall(robot, arm):
    """Carry the brick from one side of a wall of 32 cm to the other."""
    some = problem(standing(0.5, 0.25), standing(0.5, -0.25), boxes=(TABLE, wall(0.5, 0, (0.15, 0.01, 0.16))))
    world = world_of(arm, some)
    grasp = above(0.08)
    world.hold(grasp)
    ends = []
    for y_m in (0.25, -0.25):
        pose = standing(0.5, y_m, z_m=0.12) @ grasp
        ends.append(arm.inverse(pose, arm.home if not ends else ends[0] * [-1, 1, 1, 1, 1, 1, 1]))
    return some, world, grasp, ends


def test_carry_over_a_wall_keeps_everything_apart_where_the_straight_way_does_not(robot, arm, over_the_wall):
    some, world, grasp, (start, goal) = over_the_wall
    world.arm.enter(Phase.CARRY)
    assert not is_segment_free(start, goal, world.arm.is_free, 0.02)
    motions = Motions(robot, arm, 1 / 240, SETTINGS)
    motion = motions.plan_free(world.arm, Phase.CARRY, start, goal, np.random.default_rng(0))
    assert isinstance(motion, Motion)
    assert (motion.positions_rad[[0, -1]] == np.array([start, goal])).all()
    witness = Witness(robot, some)
    for position in motion.positions_rad[::5]:
        gaps = witness.gaps(position, arm.gripper_pose(position) @ inverse(grasp))
        assert min(gaps.robot_to_surroundings, gaps.target_to_surroundings, gaps.arm_to_target) > 0.002
        assert gaps.robot_to_itself > 0
    speeds = np.diff(motion.positions_rad, axis=0) * 240
    assert (np.abs(speeds) <= robot.velocity_limits_rad_s * 1.001).all()
    assert (np.abs(np.diff(speeds, axis=0)) * 240 <= robot.acceleration_limits_rad_s2 * 1.03).all()


def test_work_is_counted_so_that_no_way_ends_in_no_path(robot, arm, over_the_wall):
    _, world, _, (start, goal) = over_the_wall
    motions = Motions(robot, arm, 1 / 240, PlannerSettings(iterations=0))
    assert motions.plan_free(world.arm, Phase.CARRY, start, goal, np.random.default_rng(0)) == "no_path"


def test_line_through_the_table_is_refused(robot, arm):
    some = problem(standing(0.5, 0.25), standing(0.5, -0.25))
    world = world_of(arm, some)
    motions = Motions(robot, arm, 1 / 240, SETTINGS)
    start = arm.inverse(transform(np.diag([1.0, -1, -1]), np.array([0.45, 0, 0.25])), arm.home)
    down = arm.gripper_pose(start)
    down[2, 3] = 0.12
    assert motions.plan_line(world.arm, Phase.APPROACH, start, down) is not None
    down[2, 3] = 0.11  # fingertips end 0.1127 m below the frame
    assert motions.plan_line(world.arm, Phase.APPROACH, start, down) is None
