"""Output files of a located scene: a layout that planners read, and its description."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.scenes.locate.located_objects import LocatedObject
from manitwin.scenes.locate.located_scene import LocatedScene
from manitwin.scenes.scene import SCENE
from manitwin.scenes.scene_files import CONFIG, scene_name, write_scene
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import RECORD, canonical_json

KIND = "located"


@dataclass(frozen=True)
class NoLayout:
    """The reason why a located view has no layout, if known before simulation."""

    reason: str


def dataset_of_twin(folder: Path) -> str | None:
    """Return the data set, or flat folder of twins, that contains a twin's folder; None if there is none."""
    place = folder.resolve()
    if not (place / RECORD).is_file():
        return None
    for root in (place.parents[2], place.parent) if len(place.parents) > 2 else (place.parent,):
        found = DatasetRoot(root)
        if found.has_twins and Path(found.full(found.twin_name(place.name))) == place:
            return str(root)
    return None


def write_layout(folder: Path, scene: LocatedScene, dataset: str) -> None:
    """Write ``config.json`` and the scene file below a folder, if there is a layout."""
    if scene.record is not None:
        config = {"kind": KIND, "dataset": dataset, "seed": scene.record.seed}
        (folder / CONFIG).write_text(canonical_json(config), encoding="utf-8")
        write_scene(scene.record, folder / scene_name(scene.record.scene_id))


def layout_document(scene: LocatedScene | NoLayout) -> dict[str, Any]:
    """Return the description of a layout as JSON values."""
    if isinstance(scene, NoLayout):
        nothing = dict.fromkeys(("base", "camera_to_world", "table", "obstacles", "left_out"))
        return {"scene": None, "reason": scene.reason, "objects": [], **nothing}
    record, world = scene.record, scene.world
    objects = [
        _object_document(each, moved_m, turned_rad, None)
        for each, (moved_m, turned_rad) in zip(scene.objects, scene.motions, strict=True)
    ] + [_object_document(each, None, None, why) for each, why in scene.as_boxes]
    return {
        "scene": None if record is None else f"{scene_name(record.scene_id)}/{SCENE}",
        "reason": "nothing stays where it was found" if record is None else "",
        "base": "given" if world.calibrated else "assumed",
        "camera_to_world": world.camera_to_world.round(7).tolist(),
        "table": {"height_m": round(world.table_m, 6), "lean_deg": round(float(np.rad2deg(world.lean_rad)), 3)},
        "objects": sorted(objects, key=lambda each: str(each["name"])),
        "obstacles": None if scene.furniture is None else len(scene.furniture.boxes) - 1,
        "left_out": scene.left_out,
    }


def _object_document(
    each: LocatedObject, moved_m: float | None, turned_rad: float | None, as_boxes: str | None
) -> dict[str, Any]:
    return {
        "name": each.placed.name,
        "twin_id": each.placed.twin_id,
        "placement": each.placement,
        "moved_m": None if moved_m is None else round(moved_m, 6),
        "turned_deg": None if turned_rad is None else round(float(np.rad2deg(turned_rad)), 3),
        "as_boxes": as_boxes,
    }
