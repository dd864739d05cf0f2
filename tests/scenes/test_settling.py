from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.geometry.placed_object import PlacedObject, StaticBox
from manitwin.geometry.poses import transform
from manitwin.scenes.settling import settle_scene
from scene_twins import bowl, can, slab, standing_at

TABLE = StaticBox("table", np.array([0.5, 0.5, 0.02]), transform(translation=np.array([0, 0, -0.02])))
BOX = slab("box", 0.12, 0.08, 0.06, 0.3).body()


def test_what_stands_stays_and_says_what_it_stands_on() -> None:
    stack = [
        PlacedObject("low", "t", BOX, standing_at(0, 0)),
        PlacedObject("high", "t", BOX, standing_at(0.01, 0, 0.06)),
    ]
    other = PlacedObject("other", "c", can().body(), standing_at(0.2, 0.2))
    settled = settle_scene([*stack, other], [TABLE], seconds=2.0)
    assert settled.at_rest.all() and not settled.lost.any()
    assert set(settled.touching) == {("table", "low"), ("low", "high"), ("table", "other")}
    assert settled.neighbours("low") == {"table", "high"}
    starts = np.array([each.object_to_world for each in [*stack, other]])
    np.testing.assert_allclose(settled.object_to_world, starts, atol=1e-3)
    assert settled.steps < 120


def test_a_box_on_its_edge_tips_to_the_nearest_side() -> None:
    tilted = transform(Rotation.from_euler("x", 30, degrees=True).as_matrix(), np.array([0, 0, 0.021]))
    settled = settle_scene([PlacedObject("box", "t", BOX, tilted)], [TABLE], seconds=2.0)
    assert settled.at_rest.all()
    np.testing.assert_allclose(settled.object_to_world[0, 2, :3], [0, 0, 1], atol=1e-2)


def test_what_falls_off_is_lost_and_not_waited_for() -> None:
    objects = [PlacedObject("box", "t", BOX, standing_at(0, 0)), PlacedObject("off", "t", BOX, standing_at(0.9, 0))]
    settled = settle_scene(objects, [TABLE], seconds=2.0, give_up_m=[0.03, 0.03])
    assert settled.lost.tolist() == [False, True]
    assert settled.steps <= 24  # 3 cm of free fall take 19 steps


def test_the_same_scene_ends_the_same_whatever_was_settled_before() -> None:
    objects = [PlacedObject(f"o{i}", "t", BOX, standing_at(0.2 * i, 0.01 * i, 0.002 * i)) for i in range(3)]
    first = settle_scene(objects, [TABLE], seconds=2.0)
    settle_scene([PlacedObject("bowl", "b", bowl().body(), standing_at(0, 0, 0.01)), objects[2]], [TABLE], seconds=1.0)
    again = settle_scene(objects, [TABLE], seconds=2.0)
    np.testing.assert_array_equal(first.object_to_world, again.object_to_world)
    assert first.touching == again.touching
