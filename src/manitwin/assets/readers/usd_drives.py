"""Damping, friction and limits of USD joints, from UsdPhysics drives and the schemas of PhysX, MuJoCo and Newton."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdPhysics

from manitwin.assets.readers.usd_masses import StageUnits
from manitwin.errors import AssetError
from manitwin.formats.meshes.source import MeshSource

_UNLIMITED = 1e15
_FASTEST = 1e6
"""PhysX's default for the largest joint velocity (PhysxJointAPI): limits from here on count as none."""
_NOT_OF_TWINS = (
    "physxJoint:armature", "newton:armature", "mjc:armature", "mjc:stiffness", "physxJoint:jointFriction",
)  # fmt: skip
"""Attributes that twins have no field for.

PhysX's jointFriction is a coefficient that scales with the joint force, not a friction force or torque.
"""


@dataclass(frozen=True)
class Drive:
    """Parameters of a joint in SI units; None: no limit.

    ``damping`` is in N m s/rad or N s/m, ``friction`` and ``effort`` in N m or N, ``velocity`` in rad/s or m/s.
    """

    damping: float = 0.0
    friction: float = 0.0
    effort: float | None = None
    velocity: float | None = None


def drive_of(prim: Usd.Prim, axis: str, units: StageUnits, source: MeshSource, *, slides: bool) -> Drive:
    """Return the parameters of a joint about ``axis`` (X, Y or Z), or along it if it ``slides``.

    A drive with neither stiffness nor a target velocity is a damper. Angles in USD are degrees, so damping is a torque for each
    degree per second. Values in MuJoCo's schema, and the effort that a converter from URDF notes, are in m, kg and rad.
    Attributes without a counterpart in twins are noted as a finding of ``source``. Sources: UsdPhysics schema, DriveAPI;
    PhysxSchema, PhysxJointAPI; MuJoCo's OpenUSD documentation, MjcJointAPI; newton-usd-schemas 0.6 and urdf-usd-converter 0.3,
    NewtonJointAPI.
    """
    force = units.kg * units.m if slides else units.kg * units.m**2  # of a force or a torque, without its 1/s^2
    way = units.m if slides else math.radians(1.0)

    def said(name: str) -> float | None:
        return _positive(prim, name, source)

    damping, effort, motor = None, None, False
    for name in ("linear" if slides else "angular", f"{'trans' if slides else 'rot'}{axis}"):
        if not prim.HasAPI(UsdPhysics.DriveAPI, name):
            continue
        drive = f"drive:{name}:physics"
        most, damps = said(f"{drive}:maxForce"), said(f"{drive}:damping")
        effort = effort if most is None else most * force
        if said(f"{drive}:stiffness") or prim.GetAttribute(f"{drive}:targetVelocity").Get():
            motor = True
        elif damps is not None:
            damping = damps * force / way
    newton, mujoco = said("newton:damping"), said("mjc:damping")
    damping = mujoco or (damping if newton is None else newton * force / way)
    rubs, resists = said("mjc:frictionloss"), said("newton:friction")
    fastest = said("physxJoint:maxJointVelocity") or said("newton:velocityLimit")
    effort = effort or said("urdf:limit:effort")
    if motor or any(said(name) is not None for name in _NOT_OF_TWINS):
        source.add_finding("motors, springs and armatures of its joints were left out: twins do not have them")
    return Drive(
        damping or 0.0,
        rubs or (0.0 if resists is None else resists * force),
        effort,
        None if fastest is None or fastest >= _FASTEST else fastest * way,
    )


def _positive(prim: Usd.Prim, name: str, source: MeshSource) -> float | None:
    """Return an authored number above 0; None if none is authored, or if it is so large that it means unlimited."""
    attribute = prim.GetAttribute(name)
    written = attribute.Get(Usd.TimeCode.EarliestTime()) if attribute and attribute.HasAuthoredValue() else None
    if written is None:
        return None
    if not isinstance(written, int | float) or math.isnan(written):
        raise AssetError(f"{source.path}: {attribute.GetPath()} is {str(written)[:40]!r}; give a number")
    value = float(str(np.float32(written)))  # the shortest decimal of the float32, as in ``authored_number``
    return value if 0 < value < _UNLIMITED else None
