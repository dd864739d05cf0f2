"""What is written and printed of a location: plain values, and a folder with a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from manitwin.formats.image_file import png_of
from manitwin.formats.output_folder import new_folder
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.scenes.locate.depth_view import DepthView
from manitwin.scenes.locate.estimate import AMBIGUOUS_MARGIN, LEAST_SCORE, Location
from manitwin.scenes.locate.overlay import overlay
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import canonical_json

FRAME = "camera: x right, y down, z ahead (OpenCV); metres; quaternions wxyz"
LOCATION, OVERLAY = "location.json", "overlay.png"


def location_document(location: Location, twin: Twin, model: PoseModel) -> dict[str, Any]:
    """Return a location as JSON values: the answer, its poses, and what it was judged by."""
    symmetries = model.symmetries
    return {
        "status": location.status,
        "reason": location.reason,
        "twin_id": location.twin_id,
        "revision": twin.record.revision,
        "name": twin.record.name,
        "frame": FRAME,
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
        "symmetries": {
            "turns": sum(bool(np.linalg.det(motion) > 0) for motion in symmetries.motions),
            "axis": None if symmetries.axis is None else symmetries.axis.round(6).tolist(),
        },
    }


def write_location(
    out: Path, document: dict[str, Any], view: DepthView, mask: np.ndarray, model: PoseModel, location: Location
) -> None:
    """Write ``location.json`` and ``overlay.png`` into a new folder, whole or not at all; equal input gives equal bytes."""
    picture = overlay(view, mask, model, location.poses, location.tolerance_m)
    with new_folder(out) as folder:
        (folder / LOCATION).write_text(canonical_json(document), encoding="utf-8")
        (folder / OVERLAY).write_bytes(png_of(picture))
