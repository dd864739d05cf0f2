"""The world of an episode: what stands in it, and what its contacts are taken for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from brick_episodes import START, panda, problem, standing

from manitwin.episodes.episode import create_world
from manitwin.episodes.execution import IN_HAND, Execution
from manitwin.episodes.planning.problem import Motion, Phase, PickPlaceProblem
from manitwin.episodes.settings import EpisodeSettings
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject, StaticBox
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.trial import TrialSettings
from rigid_boxes import box

PALM_M, FINGER_END_M = 0.066, 0.1125  # where palm and fingers end, along the approach


def made(asked: PickPlaceProblem) -> RobotWorld:
    return create_world(asked, panda()[0], EpisodeSettings(), 50.0)


def before_the_hand(depth_m: float) -> np.ndarray:
    """A pose on the hand's axis at home, so far along the approach; X is the closing direction."""
    return panda()[1].tip_pose(panda()[0].home_rad) @ transform(None, np.array([0, 0, depth_m]))


@pytest.fixture
def world() -> Iterator[RobotWorld]:
    others = (standing("object_02", [0.05, 0.05, 0.1], 0.6, 0.2), standing("object_00", [0.04, 0.04, 0.04], 0.6, -0.3))
    with made(problem(obstacles=others)) as world:
        yield world


def test_objects_are_in_the_order_of_their_names_where_they_were_put(world: RobotWorld) -> None:
    assert [placed.name for placed in world.placed] == ["object_00", "object_01", "object_02"]
    assert world.target == 1
    for number, placed in enumerate(world.placed):
        assert world.object_to_world(number) == pytest.approx(placed.object_to_world, abs=1e-6)


@pytest.mark.parametrize(("extents_m", "factor"), [([0.012, 0.2, 0.02], 2), ([0.04, 0.06, 0.1], 1)])
def test_what_is_slender_is_held_with_more_rounds_of_the_solver(extents_m: list[float], factor: int) -> None:
    settings, target = EpisodeSettings(), replace(problem().target, body=box(extents_m, 0.04))
    other = standing("object_00", [0.05, 0.05, 0.1], 0.6, 0.2)
    with made(replace(problem(), target=target, obstacles=(other,))) as world:
        articulation = world.robot.articulation
        assert articulation.get_solver_position_iterations() == settings.solver_iterations
        world.expect_load(True)
        assert articulation.get_solver_position_iterations() == factor * settings.solver_iterations_held
        world.set_held_objects({other.name})
        world.expect_load(True)
        assert articulation.get_solver_position_iterations() == settings.solver_iterations_held
        world.set_held_objects({other.name, target.name})
        world.set_target(0)
        world.expect_load(True)
        assert articulation.get_solver_position_iterations() == factor * settings.solver_iterations_held, (
            "whichever is taken"
        )
        world.expect_load(False)
        assert articulation.get_solver_position_iterations() == settings.solver_iterations


def test_what_stands_comes_to_rest_borne_by_the_table_and_touched_by_nobody(world: RobotWorld) -> None:
    assert world.settle(0.5).at_rest.all()
    touches = world.contacts.touches(world.contacts.read())
    assert touches.on_support
    assert touches.finger_forces_n == (0.0, 0.0)
    assert world.contacts.unplanned(world.contacts.read(), in_hand=False) == set()


def test_what_stands_on_a_tray_on_the_table_is_borne_by_it() -> None:
    tray = StaticBox("tray", np.array([0.15, 0.15, 0.01]), transform(None, np.array([START[0, 3], START[1, 3], 0.01])))
    on_tray = problem(start=transform(None, START[:3, 3] + [0, 0, 0.02]))
    with made(replace(on_tray, static_boxes=(*on_tray.static_boxes, tray))) as world:
        assert world.settle(0.5).at_rest.all()
        assert world.contacts.touches(world.contacts.read()).on_support
        assert world.object_to_world(0)[2, 3] == pytest.approx(START[2, 3] + 0.02, abs=3e-4)


@pytest.mark.parametrize("light_kg", [0.1, 0.02, 0.005])
def test_what_is_heavy_does_not_sink_into_what_is_light_below_it(light_kg: float) -> None:
    """With 10 iterations of the solver 2 kg went through a box of 20 g to the table within half a second."""
    below = standing("object_00", [0.08, 0.08, 0.04], 0.6, 0.2)
    below = replace(below, body=box([0.08, 0.08, 0.04], light_kg))
    start = below.object_to_world @ transform(None, np.array([0, 0, 0.02 + 0.03 + 0.001]))
    with made(problem(start=start, target=box([0.06, 0.06, 0.06], 2.0), obstacles=(below,))) as world:
        for _ in range(8):
            world.step(30)
            gap_m = world.pose_of("object_01")[2, 3] - world.pose_of("object_00")[2, 3] - 0.05
            assert abs(gap_m) < 3e-4


def test_what_falls_is_not_still_and_falls_as_it_should() -> None:
    steps = 24
    with made(problem(start=transform(None, START[:3, 3] + [0, 0, 0.4]))) as world:
        assert not world.settle(steps / 120).at_rest.any()
        assert not world.contacts.touches(world.contacts.read()).on_support
        fallen_m = START[2, 3] + 0.4 - world.object_to_world(0)[2, 3]
    assert fallen_m == pytest.approx(9.81 / 120**2 * steps * (steps + 1) / 2, rel=1e-3)  # semi-implicit Euler


