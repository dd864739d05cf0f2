"""Settling on a plane and ball drop in MuJoCo, which confirm that rest poses do not depend on a single solver.

Contacts have MuJoCo's default softness, as in a scene into which a twin is loaded. A round body that lies on a narrow facet
of its hulls stays there on stiff contacts (5 ms) and rolls off on these.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import quaternion_wxyz, transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.ball_drop import BALL_KG, BALL_SECONDS, BallDrop
from manitwin.physics.mujoco.body import (
    OBJECT,
    SOFT_SOLREF,
    STIFF_SOLREF,
    TIMESTEP_S,
    add_object,
    contact_parameters,
    new_spec,
)
from manitwin.physics.sapien.settle import SettledBody

PLANE_HALF_SIZE_M = 10.0
_BALL_FRICTION = 0.5
STILL_M_S, STILL_RAD_S = 1e-3, 1e-2


def settle_on_plane_in_mujoco(
    body: RigidBody,
    object_to_plane: Sequence[np.ndarray],
    *,
    drop_m: float,
    seconds: float,
    timestep_s: float = TIMESTEP_S,
) -> list[SettledBody]:
    """Release a body ``drop_m`` above the plane z = 0 in each of several poses ``(4, 4)`` and simulate for ``seconds`` each."""
    if not len(object_to_plane):
        return []
    model = _model(body, timestep_s)
    return [_settle(model, body, np.asarray(pose), drop_m, seconds) for pose in object_to_plane]


def _model(body: RigidBody, timestep_s: float) -> mujoco.MjModel:
    spec, contact = new_spec(timestep_s), contact_parameters(body.friction_static, SOFT_SOLREF)
    size = [PLANE_HALF_SIZE_M, PLANE_HALF_SIZE_M, 0.1]
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=size, contype=1, conaffinity=2, **contact)
    add_object(spec, body, contact)
    return spec.compile()


def _settle(model: mujoco.MjModel, body: RigidBody, pose: np.ndarray, drop_m: float, seconds: float) -> SettledBody:
    data = mujoco.MjData(model)
    address = model.joint(OBJECT).qposadr[0]
    data.qpos[address : address + 3] = pose[:3, 3] + [0, 0, drop_m]
    data.qpos[address + 3 : address + 7] = quaternion_wxyz(pose[:3, :3])
    mujoco.mj_step(model, data, round(seconds / model.opt.timestep))
    number = model.body(OBJECT).id
    end = transform(data.xmat[number].reshape(3, 3), data.xpos[number])
    speed = data.qvel[model.joint(OBJECT).dofadr[0] :][:6]
    still = np.linalg.norm(speed[:3]) < STILL_M_S and np.linalg.norm(speed[3:]) < STILL_RAD_S
    return SettledBody.of(body, pose, end, bool(still))


def ball_stays_inside_in_mujoco(hulls: Sequence[np.ndarray], opening: Opening) -> bool:
    """Drop a ball that fits into an opening and tell whether it ends inside (``BallDrop``)."""
    drop = BallDrop.of(hulls, opening)
    spec = new_spec(TIMESTEP_S)
    contact = contact_parameters(_BALL_FRICTION, STIFF_SOLREF)
    for number, hull in enumerate(hulls):
        name = f"wall_{number:02d}"
        spec.add_mesh(name=name, uservert=np.asarray(hull @ drop.turn.T, np.float32).ravel())
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, contype=1, conaffinity=2, **contact)
    ball = spec.worldbody.add_body(name=OBJECT, pos=drop.start_m)
    ball.add_freejoint(name=OBJECT)
    size = [drop.radius_m, 0, 0]
    ball.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE, size=size, mass=BALL_KG, contype=2, conaffinity=1, **contact | {"condim": 6}
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, round(BALL_SECONDS / TIMESTEP_S))
    return drop.is_inside(np.array(data.xpos[model.body(OBJECT).id]))
