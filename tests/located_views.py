"""Views of a brick on a table with something else beside it, and things found in them where they are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from grasped_twins import write_brick
from manitwin.geometry.poses import inverse
from manitwin.geometry.ray_caster import RayCaster
from manitwin.render.cameras import Camera, look_at, pixel_rays
from manitwin.render.raycast import cast_camera, merge_parts
from manitwin.scenes.locate.depth_noise import DepthNoise
from manitwin.scenes.locate.depth_view import DepthView, view_of_camera
from manitwin.scenes.locate.estimate import Location, PoseEstimate, Status
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.recognition import ViewedObject
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import Twin
from seen_solids import OPENGL_TO_OPENCV

SIDE_PX = 240
BESIDE_M = np.array([-0.03, 0.17, 0.0])
"""Where the other block's corner nearest to the origin is; it is 6 cm wide and deep, and 12 cm high."""
BLOCK_M = (0.06, 0.06, 0.12)


@dataclass(frozen=True)
class BrickView:
    """A twin of a brick, what a noisy camera sees of it (and of another block), its mask and true pose."""

    twin: Twin
    model: PoseModel
    view: DepthView
    mask: np.ndarray
    object_to_camera: np.ndarray

    def thing(self, *poses: np.ndarray) -> ViewedObject:
        """The brick, found at some poses."""
        estimates = tuple(PoseEstimate(pose, 0.95, 1.0) for pose in poses)
        status: Status = "none" if not poses else "found" if len(poses) == 1 else "ambiguous"
        location = Location(self.model.twin_id, status, estimates, 0.95, "", int(self.mask.sum()), 0.005)
        return ViewedObject(self.mask, location, self.model, ())


def brick_view(root: Path, *, block: bool = False) -> BrickView:
    """A brick on a table at the origin of its own frame, seen from 0.8 m away."""
    twin = Twin(root / twin_name(write_brick(root, 0)))
    model = PoseModel.of_twin(twin)
    own = merge_parts(twin.visual)
    beside = trimesh.creation.box(BLOCK_M)
    beside.apply_translation(BESIDE_M + np.array(BLOCK_M) / 2)
    mesh = trimesh.util.concatenate([own, beside]) if block else own
    eye = model.center + 0.8 * np.array([0.7, -0.2, 0.68])
    camera = Camera(look_at(eye, model.center), 0.6, SIDE_PX, SIDE_PX)
    depth, _, face = cast_camera(RayCaster(mesh), camera)
    origins, rays = pixel_rays(camera)
    table = (-origins[:, 2] / rays[:, 2]).reshape(depth.shape)
    noisy = DepthNoise().simulate_depth(np.where(depth > 0, depth, table), np.random.default_rng(1))
    mask = (face >= 0) & (face < len(own.faces))
    return BrickView(
        twin, model, view_of_camera(camera, noisy), mask, OPENGL_TO_OPENCV @ inverse(camera.camera_to_object)
    )
