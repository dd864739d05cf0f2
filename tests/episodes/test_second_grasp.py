"""What a first grasp leaves behind, or turns too far, is taken by another one, once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from brick_episodes import GRASPS, panda, problem, run
from scipy.spatial.transform import Rotation

from manitwin.episodes.courses.course import EpisodeStart, GraspFailed
from manitwin.episodes.courses.pick_place import PickPlaceCourse
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.planning.problem import Grasp, Motion, Phase
from manitwin.episodes.settings import EpisodeSettings
from manitwin.geometry.poses import transform
from manitwin.physics.sapien.contacts import NONE_MEANT, AllowedContacts
from rigid_boxes import above

IN_THE_AIR = tuple(Grasp(f"air{i}", above([0, 0.005 * i, 0.066]), 0.04) for i in range(3))
"""They close above the brick."""


def phases(recording: object, phase: Phase) -> int:
    """How often a phase begins."""
    told = np.asarray(recording.phase)  # type: ignore[attr-defined]
    return int(((told[1:] == phase) & (told[:-1] != phase)).sum())


def test_what_is_left_behind_is_taken_by_another_grasp() -> None:
    asked = problem()
    facts, recording = run(replace(asked, grasps=(IN_THE_AIR[0], *GRASPS)))
    assert facts.outcome == "kept", (facts.plan_failures, facts.replans, facts.unplanned)
    assert facts.grasp is not None and facts.grasp.grasp_id == "g0"
    assert facts.replans["another_grasp"] == 1
    assert recording is not None
    assert (phases(recording, Phase.CLOSE), phases(recording, Phase.LIFT)) == (2, 2)


def test_a_grasp_is_not_tried_twice_and_there_is_no_third() -> None:
    alone, _ = run(replace(problem(), grasps=IN_THE_AIR[:1]))
    assert alone.outcome == "not_lifted" and not alone.replans["another_grasp"]
    facts, recording = run(replace(problem(), grasps=(*IN_THE_AIR, *GRASPS)))
    assert facts.outcome == "not_lifted"
    assert facts.grasp is not None and facts.grasp.grasp_id == "air1"
    assert recording is not None and phases(recording, Phase.CLOSE) == 2


class Held:
    """An execution whose target has turned in the hand by an angle about the approach."""

    def __init__(self, gripper_to_object: np.ndarray, turned_rad: float):
        self.done: list[str] = []
        self.meant = AllowedContacts(target=frozenset())
        self.commanded_rad = np.zeros(7)
        self._measured = gripper_to_object @ transform(Rotation.from_euler("x", turned_rad).as_matrix())

    def gripper_to_object(self) -> np.ndarray:
        return self._measured

    def follow(self, motion: Motion) -> bool:
        self.done.append(motion.phase.name)
        return True

    def open_hand(self) -> None:
        self.done.append("OPEN")


@pytest.mark.parametrize(("turned_deg", "tried_before"), [(25.0, 0), (3.0, 0), (25.0, 1)])
def test_what_has_turned_far_is_set_down_where_it_was_once(turned_deg: float, tried_before: int) -> None:
    asked = problem()
    planner, grasp = panda()[1], GRASPS[0]
    facts = EpisodeFacts()
    facts.replans["another_grasp"] = tried_before
    course = PickPlaceCourse(EpisodeStart(asked, (asked.target,), planner, EpisodeSettings(), None), facts)
    plan = planner.plan(asked).plan
    assert plan is not None
    execution = Held(plan.gripper_to_object, np.radians(turned_deg))
    execution.commanded_rad = plan.lift.positions_rad[-1]
    if turned_deg < 10 or tried_before:
        course.put_back_if_turned(plan, execution)  # type: ignore[arg-type]
        assert execution.done == []
        return
    with pytest.raises(GraspFailed, match="replan_failed"):
        course.put_back_if_turned(plan, execution)  # type: ignore[arg-type]
    assert execution.done == ["CARRY", "LOWER", "OPEN", "RETREAT"]
    assert execution.meant == NONE_MEANT  # it may touch the table again
    assert grasp.grasp_id == plan.grasp.grasp_id
