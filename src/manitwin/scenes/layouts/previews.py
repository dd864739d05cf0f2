"""Rendering of layouts from their cameras: colour, depth, normals and instance ids."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from manitwin.errors import UsageError
from manitwin.formats.label_picture import label_picture
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.render.false_colors import depth_picture, id_color, ids_picture
from manitwin.render.scene_renderer import SceneFrame, SceneRenderer, ShadowRegion
from manitwin.scenes.furniture_pictures import add_furniture, render_lighting
from manitwin.scenes.perception.scene_truth import PICTURES_FACTS
from manitwin.scenes.perception.scene_views import intrinsics, scene_camera, scene_parts, views_and_parts
from manitwin.scenes.scene import SceneRecord
from manitwin.scenes.twin_surfaces import raycast_shape, twin_drawable

WEBP_QUALITY = 90
DEPTH_UNIT_M = 0.001
"""Depth is written in whole millimetres as by depth cameras: up to 65 m in 16 bits."""


def scene_pictures(
    record: SceneRecord, twin_folder: Callable[[str], Path], *, width_px: int, height_px: int
) -> tuple[dict[str, SceneFrame], dict[str, int]]:
    """Render a scene from each of its cameras; return the frames by camera and the ids by name.

    Objects have ids from 1 in the record's order, followed by the furniture's boxes. ``twin_folder`` returns a twin's folder by
    its id. Raises UsageError for a scene without cameras, RendererMissing, TwinError.
    """
    if not record.cameras:
        raise UsageError(f"scene {record.scene_id}: no cameras in its record; sample it again")
    shadows = ShadowRegion().for_pictures_of(max(width_px, height_px))
    with SceneRenderer(render_lighting(record.ambient, record.lights), shadows=shadows) as renderer:
        for thing in record.objects:
            pose = transform(rotation_from_quaternion_wxyz(np.array(thing.quaternion_wxyz)), np.array(thing.position_m))
            renderer.add(thing.name, twin_drawable(twin_folder(thing.twin_id), max(width_px, height_px)), pose)
        add_furniture(renderer, record.furniture, seed=zlib.crc32(record.scene_id.encode()))
        cameras = [scene_camera(each, width_px, height_px) for each in record.cameras]
        frames = renderer.render(cameras, geometry=True)
        ids = renderer.ids
    return dict(zip((each.name for each in record.cameras), frames, strict=True)), ids


def write_previews(
    record: SceneRecord, twin_folder: Callable[[str], Path], folder: Path, *, size_px: int
) -> list[Path]:
    """Write square pictures of a scene with their metadata; return the sorted files.

    For each camera: ``NAME_rgb.webp``; ``NAME_depth.png`` (16 bits, millimetres along the viewing axis, 0: nothing);
    ``NAME_normals.png`` (world frame, 8 bits: 255 (n + 1) / 2, black: nothing); ``NAME_ids.png`` (8 bits, 16 for more than 255
    ids; 0: floor and backdrop); ``NAME_depth_colors.png`` and ``NAME_ids_colors.png`` for viewing, with legends;
    ``NAME_parts.png``, the numbers of ``parts`` (0: none). ``pictures.json`` has the ids by name, their colours (RGB), the
    parts by number, and the cameras: ``camera_to_world`` (OpenGL axes: x right, y up, looking along -z), the size, ``K`` with
    the upper left pixel's centre at (0.5, 0.5), and the ``ObjectView`` of each object. Raises like ``scene_pictures``, and
    TwinError.
    """
    frames, ids = scene_pictures(record, twin_folder, width_px=size_px, height_px=size_px)
    folder.mkdir(parents=True, exist_ok=True)
    facts: dict[str, object] = {"scene_id": record.scene_id, "depth_unit_m": DEPTH_UNIT_M, "ids": ids}
    facts["colors_rgb"] = {name: id_color(number) for name, number in ids.items()}
    shapes = {each: raycast_shape(twin_folder(each)) for each in sorted({thing.twin_id for thing in record.objects})}
    parts = scene_parts(record, shapes)
    facts["parts"] = {str(number): part.to_json() for number, part in enumerate(parts, 1)}
    cameras: dict[str, object] = {}
    for each in record.cameras:
        camera = scene_camera(each, size_px, size_px)
        views, part_numbers = views_and_parts(record, shapes, parts, camera, frames[each.name].ids, ids)
        (folder / f"{each.name}_parts.png").write_bytes(label_picture(part_numbers))
        cameras[each.name] = {
            "camera_to_world": camera.camera_to_object.tolist(),
            "focal_px": camera.focal_px,
            "K": intrinsics(camera),
            "width_px": size_px,
            "height_px": size_px,
            "objects": {name: view.to_json() for name, view in views.items()},
        }
    facts["cameras"] = cameras
    called = {thing.name: f"{thing.name} {thing.category}" for thing in record.objects}
    names = {called.get(name, name): number for name, number in ids.items()}
    files = [path for name, frame in frames.items() for path in _write_frame(frame, folder, name, names)]
    (folder / PICTURES_FACTS).write_text(json.dumps(facts, indent=1) + "\n")
    files += [folder / f"{each.name}_parts.png" for each in record.cameras]
    return sorted([*files, folder / PICTURES_FACTS])


def _write_frame(frame: SceneFrame, folder: Path, name: str, ids_by_name: Mapping[str, int]) -> list[Path]:
    assert frame.depth_m is not None and frame.normals is not None and frame.ids is not None
    rgb, depth, normals, ids = (
        folder / f"{name}_{what}" for what in ("rgb.webp", "depth.png", "normals.png", "ids.png")
    )
    Image.fromarray(frame.rgb).save(rgb, quality=WEBP_QUALITY, method=4)
    millimetres = np.minimum(np.rint(frame.depth_m / DEPTH_UNIT_M), np.iinfo(np.uint16).max).astype(np.uint16)
    shown = np.where(frame.depth_m[..., None] > 0, np.rint(127.5 * (frame.normals + 1)), 0).astype(np.uint8)
    numbers = frame.ids if len(ids_by_name) > np.iinfo(np.uint8).max else frame.ids.astype(np.uint8)
    for path, image in ((depth, millimetres), (normals, shown[..., ::-1]), (ids, numbers)):
        path.write_bytes(cv2.imencode(".png", image)[1].tobytes())
    depth_colors, ids_colors = folder / f"{name}_depth_colors.png", folder / f"{name}_ids_colors.png"
    depth_picture(frame.depth_m, frame.ids).save(depth_colors)
    ids_picture(frame.ids, ids_by_name).save(ids_colors)
    return [rgb, depth, normals, ids, depth_colors, ids_colors]
