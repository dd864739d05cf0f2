"""isaac_grasp export: the YAML of grasps that Isaac Sim's grasp editor, GraspDataGen's grasp_sim and GraspGen's tools read.

Sources: the Grasp Editor page of the Isaac Sim documentation (format_version, object_frame_link), GraspDataGen
docs/components/grasp-sim.md and ``GraspGuessBuffer.create_isaac_grasp_data`` (the full form), GraspGen
grasp_gen/dataset/eval_utils.py (the short form, a subset).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.grasp_rows import (
    ASSETS,
    GraspRows,
    GripperAsset,
    grasp_rows,
    parallel_gripper,
    parallel_grippers_of,
)
from manitwin.assets.writers.licenses import provenance_lines
from manitwin.assets.writers.mesh_files import object_mesh
from manitwin.errors import ExportError
from manitwin.geometry.poses import quaternion_wxyz

LEAST_CONFIDENCE = 0.001  # of a held grasp: readers take 0.0 as failed and skip it


def export(twin: TwinContent) -> Exported:
    """Write a grasp file for each parallel gripper, and the object's mesh in the object frame, +Z up.

    Confidence is the measured robustness, or the proposer's score where robustness was not measured; it is 0.0 for failed
    grasps. Poses are those of the link ``gripper_frame_link`` in the frame ``object_frame_link``; readers leave it to the user
    which prim that is. Raises ExportError for a twin without grasps of a parallel gripper.
    """
    grippers = parallel_grippers_of(twin)
    if not grippers:
        raise ExportError(
            f"{twin.name}: it has no grasps of a parallel gripper, which isaac_grasp is about alone; build it with one"
        )
    object_file = f"objects/{twin.name}.obj"
    files = {object_file: object_mesh(twin)}
    names = [ASSETS[gripper].name if gripper in ASSETS else gripper for gripper in grippers]
    for gripper, name in zip(grippers, names, strict=True):
        rows = grasp_rows(twin, gripper, controls=True)
        files[f"{name}/{twin.name}.yaml"] = "".join(_lines(twin, object_file, rows)).encode()
    unknown = [gripper for gripper in grippers if gripper not in ASSETS]
    return Exported(
        files=files,
        main=f"{names[0]}/{twin.name}.yaml",
        cannot_say=(
            "mass, inertia and friction of the object: grasp_sim takes them as arguments.",
            "why a grasp failed: the format has a confidence of 0.0.",
            *(
                f"poses of GraspGen's hand: its tools read this format too, but their hand closes along X, and these are of"
                f" {ASSETS[gripper].base_link}, which closes along Y. Turn them by a quarter about Z, or take graspgen."
                for gripper in grippers
                if gripper in ASSETS
            ),
            *(
                f"the model of {name}: its USD, links and joints are not known here, and the poses are of the grasp frame (+Z"
                " approach, X closing); grasp_sim needs --gripper_file, --finger_colliders and --grasp_file_cspace_position."
                for name in unknown
            ),
        ),
    )


def _lines(twin: TwinContent, object_file: str, rows: GraspRows) -> Iterator[str]:
    """Yield the lines of the file, held grasps first: readers take the joint names from the first grasp."""
    asset, dimensions = ASSETS.get(rows.gripper), parallel_gripper(rows.gripper)
    yield from (f"# {line}\n" for line in provenance_lines(twin.record))
    yield from _header(object_file, twin.name)
    if asset is not None and dimensions is not None:
        yield from _gripper_lines(asset, dimensions.opening_m, dimensions.tip_depth_m)
    yield "grasps:\n"
    poses = rows.gripper_to_object @ (asset.grasp_to_base if asset is not None else np.eye(4))
    quaternions_wxyz = quaternion_wxyz(poses[:, :3, :3])
    for i in np.concatenate([np.flatnonzero(rows.held), np.flatnonzero(~rows.held)]):
        w, *xyz = quaternions_wxyz[i].tolist()
        confidence = min(max(float(rows.quality[i]), LEAST_CONFIDENCE), 1.0) if rows.held[i] else 0.0
        yield f"  {_text(rows.ids[i])}:\n"
        yield f"    confidence: {_number(confidence)}\n"
        yield f"    position: {_row(poses[i, :3, 3])}\n"
        yield f"    orientation: {{w: {_number(w)}, xyz: {_row(xyz)}}}\n"
        if asset is not None and dimensions is not None:
            closed_m, open_m = float(rows.width_m[i]) / 2, dimensions.opening_m / 2
            for when, way_m in (("", closed_m), ("pregrasp_", open_m)):
                joints = ", ".join(f"{joint}: {_number(way_m)}" for joint in asset.finger_joints)
                yield f"    {when}cspace_position: {{{joints}}}\n"
                yield f"    {when}bite_point: {_row(_bite_point(asset, way_m, float(rows.depth_m[i])))}\n"


def _header(object_file: str, name: str) -> Iterator[str]:
    yield "format: isaac_grasp\n"
    yield "format_version: 1.0\n"  # a number, as Isaac Sim reads it
    yield "created_with: manitwin\n"
    yield f"object_frame_link: {_text(f'/World/{_prim_name(name)}')}\n"
    yield f"object_file: {_text(object_file)}\n"
    yield "object_scale: 1.0\n"


def _prim_name(name: str) -> str:
    """Return a valid name of a USD prim: letters, digits and underscores, not starting with a digit (USD glossary,
    identifiers).
    """
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return plain if plain and not plain[0].isdigit() else f"_{plain}"


def _gripper_lines(asset: GripperAsset, opening_m: float, tip_depth_m: float) -> Iterator[str]:
    yield f"gripper_file: {_text(asset.usd)}\n"
    yield f"gripper_frame_link: {asset.base_link}\n"
    yield f"open_limit: {asset.open_limit}\n"
    yield f"finger_colliders: [{', '.join(asset.finger_links)}]\n"
    yield f"base_length: {_number(tip_depth_m)}\n"
    yield "approach_axis: 2\n"
    yield f"bite_point: {_row(_bite_point(asset, opening_m / 2, tip_depth_m))}\n"
    yield "bite_body_idx: 1\n"  # the links in order: base, first finger, second finger


def _bite_point(asset: GripperAsset, way_m: float, depth_m: float) -> np.ndarray:
    """Return the centre of the first finger's pad (m) in the frame of the base link, for a finger travel of ``way_m``."""
    return way_m * np.array(asset.bite_axis) + depth_m * np.array([0.0, 0.0, 1.0])


def _row(values: Any) -> str:
    return f"[{', '.join(_number(float(value)) for value in values)}]"


def _number(value: float) -> str:
    """Format a float for YAML 1.1: ``1e-05`` without a point would be read as text (yaml.org/type/float.html)."""
    text = repr(value + 0.0)
    return text if "e" not in text or "." in text else text.replace("e", ".0e")


def _text(value: str) -> str:
    """Return a double-quoted scalar, so that no name is read as a number or a truth value."""
    return '"' + "".join(f"\\{c}" if c in '"\\' else c for c in value) + '"'
