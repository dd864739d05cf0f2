"""What turns in the jaws: as it is lifted it is put back and taken by another grasp, as it is carried it is planned for anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from held_skills import around, attempt, goal_of, mallet
from scipy.spatial.transform import Rotation

from manitwin.episodes.execution import Execution
from manitwin.episodes.planning.problem import Grasp, Motion, Phase
from manitwin.geometry.poses import transform
from rigid_boxes import above

BODY, FRAMES, HELD_WELL = mallet()


def ridge(side: int) -> np.ndarray:
    """An edge along Z on the handle's side, 2 mm high: pads touch it along that edge alone."""
    x, y = side * 0.012, 0.03
    return np.array([[x, y + s * 0.002, z] for s in (-1, 1) for z in (0.018, 0.022)] + [[x + side * 0.002, y, 0.02]])


KNOBBED = replace(BODY, hulls=(*BODY.hulls, ridge(1), ridge(-1)), mass_kg=0.4)
ON_THE_KNOBS = Grasp("knobs", above([0, 0.03, 0.02]), 0.028)
FARTHER = tuple(Grasp(f"farther{i}", above([0, -0.01 * i, 0.02]), 0.024) for i in range(3))
"""From the head: where the lever tells, they come later."""
SPOT = around(KNOBBED, FRAMES, 0.5, 0.05)


def closings(recording: object) -> int:
    """How often the hand closes."""
    told = np.asarray(recording.phase)  # type: ignore[attr-defined]
    return int(((told[1:] == Phase.CLOSE) & (told[:-1] != Phase.CLOSE)).sum())


def test_what_turns_as_it_is_lifted_is_taken_by_another_grasp() -> None:
    facts, recording = attempt(SPOT, goal_of("strike", SPOT), (ON_THE_KNOBS, *FARTHER))
    assert facts.replans["another_grasp"] == 1
    assert facts.grasp is not None and facts.grasp.grasp_id != "knobs"
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned, facts.replans)
    assert recording is not None and closings(recording) == 2
    assert facts.grasps_tried == 2 + sum(facts.plan_failures.values())  # the two that were executed failed of nothing


def test_where_no_other_grasp_serves_it_is_lifted_as_it_turns() -> None:
    facts, recording = attempt(SPOT, goal_of("lift", SPOT), (ON_THE_KNOBS,))
    assert facts.replans["another_grasp"] == 1
    assert facts.grasp is not None and facts.grasp.grasp_id == "knobs"
    assert facts.evaluation is not None and facts.evaluation.reached  # though it may hang against the palm
    assert recording is not None and closings(recording) == 2


def test_a_grasp_on_the_knobs_far_from_the_middle_of_a_heavy_thing_is_no_plan() -> None:
    heavy = replace(KNOBBED, mass_kg=1.9)  # at 3 cm: more than a line bears, less than a face
    spot = around(heavy, FRAMES, 0.5, 0.05)
    facts, _ = attempt(spot, goal_of("lift", spot), (ON_THE_KNOBS,))
    assert facts.outcome == "no_plan"
    assert facts.plan_failures == {"weight_not_borne": 1}


@pytest.mark.parametrize(("turned_deg", "carries"), [(0.0, 1), (15.0, 2)])
def test_what_turns_as_it_is_carried_is_carried_anew(
    monkeypatch: pytest.MonkeyPatch, turned_deg: float, carries: int
) -> None:
    measure, follow, done = Execution.gripper_to_object, Execution.follow, list[Phase]()

    def turned(execution: Execution) -> np.ndarray:
        turn = Rotation.from_euler("x", turned_deg if Phase.CARRY in done else 0.0, degrees=True).as_matrix()
        return measure(execution) @ transform(turn)

    def followed(execution: Execution, motion: Motion, *args: object, **kwargs: object) -> bool:
        done.append(motion.phase)
        return follow(execution, motion, *args, **kwargs)  # type: ignore[arg-type]

    monkeypatch.setattr(Execution, "gripper_to_object", turned)
    monkeypatch.setattr(Execution, "follow", followed)
    plain = around(BODY, FRAMES, 0.5, 0.05)
    facts, _ = attempt(plain, goal_of("strike", plain), HELD_WELL)
    assert done.count(Phase.CARRY) == carries
    assert facts.replans["after_carry"] == carries - 1
