"""Granules in an episode's world: they fall into their vessel and stay, always the same, and nobody's contacts tell of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from brick_episodes import panda, problem

from manitwin.episodes.episode import create_world
from manitwin.episodes.execution import Execution
from manitwin.episodes.goals.functional import is_granule_inside
from manitwin.episodes.goals.world_state import Granules, ObjectState
from manitwin.episodes.planning.problem import Phase
from manitwin.episodes.settings import EpisodeSettings
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.granules import GRANULES, GranuleFill, create_granule_fill
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.trial import TrialSettings
from scene_twins import THINGS, pool_of_things
from twin_folders import twin_id

NUMBER = next(number for number, thing in enumerate(THINGS) if thing.vessel)
BOWL = pool_of_things().body(twin_id(NUMBER))


def filled(seed: int = 0) -> GranuleFill:
    assert BOWL.opening is not None
    found = create_granule_fill("object_01", BOWL.opening, BOWL.body.hulls, np.random.default_rng(seed))
    assert found is not None
    return found


def world_with_bowl() -> RobotWorld:
    placed = PlacedObject("object_01", "bowl", BOWL.body, transform(None, np.array([0.5, 0.1, 0.0])))
    settings = EpisodeSettings()
    return create_world(replace(problem(), target=placed), panda()[0], settings, 50.0)


def held(world: RobotWorld, radius_m: float) -> int:
    assert world.granules is not None
    pose = world.object_to_world(0)
    bowl = ObjectState(BOWL.body, pose, pose, True, BOWL.opening)
    return int(is_granule_inside(bowl, Granules(world.granules.positions_m(), radius_m)).sum())


def test_sixty_granules_fall_into_a_bowl_and_stay_there() -> None:
    given, ends = filled(), []
    assert len(given.centers_m) == GRANULES
    assert given.volume_m3 < 0.2 * BOWL.opening.volume_m3  # type: ignore[union-attr]
    for _ in range(2):
        with world_with_bowl() as world:
            world.add_granules(given)
            world.settle(0.5)
            assert held(world, given.radius_m) == GRANULES
            assert world.granules is not None
            ends.append(world.granules.positions_m())
            contacts = world.contacts.read()
            assert world.contacts.pressing_pairs(contacts) == {frozenset({"object_01", "table"})}
            execution = Execution(world, panda()[0], TrialSettings(50.0, 1.0, timestep_s=1 / 120), panda()[1].tip_pose)
            execution.wait(Phase.REST, 2)
            positions = execution.recording().granule_positions_m
            assert positions is not None
            assert positions.shape == (3, GRANULES, 3)
    assert np.array_equal(*ends)
    assert ends[0][:, 2].min() > 0.006 + 0.8 * given.radius_m  # none has gone through the floor


def test_granules_begin_clear_of_the_walls_and_small_vessels_have_fewer_or_none() -> None:
    assert BOWL.opening is not None
    given = filled(3)
    gaps_m = np.linalg.norm(given.centers_m[:, None] - given.centers_m[None], axis=2) + np.eye(GRANULES)
    assert gaps_m.min() > 2 * given.radius_m
    assert np.linalg.norm(given.centers_m[:, :2], axis=1).max() < 0.084 - given.radius_m
    rng = np.random.default_rng(0)
    small = replace(BOWL.opening, rim_radius_m=0.02, volume_m3=2e-5)
    few = create_granule_fill("cup", small, (), rng)
    assert few is not None
    assert 10 <= len(few.centers_m) < GRANULES
    assert few.radius_m == pytest.approx(0.003)
    assert create_granule_fill("thimble", replace(small, volume_m3=2e-6), (), rng) is None
    assert create_granule_fill("straw", replace(small, rim_radius_m=0.01), (), rng) is None
