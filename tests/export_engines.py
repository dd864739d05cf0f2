"""What engines make of an exported twin: each loads the file, and is asked for mass properties, friction and size."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import mujoco
import numpy as np
import pytest
import sapien
from lxml import etree

from manitwin.assets.writers.exporter import TwinContent
from manitwin.geometry.poses import rotation_from_quaternion_wxyz

BULLET_MARGIN_M = 0.001  # gUrdfDefaultCollisionMargin: around every convex mesh
PHYSX_TOLERANCE_M = 0.0007  # PxCookingParams::planeTolerance: corners that close to the hull of the others are dropped


@dataclass(frozen=True)
class Body:
    """A body as an engine has it, in the frame of the file; ``inertia_kg_m2 (3, 3)`` is about the centre of mass."""

    mass_kg: float
    center_of_mass_m: np.ndarray
    inertia_kg_m2: np.ndarray
    box_m: np.ndarray
    friction: float
    restitution: float | None
    shapes: int


def body_of(twin: TwinContent) -> Body:
    """What the twin itself says."""
    physical = twin.physical
    corners = np.concatenate([vertices for vertices, _ in twin.hulls])
    return Body(
        physical.mass_kg.value,
        np.array(physical.center_of_mass_m),
        np.array(physical.inertia_kg_m2),
        np.stack([corners.min(0), corners.max(0)]),
        physical.friction_static.value,
        physical.restitution.value,
        len(twin.hulls),
    )


def assert_same(
    loaded: Body, twin: Body, *, inertia: bool = True, friction: bool = True, cooked_m: float = 0.0, share: float = 0.01
) -> None:
    """Compare within a share of the value, places within that share of the object's size.

    ``cooked_m``: how far an engine may cut off corners of the hulls.
    """
    size_m = float(np.ptp(twin.box_m, axis=0).max())
    assert loaded.shapes == twin.shapes
    assert loaded.mass_kg == pytest.approx(twin.mass_kg, rel=share)
    np.testing.assert_allclose(loaded.center_of_mass_m, twin.center_of_mass_m, rtol=0, atol=share * size_m)
    np.testing.assert_allclose(
        loaded.box_m, twin.box_m, rtol=0, atol=cooked_m + share * np.ptp(twin.box_m, axis=0).min()
    )
    if inertia:
        moments = np.linalg.eigvalsh(twin.inertia_kg_m2)
        np.testing.assert_allclose(np.linalg.eigvalsh(loaded.inertia_kg_m2), moments, rtol=share)
        np.testing.assert_allclose(loaded.inertia_kg_m2, twin.inertia_kg_m2, rtol=0, atol=share * moments[0])
    if friction:
        assert loaded.friction == pytest.approx(twin.friction, rel=1e-6)
        assert loaded.restitution is None or loaded.restitution == pytest.approx(twin.restitution, rel=1e-6)


def in_mujoco(path: Path) -> Body:
    """Load an MJCF file that holds one body."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert model.nbody == 2 and model.njnt == 1 and model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE
    solid = [g for g in range(model.ngeom) if model.geom_contype[g] or model.geom_conaffinity[g]]
    corners = []
    for geom in solid:
        mesh = model.geom_dataid[geom]
        start = model.mesh_vertadr[mesh]
        vertices = model.mesh_vert[start : start + model.mesh_vertnum[mesh]]
        corners.append(vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    axes = rotation_from_quaternion_wxyz(model.body_iquat[1])
    [friction] = set(model.geom_friction[solid, 0])
    return Body(
        model.body_mass[1],
        model.body_ipos[1].copy(),
        axes @ np.diag(model.body_inertia[1]) @ axes.T,
        _box(corners),
        friction,
        None,
        len(solid),
    )


def in_pybullet(path: Path) -> Body:
    """Load a URDF with the inertia of the file, or an SDF, of which PyBullet takes neither inertia nor friction."""
    pybullet = pytest.importorskip("pybullet", reason="pybullet has no wheels for this Python")
    client = pybullet.connect(pybullet.DIRECT)
    try:
        if path.suffix == ".sdf":
            [body] = pybullet.loadSDF(str(path), physicsClientId=client)
        else:
            body = pybullet.loadURDF(str(path), flags=pybullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client)
        assert pybullet.getNumJoints(body, physicsClientId=client) == 0
        dynamics = pybullet.getDynamicsInfo(body, -1, physicsClientId=client)
        center, axes = np.array(dynamics[3]), _rotation_xyzw(dynamics[4])
        shapes = len(pybullet.getCollisionShapeData(body, -1, physicsClientId=client))
        inertia = axes @ np.diag(dynamics[2]) @ axes.T
        box = _touched_from_six_sides(pybullet, client, body, dynamics[3:5])
        return Body(dynamics[0], center, inertia, box, dynamics[1], dynamics[5], shapes)
    finally:
        pybullet.disconnect(client)


def in_sapien(path: Path, contact: tuple[float, float, float]) -> Body:
    """Load a URDF without its visuals, for which a renderer would be needed; ``contact`` as the export's README has it."""
    scene = sapien.Scene([sapien.physx.PhysxCpuSystem()])
    loader = scene.create_urdf_loader()
    loader.set_material(*contact)
    _, [builder], _ = loader.parse(str(path))
    builder.visual_records.clear()
    component = builder.build().find_component_by_type(sapien.physx.PhysxRigidDynamicComponent)
    pose = component.cmass_local_pose.to_transformation_matrix()
    corners = [
        (shape.vertices * shape.scale) @ shape.local_pose.to_transformation_matrix()[:3, :3].T + shape.local_pose.p
        for shape in component.collision_shapes
    ]
    material = component.collision_shapes[0].physical_material
    return Body(
        component.mass,
        pose[:3, 3],
        pose[:3, :3] @ np.diag(component.inertia) @ pose[:3, :3].T,
        _box(corners),
        material.static_friction,
        material.restitution,
        len(corners),
    )


def sdf_text(path: Path) -> Body:
    """Read what an SDF file says of mass, inertia and friction, as Gazebo would; the size is not looked at."""
    link = etree.parse(path).getroot().find("model/link")
    pose = np.array(link.findtext("inertial/pose").split(), float)
    assert not pose[3:].any()
    upper = [[float(link.findtext(f"inertial/inertia/i{min(a, b)}{max(a, b)}")) for b in "xyz"] for a in "xyz"]
    frictions = {float(e.text) for e in link.iterfind("collision/surface/friction/*/*")}
    [restitution] = {float(e.text) for e in link.iterfind("collision/surface/bounce/restitution_coefficient")}
    [friction] = frictions
    return Body(
        float(link.findtext("inertial/mass")), pose[:3], np.array(upper), np.zeros((2, 3)), friction, restitution,
        len(link.findall("collision")),
    )  # fmt: skip


def _touched_from_six_sides(pybullet: ModuleType, client: int, body: int, inertial_to_link: Any) -> np.ndarray:
    """Return the bounding box by the distances to walls: the corners are not told, and the engine's own boxes are loose."""
    pybullet.resetBasePositionAndOrientation(
        body, *inertial_to_link, physicsClientId=client
    )  # the link's frame is the world's
    cube = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.5] * 3, physicsClientId=client)
    wall = pybullet.createMultiBody(0, cube, physicsClientId=client)
    box = np.zeros((2, 3))
    for side, sign in enumerate((-1, 1)):
        for axis in range(3):
            pybullet.resetBasePositionAndOrientation(wall, sign * np.eye(3)[axis], [0, 0, 0, 1], physicsClientId=client)
            near = min(c[8] for c in pybullet.getClosestPoints(body, wall, 5.0, physicsClientId=client))
            box[side, axis] = sign * (0.5 - near - BULLET_MARGIN_M)
    return box


def _box(corners: list[np.ndarray]) -> np.ndarray:
    everything = np.concatenate(corners)
    return np.stack([everything.min(0), everything.max(0)])


def _rotation_xyzw(quaternion: tuple[float, ...]) -> np.ndarray:
    x, y, z, w = quaternion
    return rotation_from_quaternion_wxyz(np.array([w, x, y, z]))
