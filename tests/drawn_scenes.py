"""Two drawn scenes of made twins, one of which has parts: what data sets for perception are made of."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from manitwin.formats.npy_file import labels_to_npy
from manitwin.scenes.layouts.previews import write_previews
from manitwin.scenes.perception.scene_truth import PICTURES_FOLDER
from manitwin.scenes.scene import (
    SCENE_SCHEMA_VERSION,
    Furniture,
    Light,
    SceneCamera,
    SceneMeasures,
    SceneObject,
    SceneRecord,
    SurfaceBox,
)
from manitwin.scenes.scene_files import CONFIG, read_scene, scene_files, scene_name, write_scene
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.part_records import FACE_PARTS
from manitwin.twin.store import RECORD, write_twin_record
from scene_twins import bowl, can, slab, write_thing

SIZE_PX = 128
TABLE = SurfaceBox(name="board", center_m=(0.5, 0.0, -0.02), half_extents_m=(0.4, 0.5, 0.02), material="wood")
PLACES = (
    {"box": (0.45, -0.08, 0.0), "can": (0.52, 0.02, 0.0), "mixing bowl": (0.42, 0.14, 0.0)},
    {"can": (0.58, -0.05, 0.0), "box": (0.47, 0.0, 0.0), "mixing bowl": (0.72, 0.26, 0.0)},
)
"""Where things stand: the can of the second scene behind the box, its bowl where the picture ends."""


def write_drawn_scenes(root: Path) -> Path:
    """Write a data set at ``root/set`` and two drawn scenes of it at ``root/scenes``, which is returned."""
    scenes = write_scenes(root)
    for file in scene_files(scenes):
        pictures = file.parent / PICTURES_FOLDER
        write_previews(read_scene(file), lambda each: root / "set" / twin_name(each), pictures, size_px=SIZE_PX)
    return scenes


def write_scenes(root: Path) -> Path:
    """Write the data set and the two scenes without their pictures; returns ``root/scenes``."""
    dataset, scenes = root / "set", root / "scenes"
    things = (slab("box", 0.12, 0.08, 0.06, 0.3), can(), bowl())
    twins = {thing.category: write_thing(dataset, number, thing) for number, thing in enumerate(things)}
    add_parts(dataset / twin_name(twins["can"]), ("base", "lid"))
    for number, places in enumerate(PLACES):
        record = _record(number, places, twins)
        write_scene(record, scenes / scene_name(record.scene_id))
    (scenes / CONFIG).write_text(json.dumps({"kind": "layouts", "dataset": str(dataset)}))
    return scenes


def add_parts(folder: Path, names: tuple[str, str]) -> None:
    """Give a twin two parts: the lower and the upper half of its faces."""
    twin = Twin(folder)
    centers = np.concatenate([mesh.triangles_center for mesh in twin.visual])
    areas = np.concatenate([mesh.area_faces for mesh in twin.visual])
    labels = (centers[:, 2] > np.median(centers[:, 2]) - 1e-9).astype(np.uint8)
    (folder / FACE_PARTS).write_bytes(labels_to_npy(labels))
    record = json.loads((folder / RECORD).read_bytes())
    record["parts"] = [
        {
            "id": f"p{place}", "name": name, "source": "template:can", "confidence": 1.0,
            "faces": int((labels == place).sum()), "area_share": float(areas[labels == place].sum() / areas.sum()),
            "centroid_m": np.average(centers[labels == place], axis=0, weights=areas[labels == place]).tolist(),
        }
        for place, name in enumerate(names)
    ]  # fmt: skip
    del record["revision"], record["files"]
    write_twin_record(folder, record)


def _record(number: int, places: dict[str, tuple[float, float, float]], twins: dict[str, str]) -> SceneRecord:
    turn = 0.4 + number
    objects = tuple(
        SceneObject(
            name=f"object_{place:02d}", twin_id=twins[category], revision="r", category=category, placement=0,
            position_m=position, quaternion_wxyz=(float(np.cos(turn / 2)), 0.0, 0.0, float(np.sin(turn / 2))),
        )
        for place, (category, position) in enumerate(places.items())
    )  # fmt: skip
    return SceneRecord(
        schema_version=SCENE_SCHEMA_VERSION,
        scene_id=f"layout_0_{number:06d}",
        seed=0,
        number=number,
        robot=None,
        clutter="sparse",
        furniture=Furniture(kind="table", support_height_m=0.0, boxes=(TABLE,)),
        objects=objects,
        ambient=(0.3, 0.3, 0.3),
        lights=(Light(direction=(0.3, 0.2, -1.0), color=(2.0, 2.0, 1.9), casts_shadow=True),),
        cameras=(
            SceneCamera(name="front", position_m=(-0.2, 0.0, 0.25), target_m=(0.5, 0.0, 0.05), fov_y_rad=0.6),
            SceneCamera(name="above", position_m=(0.5, 0.05, 1.1), target_m=(0.5, 0.0, 0.0), fov_y_rad=0.5),
        ),
        measures=SceneMeasures(max_moved_m=0.0, max_turned_rad=0.0, max_penetration_m=0.0, min_gap_m=None),
        repairs=0,
    )
