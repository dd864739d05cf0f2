"""Views of a scene's objects and their parts from each camera."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from manitwin.render.cameras import Camera, look_at
from manitwin.scenes.loaded_scene import object_pose
from manitwin.scenes.perception.object_views import ObjectView, RaycastShape, silhouette_of, view_of, visible_parts
from manitwin.scenes.scene import SceneCamera, SceneRecord


@dataclass(frozen=True)
class ScenePart:
    """A part of an object in a scene: the object's name and category, the part's id in the twin, and the part's name."""

    object: str
    category: str
    part_id: str
    name: str

    def to_json(self) -> dict[str, Any]:
        """Return the part as JSON values."""
        return asdict(self)


def scene_camera(camera: SceneCamera, width_px: int, height_px: int) -> Camera:
    """Return a camera of a scene; its ``camera_to_object`` is its pose in the world."""
    pose = look_at(np.array(camera.position_m), np.array(camera.target_m))
    return Camera(pose, camera.fov_y_rad, width_px, height_px)


def intrinsics(camera: Camera) -> list[list[float]]:
    """Return ``K (3, 3)`` with axes x right, y down, z forward; the centre of the upper left pixel is (0.5, 0.5)."""
    focal_px = camera.focal_px
    return [[focal_px, 0.0, camera.width_px / 2], [0.0, focal_px, camera.height_px / 2], [0.0, 0.0, 1.0]]


def scene_parts(record: SceneRecord, shapes: Mapping[str, RaycastShape]) -> list[ScenePart]:
    """Return the parts of all objects of a scene, in the record's order; ``shapes`` are by twin id."""
    return [
        ScenePart(thing.name, thing.category, part.id, part.name)
        for thing in record.objects
        for part in shapes[thing.twin_id].parts
    ]


def views_and_parts(
    record: SceneRecord,
    shapes: Mapping[str, RaycastShape],
    parts: Sequence[ScenePart],
    camera: Camera,
    ids: np.ndarray | None,
    id_of: Mapping[str, int],
) -> tuple[dict[str, ObjectView], np.ndarray]:
    """Return the view of each object by name, and the part number at each pixel, ``(H, W)``, from 1; 0 for none.

    ``ids (H, W)`` is the picture of ids.
    """
    assert ids is not None
    first: dict[str, int] = {}
    for number, part in enumerate(parts, 1):
        first.setdefault(part.object, number)
    views: dict[str, ObjectView] = {}
    numbers = np.zeros(ids.shape, np.uint16)
    for thing in record.objects:
        shape, visible = shapes[thing.twin_id], ids == id_of[thing.name]
        silhouette = silhouette_of(shape, object_pose(thing), camera)
        views[thing.name] = view_of(silhouette, visible)
        seen = visible_parts(shape, silhouette, visible)
        numbers = np.where(seen >= 0, seen + first.get(thing.name, 0), numbers).astype(np.uint16)
    return views, numbers
