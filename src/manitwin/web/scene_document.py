"""JSON document of a scene for the 3D view: furniture, placed objects, and the robot's workspace."""

from __future__ import annotations

from typing import Any

import numpy as np

from manitwin.errors import ManiTwinError, TwinError, UsageError
from manitwin.robots.load import load_robot
from manitwin.robots.robot import Workspace
from manitwin.scenes.scene import Furniture, SceneRecord
from manitwin.twin.loaded_twin import Twin
from manitwin.web.links import Links
from manitwin.web.served_files import MODEL, TwinFolders

DOCUMENT = "scene_view.json"
COLORS = {"wood": "#b58b5a", "metal": "#9aa3ab", "marble": "#d6d4cf", "cloth": "#8c93b8"}
"""Furniture colours by material; rendered pictures of a scene use textures instead."""
PLAIN = "#b9b3a8"
_DECIMALS = 5


def scene_document(record: SceneRecord, twins: TwinFolders, links: Links) -> dict[str, Any]:
    """Return the document in metres, world frame, quaternions wxyz; ``unreadable`` lists what cannot be read.

    ``hulls`` are the collision hulls of each twin, by id, in its object frame; ``model`` is the URL of an object's mesh, None if
    its twin is missing.
    """
    hulls: dict[str, list[dict[str, Any]]] = {}
    found: dict[str, Twin] = {}
    unreadable = []
    for twin_id in sorted({each.twin_id for each in record.objects}):
        try:
            found[twin_id] = twins.twin(twin_id)
            hulls[twin_id] = _hulls(found[twin_id])
        except (TwinError, UsageError) as error:
            unreadable.append(str(error))
    objects = [
        {
            "name": each.name,
            "twin_id": each.twin_id,
            "label": f"{each.name}: {each.category}, {each.relation} {each.supported_by or each.surface}",
            "position_m": list(each.position_m),
            "quaternion_wxyz": list(each.quaternion_wxyz),
            "model": links.file(each.twin_id, MODEL, found[each.twin_id].record.revision)
            if each.twin_id in found
            else None,
        }
        for each in record.objects
    ]
    robot, problem = _robot(record.robot)
    return {
        "scene_id": record.scene_id,
        "furniture": furniture_boxes(record.furniture),
        "supports": [
            {
                "name": each.name,
                "center_m": [*each.center_m, each.height_m],
                "half_extents_m": list(each.half_extents_m),
            }
            for each in record.furniture.supports
        ],
        "robot": robot,
        "objects": objects,
        "hulls": hulls,
        "unreadable": [*unreadable, *([problem] if problem else [])],
    }


def furniture_boxes(furniture: Furniture) -> list[dict[str, Any]]:
    """Return the boxes of furniture: centre and half extents in metres, world frame, and a colour."""
    return [
        {
            "name": box.name,
            "center_m": list(box.center_m),
            "half_extents_m": list(box.half_extents_m),
            "color": COLORS.get(box.material, PLAIN),
        }
        for box in furniture.boxes
    ]


def _hulls(twin: Twin) -> list[dict[str, Any]]:
    return [
        {
            "vertices": [float(v) for v in np.round(np.asarray(hull.vertices, float).ravel(), _DECIMALS)],
            "faces": np.asarray(hull.faces).ravel().tolist(),
        }
        for hull in twin.hulls
    ]


def _robot(name: str | None) -> tuple[dict[str, Any] | None, str | None]:
    """Return the workspace of a robot, whose base is the world origin, or None with the reason if it is unavailable."""
    if name is None:
        return None, None
    try:
        space: Workspace = load_robot(name).workspace
    except ManiTwinError as error:
        return None, str(error)
    return {
        "name": name,
        "min_radius_m": space.min_radius_m,
        "max_radius_m": space.max_radius_m,
        "half_angle_rad": space.half_angle_rad,
    }, None
