"""Predicates on states that are set by hand: true where they should be, and what fails first where they are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from manitwin.episodes.goals.evaluation import evaluate, judge
from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.goals.world_state import (
    ROBOT,
    Event,
    Granules,
    Holder,
    Hole,
    ObjectState,
    Peg,
    Tip,
    WorldState,
)
from manitwin.errors import UsageError
from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import transform
from rigid_boxes import block, box

ITEM = box([0.04, 0.04, 0.04], 0.1)
WALLS = tuple(
    block(low, high)
    for low, high in (
        ([-0.06, -0.06, 0.0], [0.06, 0.06, 0.005]),
        ([-0.06, -0.06, 0.0], [-0.055, 0.06, 0.08]),
        ([0.055, -0.06, 0.0], [0.06, 0.06, 0.08]),
        ([-0.06, -0.06, 0.0], [0.06, -0.055, 0.08]),
        ([-0.06, 0.055, 0.0], [0.06, 0.06, 0.08]),
    )
)
VESSEL = replace(box([0.12, 0.12, 0.08], 0.3, center_m=(0, 0, 0.03)), hulls=WALLS)
OPENING = Opening(np.array([0.0, 0, 1]), np.array([0, 0, 0.08]), 0.062, 9e-4, 0.075)


def at(x: float, y: float, z: float, turn: np.ndarray | None = None) -> np.ndarray:
    return transform(turn, np.array([x, y, z]))


def thing(pose: np.ndarray, *, still: bool = True, start: np.ndarray | None = None) -> ObjectState:
    return ObjectState(ITEM, pose, pose if start is None else start, still)


def vessel(pose: np.ndarray) -> ObjectState:
    return ObjectState(VESSEL, pose, pose, True, OPENING)


def pairs(*named: tuple[str, str]) -> frozenset[frozenset[str]]:
    return frozenset(frozenset(pair) for pair in named)


def state(item: ObjectState, *touching: tuple[str, str], other: ObjectState | None = None) -> WorldState:
    second = vessel(at(0.5, 0, 0)) if other is None else other
    return WorldState({"item": item, "vessel": second}, pairs(("vessel", "table"), *touching), frozenset({"table"}))


IN = Literal("in", "item", "vessel")


@pytest.mark.parametrize(
    ("item", "touching", "failure"),
    [
        (thing(at(0.5, 0, 0.025)), [("item", "vessel")], None),
        (thing(at(0.62, 0, 0.02)), [("item", "table")], "beside_it"),
        (thing(at(0.53, 0, 0.1)), [("item", "vessel")], "on_the_rim"),
        (thing(at(0.5, 0, 0.05)), [], "not_touching"),
        (thing(at(0.5, 0, 0.025)), [("item", "vessel"), ("item", "table")], "on_furniture"),
        (thing(at(0.5, 0, 0.025)), [("item", "vessel"), ("item", ROBOT)], "not_released"),
        (thing(at(0.5, 0, 0.025), still=False), [("item", "vessel")], "moving"),
    ],
)
def test_in(item: ObjectState, touching: list[tuple[str, str]], failure: str | None) -> None:
    judged = judge(state(item, *touching), IN)
    assert (judged.failure, judged.holds) == (failure, failure is None)


def test_nothing_is_in_a_vessel_that_lies_or_in_a_thing_without_an_opening() -> None:
    over = at(0.5, 0, 0.08, np.diag([1.0, -1, -1]))
    assert judge(state(thing(at(0.5, 0, 0.03)), ("item", "vessel"), other=vessel(over)), IN).failure == "turned_over"
    solid = state(thing(at(0.5, 0, 0.03)), ("item", "vessel"), other=thing(at(0.5, 0, 0.02)))
    assert judge(solid, IN).failure == "no_opening"


@pytest.mark.parametrize(
    ("position", "touching", "failure"),
    [
        ((0.5, 0, 0.1), [("item", "vessel")], None),
        ((0.5, 0, 0.1), [], "not_touching"),
        ((0.5, 0, 0.1), [("item", "vessel"), ("item", "table")], "held_by_something_else"),
        ((0.5, 0.07, 0.1), [("item", "vessel")], "beside_it"),
        ((0.5, 0, -0.03), [("item", "vessel")], "below_it"),
    ],
)
def test_on(position: tuple[float, ...], touching: list[tuple[str, str]], failure: str | None) -> None:
    assert judge(state(thing(at(*position)), *touching), Literal("on", "item", "vessel")).failure == failure


@pytest.mark.parametrize(
    ("side", "way"), [("left_of", (0, 1)), ("right_of", (0, -1)), ("behind", (1, 0)), ("in_front_of", (-1, 0))]
)
def test_sides_are_those_that_the_robot_sees(side: str, way: tuple[int, int]) -> None:
    def failure(x: float, y: float) -> str | None:
        return judge(state(thing(at(x, y, 0.02)), ("item", "table")), Literal(side, "item", "vessel")).failure

    assert failure(0.5 + 0.12 * way[0], 0.12 * way[1]) is None
    assert failure(0.5 - 0.12 * way[0], -0.12 * way[1]) == "another_side"
    assert failure(0.5 + 0.12 * way[1], 0.12 * way[0]) == "another_side"
    assert failure(0.5 + 0.3 * way[0], 0.3 * way[1]) == "too_far"
    assert failure(0.5 + 0.03 * way[0], 0.03 * way[1]) == "above_it"


def test_away_from_is_a_least_gap_between_footprints() -> None:
    there = state(thing(at(0.5, 0.13, 0.02)), ("item", "table"))  # 13 cm less 6 and 2
    assert judge(there, Literal("away_from", "item", "vessel", 0.049)).holds
    assert judge(there, Literal("away_from", "item", "vessel", 0.051)).failure == "too_near"


def test_near_is_a_gap_between_footprints() -> None:
    there = state(thing(at(0.5, 0.13, 0.02)), ("item", "table"))  # 13 cm less 6 and 2
    assert judge(there, Literal("near", "item", "vessel", 0.051)).holds
    assert judge(there, Literal("near", "item", "vessel", 0.049)).failure == "too_far"


def test_upright_lifted_pushed_and_undisturbed() -> None:
    lying = at(0.3, 0, 0.02, np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]))
    assert judge(state(thing(lying)), Literal("upright", "item")).failure == "tilted"
    raised = thing(at(0.3, 0, 0.12), start=at(0.3, 0, 0.02))
    assert judge(state(raised, ("item", ROBOT)), Literal("lifted", "item", value=0.09)).holds
    assert judge(state(raised, ("item", ROBOT)), Literal("lifted", "item", value=0.11)).failure == "too_low"
    assert judge(state(raised), Literal("lifted", "item", value=0.05)).failure == "not_held"
    assert judge(state(raised), Literal("undisturbed", "item")).failure == "moved"
    marks = {"mark": np.array([0.3, 0, 0])}
    push = Event("pushed", "item", None, {"rise_m": 0.002, "way_m": 0.12})
    there = replace(state(thing(at(0.3, 0.01, 0.02))), places_m=marks, events=(push,))
    literal = Literal("pushed_to", "item", "mark", 0.011)
    assert judge(there, literal).holds
    assert judge(there, Literal("pushed_to", "item", "mark", 0.009)).failure == "beside_it"
    assert judge(replace(there, events=()), literal).failure == "not_touched"
    assert (
        judge(replace(there, events=(replace(push, values={"rise_m": 0.05, "way_m": 0.12}),)), literal).failure
        == "lifted"
    )
    nudged = replace(push, values={"rise_m": 0.002, "way_m": 0.02})
    assert judge(replace(there, events=(nudged,)), literal).failure == "hardly_moved"


@pytest.mark.parametrize(
    ("touching", "still", "rise_m", "fell_m", "failure"),
    [
        ([("item", "table")], True, 0.3, 0.001, None),
        ([("item", "table")], True, 0.3, 0.03, "dropped"),
        ([("item", "table")], True, 0.04, 0.001, "low"),
        ([("item", "table")], True, None, 0.0, "not_taken"),
        ([("item", "taker")], True, 0.3, 0.0, "not_released"),
        ([("item", "table"), ("item", "taker")], True, 0.3, 0.0, "not_released"),
        ([("item", "table"), ("item", "giver")], True, 0.3, 0.0, "not_released"),
        ([("item", "other")], True, 0.3, 0.0, "not_put_down"),
        ([], True, 0.3, 0.0, "not_put_down"),
        ([("item", "table")], False, 0.3, 0.001, "moving"),
    ],
)
def test_handed_over(
    touching: list[tuple[str, str]], still: bool, rise_m: float | None, fell_m: float, failure: str | None
) -> None:
    values = {"rise_m": rise_m, "fell_m": fell_m, "time_s": 5.0}
    events = () if rise_m is None else (Event("handed_over", "item", None, values),)
    put = replace(
        state(thing(at(0.8, 0, 0.02), still=still, start=at(0.3, 0, 0.02)), *touching),
        arms=("giver", "taker"),
        events=events,
    )
    assert judge(put, Literal("handed_over", "item")).failure == failure
    assert judge(replace(put, arms=()), Literal("handed_over", "item")).failure == "one_arm"


def poured(inside: int, spilt: int, left: int) -> WorldState:
    """A source of 100 granules at x = 0.2 and a vessel at 0.5."""
    spots = [at(0.5, 0, 0.03)] * inside + [at(0.9, 0, 0.0)] * spilt + [at(0.2, 0, 0.03)] * left
    source = vessel(at(0.2, 0, 0))
    return WorldState(
        {"item": source, "vessel": vessel(at(0.5, 0, 0))}, pairs(), frozenset(),
        granules=Granules(np.array([spot[:3, 3] for spot in spots]), 0.005), granules_at_start={"item": 100},
    )  # fmt: skip


def test_poured_counts_what_is_in_neither() -> None:
    literal = Literal("poured", "item", "vessel", 0.9)
    assert judge(poured(92, 5, 3), literal).measured == {"share": 0.92, "spilt": 0.05, "left": 0.03, "granules": 100}
    assert judge(poured(92, 5, 3), literal).holds
    assert judge(poured(92, 6, 2), literal).failure == "spilt"
    assert judge(poured(80, 5, 15), literal).failure == "left_in"
    assert judge(replace(poured(100, 0, 0), granules_at_start={}), literal).failure == "nothing_to_pour"


def test_events_are_judged_by_what_was_measured_and_only_of_their_subject() -> None:
    press = Event("pressed", "item", None, {"force_n": 6.0, "off_m": 0.004, "angle_rad": 0.1})
    here = state(thing(at(0.3, 0, 0.02)))
    literal = Literal("pressed", "item", value=5.0)
    assert judge(here, literal).failure == "not_touched"
    assert judge(replace(here, events=(press,)), literal).holds
    assert judge(replace(here, events=(press,)), Literal("pressed", "item", value=7.0)).failure == "weak"
    hard = replace(
        press, values={**press.values, "force_n": 80.0}
    )  # a solver that finds a touch late makes such forces
    assert judge(replace(here, events=(hard,)), Literal("pressed", "item", value=5.0)).failure == "too_hard"
    assert judge(
        replace(here, events=(hard, press)), Literal("pressed", "item", value=5.0)
    ).holds  # fingers grasp harder
    grasped = replace(press, values={"force_n": 24.0, "off_m": 0.004, "angle_rad": 1.4})
    judgement = judge(replace(here, events=(grasped, press)), literal)
    assert judgement.holds, "one touch does it"
    assert judgement.measured["force_n"] == 6.0
    both = (grasped, replace(press, values={**press.values, "off_m": 0.02}))
    assert judge(replace(here, events=both), literal).failure == "askew", "of the hardest"
    assert judge(replace(here, events=(replace(press, subject="vessel"),)), literal).failure == "not_touched"
    off = replace(press, values={**press.values, "off_m": 0.03})
    assert judge(replace(here, events=(off,)), literal).failure == "off"
    blow = Event(
        "struck", "item", "vessel", {"speed_m_s": 0.3, "off_m": 0.001, "face_radius_m": 0.01, "angle_rad": 0.1}
    )
    strike = Literal("struck", "item", "vessel")
    assert judge(replace(here, events=(blow,)), strike).holds
    beside = replace(blow, values={**blow.values, "off_m": 0.02})
    assert judge(replace(here, events=(beside, blow)), strike).failure == "wrong_face"  # the first touch counts


def test_hung() -> None:
    peg = Peg(np.array([0.5, 0, 0.3]), np.array([1.0, 0, 0]), 0.09, 0.004)
    hole = Hole(np.array([0.0, 0, 0.02]), np.array([1.0, 0, 0]), 0.01)

    def hangs(x: float, *touching: tuple[str, str]) -> str | None:
        item = replace(thing(at(x, 0, 0.275)), hole=hole)
        return judge(replace(state(item, *touching), pegs={"peg": peg}), Literal("hung", "item", "peg")).failure

    assert hangs(0.54, ("item", "peg")) is None
    assert hangs(0.60, ("item", "peg")) == "beside_it"
    assert hangs(0.54) == "not_touching"
    assert hangs(0.54, ("item", "peg"), ("item", "table")) == "on_furniture"


def test_inserted() -> None:
    bore = Holder(at(0.5, 0, 0.07), np.array([0.02, 0.02]), 0.06, frozenset({"holder", "wall"}))
    up = np.diag([1.0, -1, -1, 1])  # the item's tip is at its +Z end: down where it is turned over

    def stands(x: float, turn: np.ndarray, *touching: tuple[str, str], z: float = 0.04) -> str | None:
        tip = Tip(np.array([0.0, 0, 0.02]), np.array([0.0, 0, 1]))
        item = replace(thing(at(x, 0, z) @ turn), tip=tip)
        return judge(
            replace(state(item, *touching), holders={"holder": bore}), Literal("inserted", "item", "holder")
        ).failure

    assert stands(0.5, up, ("item", "wall")) is None
    assert stands(0.65, up, ("item", "wall")) == "beside_it"
    assert stands(0.5, np.eye(4), ("item", "wall")) == "wrong_end"
    assert stands(0.5, up) == "not_touching"
    assert stands(0.5, up, ("item", "wall"), z=0.08) == "not_deep"
    assert stands(0.5, up, ("item", "wall"), ("item", "table")) == "held_by_something_else"


def test_a_goal_is_reached_when_all_of_it_holds_and_says_what_does_not() -> None:
    goal = Goal((IN, Literal("upright", "item")), (Literal("undisturbed", "vessel"),))
    inside = thing(at(0.5, 0, 0.025))
    assert evaluate(state(inside, ("item", "vessel")), goal).reached
    moved = replace(vessel(at(0.5, 0, 0)), start_object_to_world=at(0.48, 0, 0))
    evaluation = evaluate(state(inside, ("item", "vessel"), other=moved), goal)
    assert not evaluation.reached
    assert evaluation.failure == "undisturbed(vessel): moved"


def test_names_that_a_scene_does_not_have_are_listed() -> None:
    with pytest.raises(UsageError, match="no object 'mug' in this scene; there are: item, vessel"):
        judge(state(thing(at(0.5, 0, 0))), Literal("upright", "mug"))
    with pytest.raises(UsageError, match="no peg 'peg' in this scene; there are: none"):
        judge(state(thing(at(0.5, 0, 0))), Literal("hung", "item", "peg"))
