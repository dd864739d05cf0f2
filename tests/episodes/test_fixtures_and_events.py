"""Fixtures in an episode's world, and events latched from contacts: against weights and falls that are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sapien
from brick_episodes import panda, problem
from sapien import physx

from manitwin.episodes.episode import create_world
from manitwin.episodes.events import PressWatch, StrikeWatch
from manitwin.episodes.fixtures import PEG_LENGTH_M, Fixture, block, panel, peg_stand
from manitwin.episodes.goals.evaluation import judge
from manitwin.episodes.goals.goal import Literal
from manitwin.episodes.goals.world_state import WorldState
from manitwin.episodes.settings import EpisodeSettings
from manitwin.geometry.poses import transform
from manitwin.physics.sapien.contacts import AllowedContacts
from manitwin.physics.sapien.world import RobotWorld
from rigid_boxes import box

SPOT = np.array([0.5, 0.1, 0.0])
STEP_S = EpisodeSettings().timestep_s


def world_with(fixture: Fixture, start: np.ndarray, mass_kg: float = 0.4) -> RobotWorld:
    """A cube of 4 cm at a pose, and a fixture."""
    asked = problem(start=start, target=box([0.04, 0.04, 0.04], mass_kg))
    return create_world(replace(asked, fixtures=fixture.boxes), panda()[0], EpisodeSettings(), 50.0)


def above(fixture: Fixture, height_m: float, aside_m: float = 0.0) -> np.ndarray:
    """A cube's pose with its lower side so high above a level frame, and so far aside."""
    return fixture.frame_to_world @ transform(None, np.array([aside_m, 0, 0.02 + height_m]))


@pytest.mark.parametrize("aside_m", [0.0, 0.015])
def test_a_press_is_the_weight_that_lies_there_where_it_lies(aside_m: float) -> None:
    struck = block(SPOT, 0.3)
    watch = PressWatch("block", frozenset({"object_01"}), lambda: struck.frame_to_world)
    with world_with(struck, above(struck, 0.0, aside_m)) as world:
        world.step(60)
        for step in range(20):
            world.step()
            watch.look(world.contacts, world.contacts.read(), step * STEP_S)
        assert world.contacts.touches(world.contacts.read()).on_support
    (event,) = watch.events  # it lasts
    assert event.values["force_n"] == pytest.approx(0.4 * 9.81, rel=0.03)
    assert event.values["off_m"] == pytest.approx(aside_m, abs=5e-4)
    assert event.values["angle_rad"] == pytest.approx(0.0, abs=0.01)
    state = WorldState({}, frozenset(), events=watch.events)
    assert judge(state, Literal("pressed", "block", value=3.5)).failure == (None if aside_m < 0.012 else "off")
    assert judge(state, Literal("pressed", "block", value=5.0)).failure == ("weak" if aside_m < 0.012 else "off")


@pytest.mark.parametrize("height_m", [0.005, 0.03])
def test_a_strike_is_as_fast_as_the_fall_that_led_to_it(height_m: float) -> None:
    struck, down = block(SPOT, 0.0), transform(np.diag([1.0, -1, -1]), np.array([0, 0, -0.02]))
    with world_with(struck, above(struck, height_m)) as world:
        watch = StrikeWatch("object_01", "block", lambda: world.object_to_world(0) @ down, 0.02, STEP_S)
        for step in range(30):
            world.step()
            watch.look(world.contacts, world.contacts.read(), step * STEP_S)
    first = watch.events[0]
    fallen_m = 9.81 * STEP_S**2 * np.cumsum(np.arange(1, 30))  # after each step
    free = int(
        (fallen_m < height_m).sum()
    )  # a touch is seen ahead: the step that would end below is no free fall any more
    assert first.values["speed_m_s"] == pytest.approx(9.81 * STEP_S * free, abs=0.005)
    assert first.values["angle_rad"] < 0.02
    assert first.values["off_m"] < 0.002
    state = WorldState({}, frozenset(), events=watch.events)
    failure = judge(state, Literal("struck", "object_01", "block", 0.5)).failure
    assert failure == ("slow" if height_m < 0.01 else None)


def test_a_strike_with_the_wrong_face_is_askew() -> None:
    struck, upward = block(SPOT, 0.0), transform(None, np.array([0, 0, 0.02]))
    with world_with(struck, above(struck, 0.02)) as world:
        watch = StrikeWatch("object_01", "block", lambda: world.object_to_world(0) @ upward, 0.02, STEP_S)
        for step in range(30):
            world.step()
            watch.look(world.contacts, world.contacts.read(), step * STEP_S)
    state = WorldState({}, frozenset(), events=watch.events)
    assert judge(state, Literal("struck", "object_01", "block", 0.1)).failure == "askew"


def test_what_the_target_touches_counts_only_where_it_is_watched_and_not_meant() -> None:
    struck = block(SPOT, 0.0)
    with world_with(struck, above(struck, 0.0)) as world:
        world.step(30)
        contacts = world.contacts.read()

        def unplanned(meant: AllowedContacts) -> set[tuple[str, str]]:
            return world.contacts.unplanned(contacts, in_hand=True, meant=meant)

        assert unplanned(AllowedContacts()) == set()
        assert unplanned(AllowedContacts(target=frozenset({"block"}))) == set()
        assert unplanned(AllowedContacts(target=frozenset({"table"}))) == {("object_01", "block")}


def test_bodies_without_a_role_are_left_out() -> None:
    struck = block(SPOT, 0.0)
    with world_with(struck, above(struck, 0.0)) as world:
        sphere = physx.PhysxRigidDynamicComponent()
        sphere.attach(physx.PhysxCollisionShapeSphere(0.01, physx.get_default_material()))
        entity = sapien.Entity()
        entity.add_component(sphere)
        entity.pose = sapien.Pose([0.5, 0.1, 0.12 + 0.04 + 0.0099])  # on the cube
        world.add_ignored_bodies([entity])
        world.step(30)
        contacts = world.contacts.read()
        assert world.contacts.pressing_pairs(contacts) == {frozenset({"object_01", "block"})}
        assert world.contacts.touches(contacts).on_support
        assert world.contacts.unplanned(contacts, in_hand=False) == set()


def test_fixtures_stand_on_the_table_and_work_where_they_say() -> None:
    for made, level_m in ((peg_stand(SPOT, 0.7), 0.28), (block(SPOT, 0.7), 0.12), (panel(SPOT, 0.7), 0.046)):
        assert made.frame_to_world[:3, 3] == pytest.approx(SPOT + np.array([0, 0, level_m]))
        lowest = min(b.box_to_world[2, 3] - np.abs(b.box_to_world[2, :3]) @ b.half_extents_m for b in made.boxes)
        assert lowest == pytest.approx(0.0, abs=1e-9)
        assert made.boxes[0].name == made.name
        assert np.linalg.norm(made.footprint_m - SPOT[:2], axis=1).max() < 0.12
    peg = peg_stand(SPOT, 0.7).peg
    assert peg is not None
    assert peg.length_m == PEG_LENGTH_M
    assert peg.direction == pytest.approx(
        [np.cos(0.7) * np.cos(0.1745), np.sin(0.7) * np.cos(0.1745), np.sin(0.1745)], abs=1e-3
    )
