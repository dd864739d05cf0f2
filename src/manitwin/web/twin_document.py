"""JSON document of a twin for the 3D view: points, hulls, grasps and placements in the object frame."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from manitwin.errors import TwinError
from manitwin.geometry.grasp_diversity import farthest_grasps
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.record import TwinRecord
from manitwin.web.gripper_shapes import gripper_shape

DOCUMENT = "viewer.json"
MOST_GRASPS = 1_000
"""Maximum number of grasps per gripper; a twin has about a hundred. More are not informative and slow the browser down."""
MOST_ROWS = 20_000
"""Maximum number of rows read from the grasp table."""
_DECIMALS_M, _DECIMALS = 5, 5
_ROD_SHARE, _ROD_M = 0.012, (0.0012, 0.004)


def twin_document(twin: Twin) -> dict[str, Any]:
    """Return the document. Unreadable parts of the twin are listed in ``unreadable``; the rest is included.

    Lengths in metres, quaternions wxyz. The columns of ``grasps[gripper]`` are ordered so that the first n are far from each
    other.
    """
    record, unreadable = twin.record, []
    document: dict[str, Any] = {"twin_id": record.twin_id, "model": None, "grasps": {}, "grippers": {}, "hulls": []}
    if record.physical is None:
        return {**document, "extents_m": None, "points": [], "placements": [], "unreadable": []}
    document["model"] = "visual.glb"
    document["extents_m"] = _rounded(record.physical.extents_m)
    document["center_of_mass_m"] = _rounded(record.physical.center_of_mass_m)
    try:
        document["hulls"] = [
            {"vertices": _rounded(np.asarray(hull.vertices).ravel()), "faces": np.asarray(hull.faces).ravel().tolist()}
            for hull in twin.hulls
        ]
    except TwinError as error:
        unreadable.append(str(error))
    document["points"] = _points(record)
    document["placements"] = [
        {
            "position_m": _rounded(each.position_m),
            "quaternion_wxyz": _rounded(each.quaternion_wxyz),
            "radius_m": each.collision_radius_m,
            "label": f"{each.probability:.0%}{', upright' if each.upright else ''}{'' if each.settled else ', not settled'}",
        }
        for each in record.placements or ()
    ]
    try:
        document |= _grasps(twin, max(record.physical.extents_m))
    except TwinError as error:
        unreadable.append(str(error))
    return {**document, "unreadable": unreadable}


def document_bytes(document: dict[str, Any]) -> bytes:
    """Return a document as ASCII JSON; equal documents give equal bytes."""
    return json.dumps(document, allow_nan=False, separators=(",", ":"), sort_keys=True).encode()


def _points(record: TwinRecord) -> list[dict[str, Any]]:
    if record.points is None:
        return []
    candidates = record.points.candidates
    found = [
        _point("candidate", f"c{number}", position, normal, f"candidate {number}")
        for number, (position, normal) in enumerate(zip(candidates.positions_m, candidates.normals, strict=False))
    ]
    for functional in record.points.functional:
        said = f"{functional.label}: {functional.description}"
        point = _point("functional", functional.id, functional.position_m, functional.normal, said)
        if functional.frame is not None:
            frame = functional.frame
            point["frame"] = {
                "position_m": _rounded(frame.position_m),
                "quaternion_wxyz": _rounded(frame.quaternion_wxyz),
                "size_m": frame.size_m,
                "label": f"{functional.label}: frame of the {frame.kind}",
            }
        found.append(point)
    for grasp in record.points.grasp:
        said = f"{grasp.type.replace('_', ' ')}: {grasp.scenario}"
        found.append(_point("grasp", grasp.id, grasp.position_m, grasp.normal, said))
    return found


def _point(kind: str, name: str, position: list[float], normal: list[float], label: str) -> dict[str, Any]:
    return {"kind": kind, "id": name, "position_m": _rounded(position), "normal": _rounded(normal), "label": label}


def _grasps(twin: Twin, longest_m: float) -> dict[str, Any]:
    """Return grasps and drawings of all grippers, without the unfiltered sample and the jittered controls."""
    table = twin.grasp_table().slice(0, MOST_ROWS).to_pydict()
    keep: dict[str, list[int]] = {}
    for row, (gripper, proposer) in enumerate(zip(table["gripper"], table["proposer"], strict=True)):
        if not proposer.endswith((":unfiltered", ":jittered")):
            keep.setdefault(gripper, []).append(row)
    rod = float(np.clip(_ROD_SHARE * longest_m, *_ROD_M))
    grasps, shapes = {}, {}
    for gripper, rows in keep.items():
        quaternions = np.array([table["quaternion_wxyz"][i] for i in rows], float).reshape(-1, 4)
        positions = np.array([table["position_m"][i] for i in rows], float).reshape(-1, 3)
        depths = np.array([table["depth_m"][i] for i in rows], float)
        if not (np.isfinite(quaternions).all() and np.isfinite(positions).all() and np.isfinite(depths).all()):
            raise TwinError(f"{twin.folder}: grasps.parquet has poses that are no finite numbers; build the twin again")
        poses = np.array(
            [transform(r, t) for r, t in zip(rotation_from_quaternion_wxyz(quaternions), positions, strict=True)]
        )
        order = _farthest_first_order(poses, depths)
        shapes[gripper] = gripper_shape(gripper, rod, float(np.median(depths)))
        chosen = [rows[i] for i in order]
        grasps[gripper] = {
            "total": len(rows),
            "id": [table["grasp_id"][i] for i in chosen],
            "position_m": _rounded(positions[order].ravel()),
            "quaternion_wxyz": _rounded(quaternions[order].ravel()),
            **{name: [_finite(table[name][i]) for i in chosen] for name in ("width_m", "depth_m", "robustness")},
            "outcome": [table["outcome"][i] for i in chosen],
            "retired": [bool(table["retired"][i]) for i in chosen],
        }
    return {"grasps": grasps, "grippers": shapes}


def _farthest_first_order(poses: np.ndarray, depths: np.ndarray) -> list[int]:
    """Return the grasps in farthest-first order."""
    first = [int(i) for i in farthest_grasps(poses, depths, min(len(poses) - 1, MOST_GRASPS))] if len(poses) > 1 else []
    last = [i for i in range(len(poses)) if i not in set(first)]
    return (first + last)[:MOST_GRASPS]


def _finite(value: float | None) -> float | None:
    return round(value, _DECIMALS) if value is not None and np.isfinite(value) else None


def _rounded(values: Any) -> list[float]:
    return [float(each) for each in np.round(np.asarray(values, float), _DECIMALS_M)]
