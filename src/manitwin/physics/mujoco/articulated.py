"""Articulated bodies in MuJoCo: model construction, and settling on a plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from manitwin.geometry.articulation import ArticulatedBody, ArticulatedJoint
from manitwin.geometry.poses import quaternion_wxyz, transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.mujoco.body import SOFT_SOLREF, TIMESTEP_S, contact_parameters, new_spec
from manitwin.physics.mujoco.settle import PLANE_HALF_SIZE_M, STILL_M_S, STILL_RAD_S

ROOT = "link_00"
"""Name of the root link's body and of its free joint."""


@dataclass(frozen=True)
class ArticulatedRest:
    """Resting state of an articulated body: pose of its root link and positions ``(J,)`` of its joints.

    ``moved_m`` and ``turned_rad`` are the motion of the root link from the pose in which it was set down. ``beyond`` is
    the largest violation of a joint limit, rad or m.
    """

    root_to_plane: np.ndarray
    positions: np.ndarray
    moved_m: float
    turned_rad: float
    beyond: float
    at_rest: bool


def add_articulated(spec: mujoco.MjSpec, body: ArticulatedBody, object_to_world: np.ndarray) -> None:
    """Add the links and named joints of a body to a model; links touch geoms of contact type 1, but not each other."""
    root = spec.worldbody.add_body(name=ROOT, pos=object_to_world[:3, 3], quat=quaternion_wxyz(object_to_world[:3, :3]))
    root.add_freejoint(name=ROOT)
    holders = [root]
    origins = [np.zeros(3)]
    _fill(spec, root, ROOT, body.links[0], origins[0])
    for joint in body.joints:
        name = f"link_{joint.child:02d}"
        link = holders[joint.parent].add_body(name=name, pos=joint.origin_m - origins[joint.parent])
        _add_joint(link, joint)
        _fill(spec, link, name, body.links[joint.child], joint.origin_m)
        holders.append(link)
        origins.append(joint.origin_m)


def _add_joint(link: mujoco.MjsBody, joint: ArticulatedJoint) -> None:
    limited = joint.lower is not None and joint.upper is not None
    link.add_joint(
        name=joint.name,
        type=mujoco.mjtJoint.mjJNT_SLIDE if joint.kind == "prismatic" else mujoco.mjtJoint.mjJNT_HINGE,
        axis=joint.axis,
        ref=joint.stands_at,
        limited=mujoco.mjtLimited.mjLIMITED_TRUE if limited else mujoco.mjtLimited.mjLIMITED_FALSE,
        range=[joint.lower, joint.upper] if limited else [0, 0],
        damping=joint.damping,
        frictionloss=joint.friction,
    )


def _fill(spec: mujoco.MjSpec, link: mujoco.MjsBody, name: str, body: RigidBody, origin_m: np.ndarray) -> None:
    """Give a link its mass properties and hulls; the link frame has its origin at ``origin_m`` and the object's axes."""
    link.mass, link.explicitinertial = body.mass_kg, True
    link.ipos = body.center_of_mass_m - origin_m
    link.inertia, link.iquat = body.principal_inertia
    contact = contact_parameters(body.friction_static, SOFT_SOLREF)
    for number, hull in enumerate(body.hulls):
        mesh = f"{name}_{number:02d}"
        spec.add_mesh(name=mesh, uservert=np.asarray(hull - origin_m, np.float32).ravel())
        link.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh, contype=2, conaffinity=1, **contact)


def settle_articulated(
    body: ArticulatedBody,
    object_to_plane: np.ndarray,
    *,
    drop_m: float,
    seconds: float,
    positions: Sequence[float] | None = None,
    timestep_s: float = TIMESTEP_S,
) -> ArticulatedRest:
    """Release a body with free joints ``drop_m`` above the plane z = 0 and simulate for ``seconds``.

    ``positions (J,)`` are the initial joint positions; None: those in which the body stands in its file.
    """
    spec = new_spec(timestep_s)
    spec.compiler.degree = False
    friction = contact_parameters(body.links[0].friction_static, SOFT_SOLREF)
    size = [PLANE_HALF_SIZE_M, PLANE_HALF_SIZE_M, 0.1]
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=size, contype=1, conaffinity=2, **friction)
    start = np.array(object_to_plane, float)
    start[2, 3] += drop_m
    add_articulated(spec, body, start)
    model = spec.compile()
    data = mujoco.MjData(model)
    places = [int(model.joint(joint.name).qposadr[0]) for joint in body.joints]
    data.qpos[places] = [joint.stands_at for joint in body.joints] if positions is None else positions
    mujoco.mj_forward(model, data)
    beyond = 0.0
    for _ in range(round(seconds / timestep_s)):
        mujoco.mj_step(model, data)
        ways = (abs(data.qpos[at] - joint.within(data.qpos[at])) for at, joint in zip(places, body.joints, strict=True))
        beyond = max(beyond, *ways, 0.0)
    number = model.body(ROOT).id
    end = transform(data.xmat[number].reshape(3, 3), data.xpos[number])
    cosine = (np.trace(start[:3, :3].T @ end[:3, :3]) - 1) / 2
    center = body.links[0].center_of_mass_m
    way = (end[:3, :3] @ center + end[:3, 3]) - (start[:3, :3] @ center + start[:3, 3] - [0, 0, drop_m])
    still = np.linalg.norm(data.qvel[:3]) < STILL_M_S and np.abs(data.qvel[3:]).max() < STILL_RAD_S
    return ArticulatedRest(
        end,
        np.array(data.qpos[places]),
        float(np.linalg.norm(way)),
        float(np.arccos(np.clip(cosine, -1, 1))),
        float(beyond),
        bool(still),
    )
