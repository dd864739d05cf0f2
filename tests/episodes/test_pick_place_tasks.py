"""Where episodes begin and end: on the table, within reach, apart from each other."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.episodes.pick_place_tasks import MIN_GAP_M, MIN_MOVE_M, Placeable, PlacingArea, free_goal, sample_task
from manitwin.geometry.poses import transform_points
from manitwin.robots.robot import Workspace
from manitwin.scenes.layouts.surroundings import make_furniture
from scene_twins import pool_of_things

POOL = pool_of_things()
PLACEABLES = [Placeable.of(POOL, twin) for twin in POOL.twins]
ROOM = PlacingArea(Workspace(0.35, 0.68, 0.9), make_furniture("table", np.random.default_rng(0)).supports[0])


@pytest.mark.parametrize("seed", range(8))
def test_everything_stands_on_the_table_apart_from_each_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    target = PLACEABLES[seed % len(PLACEABLES)]
    task = sample_task(target, lambda: PLACEABLES[int(rng.integers(len(PLACEABLES)))], 5, ROOM, rng)
    assert task is not None and len(task.objects) == 6
    start, goal = task.objects[task.target].object_to_world, task.goal_object_to_world
    assert np.linalg.norm((goal - start)[:2, 3]) >= MIN_MOVE_M
    poses = [*((o.body, o.object_to_world) for o in task.objects), (task.objects[0].body, goal)]
    clouds = [transform_points(pose, np.concatenate(body.hulls)) for body, pose in poses]
    low, high = (np.add(ROOM.support.center_m, sign * np.array(ROOM.support.half_extents_m)) for sign in (-1, 1))
    for cloud in clouds:
        assert cloud[:, 2].min() == pytest.approx(0.0, abs=1e-9)
        assert (cloud[:, :2] >= low).all() and (cloud[:, :2] <= high).all()
    for number in range(1, 6):
        for fixed in (0, 6):
            gaps = np.linalg.norm(clouds[number][:, None, :2] - clouds[fixed][None, :, :2], axis=2)
            assert gaps.min() >= MIN_GAP_M


def test_a_goal_in_a_scene_keeps_the_way_the_object_stands() -> None:
    rng = np.random.default_rng(3)
    task = sample_task(PLACEABLES[1], lambda: PLACEABLES[4], 2, ROOM, rng)
    assert task is not None
    goal = free_goal(task.objects, 0, ROOM, rng)
    assert goal is not None
    turned = goal[:3, :3] @ task.objects[0].object_to_world[:3, :3].T
    assert turned[2, 2] == pytest.approx(1.0)
    assert transform_points(goal, np.concatenate(task.objects[0].body.hulls))[:, 2].min() == pytest.approx(
        0.0, abs=1e-9
    )


def test_no_room_is_none() -> None:
    nowhere = PlacingArea(Workspace(5.0, 6.0, 0.1), ROOM.support)
    assert sample_task(PLACEABLES[0], lambda: PLACEABLES[1], 1, nowhere, np.random.default_rng(0)) is None
