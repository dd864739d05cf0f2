"""Cityscapes format: label and instance pictures beside the colours (github.com/mcordts/cityscapesScripts)."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from PIL import Image

from manitwin.scenes.perception.classes import Classes
from manitwin.scenes.perception.output import Output
from manitwin.scenes.perception.scene_truth import PictureTruth, SceneTruth
from manitwin.scenes.perception.splits import split_of

INSTANCES_A_LABEL = 1000
MOST_LABELS = 65535 // INSTANCES_A_LABEL
"""Limit of a 16-bit ``instanceIds`` picture; with more labels, instance ids are written as 32-bit NumPy arrays."""


def write_cityscapes(scenes: Iterable[SceneTruth], classes: Classes, out: Output, *, validation_share: float) -> None:
    """Write ``leftImg8bit/<split>/<scene>/`` and ``gtFine/<split>/<scene>/``.

    ``*_labelIds.png`` has the class of each pixel, in 8 bits, or 16 for more than 255 classes. ``*_instanceIds.png`` is label *
    1000 + n for an object, n from 0, and the label alone for stuff (``.npz`` with 32 bits for more than 65 labels).
    ``*_partIds.png`` has the kind of part, 0 for none. ``labels.json`` names all of them.
    """
    for scene in scenes:
        split = split_of(scene.record.scene_id, validation_share)
        for picture in scene.pictures:
            name = f"{split}/{scene.record.scene_id}/{scene.record.scene_id}_{picture.name}"
            out.write_picture(f"leftImg8bit/{name}_leftImg8bit.png", Image.fromarray(picture.rgb), "PNG")
            labels = classes.class_picture(scene, picture)
            out.write_labels(f"gtFine/{name}_gtFine_labelIds.png", labels)
            instances = _instances(scene, picture, labels, classes)
            if len(classes.category_ids) <= MOST_LABELS:
                out.write_labels(f"gtFine/{name}_gtFine_instanceIds.png", instances)
            else:
                out.write_arrays(f"gtFine/{name}_gtFine_instanceIds.npz", {"instanceIds": instances.astype(np.int32)})
            out.write_labels(f"gtFine/{name}_gtFine_partIds.png", classes.part_picture(scene, picture))
    out.write_json("labels.json", {"labels": classes.category_ids, "parts": classes.part_ids})


def _instances(scene: SceneTruth, picture: PictureTruth, labels: np.ndarray, classes: Classes) -> np.ndarray:
    instances = labels.astype(np.int64)
    counted: dict[str, int] = {}
    for thing in scene.record.objects:
        number = counted.get(thing.category, 0)
        counted[thing.category] = number + 1
        label = classes.category_ids[thing.category]
        instances[picture.ids == scene.ids[thing.name]] = label * INSTANCES_A_LABEL + number
    return instances
