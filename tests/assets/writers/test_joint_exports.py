"""Links and joints go out whole as URDF, MJCF, SDF and USD: engines have the twin's masses, limits and places."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from lxml import etree
from pxr import Usd, UsdGeom, UsdPhysics
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from articulated_twins import JOINTS, MASSES_KG, NAMES, write_articulated
from articulated_usd import motions_of
from manitwin.assets.read import read_asset
from manitwin.assets.writers.exporter import TwinContent
from manitwin.assets.writers.registry import formats
from manitwin.assets.writers.write import export_twin
from manitwin.cli.main import app
from manitwin.geometry.articulation import link_motions
from manitwin.geometry.poses import transform_points
from manitwin.twin.loaded_twin import Twin

WITH_JOINTS = ("urdf", "mjcf", "sdf", "usd", "usdz")
NAMED = ("front door", "front-door", "2nd")
"""Of which USD makes one name, and that of a prim that begins with no digit."""
POSITIONS = [(0.35, 0.02), (0.0, 0.0), (-0.4, 0.06), (1.1, -0.01), (0.7, 0.03)]


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> Twin:
    return Twin(write_articulated(tmp_path_factory.mktemp("articulated") / "twin"))


@pytest.fixture(scope="module")
def exports(twin: Twin, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    out = tmp_path_factory.mktemp("exports")
    return {name: export_twin(TwinContent.of(twin), name, out) for name in WITH_JOINTS}


def wanted(twin: Twin, positions: tuple[float, float]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return centre of mass and inertia of each link in the object frame, the joints at positions."""
    body = twin.articulated_body()
    motions = link_motions(body.joints, positions)
    return [
        (transform_points(m, link.center_of_mass_m[None])[0], m[:3, :3] @ link.inertia_kg_m2 @ m[:3, :3].T)
        for m, link in zip(motions, body.links, strict=True)
    ]


@pytest.mark.parametrize("positions", POSITIONS)
def test_mujoco_has_the_links_where_the_twin_has_them(
    twin: Twin, exports: dict[str, Path], positions: tuple[float, float]
) -> None:
    model = mujoco.MjModel.from_xml_path(str(exports["mjcf"]))
    data = mujoco.MjData(model)
    for joint, position in zip(JOINTS, positions, strict=True):
        data.qpos[model.joint(joint["name"]).qposadr[0]] = position
    mujoco.mj_forward(model, data)
    assert model.nbody == 4 and model.body_mass[1:].tolist() == pytest.approx(MASSES_KG)
    for body, (center, tensor) in enumerate(wanted(twin, positions), start=1):
        axes = data.ximat[body].reshape(3, 3)
        assert np.allclose(data.xipos[body], center, atol=1e-9)
        assert np.allclose(axes @ np.diag(model.body_inertia[body]) @ axes.T, tensor, rtol=0, atol=1e-9)


def test_mujoco_has_the_joints(exports: dict[str, Path]) -> None:
    model = mujoco.MjModel.from_xml_path(str(exports["mjcf"]))
    start = mujoco.MjData(model)
    for said in JOINTS:
        joint = model.joint(said["name"])
        assert list(joint.range) == pytest.approx([said["lower"], said["upper"]])
        assert start.qpos[joint.qposadr[0]] == pytest.approx(said["locked_at"]), "it begins as the twin stands"
        assert (joint.damping[0], joint.frictionloss[0]) == pytest.approx((said["damping"], said["friction"]))
        assert np.allclose(joint.axis, said["axis"])


@pytest.mark.parametrize("positions", POSITIONS)
def test_pybullet_has_the_links_where_the_twin_has_them(
    twin: Twin, exports: dict[str, Path], positions: tuple[float, float]
) -> None:
    pybullet = pytest.importorskip("pybullet", reason="pybullet has no wheels for this Python")
    client = pybullet.connect(pybullet.DIRECT)
    try:
        body = pybullet.loadURDF(
            str(exports["urdf"]), flags=pybullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client
        )
        center, axes = pybullet.getDynamicsInfo(body, -1, physicsClientId=client)[3:5]
        pybullet.resetBasePositionAndOrientation(body, center, axes, physicsClientId=client)
        assert pybullet.getNumJoints(body, physicsClientId=client) == 2
        for number, (said, position) in enumerate(zip(JOINTS, positions, strict=True)):
            pybullet.resetJointState(body, number, position, physicsClientId=client)
            told = pybullet.getJointInfo(body, number, physicsClientId=client)
            assert (told[1].decode(), told[12].decode()) == (said["name"], said["child"])
            assert told[8:10] == pytest.approx((said["lower"], said["upper"]))
            assert told[10:12] == pytest.approx((said["effort"] or 1000, said["velocity"] or 100))
            assert told[6:8] == pytest.approx((said["damping"], said["friction"]))
        for number, (center, tensor) in enumerate(wanted(twin, positions)):
            dynamics = pybullet.getDynamicsInfo(body, number - 1, physicsClientId=client)
            assert dynamics[0] == pytest.approx(MASSES_KG[number])
            if number == 0:
                continue
            state = pybullet.getLinkState(body, number - 1, computeForwardKinematics=True, physicsClientId=client)
            assert np.allclose(state[0], center, atol=1e-6)
            axes = Rotation.from_quat(state[1]).as_matrix()
            assert np.allclose(axes @ np.diag(dynamics[2]) @ axes.T, tensor, rtol=0, atol=1e-9)
    finally:
        pybullet.disconnect(client)


