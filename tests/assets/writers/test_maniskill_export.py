"""What ManiSkill's folder makes of a twin in SAPIEN: the twin's own mass, centre of mass, inertia, friction and shape."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sapien
from sapien import physx

from known_twins import TWINS, brick, tray
from manitwin.assets.writers import maniskill
from manitwin.assets.writers.exporter import TwinContent
from manitwin.formats.meshes.gltf import read_gltf
from manitwin.formats.meshes.source import MeshLimits, MeshSource
from manitwin.geometry.poses import rotation_from_quaternion_wxyz


def written(twin: TwinContent, folder: Path) -> ModuleType:
    """Write the export and import its load.py from there."""
    exported = maniskill.export(twin)
    for name, data in exported.files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    spec = importlib.util.spec_from_file_location(f"load_{twin.name}", folder / exported.main)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def scene_with_floor() -> sapien.Scene:
    scene = sapien.Scene([physx.PhysxCpuSystem()])
    scene.set_timestep(1 / 240)
    scene.add_ground(0.0, render=False)
    return scene


def built(module: ModuleType, scene: sapien.Scene) -> Any:
    return module.object_builder(scene, module.object_names()[0], visual=False).build(name="object")


@pytest.mark.parametrize("make", TWINS)
def test_loader_builds_the_twins_own_body(make: Any, tmp_path: Path) -> None:
    twin = make()
    entity = built(written(twin, tmp_path), scene_with_floor())
    body = entity.find_component_by_type(physx.PhysxRigidDynamicComponent)
    physical = twin.physical
    assert body.mass == pytest.approx(physical.mass_kg.value, rel=1e-6)
    assert np.allclose(body.cmass_local_pose.p, physical.center_of_mass_m, atol=1e-6)
    axes = rotation_from_quaternion_wxyz(np.array(body.cmass_local_pose.q, float))
    tensor = axes @ np.diag(body.inertia) @ axes.T
    assert np.allclose(tensor, physical.inertia_kg_m2, rtol=1e-4, atol=1e-9)
    assert len(body.collision_shapes) == len(twin.hulls)
    for shape in body.collision_shapes:
        material = shape.physical_material
        assert material.static_friction == pytest.approx(physical.friction_static.value)
        assert material.dynamic_friction == pytest.approx(physical.friction_dynamic.value)
        assert material.restitution == pytest.approx(physical.restitution.value)


@pytest.mark.parametrize("make", TWINS)
def test_built_object_stays_standing_where_it_is_put(make: Any, tmp_path: Path) -> None:
    scene = scene_with_floor()
    entity = built(written(make(), tmp_path), scene)
    for _ in range(240):
        scene.step()
    assert np.abs(entity.pose.p).max() < 0.002
    assert abs(entity.pose.q[0]) > 0.9999


def test_density_alone_gives_the_mass_as_in_maniskills_own_loader(tmp_path: Path) -> None:
    twin = tray()
    written(twin, tmp_path)
    info = json.loads((tmp_path / "info_raw.json").read_text())[twin.name]
    builder = scene_with_floor().create_actor_builder()
    builder.add_multiple_convex_collisions_from_file(
        str(tmp_path / "models" / twin.name / "collision.ply"),
        scale=[info["scales"][0]] * 3,
        density=info["density"],
    )
    body = builder.build(name="x").find_component_by_type(physx.PhysxRigidDynamicComponent)
    assert body.mass == pytest.approx(twin.physical.mass_kg.value, rel=1e-4)


def test_ball_dropped_into_the_tray_stays_inside(tmp_path: Path) -> None:
    scene = scene_with_floor()
    built(written(tray(), tmp_path), scene)
    builder = scene.create_actor_builder()
    builder.add_sphere_collision(radius=0.015)
    builder.set_initial_pose(sapien.Pose([0, 0, 0.1]))
    ball = builder.build(name="ball")
    for _ in range(480):
        scene.step()
    assert np.abs(ball.pose.p[:2]).max() < 0.03
    assert ball.pose.p[2] == pytest.approx(0.006 + 0.015, abs=0.003)


def test_box_of_the_info_is_the_objects(tmp_path: Path) -> None:
    twin = brick()
    module = written(twin, tmp_path)
    info = json.loads((tmp_path / "info_raw.json").read_text())[twin.name]
    assert info["bbox"] == {"min": [-0.02, -0.03, 0.0], "max": [0.02, 0.03, 0.1]}
    assert module.object_names() == [twin.name]
    assert np.allclose(module.resting_poses(twin.name)[0].p, 0)
    assert (tmp_path / "models" / twin.name / "visual.glb").read_bytes() == twin.visual_glb
    assert info["license"] == "CC-BY-4.0"


def test_visual_mesh_is_turned_upright(tmp_path: Path) -> None:
    twin = brick()
    module = written(twin, tmp_path)
    builder = module.object_builder(scene_with_floor(), twin.name)
    (record,) = builder.visual_records
    turn = rotation_from_quaternion_wxyz(np.array(record.pose.q, float))
    raw = read_gltf(MeshSource(Path(record.filename), MeshLimits()), binary=True)[0]
    upright = np.asarray(raw.vertices) @ turn.T + record.pose.p
    assert np.allclose([upright.min(0), upright.max(0)], [[-0.02, -0.03, 0], [0.02, 0.03, 0.1]], atol=1e-6)


def test_same_twin_gives_the_same_bytes() -> None:
    assert maniskill.export(tray()) == maniskill.export(tray())
