"""COCO format: instances and parts as run-length encoded masks, and panoptic pictures (cocodataset.org/#format-data)."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from typing import Any

import numpy as np
from PIL import Image
from pycocotools import mask as coco_mask

from manitwin.scenes.perception.classes import BACKGROUND, FURNITURE, STUFF, Classes
from manitwin.scenes.perception.object_views import box_of
from manitwin.scenes.perception.output import Output
from manitwin.scenes.perception.scene_truth import PictureTruth, SceneTruth
from manitwin.scenes.perception.splits import split_of

DESCRIPTION = "Made by manitwin segmentation; every mask is that of the rays through the pixels' centres."


def write_coco(scenes: Iterable[SceneTruth], classes: Classes, out: Output, *, validation_share: float) -> None:
    """Write ``images/``, ``annotations/instances_<split>.json`` and ``annotations/parts_<split>.json``.

    An annotation contains an object's visible pixels, with ``visible_share``, ``amodal_box`` and ``cut_by_frame`` in addition
    to COCO's fields; that of a part names the ``instance_id`` of its object.
    """
    names = [{"id": number, "name": name, "supercategory": "object"} for name, number in classes.category_ids.items()]
    parts = [
        {"id": number, "name": name, "supercategory": name.partition("/")[0]}
        for name, number in classes.part_ids.items()
    ]
    instances: dict[str, _Annotations] = defaultdict(lambda: _Annotations(names[: -len(STUFF)]))
    of_parts: dict[str, _Annotations] = defaultdict(lambda: _Annotations(parts))
    for number, (scene, picture) in enumerate(_pictures(scenes), 1):
        split = split_of(scene.record.scene_id, validation_share)
        image = _image(number, scene, picture, out)
        instances[split].images.append(image)
        of_parts[split].images.append(image)
        numbers = _add_instances(instances[split], number, scene, picture, classes)
        _add_parts(of_parts[split], number, scene, picture, classes, numbers)
    for split, found in instances.items():
        out.write_json(f"annotations/instances_{split}.json", found.to_json())
        out.write_json(f"annotations/parts_{split}.json", of_parts[split].to_json())


def write_panoptic(scenes: Iterable[SceneTruth], classes: Classes, out: Output, *, validation_share: float) -> None:
    """Write ``images/``, ``panoptic_<split>/`` (RGB, id = R + 256 G + 65536 B) and ``annotations/panoptic_<split>.json``.

    Objects are things; furniture and background, one segment each, are stuff. No pixel is void.
    """
    names = [
        {"id": number, "name": name, "supercategory": name if name in STUFF else "object", "isthing": int(name not in STUFF)}
        for name, number in classes.category_ids.items()
    ]  # fmt: skip
    found: dict[str, _Annotations] = defaultdict(lambda: _Annotations(names))
    for number, (scene, picture) in enumerate(_pictures(scenes), 1):
        split = split_of(scene.record.scene_id, validation_share)
        found[split].images.append(_image(number, scene, picture, out))
        segments, segment_of = _segments(scene, picture, classes)
        name = f"{scene.record.scene_id}_{picture.name}.png"
        ids = segment_of[picture.ids]
        rgb = np.stack([ids & 255, ids >> 8 & 255, ids >> 16 & 255], -1).astype(np.uint8)
        out.write_picture(f"panoptic_{split}/{name}", Image.fromarray(rgb), "PNG")
        found[split].annotations.append({"image_id": number, "file_name": name, "segments_info": segments})
    for split, each in found.items():
        out.write_json(f"annotations/panoptic_{split}.json", each.to_json())


class _Annotations:
    """The content of an annotation file under construction."""

    def __init__(self, categories: list[dict[str, Any]]):
        self.categories = categories
        self.images: list[dict[str, Any]] = []
        self.annotations: list[dict[str, Any]] = []

    def to_json(self) -> dict[str, Any]:
        """Return the file's content."""
        return {
            "info": {"description": DESCRIPTION},
            "licenses": [],
            "images": self.images,
            "annotations": self.annotations,
            "categories": self.categories,
        }


