"""Visibility of one object in a picture, by ray casts at that object alone: its share, its boxes and its parts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.geometry.poses import inverse, transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.render.cameras import Camera, project
from manitwin.render.raycast import merge_parts
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.part_records import NO_PART, Part

NEAR_M = 0.01
"""The near plane of the cameras: nothing nearer is rendered."""

Box = tuple[int, int, int, int]
"""A box ``x, y, width, height`` in pixels; x and y may lie outside the picture."""


@dataclass(frozen=True)
class RaycastShape:
    """A twin's visual surface: a ray caster, its vertices ``(V, 3)`` and the part ``(F,)`` of each face.

    In the object frame, in metres. ``face_parts`` are indices into ``parts``; 255 (``NO_PART``) for none.
    """

    caster: RayCaster
    vertices_m: np.ndarray
    face_parts: np.ndarray
    parts: tuple[Part, ...]

    @classmethod
    def of_twin(cls, folder: Path) -> RaycastShape:
        """Read the shape of the twin in a folder; raises TwinError."""
        twin = Twin(folder)
        mesh = merge_parts(twin.visual)
        return cls(RayCaster(mesh), np.asarray(mesh.vertices), twin.face_parts(), tuple(twin.record.parts))


@dataclass(frozen=True)
class ObjectView:
    """The visibility of an object in one picture, in pixels.

    ``amodal_px`` counts its whole silhouette, without other objects and beyond the frame, up to one picture size on each side.
    ``amodal_in_frame_px`` of these lie in the frame, and ``visible_px`` are visible. Boxes are None if empty.
    """

    visible_px: int
    amodal_px: int
    amodal_in_frame_px: int
    visible_box: Box | None
    amodal_box: Box | None

    @property
    def visible_share(self) -> float:
        """The visible share of the silhouette: ``visib_fract`` of BOP."""
        return self.visible_px / self.amodal_px if self.amodal_px else 0.0

    @property
    def cut_by_frame(self) -> bool:
        """Whether the frame of the picture cuts the silhouette."""
        return self.amodal_in_frame_px < self.amodal_px

    def to_json(self) -> dict[str, Any]:
        """Return the view as JSON values, with the visible share and whether the frame cuts the silhouette."""
        return {
            "visible_px": self.visible_px,
            "amodal_px": self.amodal_px,
            "amodal_in_frame_px": self.amodal_in_frame_px,
            "visible_share": round(self.visible_share, 4),
            "cut_by_frame": self.cut_by_frame,
            "visible_box": self.visible_box,
            "amodal_box": self.amodal_box,
        }


@dataclass(frozen=True)
class Silhouette:
    """The silhouette of an object alone: ``amodal (H, W) bool`` in the frame, the face ``(H, W)`` at each pixel, -1 for none.

    ``amodal_px`` and ``box`` describe the whole silhouette, including what lies beyond the frame.
    """

    amodal: np.ndarray
    face: np.ndarray
    amodal_px: int
    box: Box | None


def silhouette_of(shape: RaycastShape, object_to_world: np.ndarray, camera: Camera) -> Silhouette:
    """Cast rays through all pixels that an object alone may cover; ``camera.camera_to_object`` is the pose in the world."""
    width, height = camera.width_px, camera.height_px
    left, top, right, bottom = _covered(shape, object_to_world, camera)
    columns, rows = np.meshgrid(np.arange(left, right) + 0.5, np.arange(top, bottom) + 0.5)
    seen = np.stack(
        [
            (columns - width / 2) / camera.focal_px,
            -(rows - height / 2) / camera.focal_px,
            -np.ones_like(columns),
        ],
        -1,
    ).reshape(-1, 3)
    camera_to_object = inverse(object_to_world) @ camera.camera_to_object
    directions = seen @ camera_to_object[:3, :3].T
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    origins = np.broadcast_to(camera_to_object[:3, 3], directions.shape)
    _, faces = shape.caster.first_hits(origins, directions / length)
    faces = faces.reshape(columns.shape)
    hit = faces >= 0
    face = np.full((height, width), -1, np.int64)
    first, last = (max(left, 0), max(top, 0)), (min(right, width), min(bottom, height))
    if first[0] < last[0] and first[1] < last[1]:
        found = faces[first[1] - top : last[1] - top, first[0] - left : last[0] - left]
        face[first[1] : last[1], first[0] : last[0]] = found
    box = box_of(hit)
    if box is not None:
        box = (box[0] + left, box[1] + top, box[2], box[3])
    return Silhouette(face >= 0, face, int(hit.sum()), box)


def view_of(silhouette: Silhouette, visible: np.ndarray) -> ObjectView:
    """Return the view of an object from its ``silhouette`` and its visible pixels, ``visible (H, W) bool``.

    Visible pixels count as silhouette too: at an edge, the ray casts and the rasterizer may differ by a pixel.
    """
    beyond = int((visible & ~silhouette.amodal).sum())
    return ObjectView(
        visible_px=int(visible.sum()),
        amodal_px=silhouette.amodal_px + beyond,
        amodal_in_frame_px=int(silhouette.amodal.sum()) + beyond,
        visible_box=box_of(visible),
        amodal_box=silhouette.box,
    )


def visible_parts(shape: RaycastShape, silhouette: Silhouette, visible: np.ndarray) -> np.ndarray:
    """Return the part ``(H, W) int`` at each visible pixel, as an index into ``shape.parts``; -1 for none."""
    parts = np.full(visible.shape, -1, np.int64)
    at = visible & silhouette.amodal
    found = shape.face_parts[silhouette.face[at]].astype(np.int64)
    parts[at] = np.where(found == NO_PART, -1, found)
    return parts


def box_of(mask: np.ndarray) -> Box | None:
    """Return the bounding box of the set pixels of ``(H, W) bool``; None if there are none."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    if not len(rows):
        return None
    return (
        int(columns[0]), int(rows[0]), int(columns[-1] - columns[0] + 1), int(rows[-1] - rows[0] + 1)
    )  # fmt: skip


def _covered(shape: RaycastShape, object_to_world: np.ndarray, camera: Camera) -> tuple[int, int, int, int]:
    """Return the pixel range ``left, top, right, bottom`` that an object may cover, up to one picture size beyond the frame."""
    width, height = camera.width_px, camera.height_px
    pixels, depth_m = project(transform_points(object_to_world, shape.vertices_m), camera)
    if not (depth_m > NEAR_M).any():
        return 0, 0, 0, 0
    if not (depth_m > NEAR_M).all():  # partly behind the camera, so it may project anywhere
        return -width, -height, 2 * width, 2 * height
    low, high = np.floor(pixels.min(0)).astype(int), np.ceil(pixels.max(0)).astype(int)
    left, top = np.clip(low, [-width, -height], [2 * width, 2 * height])
    right, bottom = np.clip(high, [-width, -height], [2 * width, 2 * height])
    return int(left), int(top), int(max(right, left)), int(max(bottom, top))
