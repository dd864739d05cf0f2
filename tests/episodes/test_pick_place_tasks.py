"""Where episodes begin and end: on the table, within reach, apart from each other."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.episodes.instructions import episode_instructions
from manitwin.episodes.pick_place_tasks import (
    MIN_GAP_M,
    MIN_MOVE_M,
    PickPlaceTask,
    Placeable,
    PlacingArea,
    free_goal,
    sample_task,
)
from manitwin.geometry.poses import transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject, RigidBody
from manitwin.robots.robot import Workspace
from manitwin.scenes.layouts.surroundings import make_furniture
from manitwin.twin.record import Language
from scene_twins import pool_of_things

POOL = pool_of_things()
PLACEABLES = [Placeable.in_likeliest_placement(POOL, twin) for twin in POOL.twins]
ROOM = PlacingArea(Workspace(0.35, 0.68, 0.9), make_furniture("table", np.random.default_rng(0)).supports[0])


@pytest.mark.parametrize("seed", range(8))
def test_everything_stands_on_the_table_apart_from_each_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    target = PLACEABLES[seed % len(PLACEABLES)]
    task = sample_task(target, lambda: PLACEABLES[int(rng.integers(len(PLACEABLES)))], 5, ROOM, rng)
    assert task is not None and len(task.objects) == 6
    goal = task.goal_object_to_world
    assert np.linalg.norm((task.start_and_goal_m[1] - task.start_and_goal_m[0])[:2]) >= MIN_MOVE_M
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


@pytest.fixture
def lying_bar() -> PlacedObject:
    """A bar of 24 cm that lies along X, the origin of its frame at one end."""
    hull = np.array(trimesh.creation.box(extents=[0.04, 0.04, 0.24]).vertices) + np.array([0, 0, 0.12])
    body = RigidBody((hull,), 0.5, np.array([0.0, 0, 0.12]), 1e-3 * np.eye(3), 0.5, 0.5)
    lies = Rotation.from_euler("y", 90, degrees=True).as_matrix()
    return PlacedObject("object_00", "bar", body, transform(lies, np.array([0.4, 0.0, 0.02])))


def test_what_lies_goes_far_enough_by_its_middle(lying_bar: PlacedObject) -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        goal = free_goal((lying_bar,), 0, ROOM, rng)
        assert goal is not None
        start_m, goal_m = PickPlaceTask((lying_bar,), 0, goal).start_and_goal_m
        assert np.linalg.norm((goal_m - start_m)[:2]) >= MIN_MOVE_M
        assert 0.35 <= np.linalg.norm(goal_m[:2]) <= 0.68  # it is within reach by its middle too


def test_the_way_of_what_is_turned_is_told_by_its_middle(lying_bar: PlacedObject) -> None:
    turned = transform(Rotation.from_euler("z", 180, degrees=True).as_matrix())
    goal = transform(translation=np.array([1.0, 0.2, 0.0])) @ turned @ lying_bar.object_to_world
    start_m, goal_m = PickPlaceTask((lying_bar,), 0, goal).start_and_goal_m
    np.testing.assert_allclose(start_m, [0.52, 0, 0.02], atol=1e-12)
    np.testing.assert_allclose(goal_m, [0.48, 0.2, 0.02], atol=1e-12)  # the origin goes from x = 0.4 to 0.6
    language = Language(
        category="bottle", color="red", material="glass", size="24 cm", shape="long", function="holding wine",
        caption="A red bottle.", captions=[],
    )  # fmt: skip
    spoken = episode_instructions(language, start_m, goal_m, seed=0, count=8)
    assert any("about 20 cm to the left" in text for text in spoken)
    assert not any("robot" in text for text in spoken)
