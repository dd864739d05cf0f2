"""Joints of a USD stage (UsdPhysics): the bodies they connect, and the motion they allow."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Usd, UsdPhysics

from manitwin.assets.joints import DeclaredJoint
from manitwin.assets.readers.usd_masses import StageUnits, body_of
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.usd_placed_prims import PlacedPrim

_KINDS = (
    (UsdPhysics.RevoluteJoint, "revolute"),
    (UsdPhysics.PrismaticJoint, "prismatic"),
    (UsdPhysics.FixedJoint, "fixed"),
    (UsdPhysics.SphericalJoint, "spherical"),
    (UsdPhysics.DistanceJoint, "distance"),
)
_WAYS = ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")
"""Degrees of freedom of a joint of the base class; a LimitAPI of this name locks one if its low is above its high."""
AXES = {"X": np.array([1.0, 0, 0]), "Y": np.array([0, 1.0, 0]), "Z": np.array([0, 0, 1.0])}
NAME = 60


@dataclass(frozen=True)
class StageJoint:
    """One joint of a stage.

    ``kind`` is its type; for the base class it follows from its limits. ``named`` are the prims that the file names, and
    ``ends`` the bodies to which they belong, None for the world. ``axis`` is X, Y or Z of the joint frame. ``lower`` and
    ``upper`` are in degrees or lengths of the stage, as written. ``is_extra``: the joint is excluded from the articulation, as
    joints that close a loop are.
    """

    prim: Usd.Prim
    kind: str
    named: tuple[Usd.Prim | None, Usd.Prim | None]
    ends: tuple[Sdf.Path | None, Sdf.Path | None]
    axis: str
    lower: float
    upper: float
    is_extra: bool

    @property
    def name(self) -> str:
        """The name of the joint."""
        return name_of(self.prim)

    @property
    def is_constraint(self) -> bool:
        """Whether it constrains its bodies to each other; a distance joint, such as a rope, does not."""
        return self.kind != "distance"

    def label(self) -> str:
        """Return its name and kind for a remark."""
        return f"{self.name[:NAME]} ({self.kind})"


def name_of(prim: Usd.Prim) -> str:
    """Return a prim's display name, which converters write for names that are no valid identifier, or else its name."""
    return str(prim.GetDisplayName() or prim.GetName())


def stage_joints(
    placed: Sequence[PlacedPrim], of_path: Mapping[Sdf.Path, PlacedPrim], source: MeshSource
) -> list[StageJoint]:
    """Return the enabled joints of a stage that connect two different bodies, in stage order."""
    found = []
    for each in placed:
        if not each.prim.IsA(UsdPhysics.Joint):
            continue
        told = f"joint {each.prim.GetName()[:NAME]!r}"
        if each.copy:
            source.add_finding(f"{told} is repeated by a point instancer and was left out")
            continue
        if UsdPhysics.Joint(each.prim).GetJointEnabledAttr().Get() is False:
            source.add_finding(f"{told} is turned off (jointEnabled) and was left out")
            continue
        joint = _joint(each.prim, of_path)
        if isinstance(joint, str):
            source.add_finding(f"{told} {joint} and was left out")
        else:
            found.append(joint)
    return found


def _joint(prim: Usd.Prim, of_path: Mapping[Sdf.Path, PlacedPrim]) -> StageJoint | str:
    """Return a joint, or a phrase on why it connects nothing."""
    api = UsdPhysics.Joint(prim)
    named: list[Usd.Prim | None] = []
    ends: list[Sdf.Path | None] = []
    for relation in (api.GetBody0Rel(), api.GetBody1Rel()):
        targets = relation.GetTargets() if relation else []
        if len(targets) > 1:
            return "names several bodies for one of its ends"
        if targets and targets[0] not in of_path:
            return f"names {str(targets[0])[:NAME]}, which is not there"
        there = of_path[targets[0]] if targets else None
        body = None if there is None else body_of(there)
        named.append(None if there is None or there.prim.IsPseudoRoot() else there.prim)
        ends.append(None if body is None else body.GetPath())
    if ends[0] == ends[1]:
        return "has both its ends on one thing" if ends[0] is not None else "joins no rigid body"
    kind, axis, lower, upper = _motion_of(prim)
    extra = bool(api.GetExcludeFromArticulationAttr().Get())
    return StageJoint(prim, kind, (named[0], named[1]), (ends[0], ends[1]), axis, lower, upper, extra)


def _motion_of(prim: Usd.Prim) -> tuple[str, str, float, float]:
    """Return the kind of a joint, its axis, and its limits as written."""
    for schema, kind in _KINDS:
        if not prim.IsA(schema):
            continue
        if kind not in ("revolute", "prismatic"):
            return kind, "", -math.inf, math.inf
        joint = schema(prim)
        lower, upper = joint.GetLowerLimitAttr().Get(), joint.GetUpperLimitAttr().Get()
        return kind, str(joint.GetAxisAttr().Get()), float(lower), float(upper)
    free = []
    for way in _WAYS:
        limit = UsdPhysics.LimitAPI(prim, way)
        has = prim.HasAPI(UsdPhysics.LimitAPI, way)
        lower, upper = (limit.GetLowAttr().Get(), limit.GetHighAttr().Get()) if has else (-math.inf, math.inf)
        if not lower >= upper:
            free.append((way, float(lower), float(upper)))
    if not free:
        return "fixed", "", -math.inf, math.inf
    if len(free) > 1:
        return f"free in {len(free)} ways", "", -math.inf, math.inf
    way, lower, upper = free[0]
    return ("revolute" if way.startswith("rot") else "prismatic"), way[-1], lower, upper


def declared_joint(joint: StageJoint, units: StageUnits) -> DeclaredJoint:
    """Return a joint as the file declares it, with limits in radians or metres."""
    names = [name_of(prim) if prim is not None else "world" for prim in joint.named]
    moves = joint.kind in ("revolute", "prismatic")
    unit = unit_of(joint, units)
    axis = AXES.get(joint.axis, np.full(3, np.nan)) if moves else None
    lower, upper = (unit * joint.lower, unit * joint.upper) if moves else (None, None)
    return DeclaredJoint(joint.name, joint.kind, names[0], names[1], axis, lower, upper)


def unit_of(joint: StageJoint, units: StageUnits) -> float:
    """Return the unit of a joint's limits in m or rad."""
    return units.m if joint.kind == "prismatic" else math.radians(1.0)
