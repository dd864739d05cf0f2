"""Output of localization: JSON values, and a folder with overlay pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.formats.image_file import png_of
from manitwin.formats.output_folder import new_folder
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.scenes.locate.depth_view import DepthView
from manitwin.scenes.locate.estimate import AMBIGUOUS_MARGIN, LEAST_SCORE
from manitwin.scenes.locate.layout_files import write_layout
from manitwin.scenes.locate.located_scene import LocatedScene
from manitwin.scenes.locate.overlay import overlay
from manitwin.scenes.locate.recognition import ViewedObject
from manitwin.scenes.locate.size_fit import SizeFit
from manitwin.scenes.locate.transferred_frames import TransferredFrame, TransferredPlacement, transfer_frames
from manitwin.scenes.locate.transferred_grasps import TransferredGrasps
from manitwin.scenes.perception.object_views import box_of
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import canonical_json

FRAME = "camera: x right, y down, z ahead (OpenCV); metres; quaternions wxyz"
LOCATION = "location.json"


def location_document(
    thing: ViewedObject,
    twin: Twin,
    carried: TransferredGrasps | None = None,
    estimator: str | None = None,
    placements: Sequence[TransferredPlacement] = (),
    size: SizeFit | None = None,
) -> dict[str, Any]:
    """Return a location as JSON values: the decision, its poses, its thresholds, and the usable annotations of the twin.

    ``placements`` are its resting poses, if requested; ``size`` is the fitted size; ``estimator`` names what guessed the poses
    in place of the search.
    """
    location, symmetries = thing.location, thing.model.symmetries
    return {
        "status": location.status,
        "reason": location.reason,
        "twin_id": location.twin_id,
        "revision": twin.record.revision,
        "name": twin.record.name,
        "frame": FRAME,
        "box": box_of(thing.mask),
        "size": None if size is None else _size(size),
        "poses": [
            {
                "position_m": pose.object_to_camera[:3, 3].round(6).tolist(),
                "quaternion_wxyz": quaternion_wxyz(pose.object_to_camera[:3, :3]).round(7).tolist(),
                "score": round(pose.score, 4),
                "visible_share": round(pose.visible_share, 4),
            }
            for pose in location.poses
        ],
        "best_score": round(location.best_score, 4),
        "least_score": LEAST_SCORE,
        "ambiguous_margin": AMBIGUOUS_MARGIN,
        "pixels": location.pixels,
        "tolerance_m": round(location.tolerance_m, 5),
        "estimator": estimator,
        "symmetries": {
            "turns": sum(bool(np.linalg.det(motion) > 0) for motion in symmetries.motions),
            "axis": None if symmetries.axis is None else symmetries.axis.round(6).tolist(),
        },
        "grasps": None if carried is None else _grasps(carried),
        "functional": [_frame(each) for each in transfer_frames(thing, twin, 1.0 if size is None else size.factor)],
        "placements": [_placement(each) for each in placements],
    }


def _size(size: SizeFit) -> dict[str, Any]:
    return {
        "factor": round(size.factor, 4),
        "low": round(size.low, 4),
        "high": round(size.high, 4),
        "shape_off_m": None if size.shape_off_m is None else round(size.shape_off_m, 5),
    }


def _pose(pose: np.ndarray) -> dict[str, Any]:
    return {
        "position_m": pose[:3, 3].round(6).tolist(),
        "quaternion_wxyz": quaternion_wxyz(pose[:3, :3]).round(7).tolist(),
    }


def _frame(each: TransferredFrame) -> dict[str, Any]:
    return {
        "id": each.point_id,
        "label": each.label,
        "kind": each.kind,
        **_pose(each.frame_to_camera),
        "size_m": None if each.size_m is None else round(each.size_m, 5),
        "certain": each.certain,
    }


def _placement(each: TransferredPlacement) -> dict[str, Any]:
    return {
        "placement": each.number,
        "probability": round(each.probability, 4),
        "upright": each.upright,
        **_pose(each.object_to_camera),
        "stands": each.stands,
        "free": each.free,
    }


def _grasps(carried: TransferredGrasps) -> dict[str, Any]:
    return {
        "gripper": carried.gripper,
        "verified": carried.verified,
        "obstructed": carried.obstructed,
        "uncertain": carried.uncertain,
        "robot": carried.robot,
        "reached": None if carried.robot is None else sum(bool(grasp.reached) for grasp in carried.grasps),
        "free": [
            {
                "grasp_id": grasp.grasp_id,
                "position_m": grasp.gripper_to_camera[:3, 3].round(6).tolist(),
                "quaternion_wxyz": quaternion_wxyz(grasp.gripper_to_camera[:3, :3]).round(7).tolist(),
                "width_m": round(grasp.width_m, 5),
                "value": round(grasp.value, 4),
                "reached": grasp.reached,
            }
            for grasp in carried.grasps
        ],
    }


def things_document(
    dataset: str,
    things: Sequence[tuple[ViewedObject, Twin]],
    carried: Sequence[TransferredGrasps | None],
    estimator: str | None = None,
    placements: Sequence[Sequence[TransferredPlacement]] = (),
) -> dict[str, Any]:
    """Return, for each object of a view, its twin in a data set, the twins tried for it, and its grasps."""
    return {
        "dataset": dataset,
        "things": [
            {
                **location_document(thing, twin, grasps, estimator, rests),
                "tried": [
                    {
                        "twin_id": each.twin_id,
                        "likeness": None if each.likeness is None else round(each.likeness, 4),
                        "score": round(each.score, 4),
                    }
                    for each in thing.tried
                ],
            }
            for (thing, twin), grasps, rests in zip(things, carried, placements or [()] * len(things), strict=True)
        ],
    }


def write_location(
    out: Path,
    document: dict[str, Any],
    view: DepthView,
    things: Sequence[ViewedObject],
    layout: tuple[LocatedScene, str] | None = None,
) -> None:
    """Write ``location.json``, an ``overlay_<n>.png`` for each object, and the layout into a new folder, atomically.

    ``layout`` is the located scene and the data set of its twins. Output is deterministic.
    """
    with new_folder(out) as folder:
        if layout is not None:
            write_layout(folder, *layout)
        (folder / LOCATION).write_text(canonical_json(document), encoding="utf-8")
        for place, thing in enumerate(things):
            picture = overlay(view, thing.mask, thing.model, thing.location.poses, thing.location.tolerance_m)
            (folder / f"overlay_{place}.png").write_bytes(png_of(picture))
