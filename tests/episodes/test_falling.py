"""Things that fall into a holder stay in it at the coarse timestep of episodes; what closes on them presses as before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from brick_episodes import START, panda, problem

from manitwin.episodes.episode import create_world
from manitwin.episodes.settings import EpisodeSettings
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject, RigidBody
from manitwin.physics.sapien.body import MAX_DEPENETRATION_M_S
from manitwin.physics.sapien.free_fall import AHEAD_M, GENTLY_M_S, FreeFallLimiter
from manitwin.physics.sapien.world import RobotWorld
from rigid_boxes import box

WALL_M, HALF_M, HEIGHT_M = 0.003, 0.03, 0.16
LEANS_RAD = (0.0, 0.1, 0.2)


def holder() -> RigidBody:
    """A square holder with a floor and walls of 3 mm, 6 cm wide and 16 cm high, its foot at the origin."""
    pieces = [box([2 * HALF_M, 2 * HALF_M, WALL_M], 0.1).hulls[0] + [0, 0, WALL_M / 2]]
    for axis in (0, 1):
        for side in (-1.0, 1.0):
            extents = np.array([2 * HALF_M, 2 * HALF_M, HEIGHT_M])
            extents[axis] = WALL_M
            middle = np.array([0, 0, HEIGHT_M / 2])
            middle[axis] = side * (HALF_M - WALL_M / 2)
            pieces.append(box(list(extents), 0.1).hulls[0] + middle)
    return replace(box([2 * HALF_M, 2 * HALF_M, HEIGHT_M], 0.3, center_m=(0, 0, 0.06)), hulls=tuple(pieces))


def dropped(lean_rad: float) -> RobotWorld:
    """A flat stick of 20 g whose lower end is 15 cm above the holder's floor, leaning."""
    foot = START[:2, 3]
    stick = box([0.01, 0.03, 0.1], 0.02)
    turn = np.array([[np.cos(lean_rad), 0, np.sin(lean_rad)], [0, 1, 0], [-np.sin(lean_rad), 0, np.cos(lean_rad)]])
    start = transform(turn, np.array([*foot, 0.2]))
    asked = problem(start=start, target=stick)
    name = "object_00" if asked.target.name != "object_00" else "object_01"
    vessel = PlacedObject(name, "holder", holder(), transform(None, np.array([*foot, 0.0])))
    return create_world(replace(asked, obstacles=(vessel,)), panda()[0], EpisodeSettings(), 50.0)


def fastest_up_m_s(world: RobotWorld) -> float:
    """How fast the target rises at most in 1.5 s, by where it is: what pushes it out of an overlap is not in its velocity."""
    heights_m = []
    for _ in range(180):
        world.step()
        heights_m.append(world.object_to_world(world.target)[2, 3])
    return float(np.diff(heights_m).max() / world.timestep_s)


@pytest.mark.parametrize("lean_rad", LEANS_RAD)
def test_a_stick_that_falls_into_a_holder_is_not_thrown_up_again(lean_rad: float) -> None:
    with dropped(lean_rad) as world:
        assert fastest_up_m_s(world) < 0.3
        offset_m = world.object_to_world(world.target)[:2, 3] - START[:2, 3]
        assert np.abs(offset_m).max() < HALF_M
        assert world.object_to_world(world.target)[2, 3] < 0.09


def test_one_that_nobody_looks_ahead_for_is_thrown_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FreeFallLimiter, "look", lambda self: None)
    fastest = []
    for lean_rad in LEANS_RAD:
        with dropped(lean_rad) as world:
            fastest.append(fastest_up_m_s(world))
    assert max(fastest) > 0.4, fastest


def test_a_hand_that_closes_ends_it() -> None:
    with dropped(0.0) as world:
        body = world.bodies[world.target]
        world.step(6)
        assert body.max_depenetration_velocity == pytest.approx(GENTLY_M_S)
        assert body.collision_shapes[0].contact_offset == pytest.approx(AHEAD_M)
        world.expect_load(True)
        assert body.max_depenetration_velocity == pytest.approx(MAX_DEPENETRATION_M_S)
        assert body.collision_shapes[0].contact_offset == pytest.approx(EpisodeSettings().contact_offset_m)
        del body  # shapes are lent: nothing of a world may outlive it
