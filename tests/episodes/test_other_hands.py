"""Episodes of a suction cup and of a hand with joints: what they hold, what they let go of, and what cannot be faked."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from brick_episodes import BRICK_M, brick, digest, problem

from manitwin.episodes.episode import EpisodeFacts, run_episode
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Grasp, Phase
from manitwin.episodes.recording import Recording
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.registry import load_skill
from manitwin.episodes.skills.robot_compatibility import check_hand, check_jaws
from manitwin.errors import UsageError
from manitwin.geometry.poses import transform
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.load import load_robot
from manitwin.robots.robot import Robot

FROM_ABOVE = np.diag([1.0, -1.0, -1.0])
G = 9.81


@cache
def planned(name: str) -> tuple[Robot, PickPlacePlanner]:
    """A robot and its planner, made once."""
    robot = load_robot(name)
    return robot, PickPlacePlanner(robot)


def cup_grasp(off_m: tuple[float, float, float] = (0, 0, 0)) -> Grasp:
    """The lip on the middle of the brick's top, or so far from there."""
    return Grasp("cup", transform(FROM_ABOVE, np.array([0, 0, BRICK_M[2] / 2 + 0.12]) + off_m), 0.0)


def hand_grasp(off_m: tuple[float, float, float] = (0, 0, 0), closed_m: float = 0.02) -> Grasp:
    """Thumb and fingers around the brick's 40 mm, from above."""
    hand = load_robot("xarm7_allegro").gripper
    assert isinstance(hand, MultiFingerGripper)
    joints = hand.postures[0].joints_at(np.array([BRICK_M[0] + 2 * hand.clearance_m, closed_m]))
    return Grasp("hand", transform(FROM_ABOVE, np.array([0, 0, 0.02 + 0.075]) + off_m), BRICK_M[0], joints)


def run(
    name: str, grasp: Grasp, *, mass_kg: float = 0.3, force_n: float | None = None
) -> tuple[EpisodeFacts, Recording | None]:
    robot, planner = planned(name)
    asked = replace(problem(target=brick(mass_kg)), grasps=(grasp,))
    return run_episode(asked, planner, robot, EpisodeSettings(closing_force_n=force_n))


@pytest.fixture(scope="module")
def carried_by_cup() -> tuple[EpisodeFacts, Recording]:
    facts, recording = run("ur5_suction", cup_grasp())
    assert recording is not None
    return facts, recording


def test_a_cup_carries_a_brick_and_lets_it_go_where_it_should(carried_by_cup: tuple[EpisodeFacts, Recording]) -> None:
    facts, recording = carried_by_cup
    assert facts.outcome == "kept" and facts.unplanned == ()
    assert facts.errors is not None and facts.errors.position_error_m < 0.002
    told = recording.action_hand[:, 0]
    assert set(told) == {0.0, 1.0} and not told[recording.phase <= Phase.APPROACH].any()
    assert not told[recording.phase >= Phase.RETREAT].any()


def test_the_lip_presses_with_the_vacuum_less_the_weight_while_the_brick_hangs_from_it(
    carried_by_cup: tuple[EpisodeFacts, Recording],
) -> None:
    _, recording = carried_by_cup
    hanging = np.flatnonzero(recording.phase == Phase.CARRY) + 1
    vacuum_n = load_robot("ur5_suction").gripper.force_n
    assert recording.finger_forces_n[hanging].mean() == pytest.approx(vacuum_n - 0.3 * G, abs=0.15)
    assert (
        recording.finger_forces_n[:-1][recording.phase <= Phase.APPROACH].max()
        == 0
        == recording.finger_forces_n[-1].max()
    )
    assert np.ptp(recording.hand[hanging]) < 5e-4  # the plunger is blocked


@pytest.mark.parametrize(
    ("grasp", "mass_kg", "force_n"),
    [
        (cup_grasp(), 0.3, 1e-3),  # no vacuum
        (cup_grasp(), 0.3, 0.8 * 0.3 * G),  # less than the weight
        (cup_grasp(), 4.5, None),  # more than 42 N
        (cup_grasp((0.03, 0, 0)), 0.3, None),  # half of the lip is beside it
        (cup_grasp((0, 0, 0.03)), 0.3, None),  # 3 cm short of it: nothing touches
    ],
)
def test_a_cup_lifts_nothing_that_it_does_not_hold(grasp: Grasp, mass_kg: float, force_n: float | None) -> None:
    facts, recording = run("ur5_suction", grasp, mass_kg=mass_kg, force_n=force_n)
    assert facts.outcome == "not_lifted"
    assert recording is not None
    assert recording.object_positions_m[:, 0, 2].max() < BRICK_M[2] / 2 + 0.012


def test_a_cup_lets_go_on_the_way_where_its_lip_must_bear_too_much() -> None:
    """The brick hangs 10 mm beside its middle, so that at rest the lip bears (2 M / r + T) / V: 0.54 and 1.08 of its limit."""
    facts, _ = run("ur5_suction", cup_grasp((0, 0.010, 0)), mass_kg=1.0)
    assert facts.outcome == "kept"
    facts, _ = run("ur5_suction", cup_grasp((0, 0.010, 0)), mass_kg=1.0, force_n=21.2)
    assert facts.outcome in ("not_lifted", "dropped")


def test_a_hand_with_joints_takes_its_shape_before_it_reaches_and_closes_as_its_grasp_says() -> None:
    grasp = hand_grasp()
    facts, recording = run("xarm7_allegro", grasp)
    assert facts.outcome == "kept" and facts.unplanned == ()
    assert facts.errors is not None and facts.errors.position_error_m < 0.01
    assert recording is not None and grasp.joints_rad is not None
    approaching = recording.phase == Phase.APPROACH
    assert recording.action_hand[approaching] == pytest.approx(
        np.tile(grasp.joints_rad[0], (approaching.sum(), 1)), abs=1e-6
    )
    carried = np.flatnonzero(recording.phase == Phase.CARRY) + 1
    assert recording.finger_forces_n[carried].min() > 1.0  # thumb and fingers press on both sides
    assert recording.hand.shape[1] == recording.action_hand.shape[1] == 16
    assert recording.action_hand[-1] == pytest.approx(grasp.joints_rad[0], abs=1e-6)
    opens = int(np.flatnonzero(recording.phase == Phase.OPEN)[0])
    assert recording.action_hand[opens] == pytest.approx(recording.hand[opens], abs=1e-6), "all stop pressing at once"
    _, again = run("xarm7_allegro", grasp)
    assert again is not None and digest(again) == digest(recording)


@pytest.mark.parametrize("off", [{"off_m": (0, 0, 0.08)}, {"closed_m": 0.06}], ids=["above", "open"])
def test_a_hand_that_closes_above_the_brick_or_not_at_all_lifts_nothing(off: dict[str, Any]) -> None:
    facts, _ = run("xarm7_allegro", hand_grasp(**off))
    assert facts.outcome == "not_lifted"


def test_what_wants_jaws_is_refused_in_one_line() -> None:
    robot = load_robot("ur5_suction")
    for name in ("pour", "push"):
        with pytest.raises(UsageError, match=rf"^skill {name} needs .*give one of panda, .* pick_place, place_on"):
            check_hand(robot, load_skill(name))
    check_hand(robot, load_skill("place_in"))
    check_hand(robot, None)
    check_hand(load_robot("panda"), load_skill("pour"))
    with pytest.raises(
        UsageError, match=r"^grasps that are carried over need a two-jaw gripper, but xarm7_allegro has allegro"
    ):
        check_jaws(load_robot("xarm7_allegro"), "grasps that are carried over")
