"""Skills that set an object down: they reach their goals in physics, and what is put 15 cm beside does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from granular_things import deep_pot
from placing_skills import AREA, GRASPS, LYING, POOL, around, attempt, goal_of, placed, pool_with_lying_can

from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.registry import PICK_PLACE, SKILLS, load_skill, skill_names
from manitwin.episodes.skills.skill import LazyPoses
from manitwin.episodes.skills.within_rim import LET_GO_M
from manitwin.errors import UsageError
from manitwin.geometry.poses import transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose
from rigid_boxes import above, box
from twin_folders import twin_id

DICE = (GRASPS["dice"],)
CASES = {
    "place_in": ("mixing bowl", "beside_it"),
    "place_on": ("box", "not_touching"),
    "left_of": ("box", "another_side"),
    "near": ("box", "too_far"),
}


@pytest.mark.parametrize("skill", CASES)
def test_a_goal_is_reached_and_15_cm_beside_it_is_not(skill: str) -> None:
    surroundings = around(placed(0, "dice", 0.45, -0.2), placed(1, CASES[skill][0], 0.5, 0.1))
    goal = goal_of(skill, surroundings)
    assert goal is not None
    facts = attempt(surroundings, goal, DICE)
    assert facts.outcome == "kept", (facts, facts.evaluation)
    away_m = 0.2 if goal.poses[0][1, 3] > surroundings.objects[1].object_to_world[1, 3] else -0.2
    missed = attempt(surroundings, goal, DICE, off_m=(0.0, -0.3, 0.0) if skill == "left_of" else (0.0, away_m, 0.01))
    assert missed.outcome in ("goal_missed", "no_plan")
    assert missed.outcome == "goal_missed"
    assert missed.evaluation is not None and not missed.evaluation.reached


def test_a_can_that_lies_is_stood_up() -> None:
    pool = pool_with_lying_can()
    can = placed(0, "can", 0.5, 0.1, LYING, 0.035)
    surroundings = around(can, pool=pool)
    goal = goal_of("upright", surroundings)
    assert goal is not None
    # from the side that is up while the can lies, closing across its axis
    grasp = above([0, 0.0, 0.065], LYING)
    turned = grasp @ np.diag([-1.0, -1, 1, 1])
    facts = attempt(surroundings, goal, (Grasp("g0", grasp, 0.07), Grasp("g1", turned, 0.07)))
    assert facts.outcome == "kept", (facts, facts.evaluation)


@pytest.mark.parametrize("skill", ["left_of", "right_of", "behind", "in_front_of", "near"])
def test_what_is_true_already_is_no_goal(skill: str) -> None:
    way = {"left_of": (0, 1), "right_of": (0, -1), "behind": (1, 0), "in_front_of": (-1, 0), "near": (0, 1)}[skill]
    beside = placed(0, "dice", 0.5 + 0.13 * way[0], 0.1 * way[1])
    assert goal_of(skill, around(beside, placed(1, "box", 0.5, 0.0))) is None


def test_what_is_near_another_thing_is_set_down_away_from_it_and_where_it_was_is_too_near() -> None:
    surroundings = around(placed(0, "dice", 0.5, 0.05), placed(1, "box", 0.5, -0.1), placed(2, "can", 0.5, 0.3))
    goal = goal_of("away_from", surroundings)
    assert goal is not None
    facts = attempt(surroundings, goal, DICE)
    assert facts.outcome == "kept", (facts, facts.evaluation)
    assert facts.evaluation is not None and facts.evaluation.literals[0].measured["gap_m"] >= 0.15
    put_back = replace(goal, poses=(surroundings.objects[0].object_to_world,))
    missed = attempt(surroundings, put_back, DICE)
    assert missed.outcome == "goal_missed" and missed.evaluation is not None
    assert missed.evaluation.literals[0].failure == "too_near"


def test_what_is_far_from_another_thing_is_not_asked_to_go_away_from_it() -> None:
    assert goal_of("away_from", around(placed(0, "dice", 0.45, -0.3), placed(1, "box", 0.5, 0.2))) is None
    board, dice = (next(twin for twin in POOL.twins if twin.category == name) for name in ("board", "dice"))
    assert SKILLS["away_from"].suits(POOL, dice, board) and not SKILLS["away_from"].suits(POOL, dice, None)


@pytest.mark.parametrize("seed", range(4))
def test_sides_are_free_and_in_reach(seed: int) -> None:
    surroundings = around(
        placed(0, "dice", 0.45, -0.3),
        placed(1, "box", 0.5, 0.0),
        placed(2, "can", 0.5, 0.14),
        placed(3, "tea box", 0.62, 0.0),
    )
    for skill in ("left_of", "behind", "near"):
        goal = goal_of(skill, surroundings, seed)
        if goal is None:
            continue
        for pose in goal.poses:
            corners = transform_points(pose, np.concatenate(surroundings.objects[0].body.hulls))
            assert corners[:, 2].min() == pytest.approx(0.0, abs=1e-9)
            for other in surroundings.objects[1:]:
                there = transform_points(other.object_to_world, np.concatenate(other.body.hulls))
                assert np.linalg.norm(corners[:, None, :2] - there[None, :, :2], axis=2).min() > 0.02
            assert AREA.is_reachable(pose[:2, 3], corners[:, :2])


def test_only_what_fits_goes_into_a_vessel() -> None:
    bowl, box, dice, board = (
        next(t for t in POOL.twins if t.category == c) for c in ("mixing bowl", "box", "dice", "board")
    )
    assert SKILLS["place_in"].suits(POOL, dice, bowl)
    assert not SKILLS["place_in"].suits(POOL, board, bowl)
    assert not SKILLS["place_in"].suits(POOL, dice, box)
    assert not SKILLS["stack"].suits(POOL, dice, box)
    assert SKILLS["place_on"].suits(POOL, dice, board)
    assert not SKILLS["place_on"].suits(POOL, dice, bowl)  # a vessel has only a rim


def standing_box(extents_m: list[float], *poses: StandingPose) -> tuple[PlacedObject, Pool]:
    """A box that stands on the table, its frame's origin below it, and the things with it."""
    half_m = extents_m[2] / 2
    body = box(extents_m, 0.1, center_m=(0, 0, half_m))
    body = replace(body, hulls=tuple(hull + np.array([0, 0, half_m]) for hull in body.hulls))
    twin = PoolTwin(twin_id(91), "0", "carton", poses, False, ())
    bodies = {each.twin_id: POOL.body(each.twin_id).body for each in POOL.twins} | {twin.twin_id: body}
    standing = PlacedObject("object_00", twin.twin_id, body, transform(None, np.array([0.45, -0.2, 0])))
    return standing, Pool([*POOL.twins, twin], bodies.__getitem__)


