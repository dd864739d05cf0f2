"""Joints of a USD stage as constraints between bodies: frame, axis, position, limits, and whether twins support them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from pxr import Sdf, UsdPhysics
from scipy.spatial.transform import Rotation

from manitwin.assets.readers.declared_joints import Limits, immovable_reason, unsupported_joint_reason
from manitwin.assets.readers.usd_drives import drive_of
from manitwin.assets.readers.usd_joints import AXES, NAME, StageJoint, unit_of
from manitwin.assets.readers.usd_masses import StageUnits
from manitwin.assets.readers.usd_shapes import metric_transform
from manitwin.errors import AssetError
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.usd_placed_prims import PlacedPrim
from manitwin.geometry.articulation import ArticulatedJoint, axis_motion
from manitwin.geometry.poses import inverse, rotation_from_quaternion_wxyz, transform

_UNLIMITED = 1e15
_SHORTEST = 1e-9
_MEETS_M, _MEETS_RAD = 1e-4, 1e-3
"""Tolerances within which the two frames of a joint coincide: they have single precision, and often six digits."""
_SAME_LINE_M = 1e-3
"""Distance within which manually placed hinges count as coaxial."""
_MIMICS = ("PhysxMimicJointAPI", "NewtonMimicAPI")


@dataclass(frozen=True)
class JointConstraint:
    """How a joint holds a body: ``joint`` in the stage's axes, None if fixed or unsupported; then ``cause`` is the reason.

    ``motion (4, 4)`` moves the body from its pose in the stage to the pose that the joint requires, relative to its parent. The
    reason is empty for a fixed joint.
    """

    joint: ArticulatedJoint | None = None
    cause: str = ""
    motion: np.ndarray = field(default_factory=lambda: np.eye(4))


def combined_constraint(
    joints: Sequence[StageJoint],
    body: Sdf.Path | None,
    of_path: Mapping[Sdf.Path, PlacedPrim],
    units: StageUnits,
    source: MeshSource,
) -> tuple[StageJoint, JointConstraint]:
    """Return the joint among those between two bodies that holds the other one to ``body``, and how it does.

    A fixed joint overrides the others, and several coaxial hinges count as one. Other combinations cannot be kept. Raises
    AssetError for malformed joints.
    """
    joints = [joint for joint in joints if not joint.is_extra] or joints
    fixed = next((joint for joint in joints if joint.kind == "fixed"), None)
    first = joints[0] if fixed is None else fixed
    held = [
        _joint_constraint(joint, of_path, units, source, backward=joint.ends[1] == body)
        for joint in (first, *joints[1:])
    ]
    if fixed is None and any(not _allow_same_motion(held[0], each) for each in held[1:]):
        cause = f"{first.name[:NAME]!r} is one of {len(joints)} between two bodies, which twins do not have"
        return first, JointConstraint(cause=cause)
    return first, held[0]


def _allow_same_motion(first: JointConstraint, second: JointConstraint) -> bool:
    """Return whether two joints allow the same motion: rotation about the same line, or translation along the same direction."""
    one, other = first.joint, second.joint
    if one is None or other is None:
        return one is other and first.cause == second.cause
    apart = np.cross(one.axis, other.origin_m - one.origin_m) * (one.kind != "prismatic")
    slides = (one.kind == "prismatic", other.kind == "prismatic")
    return bool(
        slides[0] == slides[1]
        and np.linalg.norm(np.cross(one.axis, other.axis)) <= _MEETS_RAD
        and np.linalg.norm(apart) <= _SAME_LINE_M
    )


def _joint_constraint(
    joint: StageJoint, of_path: Mapping[Sdf.Path, PlacedPrim], units: StageUnits, source: MeshSource, *, backward: bool
) -> JointConstraint:
    """Return how a joint holds its second end to its first (``backward``: its first to its second), in m and rad.

    The joint position is that of the bodies in the stage, clipped to its limits. If the frames of the joint do not coincide in
    the stage, the body is moved to where a simulation would put it, with a remark. Raises AssetError for frames and limits that
    are not finite.
    """
    if joint.kind == "fixed":
        return JointConstraint(
            motion=_motion(joint, _frames(joint, of_path, units, source), np.eye(4), source, backward=backward)
        )
    schemas = [str(schema).partition(":")[0] for schema in joint.prim.GetPrimTypeInfo().GetAppliedAPISchemas()]
    mimics = any(schema in _MIMICS for schema in schemas)
    if cause := unsupported_joint_reason(joint.name, joint.kind, mimics=mimics):
        return JointConstraint(cause=cause)
    slides, axis, limits = joint.kind == "prismatic", AXES.get(joint.axis), _limits(joint, units, source)
    if axis is None or limits is None:
        return JointConstraint(cause=immovable_reason(joint.name, axis, limits))
    frames = _frames(joint, of_path, units, source)
    at, (lower, upper) = _joint_position(*frames, axis, slides=slides), limits
    if lower is not None and upper is not None:
        if not slides:  # angles are equal up to whole turns
            at += 2 * math.pi * round(((lower + upper) / 2 - at) / (2 * math.pi))
        at = min(max(at, lower), upper)
    moved = axis_motion(np.zeros(3), axis, at, slides=slides)
    drive = drive_of(joint.prim, joint.axis, units, source, slides=slides)
    holder = frames[1 if backward else 0]
    kept = ArticulatedJoint(
        name=joint.name,
        kind="prismatic" if slides else "continuous" if lower is None else "revolute",
        parent=0,
        child=0,
        origin_m=holder[:3, 3],
        axis=holder[:3, :3] @ (-axis if backward else axis),
        lower=lower,
        upper=upper,
        stands_at=at,
        damping=drive.damping,
        friction=drive.friction,
        effort=drive.effort,
        velocity=drive.velocity,
    )
    return JointConstraint(kept, motion=_motion(joint, frames, moved, source, backward=backward))


def _motion(
    joint: StageJoint, frames: tuple[np.ndarray, np.ndarray], moved: np.ndarray, source: MeshSource, *, backward: bool
) -> np.ndarray:
    """Return the correction ``(4, 4)`` of the held body, after which its joint frame is the other frame ``moved (4, 4)``."""
    first, second = frames
    held = second @ inverse(moved) @ inverse(first) if backward else first @ moved @ inverse(second)
    frame = first if backward else second
    apart_m = float(np.linalg.norm((held @ frame - frame)[:3, 3]))
    turned = float(Rotation.from_matrix(held[:3, :3]).magnitude())
    if apart_m <= _MEETS_M and turned <= _MEETS_RAD:
        return np.eye(4)
    source.add_finding(
        f"what joint {joint.name[:NAME]!r} holds was moved by {1000 * apart_m:.3g} mm and {math.degrees(turned):.3g} degrees,"
        " to where its frames and limits have it"
    )
    return held


def _limits(joint: StageJoint, units: StageUnits, source: MeshSource) -> Limits:
    """Return the limits in rad or m; (None, None) if either is unlimited, None for an empty range."""
    if math.isnan(joint.lower) or math.isnan(joint.upper):
        raise AssetError(
            f"{source.path}: the limits of joint {joint.prim.GetPath()} are {joint.lower} and {joint.upper}; give numbers,"
            " the lower one first"
        )
    if not joint.lower < joint.upper:
        return None
    beyond = (joint.lower <= -_UNLIMITED, joint.upper >= _UNLIMITED)
    if any(beyond):
        if not all(beyond):
            source.add_finding(
                f"joint {joint.name[:NAME]!r} has one limit, where twins have two or none: none was taken"
            )
        return None, None
    # the intended decimals: 0.45, not 0.44999998807907104
    lower, upper = (unit_of(joint, units) * float(str(np.float32(end))) for end in (joint.lower, joint.upper))
    return lower, upper


def _frames(
    joint: StageJoint, of_path: Mapping[Sdf.Path, PlacedPrim], units: StageUnits, source: MeshSource
) -> tuple[np.ndarray, np.ndarray]:
    first, second = (_frame(joint, end, of_path, units, source) for end in (0, 1))
    return first, second


def _frame(
    joint: StageJoint, end: int, of_path: Mapping[Sdf.Path, PlacedPrim], units: StageUnits, source: MeshSource
) -> np.ndarray:
    """Return the frame ``(4, 4)`` of a joint on one of its ends, in the stage's axes and metres.

    Its position is in the scaled axes of the prim, its rotation in the axes without scale; the frame of the world is that of
    the stage.
    """
    api, named = UsdPhysics.Joint(joint.prim), joint.named[end]
    place = api.GetLocalPos0Attr().Get() if end == 0 else api.GetLocalPos1Attr().Get()
    turn = api.GetLocalRot0Attr().Get() if end == 0 else api.GetLocalRot1Attr().Get()
    point, wxyz = np.array(place, float), np.array([turn.GetReal(), *turn.GetImaginary()], float)
    if not (np.isfinite(point).all() and np.isfinite(wxyz).all()):
        raise AssetError(
            f"{source.path}: localPos{end} or localRot{end} of joint {joint.prim.GetPath()} is not finite; give finite numbers"
        )
    to_world = (
        np.diag([units.m] * 3 + [1.0]) if named is None else metric_transform(of_path[named.GetPath()], units.m, source)
    )
    left, _, right = np.linalg.svd(to_world[:3, :3])
    axes = left @ right
    axes = axes if np.linalg.det(axes) > 0 else -axes  # as Gf factors a transform with a reflection
    rotation = rotation_from_quaternion_wxyz(wxyz) if np.linalg.norm(wxyz) > _SHORTEST else np.eye(3)
    return transform(axes @ rotation, to_world[:3, :3] @ point + to_world[:3, 3])


def _joint_position(first: np.ndarray, second: np.ndarray, axis: np.ndarray, *, slides: bool) -> float:
    """Return the position of the second frame of a joint relative to the first, along or about the axis, in m or rad."""
    if slides:
        return float((second[:3, 3] - first[:3, 3]) @ (first[:3, :3] @ axis))
    *vector, real = Rotation.from_matrix(first[:3, :3].T @ second[:3, :3]).as_quat()
    turn = 2 * math.atan2(float(np.array(vector) @ axis), float(real))
    return (turn + math.pi) % (2 * math.pi) - math.pi
