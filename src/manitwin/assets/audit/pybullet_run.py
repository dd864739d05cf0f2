"""PyBullet simulations for the audit: a rigid body dropped on a plane, and a ball dropped into a vessel."""

from __future__ import annotations

import importlib
import io
import tempfile
from collections.abc import Sequence
from contextlib import redirect_stderr
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import inverse, quaternion_wxyz, transform, transform_points
from manitwin.geometry.rigid_body import RigidBody, principal_frame
from manitwin.physics.ball_drop import BALL_KG, BALL_SECONDS, BallDrop

GRAVITY_M_S2 = 9.81
_BALL_TIMESTEP_S = 1 / 480
STILL_M_S, STILL_RAD_S = 2e-3, 2e-2


def drop_in_pybullet(
    body: RigidBody, start: np.ndarray, drop_m: float, seconds: float, timestep_s: float
) -> tuple[np.ndarray, bool]:
    """Release a body above the plane z = 0; return its final pose ``(4, 4)``, and whether it is at rest.

    Poses are converted to and from the principal frame at the centre of mass, which is PyBullet's base frame of a body with its
    own inertial frame (PyBullet Quickstart Guide, ``resetBasePositionAndOrientation``).
    """
    pybullet = _quiet_import()
    moments, axes = principal_frame(body.inertia_kg_m2)
    principal_to_object = transform(axes, body.center_of_mass_m)
    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.setGravity(0, 0, -GRAVITY_M_S2, physicsClientId=client)
        pybullet.setTimeStep(timestep_s, physicsClientId=client)
        plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
        floor = pybullet.createMultiBody(0, plane, physicsClientId=client)
        number = _create_body(pybullet, client, body, principal_to_object)
        # the friction of a contact is the product of both
        pybullet.changeDynamics(floor, -1, lateralFriction=1.0, physicsClientId=client)
        pybullet.changeDynamics(
            number, -1, mass=body.mass_kg, localInertiaDiagonal=moments.tolist(), lateralFriction=body.friction_static,
            linearDamping=0.0, angularDamping=0.0, physicsClientId=client,
        )  # fmt: skip
        lifted = start.copy()
        lifted[2, 3] += drop_m
        pose = lifted @ principal_to_object
        pybullet.resetBasePositionAndOrientation(number, pose[:3, 3], _xyzw(pose), physicsClientId=client)
        for _ in range(round(seconds / timestep_s)):
            pybullet.stepSimulation(physicsClientId=client)
        position, xyzw = pybullet.getBasePositionAndOrientation(number, physicsClientId=client)
        linear, angular = pybullet.getBaseVelocity(number, physicsClientId=client)
    finally:
        pybullet.disconnect(client)
    turn = np.asarray(pybullet.getMatrixFromQuaternion(xyzw)).reshape(3, 3)
    end = transform(turn, np.asarray(position)) @ inverse(principal_to_object)
    rests = bool(np.linalg.norm(linear) < STILL_M_S and np.linalg.norm(angular) < STILL_RAD_S)
    return end, rests


def ball_stays_inside_in_pybullet(hulls: Sequence[np.ndarray], opening: Opening) -> bool:
    """Drop a ball that fits into an opening; return whether it enters and stays inside (``BallDrop``)."""
    pybullet, drop = _quiet_import(), BallDrop.of(hulls, opening)
    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.setGravity(0, 0, -GRAVITY_M_S2, physicsClientId=client)
        pybullet.setTimeStep(_BALL_TIMESTEP_S, physicsClientId=client)
        vessel = pybullet.createMultiBody(
            0, _create_hulls(pybullet, client, [hull @ drop.turn.T for hull in hulls]), physicsClientId=client
        )
        sphere = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=drop.radius_m, physicsClientId=client)
        ball = pybullet.createMultiBody(BALL_KG, sphere, basePosition=drop.start_m.tolist(), physicsClientId=client)
        for number in (vessel, ball):
            pybullet.changeDynamics(
                number, -1, lateralFriction=0.5, restitution=0.0, linearDamping=0.5, physicsClientId=client
            )
        for _ in range(round(BALL_SECONDS / _BALL_TIMESTEP_S)):
            pybullet.stepSimulation(physicsClientId=client)
        position, _ = pybullet.getBasePositionAndOrientation(ball, physicsClientId=client)
    finally:
        pybullet.disconnect(client)
    return drop.is_inside(np.asarray(position))


def _quiet_import() -> Any:
    """Import PyBullet without the line that it writes to standard error."""
    with redirect_stderr(io.StringIO()):
        return importlib.import_module("pybullet")


def _create_body(pybullet: Any, client: int, body: RigidBody, principal_to_object: np.ndarray) -> int:
    """Add a body whose shapes are given in its principal frame."""
    object_to_principal = inverse(principal_to_object)
    hulls = [transform_points(object_to_principal, hull) for hull in body.hulls]
    return int(pybullet.createMultiBody(body.mass_kg, _create_hulls(pybullet, client, hulls), physicsClientId=client))


def _create_hulls(pybullet: Any, client: int, hulls: Sequence[np.ndarray]) -> int:
    """Create a collision shape from hulls: PyBullet builds a hull from each group of an OBJ file."""
    lines, count = [], 0
    for index, hull in enumerate(hulls):
        mesh = trimesh.convex.convex_hull(hull)
        lines.append(f"o hull_{index}")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (mesh.faces + count + 1).tolist()]
        count += len(mesh.vertices)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "hulls.obj"
        file.write_text("\n".join(lines) + "\n")
        shape = pybullet.createCollisionShape(pybullet.GEOM_MESH, fileName=str(file), physicsClientId=client)
    if shape < 0:
        raise RuntimeError("PyBullet cannot make its collision shapes")
    return int(shape)


def _xyzw(pose: np.ndarray) -> np.ndarray:
    return np.asarray(np.roll(quaternion_wxyz(pose[:3, :3]), -1))