@pytest.mark.parametrize("seed", range(3))
def test_what_stands_is_put_on_another_thing_standing_though_it_would_rather_lie(seed: int) -> None:
    lying = StandingPose(1, transform(LYING, np.array([0, 0.05, 0.025])), 0.9, 0.06)
    carton, pool = standing_box([0.04, 0.05, 0.1], StandingPose(0, np.eye(4), 0.1, 0.04, True), lying)
    goal = goal_of("place_on", around(carton, placed(1, "box", 0.5, 0.1), pool=pool), seed)
    assert goal is not None
    assert goal.poses[0][2, 2] > 0.99
    assert any(abs(pose[2, 2]) < 0.01 for pose in goal.poses)


def test_what_stands_on_another_thing_only_where_it_is_put_exactly_is_not_put_there() -> None:
    rod, pool = standing_box([0.012, 0.012, 0.2], StandingPose(0, np.eye(4), 1.0, 0.01, True))
    assert goal_of("place_on", around(rod, placed(1, "box", 0.5, 0.1), pool=pool)) is None


def test_into_a_deep_vessel_things_are_also_let_go_at_its_rim() -> None:
    body, _ = deep_pot(0.16, 0.06)
    pot = PoolTwin(twin_id(90), "0", "pot", (StandingPose(0, np.eye(4), 1.0, 0.07, True),), True, ())
    bodies = {twin.twin_id: POOL.body(twin.twin_id).body for twin in POOL.twins} | {pot.twin_id: body}
    pool = Pool([*POOL.twins, pot], bodies.__getitem__)
    standing = PlacedObject("object_01", pot.twin_id, body, transform(None, np.array([0.5, 0.1, 0])))
    surroundings = around(placed(0, "dice", 0.45, -0.2), standing, pool=pool)
    goal = goal_of("place_in", surroundings)
    assert goal is not None
    dice = np.concatenate(surroundings.objects[0].body.hulls)
    low_m = np.array([transform_points(pose, dice)[:, 2].min() for pose in goal.poses])
    assert (low_m < 0.03).any()  # where it comes to rest
    assert (low_m > 0.16 + 0.004 - LET_GO_M - 0.01).any()  # where a hand that is wider than the pot can let it go


