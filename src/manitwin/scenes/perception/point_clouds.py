"""Point clouds of scenes: the pixels of all cameras in one cloud, with the ground truth of each point."""

from __future__ import annotations

import zlib
from collections.abc import Iterable

import numpy as np

from manitwin.geometry.poses import transform_points
from manitwin.scenes.perception.classes import Classes
from manitwin.scenes.perception.output import Output
from manitwin.scenes.perception.scene_truth import PictureTruth, SceneTruth
from manitwin.scenes.perception.splits import split_of

POINTS = 100_000


def write_point_clouds(
    scenes: Iterable[SceneTruth], classes: Classes, out: Output, *, validation_share: float, points: int = POINTS
) -> None:
    """Write ``<split>/<scene>.npz`` with at most ``points`` random pixels for each scene, and ``classes.json``.

    Pixels are drawn uniformly from all cameras. ``xyz_m (N, 3) f32`` and ``normal (N, 3) f32`` are in the world frame;
    ``rgb (N, 3) u8``; ``instance`` (the ids of ``pictures.json``; 0 for the floor), ``semantic`` and ``part`` (0 for none) are
    ``(N,) i32``. ``camera (N,) u8``, an index into ``cameras``, and ``pixel (N, 2) u16`` (column, row) give the source of each
    point.
    """
    for scene in scenes:
        clouds = [_cloud(number, scene, picture, classes) for number, picture in enumerate(scene.pictures)]
        cloud = {name: np.concatenate([each[name] for each in clouds]) for name in clouds[0]}
        total = len(cloud["xyz_m"])
        if total > points:
            rng = np.random.default_rng(zlib.crc32(scene.record.scene_id.encode()))
            kept = np.sort(rng.choice(total, points, replace=False))
            cloud = {name: values[kept] for name, values in cloud.items()}
        cloud["cameras"] = np.array([picture.name for picture in scene.pictures])
        out.write_arrays(f"{split_of(scene.record.scene_id, validation_share)}/{scene.record.scene_id}.npz", cloud)
    out.write_json("classes.json", {"semantic": classes.category_ids, "part": classes.part_ids})


def back_projected(depth_m: np.ndarray, intrinsics: np.ndarray, camera_to_world: np.ndarray) -> np.ndarray:
    """Return the world points ``(H, W, 3)`` of a depth picture ``(H, W)``; pixels of depth 0 give the camera position.

    In ``intrinsics (3, 3)`` the centre of the upper left pixel is (0.5, 0.5); ``camera_to_world (4, 4)`` uses OpenGL axes.
    """
    rows, columns = np.indices(depth_m.shape) + 0.5
    right = (columns - intrinsics[0, 2]) / intrinsics[0, 0]
    down = (rows - intrinsics[1, 2]) / intrinsics[1, 1]
    seen_m = np.stack([right, -down, -np.ones_like(right)], -1) * depth_m[..., None]
    return transform_points(camera_to_world, seen_m.reshape(-1, 3)).reshape(seen_m.shape)


def _cloud(number: int, scene: SceneTruth, picture: PictureTruth, classes: Classes) -> dict[str, np.ndarray]:
    at = picture.depth_m > 0
    rows, columns = np.nonzero(at)
    points_m = back_projected(picture.depth_m, picture.intrinsics, picture.camera.camera_to_object)
    return {
        "xyz_m": points_m[at].astype(np.float32),
        "normal": picture.normals[at].astype(np.float32),
        "rgb": picture.rgb[at],
        "instance": picture.ids[at].astype(np.int32),
        "semantic": classes.class_picture(scene, picture)[at].astype(np.int32),
        "part": classes.part_picture(scene, picture)[at].astype(np.int32),
        "camera": np.full(len(rows), number, np.uint8),
        "pixel": np.stack([columns, rows], -1).astype(np.uint16),
    }
