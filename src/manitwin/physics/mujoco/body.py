"""Rigid bodies in MuJoCo: twins with their mass properties and friction, and boxes."""

from __future__ import annotations

import mujoco
import numpy as np

from manitwin.geometry.poses import quaternion_wxyz
from manitwin.geometry.rigid_body import RigidBody

TIMESTEP_S = 0.002
OBJECT = "object"
SOFT_SOLREF, STIFF_SOLREF = (0.02, 1.0), (0.005, 1.0)
"""``solref``: time constant (s) and damping ratio. MuJoCo's default, and a stiffer contact."""
TORSIONAL_FRICTION_M, ROLLING_FRICTION_M = 0.005, 1e-4  # MuJoCo's defaults


def contact_parameters(friction: float, solref: tuple[float, float]) -> dict[str, object]:
    """Return the geom attributes for a friction and stiffness. MuJoCo uses the larger friction of two touching geoms."""
    slide_spin_roll = [friction, TORSIONAL_FRICTION_M, ROLLING_FRICTION_M]
    return {"friction": slide_spin_roll, "condim": 4, "solref": list(solref)}


def add_hulls(spec: mujoco.MjSpec, name: str, body: RigidBody) -> list[str]:
    """Add the hulls of a body as meshes with the prefix ``name``, and return the mesh names for ``add_body``."""
    names = [f"{name}_{number:02d}" for number in range(len(body.hulls))]
    for mesh, hull in zip(names, body.hulls, strict=True):
        spec.add_mesh(name=mesh, uservert=np.asarray(hull, np.float32).ravel())
    return names


def add_body(
    spec: mujoco.MjSpec,
    name: str,
    body: RigidBody,
    meshes: list[str],
    contact: dict[str, object],
    *,
    object_to_world: np.ndarray | None = None,
    contact_types: tuple[int, int] = (1, 1),
) -> None:
    """Add a body of these meshes with a free joint of the same name; ``contact_types`` are ``contype`` and ``conaffinity``."""
    pose = np.eye(4) if object_to_world is None else object_to_world
    thing = spec.worldbody.add_body(name=name, pos=pose[:3, 3], quat=quaternion_wxyz(pose[:3, :3]))
    thing.add_freejoint(name=name)
    thing.mass, thing.explicitinertial = body.mass_kg, True
    thing.ipos = body.center_of_mass_m
    thing.inertia, thing.iquat = body.principal_inertia
    for number, mesh in enumerate(meshes):
        thing.add_geom(
            name=f"{name}_{number:02d}",
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=mesh,
            contype=contact_types[0],
            conaffinity=contact_types[1],
            **contact,
        )


def add_object(spec: mujoco.MjSpec, body: RigidBody, contact: dict[str, object]) -> None:
    """Add the body ``OBJECT``, which touches geoms of contact type 1 but not itself."""
    add_body(spec, OBJECT, body, add_hulls(spec, "hull", body), contact, contact_types=(2, 1))


def add_box(
    holder: mujoco.MjsBody,
    box_to_holder: np.ndarray,
    half_extents_m: np.ndarray,
    contact: dict[str, object],
    *,
    name: str = "",
    contact_types: tuple[int, int] = (1, 1),
) -> None:
    """Add a box geom at a pose ``(4, 4)`` in the frame of a body."""
    holder.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=box_to_holder[:3, 3],
        quat=quaternion_wxyz(box_to_holder[:3, :3]),
        size=half_extents_m,
        contype=contact_types[0],
        conaffinity=contact_types[1],
        **contact,
    )


def new_spec(timestep_s: float) -> mujoco.MjSpec:
    """Return an empty model with the implicitfast integrator and elliptic friction cones."""
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.integrator = timestep_s, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    return spec