@pytest.mark.parametrize("positions", POSITIONS)
def test_usd_has_the_links_where_the_twin_has_them(
    twin: Twin, exports: dict[str, Path], positions: tuple[float, float]
) -> None:
    stage = Usd.Stage.Open(str(exports["usd"]))
    motions = motions_of(stage, {joint["name"]: at for joint, at in zip(JOINTS, positions, strict=True)})
    bodies = [prim for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
    assert [prim.GetName() for prim in bodies] == list(NAMES)
    for prim, mass_kg, (center, tensor) in zip(bodies, MASSES_KG, wanted(twin, positions), strict=True):
        api, pose = UsdPhysics.MassAPI(prim), np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)).T
        placed = motions.get(prim.GetPath(), np.eye(4)) @ pose
        quaternion = api.GetPrincipalAxesAttr().Get()
        axes = placed[:3, :3] @ Rotation.from_quat([*quaternion.GetImaginary(), quaternion.GetReal()]).as_matrix()
        assert api.GetMassAttr().Get() == pytest.approx(mass_kg)
        assert np.allclose(transform_points(placed, np.array([api.GetCenterOfMassAttr().Get()]))[0], center, atol=1e-7)
        assert np.allclose(axes @ np.diag(api.GetDiagonalInertiaAttr().Get()) @ axes.T, tensor, rtol=0, atol=1e-9)


def test_usd_has_the_joints_and_each_link_its_own_meshes(twin: Twin, exports: dict[str, Path]) -> None:
    stage = Usd.Stage.Open(str(exports["usd"]))
    root = stage.GetDefaultPrim()
    assert root.HasAPI(UsdPhysics.ArticulationRootAPI) and not root.HasAPI(UsdPhysics.RigidBodyAPI)
    elbow = stage.GetPrimAtPath(root.GetPath().AppendPath("joints/elbow"))
    said = JOINTS[0]
    assert elbow.GetAttribute("physics:upperLimit").Get() == pytest.approx(np.degrees(said["upper"]))
    assert elbow.GetAttribute("drive:angular:physics:damping").Get() == pytest.approx(np.radians(said["damping"]))
    assert elbow.GetAttribute("drive:angular:physics:maxForce").Get() == pytest.approx(said["effort"])
    frictions = [elbow.GetAttribute(name).Get() for name in ("mjc:frictionloss", "newton:friction")]
    assert frictions == pytest.approx([said["friction"]] * 2)
    assert elbow.GetAttribute("physxJoint:maxJointVelocity").Get() == pytest.approx(np.degrees(said["velocity"]))
    asset = read_asset(exports["usd"], joints="keep")
    assert asset.articulation is not None and asset.articulation.link_of_visual == TwinContent.of(twin).link_of_visual
    assert [joint.stands_at for joint in asset.articulation.joints] == pytest.approx(
        [joint["locked_at"] for joint in JOINTS], abs=1e-6
    )
    assert (asset.articulation.joints[0].effort, asset.articulation.joints[0].velocity) == pytest.approx((2, 3))
    assert asset.inertial.mass_kg == pytest.approx(sum(MASSES_KG)) and len(asset.collision) == len(twin.hulls)
    for mine, theirs in zip(asset.visual, TwinContent.of(twin).visual, strict=True):
        assert np.allclose(mine.bounds, theirs.bounds, atol=1e-6)


