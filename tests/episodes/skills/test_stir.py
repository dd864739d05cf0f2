"""Stirring: a stick goes around in a bowl of granules; beside the bowl, or in an empty one, nothing is stirred."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from granular_things import deep_pot, mixing_bowl, two_things, with_fewer
from held_skills import attempt, beside

from manitwin.episodes.courses.held import turned_in_place
from manitwin.episodes.planning.problem import Grasp, Phase
from manitwin.episodes.skills.held_skill import stick_frame
from manitwin.episodes.skills.held_task import HeldScene
from manitwin.episodes.skills.registry import SKILLS
from manitwin.episodes.skills.skill import SkillGoal
from manitwin.episodes.skills.stir import leans_rad
from manitwin.geometry.cavity_floor import floor_below_rim
from manitwin.geometry.poses import transform
from manitwin.scenes.layouts.twin_frames import TwinFrame
from rigid_boxes import above, block, box

LENGTH_M = 0.2
STICK = replace(
    box([LENGTH_M, 0.012, 0.02], 0.05, center_m=(0, 0, 0.01)),
    hulls=(block([-LENGTH_M / 2, -0.006, 0], [LENGTH_M / 2, 0.006, 0.02]),),
)
HANDLE = TwinFrame("handle", "axis", transform(None, np.array([-0.05, 0, 0.01])), 0.1, True)
ACROSS = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
GRASPS = tuple(Grasp(f"g{i}", above([-0.06 - 0.01 * i, 0, 0.013], ACROSS), 0.012) for i in range(3))
SPOT = two_things((STICK, (HANDLE,)), mixing_bowl(), ((0.45, -0.2), (0.5, 0.12)), vessels=(False, True))


def stirred_goal() -> SkillGoal:
    goal = SKILLS["stir"].sample_goal(SPOT, 0, 1, np.random.default_rng(1))
    assert goal is not None
    return with_fewer(goal, 30)


@pytest.mark.slow
def test_a_stick_goes_around_in_a_bowl_and_is_laid_back() -> None:
    facts, recording = attempt(SPOT, stirred_goal(), GRASPS)
    assert facts.evaluation is not None, (facts.plan_failures, facts.replans)
    assert facts.evaluation.literals[0].measured["sectors"] == 1.0
    assert facts.outcome == "kept", (facts.evaluation, facts.unplanned)
    assert recording is not None
    assert recording.object_positions_m[-1, 0] == pytest.approx(recording.object_positions_m[0, 0], abs=0.02)
    assert Phase.RETURN not in recording.phase  # it has come out of the bowl: it does not go around backwards


@pytest.mark.slow
@pytest.mark.parametrize(("off_m", "filled", "failure"), [(0.15, True, "missed"), (0.0, False, "nothing_to_stir")])
def test_beside_the_bowl_or_in_an_empty_one_nothing_is_stirred(off_m: float, filled: bool, failure: str) -> None:
    goal = stirred_goal() if filled else replace(stirred_goal(), granules=None)
    facts, _ = attempt(SPOT, goal, GRASPS, off=beside(-off_m, -off_m) @ transform(None, np.array([0, 0, 0.5 * off_m])))
    assert facts.evaluation is not None, (facts.plan_failures, facts.replans)
    assert facts.evaluation.literals[0].failure == failure
    assert facts.outcome == "goal_missed"


def test_only_slender_things_stir_and_only_where_there_is_room() -> None:
    stir, pool = SKILLS["stir"], SPOT.pool
    stick, bowl = SPOT.twin(0), SPOT.twin(1)
    assert stir.suits(pool, stick, bowl)
    assert not stir.suits(pool, bowl, bowl)
    assert not stir.suits(pool, stick, stick)
    assert not stir.suits(pool, stick, None)


def test_a_stick_stands_steeper_in_a_narrow_pot_and_is_too_short_for_a_deep_one() -> None:
    def suits(depth_m: float, radius_m: float) -> bool:
        spot = two_things(
            (STICK, (HANDLE,)), deep_pot(depth_m, radius_m), ((0.45, -0.2), (0.5, 0.12)), vessels=(False, True)
        )
        return SKILLS["stir"].suits(spot.pool, spot.twin(0), spot.twin(1))

    assert suits(0.06, 0.06) and suits(0.06, 0.045)
    assert not suits(0.17, 0.06)  # the hand would be below its rim
    assert not suits(0.10, 0.03)  # it leans on the rim at any angle
    wide, narrow = leans_rad(0.09, 0.03, 0.012), leans_rad(0.04, 0.06, 0.012)
    assert max(wide) == pytest.approx(np.radians(55)) and max(narrow) <= np.radians(25)
    for radius_m, leans in ((0.09, wide), (0.04, narrow)):
        depth_m = 0.03 if radius_m == 0.09 else 0.06
        assert all(depth_m * np.tan(lean) < 0.75 * radius_m for lean in leans)


def test_the_end_follows_the_floor_of_a_bowl() -> None:
    goal = stirred_goal()
    scene = HeldScene(
        target=SPOT.objects[0], objects={each.name: each for each in SPOT.objects}, partner=SPOT.objects[1],
        frames=goal.frames, openings=goal.openings, places_m={}, fixtures=(), fingers=frozenset(),
        fingertips_m=np.zeros((1, 3)), tip_depth_m=0.1, rng=np.random.default_rng(0),
    )  # fmt: skip
    body, center = SPOT.body(1), SPOT.objects[1].object_to_world[:3, 3]
    assert body.opening is not None and goal.path is not None
    stick = stick_frame(np.concatenate(STICK.hulls), (HANDLE,), np.array([0.0, 0, 1]))
    for path in goal.path(scene).paths:
        ends = (path.poses @ stick)[2:-2, :3, 3]
        out_m = np.linalg.norm(ends[:, :2] - center[:2], axis=1)
        floors_m = [
            center[2] + body.opening.center_m[2] + floor_below_rim(body.body.hulls, body.opening, out) for out in out_m
        ]
        assert (ends[:, 2] > floors_m).all()
        assert ends[out_m.argmin(), 2] < ends[out_m.argmax(), 2] + 1e-9


def test_the_end_away_from_the_handle_stirs_and_floors_are_where_they_are() -> None:
    frame = stick_frame(np.concatenate(STICK.hulls), (HANDLE,), np.array([0.0, 0, 1]))
    assert frame[:3, 2] == pytest.approx([1, 0, 0], abs=1e-6)
    assert frame[0, 3] == pytest.approx(LENGTH_M / 2)
    body = SPOT.body(1)
    assert body.opening is not None
    floor_m = floor_below_rim(body.body.hulls, body.opening, 0.05)
    assert body.opening.center_m[2] + floor_m == pytest.approx(0.006, abs=1e-6)


def test_a_thing_is_turned_in_place_about_its_centre_of_mass() -> None:
    placed = SPOT.objects[0]
    center = placed.body.center_of_mass_m
    for angle_rad in (0.0, np.pi / 2):
        turned = turned_in_place(placed, angle_rad)
        np.testing.assert_allclose(
            turned[:3, :3] @ center + turned[:3, 3],
            placed.object_to_world[:3, :3] @ center + placed.object_to_world[:3, 3],
        )
        assert turned[0, 0] == pytest.approx(np.cos(angle_rad) * placed.object_to_world[0, 0])
