"""A rigid body in MuJoCo: its hulls, and its own mass properties and friction."""

from __future__ import annotations

import mujoco
import numpy as np

from manitwin.geometry.rigid_body import RigidBody

OBJECT = "object"
SOFT_SOLREF, STIFF_SOLREF = (
    (0.02, 1.0),
    (0.005, 1.0),
)  # time constant (s) and damping ratio: MuJoCo's default, and stiffer
TORSIONAL_FRICTION_M, ROLLING_FRICTION_M = 0.005, 1e-4  # MuJoCo's own defaults


def contact_parameters(friction: float, solref: tuple[float, float]) -> dict[str, object]:
    """Return what geoms are given so that a contact has this friction and stiffness; MuJoCo takes the larger friction of two."""
    slide_spin_roll = [friction, TORSIONAL_FRICTION_M, ROLLING_FRICTION_M]
    return {"friction": slide_spin_roll, "condim": 4, "solref": list(solref)}


def add_object(spec: mujoco.MjSpec, body: RigidBody, contact: dict[str, object]) -> None:
    """Add the body, free to move; it touches geoms of contact type 1."""
    thing = spec.worldbody.add_body(name=OBJECT)
    thing.add_freejoint(name=OBJECT)
    thing.mass, thing.explicitinertial = body.mass_kg, True
    thing.ipos = body.center_of_mass_m
    thing.inertia, thing.iquat = body.principal_inertia
    for number, hull in enumerate(body.hulls):
        name = f"hull_{number:02d}"
        spec.add_mesh(name=name, uservert=np.asarray(hull, np.float32).ravel())
        thing.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, contype=2, conaffinity=1, **contact)
