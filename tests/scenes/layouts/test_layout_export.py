from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
from lxml import etree
from pxr import Usd, UsdGeom, UsdPhysics
from scipy.spatial.transform import Rotation

from articulated_twins import write_articulated
from manitwin.assets.writers.write import write_exported
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.scenes.layouts.export_mjcf import export_mjcf
from manitwin.scenes.layouts.export_sdf import export_sdf
from manitwin.scenes.layouts.export_usd import export_usd
from manitwin.scenes.layouts.pool import read_pool
from manitwin.scenes.layouts.sample import sample_layout
from manitwin.scenes.loaded_scene import Scene
from manitwin.scenes.settings import LayoutSettings
from manitwin.twin.loaded_twin import Twin, TwinSource
from scene_twins import slab, write_things


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """Five objects of three twins on a tray: some twins are there twice."""
    root: Path = tmp_path_factory.mktemp("exported")
    write_things(root, (slab("dice", 0.03, 0.03, 0.03), slab("knife", 0.2, 0.02, 0.01), slab("box", 0.08, 0.06, 0.05)))
    settings = LayoutSettings(objects=(5, 5), surface="tray", clutter="dense")
    return Scene(sample_layout(read_pool(root), settings, 2, 0), TwinSource(root))


def test_mjcf_folder_loads_with_everything_in_its_place_and_rests(scene: Scene, tmp_path: Path) -> None:
    main = write_exported(export_mjcf(scene), tmp_path / "mjcf")
    model = mujoco.MjModel.from_xml_path(str(main))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, round(1 / model.opt.timestep))
    assert model.njnt == 5 and model.ncam == 3 and model.nlight == len(scene.record.lights)
    for placed in scene.record.objects:
        [number] = [i for i in range(model.nbody) if model.body(i).name.startswith(f"{placed.name}/")]
        np.testing.assert_allclose(model.body_pos[number], placed.position_m, atol=1e-9)
        np.testing.assert_allclose(data.xpos[number], placed.position_m, atol=2e-3)
        assert model.body_mass[number] == pytest.approx(scene.twin(placed.twin_id).physical.mass_kg.value)
    for box in scene.record.furniture.boxes:
        np.testing.assert_allclose(model.geom(box.name).size, box.half_extents_m)


def test_cameras_of_mjcf_look_at_their_targets(scene: Scene, tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(write_exported(export_mjcf(scene), tmp_path / "mjcf")))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for camera in scene.record.cameras:
        number = model.camera(camera.name).id
        axes = data.cam_xmat[number].reshape(3, 3)
        toward = np.subtract(camera.target_m, camera.position_m)
        np.testing.assert_allclose(-axes[:, 2], toward / np.linalg.norm(toward), atol=1e-6)
        assert axes[2, 0] == pytest.approx(0, abs=1e-9) and axes[2, 1] > 0  # level, and not upside down
        assert model.cam_fovy[number] == pytest.approx(np.degrees(camera.fov_y_rad))


def test_usd_folder_opens_with_everything_in_its_place(scene: Scene, tmp_path: Path) -> None:
    stage = Usd.Stage.Open(str(write_exported(export_usd(scene), tmp_path / "usd")))
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1 and UsdGeom.GetStageUpAxis(stage) == "Z"
    cache = UsdGeom.XformCache()
    for placed in scene.record.objects:
        prim = stage.GetPrimAtPath(f"/scene/objects/{placed.name}")
        matrix = np.array(cache.GetLocalToWorldTransform(prim)).T  # USD multiplies row vectors
        np.testing.assert_allclose(matrix[:3, 3], placed.position_m, atol=1e-9)
        turn = rotation_from_quaternion_wxyz(np.array(placed.quaternion_wxyz))
        np.testing.assert_allclose(matrix[:3, :3], turn, atol=1e-6)
        assert prim.HasAPI(UsdPhysics.RigidBodyAPI)
        mass = UsdPhysics.MassAPI(prim).GetMassAttr().Get()
        assert mass == pytest.approx(scene.twin(placed.twin_id).physical.mass_kg.value)
        assert sum(child.HasAPI(UsdPhysics.CollisionAPI) for child in Usd.PrimRange(prim)) == 1
    for box in scene.record.furniture.boxes:
        prim = stage.GetPrimAtPath(f"/scene/furniture/{box.name}")
        bounds = UsdGeom.BBoxCache(0, ["default"]).ComputeWorldBound(prim).ComputeAlignedRange()
        np.testing.assert_allclose(bounds.GetMax(), np.add(box.center_m, box.half_extents_m), atol=1e-6)
        assert prim.HasAPI(UsdPhysics.CollisionAPI)


def test_equal_scenes_give_equal_bytes(scene: Scene) -> None:
    assert export_mjcf(scene).files == export_mjcf(scene).files
    assert export_usd(scene).files["scene.usda"] == export_usd(scene).files["scene.usda"]


def test_sdf_world_has_everything_in_its_place(scene: Scene, tmp_path: Path) -> None:
    main = write_exported(export_sdf(scene), tmp_path / "sdf")
    world = etree.parse(main).getroot().find("world")
    assert world is not None
    models = {model.get("name"): model for model in world.findall("model")}
    assert list(models) == ["furniture", *(placed.name for placed in scene.record.objects)]
    assert len(world.findall("light")) == len(scene.record.lights)
    for placed in scene.record.objects:
        model, twin = models[placed.name], scene.twin(placed.twin_id)
        pose = [float(number) for number in model.findtext("pose").split()]
        np.testing.assert_allclose(pose[:3], placed.position_m, atol=1e-9)
        turn = Rotation.from_euler("xyz", pose[3:]).as_matrix()
        np.testing.assert_allclose(turn, rotation_from_quaternion_wxyz(np.array(placed.quaternion_wxyz)), atol=1e-9)
        assert float(model.findtext("link/inertial/mass")) == pytest.approx(twin.physical.mass_kg.value)
        uris = [each.text for each in model.findall("link/collision/geometry/mesh/uri")]
        sides = [trimesh.load_mesh(main.parent / uri).bounds for uri in uris]
        low, high = np.min([side[0] for side in sides], axis=0), np.max([side[1] for side in sides], axis=0)
        corners = np.concatenate([hull.vertices for hull in twin.hulls])
        np.testing.assert_allclose([low, high], [corners.min(0), corners.max(0)], atol=1e-6)
    furniture = models["furniture"]
    assert furniture.findtext("static") == "true"
    for box in scene.record.furniture.boxes:
        (shape,) = furniture.xpath(f"link/collision[@name='{box.name}']")
        size = [float(number) for number in shape.findtext("geometry/box/size").split()]
        np.testing.assert_allclose(size, np.multiply(2, box.half_extents_m))
        at = [float(number) for number in shape.findtext("pose").split()]
        np.testing.assert_allclose(at, [*box.center_m, 0, 0, 0])


def test_sdf_world_has_a_twin_with_joints_as_one_body_and_says_so(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hammer = Twin(write_articulated(tmp_path / "twin"))
    monkeypatch.setattr(Scene, "twin", lambda self, twin_id: hammer)
    exported = export_sdf(scene)
    assert any(said.startswith("the joints of claw_hammer_") for said in exported.cannot_say)
    (model, *_) = etree.fromstring(exported.files[exported.main]).xpath("world/model[@name!='furniture']")
    assert len(model.findall("link")) == 1 and not model.findall("joint")
    assert float(model.findtext("link/inertial/mass")) == pytest.approx(hammer.physical.mass_kg.value)