def run_length(mask: np.ndarray) -> dict[str, Any]:
    """Return COCO's compressed run-length encoding of a mask ``(H, W) bool`` as JSON values."""
    encoded = coco_mask.encode(np.asfortranarray(mask, dtype=np.uint8))
    return {"size": [int(side) for side in encoded["size"]], "counts": encoded["counts"].decode("ascii")}


def _pictures(scenes: Iterable[SceneTruth]) -> Iterable[tuple[SceneTruth, PictureTruth]]:
    for scene in scenes:
        for picture in scene.pictures:
            yield scene, picture


def _image(number: int, scene: SceneTruth, picture: PictureTruth, out: Output) -> dict[str, Any]:
    name = f"{scene.record.scene_id}_{picture.name}.jpg"
    out.write_picture(f"images/{name}", Image.fromarray(picture.rgb), "JPEG")
    return {
        "id": number,
        "file_name": name,
        "width": picture.camera.width_px,
        "height": picture.camera.height_px,
        "scene_id": scene.record.scene_id,
        "camera": picture.name,
    }


def _add_instances(
    to: _Annotations, image: int, scene: SceneTruth, picture: PictureTruth, classes: Classes
) -> dict[str, int]:
    """Add an annotation for each visible object; return their numbers by name."""
    numbers: dict[str, int] = {}
    for thing in scene.record.objects:
        view = picture.views[thing.name]
        annotation = _annotation(len(to.annotations) + 1, image, picture.ids == scene.ids[thing.name])
        if annotation is None:
            continue
        numbers[thing.name] = annotation["id"]
        to.annotations.append(
            {
                **annotation,
                "category_id": classes.category_ids[thing.category],
                "object": thing.name,
                "twin_id": thing.twin_id,
                "visible_share": round(view.visible_share, 4),
                "amodal_box": view.amodal_box,
                "cut_by_frame": view.cut_by_frame,
            }
        )
    return numbers


def _add_parts(
    to: _Annotations, image: int, scene: SceneTruth, picture: PictureTruth, classes: Classes, instances: dict[str, int]
) -> None:
    for number, part in scene.parts.items():
        annotation = _annotation(len(to.annotations) + 1, image, picture.parts == number)
        if annotation is not None:
            kind = classes.part_ids[f"{part.category}/{part.name}"]
            to.annotations.append({**annotation, "category_id": kind, "instance_id": instances[part.object]})


def _annotation(number: int, image: int, mask: np.ndarray) -> dict[str, Any] | None:
    box = box_of(mask)
    if box is None:
        return None
    return {
        "id": number,
        "image_id": image,
        "segmentation": run_length(mask),
        "area": int(mask.sum()),
        "bbox": list(box),
        "iscrowd": 0,
    }


def _segments(scene: SceneTruth, picture: PictureTruth, classes: Classes) -> tuple[list[dict[str, Any]], np.ndarray]:
    """Return the segments of a picture, and the segment of each id: things keep their ids, stuff follows."""
    most = int(max(picture.ids.max(), *scene.ids.values(), 0))
    segment_of = np.full(most + 1, most + 2, np.uint32)
    segment_of[0] = most + 1
    kinds = {most + 1: BACKGROUND, most + 2: FURNITURE}
    for thing in scene.record.objects:
        segment_of[scene.ids[thing.name]] = scene.ids[thing.name]
        kinds[scene.ids[thing.name]] = thing.category
    segments = []
    found = segment_of[picture.ids]
    for number in np.unique(found):
        mask = found == number
        segments.append(
            {
                "id": int(number),
                "category_id": classes.category_ids[kinds[int(number)]],
                "area": int(mask.sum()),
                "bbox": list(box_of(mask) or ()),
                "iscrowd": 0,
            }
        )
    return segments, segment_of
