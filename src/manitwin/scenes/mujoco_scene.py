"""A scene in MuJoCo: bodies with their own mass properties, furniture of boxes, contacts as soft as MuJoCo's default."""

from __future__ import annotations

import mujoco
import numpy as np

from manitwin.geometry.poses import quaternion_wxyz
from manitwin.physics.mujoco.body import SOFT_SOLREF, contact_parameters
from manitwin.scenes.loaded_scene import Scene
from manitwin.scenes.sapien_scene import FURNITURE_FRICTION

TIMESTEP_S = 0.002


def to_mujoco(scene: Scene) -> mujoco.MjModel:
    """Return the model; the objects are bodies with a free joint of the same name, ``qpos0`` is the recorded scene.

    MuJoCo takes the larger friction of two that touch, where PhysX takes the mean.
    """
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.integrator = TIMESTEP_S, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    contact = contact_parameters(FURNITURE_FRICTION, SOFT_SOLREF)
    for box in scene.static_boxes():
        spec.worldbody.add_geom(
            name=box.name, type=mujoco.mjtGeom.mjGEOM_BOX, size=box.half_extents_m,
            pos=box.box_to_world[:3, 3], quat=quaternion_wxyz(box.box_to_world[:3, :3]), **contact,
        )  # fmt: skip
    known: dict[str, list[str]] = {}
    for placed in scene.placed_objects():
        body = placed.body
        if placed.twin_id not in known:
            known[placed.twin_id] = [f"{placed.twin_id}_{i:02d}" for i in range(len(body.hulls))]
            for name, hull in zip(known[placed.twin_id], body.hulls, strict=True):
                spec.add_mesh(name=name, uservert=np.asarray(hull, np.float32).ravel())
        thing = spec.worldbody.add_body(
            name=placed.name, pos=placed.object_to_world[:3, 3], quat=quaternion_wxyz(placed.object_to_world[:3, :3])
        )
        thing.add_freejoint(name=placed.name)
        thing.mass, thing.explicitinertial = body.mass_kg, True
        thing.ipos = body.center_of_mass_m
        thing.inertia, thing.iquat = body.principal_inertia
        friction = contact_parameters(body.friction_static, SOFT_SOLREF)
        for i, mesh in enumerate(known[placed.twin_id]):
            name = f"{placed.name}_{i:02d}"
            thing.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh, **friction)
    return spec.compile()
