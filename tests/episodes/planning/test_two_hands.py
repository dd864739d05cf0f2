"""Two hands around one bar: which grasps leave room for both, and how one puts down what has turned in it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from brick_episodes import TABLE
from scipy.spatial.transform import Rotation

from manitwin.episodes.grasp_stability import LEAST_APART_M
from manitwin.episodes.planning import placement_choice
from manitwin.episodes.planning.grasp_pairs import TwoHands
from manitwin.episodes.planning.placement import Placement
from manitwin.episodes.planning.placement_choice import HeldGrasp, PlacementChoice
from manitwin.episodes.planning.problem import Grasp, PickPlaceProblem
from manitwin.episodes.planning.two_arms import TwoArmPlanner
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.robots.load import load_robot
from rigid_boxes import above, box

DOWN = np.diag([1.0, -1, -1])
FROM_BELOW = np.eye(3)
BAR = box([0.03, 0.3, 0.03], 0.2, center_m=(0, 0, 0))


def across(name: str, y_m: float, rotation: np.ndarray = DOWN) -> Grasp:
    return Grasp(name, above([0, y_m, 0], rotation), 0.03)


GIVER = across("giver", 0.0)
FAR, NEAR, NEARER = across("far", 0.12), across("near", 0.05), across("nearer", 0.03)
OPPOSITE, OPPOSITE_NEARER = across("opposite", 0.05, FROM_BELOW), across("opposite nearer", 0.03, FROM_BELOW)
GRASPS = (OPPOSITE_NEARER, OPPOSITE, NEARER, NEAR, FAR, GIVER)


@cache
def arms() -> TwoArmPlanner:
    return TwoArmPlanner(load_robot("two_pandas"))


def problem(body: object = BAR, height_m: float = 0.015) -> PickPlaceProblem:
    at = transform(None, np.array([0.45, -0.1, height_m]))
    return PickPlaceProblem(PlacedObject("bar", "bar", body, at), at, GRASPS, (), (TABLE,), seed=3)  # type: ignore[arg-type]


@cache
def hands() -> TwoHands:
    return arms()._hands


def test_a_hand_finds_room_beside_another_or_against_it_but_not_in_its_place() -> None:
    found = hands().taker_grasps(problem(), GIVER.gripper_to_object)
    names = list(dict.fromkeys(held.grasp.grasp_id for held in found))
    assert names == ["opposite", "far"], "5 cm beside it two hands from one side overlap, from two sides they do not"
    assert LEAST_APART_M == 0.04
    assert len(hands().apart_grasps((FAR,), GIVER.gripper_to_object)) == 2
    assert hands().apart_grasps((NEARER,), GIVER.gripper_to_object) == []


def test_givers_beside_which_nothing_is_far_enough_are_left_out() -> None:
    alone = replace(problem(), grasps=(GIVER, NEARER))
    assert hands().giver_grasps(alone) == ()
    assert (
        hands().giver_grasps(replace(problem(), grasps=(GIVER, NEARER, FAR)))[0] is GIVER
    )  # its middle is that of the bar


def test_neither_hand_holds_by_a_corner_and_what_is_too_heavy_for_one_hand_is_not_handed_over() -> None:
    corner = replace(FAR, grasp_id="corner", gripper_to_object=above([0, 0.146, 0.02], DOWN))
    asked = replace(problem(), grasps=(GIVER, FAR, corner))
    assert {each.grasp_id for each in hands().giver_grasps(asked)} == {"giver", "far"}
    assert {held.grasp.grasp_id for held in hands().taker_grasps(asked, GIVER.gripper_to_object)} == {"far"}
    heavy = box([0.03, 0.3, 0.03], 1.0, center_m=(0, 0, 0))  # its end weighs 1.2 Nm about the jaws
    assert hands().giver_grasps(replace(problem(heavy), grasps=(GIVER, FAR))) == ()


def placed(measured: np.ndarray) -> tuple[np.ndarray, Placement] | None:
    """Put the bar down, as it has come to be in the hand, whose open fingers are 7 mm above the table then."""
    asked = problem()
    taker = arms().taker
    goal = transform(None, np.array([0.75, 0.1, 0.016]))
    held = HeldGrasp(GIVER, GIVER.gripper_to_object)
    found = PlacementChoice(taker, arms().with_giver_at(asked, arms().arm.home), [goal])
    return found.plan(arms().with_giver_at(asked, arms().arm.home), held, taker.arm.home, measured)


def test_what_has_turned_in_the_hand_is_put_down_as_there_is_room(monkeypatch: pytest.MonkeyPatch) -> None:
    turned = GIVER.gripper_to_object @ transform(None, np.array([0, 0, 0.1034]))
    turned = turned @ transform(Rotation.from_euler("y", 12, degrees=True).as_matrix())
    turned = turned @ transform(None, np.array([0, 0, -0.1034]))
    assert placed(GIVER.gripper_to_object) is not None
    assert placed(turned) is not None
    monkeypatch.setattr(placement_choice, "goals_after_slip", lambda _, goal, *__: [goal])
    assert placed(turned) is None


def test_as_a_last_resort_all_places_with_room_are_planned_for(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, taker = problem(), arms().taker
    goals = [transform(None, np.array([0.75, y_m, 0.016])) for y_m in np.linspace(-0.15, 0.15, 7)]
    held = HeldGrasp(GIVER, GIVER.gripper_to_object)
    at = PlacementChoice(taker, arms().with_giver_at(asked, arms().arm.home), goals)
    plan_place, tried = taker.plan_place, list[np.ndarray]()

    def only_the_last(*given: object) -> Placement | None:
        tried.append(given[4])  # type: ignore[arg-type]
        return plan_place(*given) if given[4] is goals[-1] else None  # type: ignore[arg-type]

    monkeypatch.setattr(taker, "plan_place", only_the_last)
    where = arms().with_giver_at(asked, arms().arm.home), held, taker.arm.home, held.gripper_to_object
    assert at.plan(*where) is None
    assert len(tried) == placement_choice.MOST_PLANNED
    found = at.plan(*where, placement_choice.PLACES)
    assert found is not None
    assert found[0] is goals[-1]