def test_what_is_held_beside_its_heavy_end_leans_in_a_small_bowl_that_has_no_room_for_the_hand() -> None:
    hammer = box([0.24, 0.03, 0.03], 0.3, 0.6, center_m=(0.08, 0, 0))
    bowl, _ = deep_pot(0.05, 0.055)
    lies, stands = transform(None, np.array([0, 0, 0.015])), np.eye(4)
    names = twin_id(91), twin_id(90)
    twins = (
        PoolTwin(names[0], "0", "hammer", (StandingPose(0, lies, 1.0, 0.13),), False, ()),
        PoolTwin(names[1], "0", "bowl", (StandingPose(0, stands, 1.0, 0.07, True),), True, ()),
    )
    pool = Pool(twins, {names[0]: hammer, names[1]: bowl}.__getitem__)
    surroundings = around(
        PlacedObject("object_00", names[0], hammer, transform(None, np.array([0.45, -0.2, 0.015]))),
        PlacedObject("object_01", names[1], bowl, transform(None, np.array([0.5, 0.1, 0]))),
        pool=pool,
    )
    goal = goal_of("place_in", surroundings)
    assert goal is not None
    across = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])  # from above, closing across the length
    held = Grasp("g0", above([0.07, 0, 0], across), 0.03)
    on_end = [pose for pose in goal.poses if abs(pose[2, 0]) > 0.99]
    upright = replace(goal, poses=tuple(on_end))
    assert on_end and attempt(surroundings, upright, (held,)).outcome == "no_plan", (
        "the hand is in the bowl, or in the table"
    )
    facts = attempt(surroundings, goal, (held,))
    assert facts.outcome == "kept", (facts, facts.evaluation)


def test_the_same_seed_gives_the_same_poses() -> None:
    surroundings = around(placed(0, "dice", 0.45, -0.2), placed(1, "mixing bowl", 0.5, 0.1))
    first, second = (goal_of("place_in", surroundings, 5) for _ in range(2))
    assert first is not None and second is not None
    assert np.array_equal(first.poses, second.poses)


def test_poses_are_looked_for_as_they_are_asked_for_and_each_once() -> None:
    looked_for = list[int]()

    def find(number: int) -> np.ndarray:
        looked_for.append(number)
        return np.full((4, 4), number)

    poses = LazyPoses(find(number) for number in range(4))
    assert poses[0][0, 0] == 0 and looked_for == [0]
    assert [pose[0, 0] for _, pose in zip("ab", poses, strict=False)] == [0, 1]
    assert looked_for == [0, 1]
    assert len(poses) == 4 and poses[-1][0, 0] == 3 and len(poses[2:]) == 2
    assert looked_for == [0, 1, 2, 3]
    with pytest.raises(IndexError):
        poses[4]


def test_unknown_skills_are_refused_with_the_valid_ones() -> None:
    assert load_skill(PICK_PLACE) is None
    assert set(skill_names()) == {PICK_PLACE, *SKILLS}
    with pytest.raises(UsageError, match="place_in"):
        load_skill("place_inn")
