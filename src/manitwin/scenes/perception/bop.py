"""BOP format for pose estimation (github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from manitwin.geometry.poses import inverse
from manitwin.render.cameras import OPENGL_TO_OPENCV
from manitwin.scenes.loaded_scene import object_pose
from manitwin.scenes.perception.bop_models import MM, BopModel
from manitwin.scenes.perception.classes import Classes
from manitwin.scenes.perception.object_views import Box, RaycastShape, silhouette_of
from manitwin.scenes.perception.output import Output
from manitwin.scenes.perception.scene_truth import PictureTruth, SceneTruth
from manitwin.scenes.perception.splits import split_of

KIND = "pbr"  # BOP's term for rendered pictures
NO_BOX = [-1, -1, -1, -1]


def write_bop(
    scenes: Iterable[SceneTruth],
    classes: Classes,
    out: Output,
    *,
    twin_folder: Callable[[str], Path],
    validation_share: float,
) -> None:
    """Write ``models/``, ``camera.json`` and ``<split>_pbr/<scene>/`` with colours, depths, masks and ground truth.

    Objects are twins, numbered from 1 in the order of their ids; ``objects.json`` gives their ids and categories. Lengths are
    in millimetres, cameras have OpenCV's axes, and K has the centre of the upper left pixel at the origin.
    """
    categories = {thing.twin_id: thing.category for scene in scenes for thing in scene.record.objects}
    models = {twin_id: BopModel.of_twin(twin_folder(twin_id)) for twin_id in sorted(categories)}
    shapes = {twin_id: RaycastShape.of_twin(twin_folder(twin_id)) for twin_id in models}
    numbers = {twin_id: number for number, twin_id in enumerate(models, 1)}
    for twin_id, number in numbers.items():
        out.write_bytes(f"models/obj_{number:06d}.ply", models[twin_id].ply())
    out.write_json("models/models_info.json", {str(n): models[twin_id].info() for twin_id, n in numbers.items()})
    told = {str(n): {"twin_id": twin_id, "category": categories[twin_id]} for twin_id, n in numbers.items()}
    out.write_json("objects.json", told)
    for place, scene in enumerate(scenes):
        if place == 0:
            out.write_json("camera.json", _camera_of_all(scene.pictures[0]))
        split = split_of(scene.record.scene_id, validation_share)
        _write_scene(f"{split}_{KIND}/{place:06d}", scene, models, shapes, numbers, out)


def _write_scene(
    folder: str,
    scene: SceneTruth,
    models: dict[str, BopModel],
    shapes: dict[str, RaycastShape],
    numbers: dict[str, int],
    out: Output,
) -> None:
    cameras: dict[str, Any] = {}
    poses: dict[str, list[Any]] = {}
    infos: dict[str, list[Any]] = {}
    for place, picture in enumerate(scene.pictures):
        camera_from_world = OPENGL_TO_OPENCV @ inverse(picture.camera.camera_to_object)
        out.write_picture(f"{folder}/rgb/{place:06d}.jpg", Image.fromarray(picture.rgb), "JPEG")
        depth_mm = np.minimum(np.rint(picture.depth_m * MM), 65535)
        out.write_labels(f"{folder}/depth/{place:06d}.png", depth_mm)
        cameras[str(place)] = {
            "cam_K": bop_intrinsics(picture).ravel().tolist(),
            "depth_scale": 1.0,
            "cam_R_w2c": camera_from_world[:3, :3].ravel().tolist(),
            "cam_t_w2c": (camera_from_world[:3, 3] * MM).tolist(),
        }
        poses[str(place)], infos[str(place)] = [], []
        for number, thing in enumerate(scene.record.objects):
            model = models[thing.twin_id]
            model_to_camera = camera_from_world @ object_pose(thing) @ model.bop_to_object
            poses[str(place)].append(
                {
                    "obj_id": numbers[thing.twin_id],
                    "cam_R_m2c": model_to_camera[:3, :3].ravel().tolist(),
                    "cam_t_m2c": (model_to_camera[:3, 3] * MM).tolist(),
                }
            )
            visible = picture.ids == scene.ids[thing.name]
            amodal = silhouette_of(shapes[thing.twin_id], object_pose(thing), picture.camera).amodal | visible
            view = picture.views[thing.name]
            infos[str(place)].append(
                {
                    "bbox_obj": _box(view.amodal_box),
                    "bbox_visib": _box(view.visible_box),
                    "px_count_all": view.amodal_px,
                    "px_count_valid": int((amodal & (picture.depth_m > 0)).sum()),
                    "px_count_visib": view.visible_px,
                    "visib_fract": view.visible_share,
                }
            )
            out.write_labels(f"{folder}/mask/{place:06d}_{number:06d}.png", amodal * np.uint8(255))
            out.write_labels(f"{folder}/mask_visib/{place:06d}_{number:06d}.png", visible * np.uint8(255))
    out.write_json(f"{folder}/scene_camera.json", cameras)
    out.write_json(f"{folder}/scene_gt.json", poses)
    out.write_json(f"{folder}/scene_gt_info.json", infos)


def bop_intrinsics(picture: PictureTruth) -> np.ndarray:
    """Return ``K (3, 3)`` in the convention of BOP and OpenCV: (0, 0) is the centre of the upper left pixel."""
    intrinsics = picture.intrinsics.copy()
    intrinsics[:2, 2] -= 0.5
    return intrinsics


def _camera_of_all(picture: PictureTruth) -> dict[str, Any]:
    intrinsics = bop_intrinsics(picture)
    return {
        "cx": float(intrinsics[0, 2]),
        "cy": float(intrinsics[1, 2]),
        "depth_scale": 1.0,
        "fx": float(intrinsics[0, 0]),
        "fy": float(intrinsics[1, 1]),
        "height": picture.camera.height_px,
        "width": picture.camera.width_px,
    }


def _box(box: Box | None) -> list[int]:
    return NO_BOX if box is None else list(box)