def test_world_with_used_shapes_is_that_with_fresh_ones() -> None:
    asked = problem(start=transform(None, START[:3, 3] + [0, 0, 0.02]))
    ends = []
    for _ in range(3):
        with made(asked) as world:
            world.step(100)
            ends.append(world.object_to_world(0))
    assert np.array_equal(ends[0], ends[1])
    assert np.array_equal(ends[0], ends[2])


def hits(asked: PickPlaceProblem, number: int, phase: Phase) -> set[tuple[str, str]]:
    """The unplanned contacts of an object that flies up into the hand at home at 1 m/s."""
    found: set[tuple[str, str]] = set()
    with made(asked) as world:
        world.bodies[number].set_linear_velocity(np.array([0, 0, 1.0], np.float32))
        for _ in range(8):
            world.step()
            found.update(world.contacts.unplanned(world.contacts.read(), in_hand=phase in IN_HAND))
    return found


@pytest.mark.parametrize(("phase", "unplanned"), [(Phase.REACH, True), (Phase.LIFT, False), (Phase.RETREAT, True)])
def test_palm_may_touch_the_target_only_while_it_has_it_in_hand(phase: Phase, unplanned: bool) -> None:
    between_the_fingers = before_the_hand(PALM_M + 0.075 + 0.005)
    found = hits(problem(start=between_the_fingers, target=box([0.04, 0.04, 0.15], 0.3)), 0, phase)
    assert found == ({("panda_hand", "object_01")} if unplanned else set())


@pytest.mark.parametrize("phase", list(Phase))
def test_robot_may_never_touch_another_object(phase: Phase) -> None:
    below_the_fingers = before_the_hand(FINGER_END_M + 0.01 + 0.003)
    bar = PlacedObject("object_00", "bar", box([0.2, 0.02, 0.02], 0.3), below_the_fingers)
    assert hits(problem(obstacles=(bar,)), 0, phase) == {
        ("panda_leftfinger", "object_00"), ("panda_rightfinger", "object_00"),
    }  # fmt: skip


def test_fingers_press_on_the_target_with_equal_forces_that_are_their_drives(world: RobotWorld) -> None:
    in_the_fingers = before_the_hand(panda()[0].gripper.tip_depth_m)
    with made(problem(start=in_the_fingers, target=box([0.04, 0.06, 0.06], 0.1))) as world:
        opening_m = 0.04
        world.expect_load(True)
        world.robot.set_opening_target(opening_m - 2 * 20.0 / 1e4)  # 20 N at the drives' stiffness of 1e4 N/m
        world.step(120)
        touches = world.contacts.touches(world.contacts.read())
    assert touches.finger_forces_n == pytest.approx((20, 20), rel=0.08)
    assert not touches.on_support


@pytest.mark.parametrize("phase", [Phase.REACH, Phase.CARRY, Phase.LOWER])
def test_touch_of_one_step_between_two_rows_is_not_missed(
    world: RobotWorld, monkeypatch: pytest.MonkeyPatch, phase: Phase
) -> None:
    robot, planner = panda()
    execution = Execution(world, robot, TrialSettings(50.0, 1.0, timestep_s=1 / 120), planner.tip_pose)
    pair = ("panda_link7", "board")
    monkeypatch.setattr(world.contacts, "unplanned", lambda *_, **__: {pair} if execution.steps == 10 else set())
    execution.wait(phase, 3)
    assert execution.unplanned == {pair}
    assert execution.recording().unplanned_contact.tolist() == [False, False, True, False]


def turning(world: RobotWorld, samples: int) -> tuple[Execution, Motion]:
    """An execution, and a motion of the arm's base of so many samples."""
    robot, planner = panda()
    execution = Execution(world, robot, TrialSettings(50.0, 1.0, timestep_s=1 / 120), planner.tip_pose)
    positions_rad = np.repeat(np.array(robot.home_rad, float)[None], samples, axis=0)
    positions_rad[:, 0] += 1e-3 * np.arange(samples)
    return execution, Motion(Phase.REACH, positions_rad, np.zeros_like(positions_rad))


def test_a_guarded_motion_ends_with_the_row_in_which_something_is_felt(world: RobotWorld) -> None:
    execution, motion = turning(world, 60)
    asked = list[int]()

    def felt() -> bool:
        asked.append(execution.steps)
        return execution.steps == 8

    assert not execution.follow(motion, felt)
    assert asked == [*range(1, 9)], "what is felt for a moment is felt"
    assert (execution.steps, execution.recording().steps) == (12, 2)
    assert execution.commanded_rad == pytest.approx(motion.positions_rad[11], abs=1e-6)


def test_a_slower_pace_takes_a_row_for_every_sample(world: RobotWorld) -> None:
    execution, motion = turning(world, 12)
    assert execution.follow(motion, pace=lambda first: 1.0 if first < 6 else 0.0)
    told_rad = execution.recording().action_joint_positions_rad[:, 0]
    assert told_rad[:7] == pytest.approx(motion.positions_rad[5:, 0], abs=1e-6)


@pytest.mark.parametrize("sample", [20, 23])
def test_a_delayed_motion_has_its_sample_at_the_end_of_a_row(world: RobotWorld, sample: int) -> None:
    execution, motion = turning(world, 60)
    delayed = execution.delayed(motion, sample)
    assert len(delayed.positions_rad) == len(delayed.velocities_rad_s) < 66
    assert np.array_equal(delayed.positions_rad[5::6][3], motion.positions_rad[sample])
