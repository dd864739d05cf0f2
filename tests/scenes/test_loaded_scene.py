from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import sapien

from manitwin.geometry.poses import rotation_angle_rad, transform
from manitwin.scenes.layouts.pool import read_pool
from manitwin.scenes.layouts.sample import sample_layout
from manitwin.scenes.loaded_scene import Scene, object_pose
from manitwin.scenes.scene_files import write_scene
from manitwin.scenes.settings import LayoutSettings
from scene_twins import write_things


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """A bowl with something in it, something on something, and others, read from disk."""
    root: Path = tmp_path_factory.mktemp("scene")
    write_things(root)
    settings = LayoutSettings(objects=(7, 7), include=("bowl",), contained=1, stacked=1)
    record = sample_layout(read_pool(root), settings, 1, 0)
    return Scene.read(write_scene(record, root / "scenes" / "0"), root)


def test_everything_rests_at_the_recorded_poses_in_sapien(scene: Scene) -> None:
    world = sapien.Scene([sapien.physx.PhysxCpuSystem()])
    world.set_timestep(1 / 240)
    entities = scene.add_to_sapien(world, visual=False)
    assert set(entities.furniture) == {box.name for box in scene.record.furniture.boxes}
    for entity in [*entities.objects.values(), *entities.furniture.values()]:
        component = entity.find_component_by_type(sapien.physx.PhysxRigidBaseComponent)
        # at SAPIEN's own 10 mm, thin things that do not touch may be thrown apart
        assert [s.contact_offset for s in component.collision_shapes] == pytest.approx(
            [0.002] * len(component.collision_shapes)
        )
    for _ in range(240):
        world.step()
    for placed in scene.record.objects:
        end = entities.objects[placed.name].pose.to_transformation_matrix()
        _assert_stays(object_pose(placed), end.astype(float))


def test_everything_rests_at_the_recorded_poses_in_mujoco(scene: Scene) -> None:
    model = scene.to_mujoco()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, round(1 / model.opt.timestep))
    for placed in scene.record.objects:
        number = model.body(placed.name).id
        assert model.body_mass[number] == pytest.approx(scene.twin(placed.twin_id).physical.mass_kg.value)
        _assert_stays(object_pose(placed), transform(data.xmat[number].reshape(3, 3), data.xpos[number]))


def test_objects_and_furniture_are_given_as_the_planner_takes_them(scene: Scene) -> None:
    objects, boxes = scene.placed_objects(), scene.static_boxes()
    assert [each.name for each in objects] == [f"object_{i:02d}" for i in range(7)]
    for placed, recorded in zip(objects, scene.record.objects, strict=True):
        np.testing.assert_allclose(placed.object_to_world[:3, 3], recorded.position_m)
        assert placed.body.mass_kg == scene.twin(recorded.twin_id).physical.mass_kg.value
    [table] = boxes
    assert table.box_to_world[2, 3] + table.half_extents_m[2] == pytest.approx(0)


def _assert_stays(start: np.ndarray, end: np.ndarray) -> None:
    assert np.linalg.norm(end[:3, 3] - start[:3, 3]) < 0.01
    assert rotation_angle_rad(end[:3, :3] @ start[:3, :3].T) < np.radians(5)
