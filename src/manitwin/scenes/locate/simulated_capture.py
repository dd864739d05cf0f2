"""Simulated capture of a rendered layout: true colours, depths with camera noise, and object masks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from manitwin.errors import UsageError, unknown_name_message
from manitwin.geometry.poses import inverse
from manitwin.render.cameras import OPENGL_TO_OPENCV
from manitwin.scenes.locate.capture_folder import Capture
from manitwin.scenes.locate.depth_noise import DepthNoise
from manitwin.scenes.perception.scene_truth import read_scene_truth
from manitwin.scenes.scene_files import scene_files

DEVICE = "rehearsal: a drawn layout with the noise of a depth camera"


def capture_of_scene(place: Path, camera: str, seed: int) -> Capture:
    """Return the simulated view of one camera of a scene; the robot's base is the origin of its world.

    Raises UsageError for a path that is not a single rendered scene, or lacks this camera.
    """
    files = scene_files(place)
    if len(files) != 1:
        raise UsageError(f"{place}: contains {len(files)} scenes; give the folder of one")
    truth = read_scene_truth(files[0])
    pictures = {each.name: each for each in truth.pictures}
    if camera not in pictures:
        raise UsageError(f"{place}: {unknown_name_message('camera', camera, pictures)}")
    picture, noise = pictures[camera], DepthNoise()
    intrinsics = np.array(picture.intrinsics, float)
    intrinsics[:2, 2] -= 0.5
    masks = {each.name: picture.ids == truth.ids[each.name] for each in truth.record.objects}
    return Capture(
        depth_m=noise.simulate_depth(picture.depth_m, np.random.default_rng(seed)),
        depth_unit_m=noise.step_m,
        intrinsics=intrinsics,
        rgb=picture.rgb,
        device=DEVICE,
        camera_to_base=inverse(OPENGL_TO_OPENCV @ inverse(picture.camera.camera_to_object)),
        masks={name: mask for name, mask in masks.items() if mask.any()},
    )
