"""Held paths of the Panda: those with room to spare around the arm come first, and those without it are not given up."""

from __future__ import annotations

import numpy as np
import pytest
from planning_problems import TABLE, above, grasps_from_above, problem, standing, wall

from manitwin.episodes.planning import held_path
from manitwin.episodes.planning.arm_planning import ArmPlanning
from manitwin.episodes.planning.held_knots import HeldKnots, HeldPath
from manitwin.episodes.planning.held_path import SPARE_M, HeldPathPlanner
from manitwin.episodes.planning.problem import Phase
from manitwin.robots.load import load_robot

WALL_X_M, HALF_WALL_M = 0.6, 0.01


@pytest.fixture(scope="module")
def parts() -> ArmPlanning:
    return ArmPlanning(load_robot("panda"))


@pytest.fixture(scope="module")
def beside_a_wall():
    """A brick on a table with a wall 40 cm high; it is held so that the hand is at the wall sooner than it is."""
    around = (TABLE, wall(WALL_X_M, 0.2, (HALF_WALL_M, 0.2, 0.2)))
    return problem(standing(0.45, -0.2), standing(0.45, -0.2), grasps_from_above(0.08), boxes=around)


def to(x_m: float) -> HeldPath:
    """A path to a place at some height, before the wall."""
    return HeldPath(np.array([standing(x_m - back_m, 0.2, z_m=0.1) for back_m in (0.06, 0.03, 0.0)]))


@pytest.fixture(scope="module")
def tight_x_m(parts: ArmPlanning, beside_a_wall) -> float:
    """Where the hand is between 1 mm and the spare room away from the wall."""
    world = parts.problem_world(beside_a_wall, beside_a_wall.target.object_to_world)
    world.hold(above(0.08))

    def fits(x_m: float, spare_m: float) -> bool:
        world.arm.enter(Phase.CARRY, parts.settings.clearance_m, frozenset(), spare_m)
        q = parts.arm.inverse(standing(x_m, 0.2, z_m=0.1) @ above(0.08), parts.arm.home)
        return q is not None and world.arm.is_free(q)

    farthest = max(x for x in np.arange(0.35, 0.6, 0.001) if fits(x, 0.0))
    with_room = max(x for x in np.arange(0.35, 0.6, 0.001) if fits(x, SPARE_M))
    assert farthest - with_room == pytest.approx(SPARE_M, abs=0.003)  # the wall stands across X
    return float((farthest + with_room) / 2)


def planned(parts: ArmPlanning, some, *paths: HeldPath) -> HeldPath | None:
    plan, _ = HeldPathPlanner(parts).plan(some, paths, as_hulls=False, longest_s=6.0)
    return None if plan is None else plan.held


def test_a_path_with_room_to_spare_is_taken_before_a_tight_one(parts, beside_a_wall, tight_x_m) -> None:
    tight, wide = to(tight_x_m), to(tight_x_m - 0.05)
    assert planned(parts, beside_a_wall, tight, wide) is wide
    assert planned(parts, beside_a_wall, wide, tight) is wide
    assert planned(parts, beside_a_wall, tight) is tight
    assert planned(parts, beside_a_wall, to(tight_x_m + 0.03)) is None


def test_spare_room_is_asked_of_the_arm_and_not_of_what_it_holds(parts, beside_a_wall) -> None:
    world = parts.problem_world(beside_a_wall, beside_a_wall.target.object_to_world)
    lying = standing(0.45, -0.2, z_m=0.004) @ above(0.08)
    world.hold(above(0.08))
    q = parts.arm.inverse(lying, parts.arm.home)
    for spare_m in (0.0, SPARE_M):  # the brick is 4 mm above the table, the fingers 5 cm
        world.arm.enter(Phase.CARRY, 0.001, frozenset(), spare_m)
        assert world.arm.is_free(q), world.arm.touching(q)


def test_where_the_hand_alone_is_in_the_way_no_joints_are_sought_and_none_would_serve(parts, beside_a_wall) -> None:
    world, knots = (
        parts.problem_world(beside_a_wall, beside_a_wall.target.object_to_world),
        HeldKnots(parts, Phase.CARRY),
    )
    world.hold(above(0.08))
    told = set[bool]()
    for x_m in np.arange(0.35, 0.62, 0.01):
        is_free = knots.is_hand_free(world, to(x_m), above(0.08))
        world.arm.enter(Phase.CARRY, parts.settings.clearance_m)
        joints = [parts.arm.inverse(pose @ above(0.08), parts.arm.home) for pose in to(x_m).poses]
        assert is_free or not all(q is not None and world.arm.is_free(q) for q in joints)
        told.add(is_free)
    assert told == {True, False}


def test_what_the_hand_alone_forbids_does_not_count_towards_the_most_that_are_tried(
    parts, beside_a_wall, tight_x_m, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(held_path, "MOST_PAIRS", 1)
    wide = to(tight_x_m - 0.05)
    assert planned(parts, beside_a_wall, *(to(tight_x_m + 0.03),) * 3, wide) is wide
