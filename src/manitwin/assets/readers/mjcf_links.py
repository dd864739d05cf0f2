"""Selection of the joints of an MJCF file that twins support."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from manitwin.assets.articulation import BodyNode, LinkTree, build_link_tree
from manitwin.assets.asset_files import AssetFiles
from manitwin.assets.readers.mjcf_shapes import is_solid
from manitwin.geometry.articulation import ArticulatedJoint, JointKind

_KINDS: dict[int, JointKind] = {
    int(mujoco.mjtJoint.mjJNT_HINGE): "revolute",
    int(mujoco.mjtJoint.mjJNT_SLIDE): "prismatic",
}


def moving_bodies(model: Any, bodies: list[tuple[int, np.ndarray]], files: AssetFiles) -> LinkTree | None:
    """Return the articulation tree of bodies with their poses, parents first; None if no joint is kept.

    Joints of the first body move the whole object and are not part of it.
    """
    place_of = {index: place for place, (index, _) in enumerate(bodies)}
    nodes: list[BodyNode] = []
    for index, pose in bodies:
        holder = place_of.get(int(model.body_parentid[index])) if nodes else None
        joint, cause = (None, "") if not nodes else _kept(model, index, pose)
        nodes.append(
            BodyNode(model.body(index).name or f"body_{index:02d}", holder, is_solid(model, index), joint, cause)
        )
    if not any(node.joint is not None or node.cause for node in nodes):
        return None
    found = build_link_tree(nodes)
    for remark in found.remarks:
        files.remark(remark)
    if found.joints and _has_springs(model, bodies):
        files.remark("springs and armatures of its joints were left out: twins do not have them")
    return found if found.joints else None


def _kept(model: Any, index: int, body_to_asset: np.ndarray) -> tuple[ArticulatedJoint | None, str]:
    """Return a body's joint in the asset's axes and "", or None and the reason; the reason is empty for a fixed body."""
    count, number = int(model.body_jntnum[index]), int(model.body_jntadr[index])
    if not count:
        return None, ""
    name = model.joint(number).name or f"joint_{number:02d}"
    if count > 1:
        return None, f"{name[:60]!r} is one of {count} of a body, which twins do not have"
    kind = _KINDS.get(int(model.jnt_type[number]))
    if kind is None:
        return None, f"{name[:60]!r} is a ball joint, which twins do not have"
    lower, upper = (float(end) for end in model.jnt_range[number]) if model.jnt_limited[number] else (None, None)
    stands_at = float(model.qpos0[model.jnt_qposadr[number]])
    if lower is not None and upper is not None and not lower < upper:
        return None, f"{name[:60]!r} cannot move: its limits leave it no way"
    if lower is not None and upper is not None and not lower <= stands_at <= upper:
        return None, f"{name[:60]!r} stands at {stands_at:.4g}, outside of its limits"
    dof = int(model.jnt_dofadr[number])
    return (
        ArticulatedJoint(
            name=name,
            kind="continuous" if kind == "revolute" and lower is None else kind,
            parent=0,
            child=0,
            origin_m=body_to_asset[:3, :3] @ np.array(model.jnt_pos[number]) + body_to_asset[:3, 3],
            axis=body_to_asset[:3, :3] @ np.array(model.jnt_axis[number]),
            lower=lower,
            upper=upper,
            stands_at=stands_at,
            damping=float(model.dof_damping[dof]),
            friction=float(model.dof_frictionloss[dof]),
        ),
        "",
    )


def _has_springs(model: Any, bodies: list[tuple[int, np.ndarray]]) -> bool:
    numbers = [int(model.body_jntadr[index]) for index, _ in bodies[1:] if model.body_jntnum[index]]
    dofs = [int(model.jnt_dofadr[number]) for number in numbers]
    return bool(np.any(model.jnt_stiffness[numbers]) or np.any(model.dof_armature[dofs]))
