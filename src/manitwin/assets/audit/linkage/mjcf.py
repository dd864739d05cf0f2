"""Parts and joints of an MJCF file, and the overlaps that MuJoCo finds at loading."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from manitwin.assets.asset_files import SHAPE_LIMITS, AssetFiles
from manitwin.assets.audit.linkage.linkage import Linkage, MovingJoint, Overlap
from manitwin.assets.audit.linkage.read import moving_joint, part_of, require_no_missing_mesh
from manitwin.assets.read import only_file
from manitwin.assets.readers.joint_elements import mjcf_joints
from manitwin.assets.readers.mjcf_document import MjcfSource, open_mjcf
from manitwin.assets.readers.mjcf_model import compile_mjcf
from manitwin.assets.readers.mjcf_shapes import BodyShapes
from manitwin.assets.root import root_of
from manitwin.errors import AssetError
from manitwin.geometry.poses import transform

GROUND = "the ground"
_GROUND_KINDS = (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))
_WORLD = 0


def read(path: Path, root: Path | None = None) -> Linkage:
    """Read the parts and joints of an MJCF file in world axes; raises AssetError.

    Bodies without a joint form one part with their parent. Overlaps are those of the initial configuration or keyframe with the
    smallest total depth.
    """
    file = only_file(path) if path.is_dir() else path
    files = AssetFiles(root or root_of(path), file.resolve().parent, SHAPE_LIMITS)
    source = open_mjcf(file, files)
    result = compile_mjcf(source, files)
    require_no_missing_mesh(files, file.name)
    model, data = result.model, mujoco.MjData(result.model)
    starts = [found for qpos in _starts(source, model) if (found := _overlaps(source, model, data, qpos)) is not None]
    if not starts:
        raise AssetError(f"{file.name}: MuJoCo finds no contacts of it that are finite numbers")
    mujoco.mj_resetData(model, data)
    mujoco.mj_kinematics(model, data)
    heads = list(dict.fromkeys(int(head) for head in model.body_weldid))
    shapes = BodyShapes(result, files)
    parts = tuple(
        part_of(
            _name(model, head),
            shapes.body_shapes(
                [(body, _pose(data, body)) for body in range(model.nbody) if model.body_weldid[body] == head]
            )[1],
        )
        for head in heads
    )
    joints = tuple(_joints(source, model, data, heads))
    return Linkage(parts, joints, min(starts, key=lambda found: sum(each.depth_m for each in found)))


def _starts(source: MjcfSource, model: Any) -> list[np.ndarray]:
    """Return the initial configurations of the file: that of its joints, and those of its keyframes."""
    return [np.array(model.qpos0), *(key for key in source.keys if len(key) == model.nq)]


def _overlaps(source: MjcfSource, model: Any, data: Any, qpos: np.ndarray) -> tuple[Overlap, ...] | None:
    mujoco.mj_resetData(model, data)
    data.qpos[:] = qpos
    mujoco.mj_fwdPosition(model, data)
    deepest: dict[tuple[str, str], float] = {}
    for contact in data.contact[: data.ncon]:
        geoms = [int(geom) for geom in contact.geom]
        if not np.isfinite(contact.dist):
            return None
        bodies = [int(model.geom_bodyid[geom]) for geom in geoms]
        if frozenset(model.body(body).name for body in bodies) in source.apart:
            continue
        ground = [int(model.geom_type[geom]) in _GROUND_KINDS for geom in geoms]
        names = [
            GROUND if plane else _name(model, int(model.body_weldid[body]))
            for plane, body in zip(ground, bodies, strict=True)
        ]
        key = (min(names), max(names)) if not any(ground) else (names[ground.index(False)], GROUND)
        deepest[key] = max(deepest.get(key, 0.0), -float(contact.dist))
    return tuple(Overlap(one, other, depth) for (one, other), depth in deepest.items() if depth > 0)


def _joints(source: MjcfSource, model: Any, data: Any, heads: list[int]) -> list[MovingJoint]:
    found = []
    for index, said in enumerate(mjcf_joints(model)):
        body = int(model.jnt_bodyid[index])
        parent = int(model.body_weldid[model.body_parentid[body]])
        pose = transform(np.eye(3), np.array(data.xanchor[index]))
        ends = (heads.index(parent), heads.index(int(model.body_weldid[body])))
        kind = said.kind if _can_collide(source, model, parent, body) else "fixed"
        made = moving_joint(said.name, kind, ends, pose, np.array(data.xaxis[index]), (said.lower, said.upper))
        found.append(_joint_at(made, float(model.qpos0[model.jnt_qposadr[index]])))
    return found


def _joint_at(joint: MovingJoint, start: float) -> MovingJoint:
    return MovingJoint(
        joint.name, joint.kind, joint.parent, joint.child, joint.point, joint.axis, start, joint.lower, joint.upper
    )


def _can_collide(source: MjcfSource, model: Any, parent: int, child: int) -> bool:
    """Return whether the file lets shapes of two parts collide, apart from the parent-child filter."""
    groups = [
        [b for b in range(model.nbody) if model.body_weldid[b] == model.body_weldid[head]] for head in (parent, child)
    ]
    named = [{model.body(b).name for b in group} for group in groups]
    if any(frozenset((one, other)) in source.apart for one in named[0] for other in named[1]):
        return False
    types, affinities = ([_bits(model, field, group) for group in groups] for field in ("contype", "conaffinity"))
    return bool((types[0] & affinities[1]) | (types[1] & affinities[0]))


def _bits(model: Any, field: str, bodies: list[int]) -> int:
    """Return the union of the bits in contype or conaffinity over all geoms of bodies."""
    values = getattr(model, f"geom_{field}")
    return int(
        np.bitwise_or.reduce([int(values[g]) for g in range(model.ngeom) if model.geom_bodyid[g] in bodies] or [0])
    )


def _name(model: Any, body: int) -> str:
    return "the world" if body == _WORLD else model.body(body).name or f"body_{body:02d}"


def _pose(data: Any, body: int) -> np.ndarray:
    return transform(np.array(data.xmat[body]).reshape(3, 3), np.array(data.xpos[body]))
