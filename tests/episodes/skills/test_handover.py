"""Handing over: the second arm takes the bar and puts it down; where it goes 15 cm beside, or does not close, it has nothing."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import pytest
from brick_episodes import TABLE, digest, panda
from held_skills import around, goal_of
from synthetic_episodes import attempt as made_up_attempt

from manitwin.episodes.courses.handover import GIVER, HandoverCourse
from manitwin.episodes.episode import run_episode
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.execution import Execution
from manitwin.episodes.hdf5_file import EpisodeFile, write_episodes
from manitwin.episodes.lerobot.frame_features import features_of, frames_of
from manitwin.episodes.planning.problem import Grasp, Phase, PickPlaceProblem
from manitwin.episodes.planning.two_arms import TakePlan, TwoArmPlanner
from manitwin.episodes.recording import Recording, tip_delta
from manitwin.episodes.settings import EpisodeSettings, TrajectoriesConfig
from manitwin.episodes.skills.registry import load_skill
from manitwin.episodes.skills.robot_compatibility import check_hand, check_jaws
from manitwin.episodes.stored_episode import RecordedObject, StoredEpisode, recorded_robot
from manitwin.errors import EpisodesError, UsageError
from manitwin.geometry.poses import transform
from manitwin.robots.load import load_robot
from rigid_boxes import above, box

BAR = box([0.03, 0.24, 0.03], 0.2, center_m=(0, 0, 0))
SIDEWAYS = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])  # the hand comes along X and closes along Z
TURNED = np.array([[0.0, 0, 1], [0, -1, 0], [1, 0, 0]])
GRASPS = tuple(
    Grasp(f"{name}{number}", above([0, y_m, 0], rotation), 0.03)
    for name, rotation in (
        ("above", np.diag([1.0, -1, -1])),
        ("from_x", TURNED),
        ("from_-x", TURNED @ np.diag([-1.0, 1, -1])),
    )
    for number, y_m in enumerate((-0.09, -0.06, 0.0, 0.06, 0.09))
)
"""Across the bar, by three of its sides."""
SURROUNDINGS = around(BAR, (), 0.45, -0.1)
BAR_AT = transform(None, np.array([0.45, -0.1, 0.015]))


@cache
def two_pandas() -> TwoArmPlanner:
    return TwoArmPlanner(load_robot("two_pandas"))


def problem(grasps: tuple[Grasp, ...] = GRASPS) -> PickPlaceProblem:
    placed = replace(SURROUNDINGS.objects[0], object_to_world=BAR_AT)
    return PickPlaceProblem(placed, BAR_AT, grasps, (), (TABLE,), seed=3)


def attempt(planner: TwoArmPlanner | None = None) -> tuple[EpisodeFacts, Recording | None]:
    goal = goal_of("handover", SURROUNDINGS)
    return run_episode(problem(), planner or two_pandas(), load_robot("two_pandas"), EpisodeSettings(), goal)


@cache
def kept() -> tuple[EpisodeFacts, Recording]:
    facts, recording = attempt()
    assert recording is not None
    return facts, recording


def test_the_second_arm_takes_the_bar_holds_it_alone_and_puts_it_down() -> None:
    facts, recording = kept()
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned, facts.plan_failures)
    assert facts.grasp is not None
    assert facts.taker_grasp is not None
    giver_n, taker_n = recording.finger_forces_n[:, :2], recording.finger_forces_n[:, 2:]
    lifted = np.flatnonzero(recording.phase == Phase.LIFT)
    assert giver_n[lifted + 1].min() > 0, "the first arm picks it"
    assert taker_n[lifted + 1].max() == 0
    assert (np.minimum(giver_n.min(1), taker_n.min(1)) > 0).any(), "for a while both hold it"
    lowered = np.flatnonzero(recording.phase == Phase.LOWER)
    assert taker_n[lowered].min() > 10, "the second one puts it down"
    assert giver_n[lowered].max() == 0
    held = slice(lifted[0], lowered[-1])
    assert (recording.finger_forces_n.max(1) > 0)[held].all(), "it is never let fall"
    assert recording.object_positions_m[lowered[0], 0, 2] > recording.object_positions_m[0, 0, 2] + 0.05


def test_the_bar_ends_on_the_table_before_the_second_arm_let_go_by_both() -> None:
    facts, recording = kept()
    assert recording.finger_forces_n[-1].max() == 0
    assert recording.target_on_support[-1]
    end = recording.object_positions_m[-1, 0]
    assert end[2] == pytest.approx(BAR_AT[2, 3], abs=1e-3)
    from_taker_m = np.linalg.norm(end[:2] - [1.2, 0])
    workspace = load_robot("panda").workspace
    assert workspace.min_radius_m - 0.02 < from_taker_m < workspace.max_radius_m + 0.02
    event = next(each for each in facts.events if each.kind == "handed_over")
    assert event.values["rise_m"] > 0.2
    assert event.values["fell_m"] < 0.005


def test_both_hands_hold_it_by_grasps_that_were_given_and_6_cm_apart() -> None:
    facts, _ = kept()
    assert facts.grasp in GRASPS
    assert facts.taker_grasp in GRASPS
    tip_m = np.array([0, 0, load_robot("panda").gripper.tip_depth_m, 1])
    tips = [(grasp.gripper_to_object @ tip_m)[:3] for grasp in (facts.grasp, facts.taker_grasp)]
    assert np.linalg.norm(tips[0] - tips[1]) >= 0.06 - 1e-9


@pytest.mark.slow
def test_the_same_seed_gives_the_same_episode() -> None:
    again = attempt(TwoArmPlanner(load_robot("two_pandas")))[1]
    assert again is not None
    assert digest(again) == digest(kept()[1])


class Beside(TwoArmPlanner):
    """Plans the second arm for where the bar is not: 15 cm to the side, once the first one has brought it."""

    def plan_take(self, problem, object_to_world, giver_rad, opening_m, giver_to_object, put_down, first=()):
        ways = [0.15 * np.array([x, y, 0.0]) for x, y in ((0, 1), (0, -1), (1, 0))] if first else [np.zeros(3)]
        plans = (
            super(Beside, self).plan_take(
                problem, transform(None, way) @ object_to_world, giver_rad, opening_m, giver_to_object, put_down, first
            )
            for way in ways
        )
        return next((plan for plan in plans if plan is not None), None)


def test_a_second_arm_15_cm_beside_takes_nothing() -> None:
    facts, recording = attempt(Beside(load_robot("two_pandas")))
    assert facts.outcome == "dropped"
    assert facts.events == (), "nobody took it"
    assert recording is not None
    assert recording.object_positions_m[-1, 0, 2] < 0.1, "it fell"


class Once(TwoArmPlanner):
    """Finds no way to the bar where the first arm has brought it."""

    asked = 0

    def plan_take(self, problem, object_to_world, giver_rad, opening_m, giver_to_object, put_down, first=()):
        self.asked += bool(first)
        if self.asked == 1 and first:
            return None
        return super().plan_take(problem, object_to_world, giver_rad, opening_m, giver_to_object, put_down, first)


def test_where_the_second_arm_does_not_come_to_they_meet_elsewhere() -> None:
    facts, recording = attempt(Once(load_robot("two_pandas")))
    assert facts.replans["take_failed"] == 1
    assert facts.replans["elsewhere"] == 1
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned, facts.replans)
    assert recording is not None
    acts = (recording.phase[1:] == Phase.ACT) & (recording.phase[:-1] != Phase.ACT)
    assert acts.sum() == 2


class Never(TwoArmPlanner):
    """Finds no way to the bar once it is in the first hand."""

    def plan_take(self, problem, object_to_world, giver_rad, opening_m, giver_to_object, put_down, first=()):
        if first:
            return None
        return super().plan_take(problem, object_to_world, giver_rad, opening_m, giver_to_object, put_down, first)


def test_what_cannot_be_taken_anywhere_is_not_handed_over() -> None:
    facts, _ = attempt(Never(load_robot("two_pandas")))
    assert facts.outcome == "replan_failed"
    assert not facts.replans["elsewhere"]


def test_a_second_arm_that_does_not_close_takes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    close = Execution.close_hand
    monkeypatch.setattr(Execution, "close_hand", lambda self: close(self) if self.selected_arm == GIVER else None)
    facts, recording = attempt()
    assert facts.outcome == "dropped"
    assert facts.events == ()
    assert recording is not None
    assert recording.finger_forces_n[-1].max() == 0


def test_a_first_arm_that_does_not_let_go_has_not_handed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    def stay(course: HandoverCourse, _: TakePlan, execution: Execution) -> None:
        course._giver_rad = execution.commanded_rad

    monkeypatch.setattr(HandoverCourse, "_release_and_withdraw", stay)
    monkeypatch.setattr(HandoverCourse, "_set_down", lambda *_: None)
    facts, _ = attempt()
    assert facts.outcome == "goal_missed"
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure == "not_taken"


def test_a_second_arm_that_keeps_the_bar_has_not_handed_it_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(HandoverCourse, "_set_down", lambda *_: None)
    facts, _ = attempt()
    assert facts.outcome == "goal_missed"
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure == "not_released"


def test_a_second_arm_that_lets_the_bar_fall_has_not_put_it_down(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(HandoverCourse, "_set_down", lambda _, __, execution: execution.open_hand())
    facts, _ = attempt()
    assert facts.outcome == "goal_missed"
    assert facts.evaluation is not None
    assert facts.evaluation.literals[0].failure == "dropped"


def test_grasps_at_one_place_leave_no_room_for_a_second_hand() -> None:
    goal = goal_of("handover", SURROUNDINGS)
    near = tuple(grasp for grasp in GRASPS if grasp.grasp_id.endswith("2"))
    robot = load_robot("two_pandas")
    facts, recording = run_episode(problem(near), two_pandas(), robot, EpisodeSettings(), goal)
    assert facts.outcome == "no_plan"
    assert recording is None


def stored() -> StoredEpisode:
    robot, recording = recorded_robot(load_robot("two_pandas")), kept()[1]
    return StoredEpisode(
        made_up_attempt(0, robot_name=robot.name), recording, robot, (RecordedObject("object_00", "bar"),)
    )


def test_both_arms_are_stored_and_come_back(tmp_path: Path) -> None:
    given = stored()
    path = tmp_path / "episodes.h5"
    write_episodes(path, [given])
    with EpisodeFile(path) as file:
        found = file[0]
    assert found.robot == given.robot
    for name, array in vars(given.recording).items():
        if isinstance(array, np.ndarray):
            np.testing.assert_allclose(getattr(found.recording, name), array, atol=1e-6, err_msg=name)
    with h5py.File(path) as file:
        group = file["traj_0"]
        joints = given.recording.joint_positions_rad
        taker = group["env_states/articulations/taker"][:]
        assert sorted(group["env_states/articulations"]) == ["giver", "taker"]
        np.testing.assert_allclose(taker[0, :7], [1.2, 0, 0, 0, 0, 0, 1], atol=1e-6)
        np.testing.assert_array_equal(taker[:, 13:20], joints[:, 7:])
        assert group["actions"].shape[1] == 16
        assert group["obs/extra/tcp_pose"].shape[1] == 14


def test_an_arm_of_other_joints_than_its_robot_is_refused(tmp_path: Path) -> None:
    given = stored()
    giver, taker = given.robot.arms
    wrong = replace(given, robot=replace(given.robot, arms=(giver, replace(taker, joints=6))))
    write_episodes(tmp_path / "episodes.h5", [wrong])
    with EpisodeFile(tmp_path / "episodes.h5") as file, pytest.raises(EpisodesError, match="arms have other joints"):
        file[0]


def test_frames_name_what_is_of_which_arm() -> None:
    given = stored()
    features, frames = {each.name: each for each in features_of(given.robot)}, frames_of(given, 0, 0, 0, 20)
    for name in ("observation.state", "observation.tip_pose", "action", "action.tip_delta"):
        assert frames[name].shape[1] == features[name].width, name
    names = features["observation.state"].names
    assert names is not None
    assert names[0].startswith("giver_")
    assert names[-1] == "taker_gripper_opening_m"
    told = features["observation.tip_pose"].names
    assert told is not None
    assert told[7] == "taker_x_m"
    taker_x_m = frames["observation.tip_pose"][0, 7]
    assert taker_x_m == pytest.approx(1.2 - panda()[1].tip_pose(load_robot("panda").home_rad)[0, 3], abs=1e-3)


def test_the_difference_of_the_taker_s_tip_leads_to_what_it_is_told() -> None:
    recording = kept()[1]
    delta = tip_delta(recording)
    assert delta.shape[1] == 14
    np.testing.assert_allclose(
        recording.tip_position_m[:-1, 3:] + delta[:, 6:9], recording.action_tip_position_m[:, 3:], atol=1e-6
    )


def test_a_handover_wants_two_arms_which_also_do_what_one_does() -> None:
    two, one = load_robot("two_pandas"), load_robot("panda")
    check_hand(two, load_skill("handover"))
    with pytest.raises(UsageError, match="needs two arms, but panda has one; give one of two_pandas"):
        check_hand(one, load_skill("handover"))
    for name in ("place_in", "pick_place", "pour"):
        check_hand(two, load_skill(name))
    with pytest.raises(UsageError, match="grasps that are carried over need one arm"):
        check_jaws(two, "grasps that are carried over")


def test_two_arms_are_chosen_where_none_are_named() -> None:
    assert TrajectoriesConfig(skill="handover").robot == "two_pandas"
    assert TrajectoriesConfig(skill="handover", robot="mine.toml").robot == "mine.toml"
    assert TrajectoriesConfig(skill="place_in").robot == "panda"
