"""Selection of the prims of the first articulated object in a USD stage, and of its joints that twins support."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from pxr import Sdf, Usd, UsdPhysics

from manitwin.assets.articulation import BodyNode, LinkTree, build_link_tree
from manitwin.assets.asset_files import MOST_NAMED, left_out_remarks, locked_joint_remarks
from manitwin.assets.joints import DeclaredJoint, Joints
from manitwin.assets.readers.usd_constraints import combined_constraint
from manitwin.assets.readers.usd_joints import StageJoint, declared_joint, name_of, stage_joints
from manitwin.assets.readers.usd_masses import StageUnits, body_of
from manitwin.assets.readers.usd_shapes import is_rendered, is_solid
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.usd_placed_prims import PlacedPrim

Body: TypeAlias = "Sdf.Path | None"
"""The path of a rigid body, or None for prims outside all rigid bodies, which are static."""


@dataclass(frozen=True)
class StageSelection:
    """The selected prims: the ``whole`` stage, or one articulated object; ``joints`` are all joints of the stage.

    ``moving`` is the joint tree, None if no joint is kept, with ``bodies`` and ``nodes`` in its order. ``partial``: other
    bodies were left out.
    """

    placed: tuple[PlacedPrim, ...]
    joints: tuple[DeclaredJoint, ...]
    whole: bool = True
    partial: bool = False
    bodies: tuple[Body, ...] = ()
    nodes: tuple[BodyNode, ...] = ()
    moving: LinkTree | None = None

    def node_of(self, placed: PlacedPrim) -> int:
        """Return the index of the node to which a prim belongs."""
        return self.bodies.index(path_of_body(placed))


def path_of_body(placed: PlacedPrim) -> Body:
    """Return the path of the rigid body to which a prim belongs, None for a static prim."""
    body = body_of(placed)
    return None if body is None else body.GetPath()


def select_bodies(
    stage: Usd.Stage, placed: Sequence[PlacedPrim], units: StageUnits, joints: Joints, source: MeshSource
) -> StageSelection:
    """Return the part of a stage that is read: all of it if no joint moves, or with ``joints="part"``.

    With "lock" and "keep" it is the first articulated object, in the pose of the stage; with "keep" including links and joints.
    Static prims belong to it if a joint names them, or connects a moving body to the world. Raises AssetError.
    """
    of_path = {each.prim.GetPath(): each for each in placed if not each.copy}
    found = stage_joints(placed, of_path, source)
    declared = tuple(declared_joint(joint, units) for joint in found)
    held = [joint for joint in found if joint.is_constraint]
    if joints == "part" or all(joint.kind == "fixed" for joint in held):
        return StageSelection(tuple(placed), declared)
    owned = [(each, path_of_body(each)) for each in placed]
    default = stage.GetDefaultPrim()
    world = default.GetPath() if default else Sdf.Path.absoluteRootPath
    joining = [joint for joint in held if all(joint.ends) or _anchors_static_prims(joint, owned, world)]
    fast = {_below(joint, world) for joint in joining} - {None}
    owned = [(each, body) for each, body in owned if body is not None or _is_below(each, fast)]
    groups = _joint_graph(joining, owned)
    solid = {body for each, body in owned if is_solid(each.prim)}
    moved = [joint for joint in joining if joint.kind != "fixed" and groups[joint.ends[0]] & solid]
    if not moved:
        return StageSelection(tuple(placed), declared)
    chosen = groups[moved[0].ends[0]]
    kept = [(each, body) for each, body in owned if body in chosen]
    left = _left_out(placed, {id(each) for each, _ in kept}, held)
    for sentence in left_out_remarks(left, "bodies and shapes"):
        source.add_finding(sentence)
    mine, within = tuple(each for each, _ in kept), [joint for joint in joining if joint.ends[0] in chosen]
    if joints == "lock":
        for sentence in locked_joint_remarks([joint.label() for joint in within if joint.kind != "fixed"]):
            source.add_finding(sentence)
        return StageSelection(mine, declared, whole=False, partial=bool(left))
    root = _root(list(dict.fromkeys(body for _, body in kept)), within, held, of_path)
    order, nodes, motions = _tree(root, within, kept, of_path, units, source)
    tree = build_link_tree(nodes)
    for sentence in tree.remarks:
        source.add_finding(sentence)
    moving = tree if tree.joints else None
    scale = np.diag([units.m] * 3 + [1.0])
    in_units = {body: np.linalg.inv(scale) @ motion @ scale for body, motion in zip(order, motions, strict=True)}
    mine = tuple(replace(each, to_world=in_units[body] @ each.to_world) for each, body in kept)
    return StageSelection(mine, declared, False, bool(left), tuple(order), tuple(nodes), moving)


def _below(joint: StageJoint, world: Sdf.Path) -> Body:
    """Return the prim below which static prims belong to a joint to the world; None if the joint holds none of them.

    A fixed joint that names no prim only anchors its body in the world.
    """
    if all(joint.ends):
        return None
    named = joint.named[joint.ends.index(None)]
    if named is not None:
        return named.GetPath()
    return None if joint.kind == "fixed" else world


def _anchors_static_prims(joint: StageJoint, owned: Sequence[tuple[PlacedPrim, Body]], world: Sdf.Path) -> bool:
    below = _below(joint, world)
    fast = (each for each, body in owned if body is None and is_solid(each.prim))
    return below is not None and any(_is_below(each, {below}) for each in fast)


def _is_below(placed: PlacedPrim, paths: Set[Body]) -> bool:
    return Sdf.Path.absoluteRootPath in paths or any(prim.GetPath() in paths for prim in placed.lineage())


def _joint_graph(joints: Sequence[StageJoint], owned: Sequence[tuple[PlacedPrim, Body]]) -> dict[Body, set[Body]]:
    """Return, for each body, the set of bodies that joints connect to it."""
    group: dict[Body, set[Body]] = {body: {body} for _, body in owned}
    for joint in joints:
        first, second = (group[end] for end in joint.ends)
        if first is not second:
            small, large = sorted((first, second), key=len)
            large |= small
            group.update(dict.fromkeys(small, large))
    return group


def _left_out(placed: Sequence[PlacedPrim], kept: Set[int], held: Sequence[StageJoint]) -> list[str]:
    """Return a remark for each body, or shape outside bodies, that does not belong to the object; ``kept`` are ids of prims."""
    moves = {end: joint for joint in held if joint.kind != "fixed" for end in joint.ends}
    left: dict[Body, str] = {}
    for each in placed:
        if id(each) in kept or not is_solid(each.prim):
            continue
        body = path_of_body(each)
        if body is None:
            left.setdefault(each.prim.GetPath(), f"shape {each.prim.GetName()!r} is of no rigid body")
        else:
            how = f"moves by joint {moves[body].label()}" if body in moves else "is joined to nothing that moves"
            left.setdefault(body, f"body {body.name!r} {how}")
    return list(left.values())


def _root(
    bodies: Sequence[Body],
    within: Sequence[StageJoint],
    held: Sequence[StageJoint],
    of_path: Mapping[Sdf.Path, PlacedPrim],
) -> Body:
    """Return the root body of the object.

    In order of priority: the static prims, a body fixed to the world, a declared articulation root, a body that is not the
    second body of any joint, the first body.
    """
    anchored = {end for joint in held if joint.kind == "fixed" and None in joint.ends for end in joint.ends}
    said = {body for body in bodies if body and of_path[body].prim.HasAPI(UsdPhysics.ArticulationRootAPI)}
    seconds = {joint.ends[1] for joint in within}
    first = [body for body in bodies if body not in seconds]
    for these in ({None}, anchored, said, set(first)):
        root = [body for body in bodies if body in these]
        if root:
            return root[0]
    return bodies[0]


def _tree(
    root: Body,
    joints: Sequence[StageJoint],
    kept: Sequence[tuple[PlacedPrim, Body]],
    of_path: Mapping[Sdf.Path, PlacedPrim],
    units: StageUnits,
    source: MeshSource,
) -> tuple[list[Body], list[BodyNode], list[np.ndarray]]:
    """Return the bodies, parents first, a node for each, and the correction ``(4, 4)`` of its pose.

    The correction moves a body from its pose in the stage to the pose that joints require, in the stage's axes and metres. A
    joint that would attach a body a second time closes a loop and is left out with a remark; of two such joints, the one
    excluded from the articulation.
    """
    seen = {body for each, body in kept if is_solid(each.prim) and is_rendered(each) and not each.is_hidden()}
    at: dict[Body, dict[Body, list[StageJoint]]] = {}
    for joint in joints:
        for body, other in (joint.ends, joint.ends[::-1]):
            at.setdefault(body, {}).setdefault(other, []).append(joint)
    place_of = {root: 0}
    order, used = [root], set()
    nodes, motions = [BodyNode(_body_name(root, joints, of_path), None, root in seen)], [np.eye(4)]
    for extra in (False, True):
        for body in order:  # grows by the bodies attached to it
            for other, between in at.get(body, {}).items():
                if other in place_of or (not extra and all(joint.is_extra for joint in between)):
                    continue
                joint, held = combined_constraint(between, body, of_path, units, source)
                holder = motions[place_of[body]]
                moves = None if held.joint is None else held.joint.moved(holder)
                nodes.append(
                    BodyNode(_body_name(other, joints, of_path), place_of[body], other in seen, moves, held.cause)
                )
                motions.append(holder @ held.motion)
                place_of[other] = len(order)
                order.append(other)
                used |= {each.prim.GetPath() for each in (between if held.cause else (joint,))}
    closing = [joint.label() for joint in joints if joint.prim.GetPath() not in used]
    for told in closing[:MOST_NAMED]:
        source.add_finding(f"joint {told} closes a loop and was left out")
    if len(closing) > MOST_NAMED:
        source.add_finding(f"{len(closing) - MOST_NAMED} more joints close loops and were left out")
    return order, nodes, motions


def _body_name(body: Body, joints: Sequence[StageJoint], of_path: Mapping[Sdf.Path, PlacedPrim]) -> str:
    """Return a body's name; for static prims, that of the prim which a joint names."""
    if body is not None:
        return name_of(of_path[body].prim)
    named = (joint.named[joint.ends.index(None)] for joint in joints if None in joint.ends)
    return next((name_of(prim) for prim in named if prim is not None), "world")
