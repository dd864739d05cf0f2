"""Requests to a user's own pose estimator for an object in a view."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh

from manitwin.errors import UsageError
from manitwin.formats.image_file import png_of
from manitwin.formats.label_picture import label_picture
from manitwin.models.pose_estimators.protocol import MOST_POSES, PROTOCOL, PoseEstimator, PoseRequest
from manitwin.render.raycast import merge_parts
from manitwin.scenes.locate.depth_view import DepthView, known_depth
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.twin.loaded_twin import Twin

MOST_NUMBER = 65535
"""The largest value of a 16-bit picture."""
UNITS_M = (0.0001, 0.001, 0.01)
"""Units of depth pictures, finest first; the first one in which all depths fit into 16 bits is used."""
MESH, VISUAL, DEPTH, MASK, RGB = "model.ply", "visual.glb", "depth.png", "mask.png", "rgb.png"


class ExternalEstimator:
    """Queries an estimator about twins in a view; ``model`` is the one that answered last."""

    def __init__(self, estimator: PoseEstimator, twin: Callable[[str], Twin], seed: int):
        """Store the estimator, a function that returns a twin by id, and the seed for requests."""
        self._estimator, self._twin, self._seed = estimator, twin, seed
        self.model: str | None = None

    def __call__(self, view: DepthView, mask: np.ndarray, model: PoseModel) -> np.ndarray:
        """Return its guesses ``object_to_camera (K, 4, 4)``; raises a BackendError for an invalid answer."""
        found = self._estimator.guess(pose_request(view, mask, model, self._twin(model.twin_id), self._seed))
        self.model = found.model
        return found.poses


def pose_request(view: DepthView, mask: np.ndarray, model: PoseModel, twin: Twin, seed: int) -> PoseRequest:
    """Return the request for the pose of the twin that ``mask (H, W) bool`` shows.

    Raises UsageError for depths that exceed a 16-bit picture.
    """
    depth = np.where(known_depth(view), view.depth_m, 0.0)
    unit_m = next((each for each in UNITS_M if depth.max() / each < MOST_NUMBER), None)
    if unit_m is None:
        raise UsageError(
            f"--estimator: depths of up to {depth.max():.0f} m do not fit into a 16-bit picture; give a view from"
            f" nearer"
        )
    shape = merge_parts(twin.visual)
    mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False).export(file_type="ply")
    assert isinstance(mesh, bytes)
    files = {
        MESH: mesh,
        VISUAL: twin.read_bytes(VISUAL),
        DEPTH: label_picture(np.rint(depth / unit_m)),
        MASK: label_picture(mask * 255),
    }
    if view.rgb is not None:
        files[RGB] = png_of(view.rgb)
    k, (height, width) = view.intrinsics, depth.shape
    document = {
        "protocol": PROTOCOL,
        "name": model.twin_id,
        "seed": seed,
        "most_poses": MOST_POSES,
        "camera": {
            "fx": float(k[0, 0]), "fy": float(k[1, 1]), "cx": float(k[0, 2]) - 0.5, "cy": float(k[1, 2]) - 0.5,
            "width": width, "height": height,
        },
        "depth_unit_m": unit_m,
        "diameter_m": model.diameter_m,
        "symmetries": model.symmetry_poses.tolist(),
        "files": {"mesh": MESH, "visual": VISUAL, "depth": DEPTH, "mask": MASK, "rgb": RGB if RGB in files else None},
    }  # fmt: skip
    return PoseRequest(document, files)