@pytest.mark.parametrize("format", WITH_JOINTS)
def test_what_goes_out_comes_in_again(twin: Twin, exports: dict[str, Path], format: str) -> None:
    asset = read_asset(exports[format], joints="keep")
    assert asset.articulation is not None
    assert [link.name for link in asset.articulation.links][1:] == list(NAMES[1:])
    for number, link in enumerate(asset.articulation.links):
        assert link.inertial.mass_kg == pytest.approx(MASSES_KG[number])
    at = (0.5, 0.01)
    ours, theirs = twin.articulated_body().joints, asset.articulation.joints
    for mine, other in zip(ours, theirs, strict=True):
        assert (mine.name, mine.kind, mine.lower, mine.upper) == (
            other.name, other.kind, pytest.approx(other.lower), pytest.approx(other.upper)
        )  # fmt: skip
        assert (other.damping, other.friction) == pytest.approx((mine.damping, mine.friction))
    standing = link_motions(ours, [joint.stands_at for joint in theirs])  # a URDF and an SDF stand at 0
    centers = [transform_points(m, link.center_of_mass_m[None])[0] for m, link in
               zip(link_motions(ours, at), twin.articulated_body().links, strict=True)]  # fmt: skip
    again = [transform_points(m, np.asarray(link.inertial.center_of_mass_m)[None])[0] for m, link in
             zip(link_motions(theirs, at), asset.articulation.links, strict=True)]  # fmt: skip
    assert np.allclose(standing[0], np.eye(4)) and np.allclose(centers, again, atol=1e-6)


def test_names_that_usd_cannot_write_come_in_again(twin: Twin, tmp_path: Path) -> None:
    links = [link.model_copy(update={"name": name}) for link, name in zip(twin.record.links, NAMED, strict=True)]
    joints = [
        joint.model_copy(update={"name": f"{name}.0", "parent": parent, "child": name})
        for joint, parent, name in zip(twin.record.joints, NAMED, NAMED[1:], strict=False)
    ]
    record = twin.record.model_copy(update={"links": links, "joints": joints})
    main = export_twin(replace(TwinContent.of(twin), record=record), "usd", tmp_path)
    found = read_asset(main, joints="keep").articulation
    assert found is not None and tuple(link.name for link in found.links) == NAMED
    assert [joint.name for joint in found.joints] == [f"{name}.0" for name in NAMED[1:]]


def test_other_formats_say_that_joints_are_not_in_them(twin: Twin, tmp_path: Path) -> None:
    locked: list[str] = []
    content = TwinContent.of(twin)
    for name in formats():
        main = export_twin(content, name, tmp_path, on_locked=locked.append)
        folder = tmp_path / content.name / name
        said = "its 2 joints: it is one rigid body as the twin stands" in (folder / "README.md").read_text()
        assert said == (name not in WITH_JOINTS) and main.is_file()
    assert locked == [name for name in formats() if name not in WITH_JOINTS]


def test_the_command_says_in_one_line_what_went_out_without_joints(twin: Twin, tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["export", str(twin.folder), "--to", "urdf,glb,isaaclab", "-o", str(tmp_path)])
    line = " ".join(done.output.split())
    assert (
        done.exit_code == 0
        and "exported without joints, as one rigid body, to glb, isaaclab; mjcf, urdf, sdf and usd keep the joints"
        in line
    )


def test_each_link_has_its_own_meshes(exports: dict[str, Path]) -> None:
    model = mujoco.MjModel.from_xml_path(str(exports["mjcf"]))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    shown = [model.geom_bodyid[geom] for geom in range(model.ngeom) if not model.geom_contype[geom]]
    felt = [model.geom_bodyid[geom] for geom in range(model.ngeom) if model.geom_contype[geom]]
    assert shown == felt == [1, 2, 3]


def test_sdf_has_no_joint_of_a_links_name(twin: Twin, tmp_path: Path) -> None:
    links, joints = twin.record.links, twin.record.joints
    names = (links[1].name, f"{links[1].name}_joint")
    renamed = [joint.model_copy(update={"name": name}) for joint, name in zip(joints, names, strict=True)]
    content = TwinContent.of(twin)
    content = replace(content, record=twin.record.model_copy(update={"joints": renamed}))
    main = export_twin(content, "sdf", tmp_path)
    model = etree.parse(main).getroot().find("model")
    assert model is not None
    said = [each.get("name") for each in (*model.findall("link"), *model.findall("joint"))]
    assert len(set(said)) == len(said) and said[-2:] == [f"{links[1].name}_joint_joint", names[1]]
    assert f"{names[0]} is {names[0]}_joint_joint" in (main.parents[1] / "README.md").read_text()
