"""Objects of a scene as questions need them: words, hulls at their poses, and their view in each picture."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
import trimesh
from scipy.spatial.distance import pdist

from manitwin.geometry.hull_distance import ConvexParts, PlacedParts
from manitwin.geometry.poses import inverse, transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.render.cameras import Camera, project
from manitwin.render.raycast import merge_parts
from manitwin.scenes.loaded_scene import object_pose
from manitwin.scenes.perception.object_views import ObjectView
from manitwin.scenes.perception.scene_truth import PictureTruth, SceneTruth
from manitwin.scenes.scene import SceneObject
from manitwin.scenes.vqa.nouns import noun_of
from manitwin.scenes.vqa.question import Point
from manitwin.scenes.vqa.visible_colors import is_color_visible, leading
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.part_records import Part

NAMED_SHARE, NAMED_PX = 0.40, 150
"""Least visible share and pixels of an object in a question; pixels are those of a picture of 512 x 512."""
HIDDEN_PX = 20
"""An object with at most this many visible pixels is not in the picture; one between the two limits is doubtful."""
REFERENCE_PX = 512

_SHARE = re.compile(r"^(?P<word>[a-z ]+?)(?: \((?P<percent>\d+) %\))?$")


@dataclass(frozen=True)
class TwinShape:
    """A twin's surface for ray casts and its hulls, in the object frame; shared by all scenes."""

    twin: Twin
    hulls: ConvexParts

    @classmethod
    def of_twin(cls, folder: Path) -> TwinShape:
        """Read a twin; raises TwinError."""
        twin = Twin(folder)
        return cls(twin, ConvexParts.of([np.asarray(hull.vertices) for hull in twin.hulls]))

    @cached_property
    def caster(self) -> RayCaster:
        """The ray caster of the whole visual surface."""
        return RayCaster(merge_parts(self.twin.visual))

    @cached_property
    def longest_m(self) -> float:
        """The diameter: the distance (m) of its two farthest points."""
        return float(pdist(self.hulls.whole).max())

    @cached_property
    def part_casters(self) -> dict[str, tuple[RayCaster, np.ndarray]]:
        """The ray caster of each part alone and its triangle corners ``(V, 3)``, by part id."""
        mesh, labels = merge_parts(self.twin.visual), self.twin.face_parts()
        found = {}
        for place, part in enumerate(self.twin.record.parts):
            alone = trimesh.Trimesh(mesh.vertices, mesh.faces[labels == place], process=False)
            found[part.id] = (RayCaster(alone), np.asarray(alone.triangles).reshape(-1, 3))
        return found


@dataclass(frozen=True)
class PosedObject:
    """An object at its pose: ``number`` is its id in pictures, ``color`` a certain colour word or None."""

    placed_as: SceneObject
    number: int
    shape: TwinShape
    pose: np.ndarray
    color: str | None

    @property
    def name(self) -> str:
        """The name in the scene."""
        return self.placed_as.name

    @property
    def category(self) -> str:
        """The category."""
        return self.placed_as.category

    @property
    def head(self) -> str:
        """The noun of the category: ``bottle`` for ``ketchup bottle``."""
        return noun_of(self.category)

    @property
    def parts(self) -> list[Part]:
        """The parts of the twin."""
        return self.shape.twin.record.parts

    @cached_property
    def placed_hulls(self) -> PlacedParts:
        """The hulls at the object's pose in the world."""
        return self.shape.hulls.at(self.pose)

    @cached_property
    def center_m(self) -> np.ndarray:
        """The centre of its bounding box in the world ``(3,)``."""
        low, high = self.placed_hulls.bounds
        return np.asarray((low + high) / 2)

    @property
    def longest_m(self) -> float:
        """The distance (m) of its two farthest points."""
        return self.shape.longest_m


@dataclass(frozen=True)
class ObjectInPicture:
    """The view of an object in a picture."""

    thing: PosedObject
    view: ObjectView
    picture: PictureTruth

    @cached_property
    def mask(self) -> np.ndarray:
        """The visible pixels ``(H, W) bool``."""
        return self.picture.ids == self.thing.number

    @cached_property
    def column(self) -> float:
        """The mean column of the visible pixels."""
        return float(np.nonzero(self.mask)[1].mean() + 0.5)

    @cached_property
    def columns(self) -> tuple[float, float]:
        """The first and the last column of the visible pixels."""
        columns = np.flatnonzero(self.mask.any(0))
        return float(columns[0]), float(columns[-1])

    @cached_property
    def inner(self) -> tuple[Point, float]:
        """The point of the picture deepest inside the visible pixels, and its depth (px)."""
        return inner_point(self.mask)

    @cached_property
    def color(self) -> str | None:
        """The object's colour word if it also leads on the visible surface; else None."""
        shape, camera = self.thing.shape, self.picture.camera
        color = self.thing.color
        if color is None or not self.mask.any():
            return None
        return color if is_color_visible(color, shape.twin, shape.caster, self.thing.pose, camera, self.mask) else None

    @property
    def scale(self) -> float:
        """The ratio of this picture's area to that of one of 512 x 512 pixels."""
        return self.picture.camera.width_px * self.picture.camera.height_px / REFERENCE_PX**2

    @property
    def is_clear(self) -> bool:
        """Whether a question may name the object."""
        return self.view.visible_share >= NAMED_SHARE and self.view.visible_px >= NAMED_PX * self.scale

    @property
    def is_hidden(self) -> bool:
        """Whether the picture does not show the object."""
        return self.view.visible_px <= HIDDEN_PX * self.scale


@dataclass(frozen=True)
class View:
    """A picture with its views of all objects."""

    picture: PictureTruth
    seen: tuple[ObjectInPicture, ...]

    @property
    def camera(self) -> Camera:
        """The camera."""
        return self.picture.camera

    @property
    def name(self) -> str:
        """The camera's name."""
        return self.picture.name

    @cached_property
    def clear_objects(self) -> list[ObjectInPicture]:
        """The objects that may be named."""
        return [each for each in self.seen if each.is_clear]

    @cached_property
    def is_sure(self) -> bool:
        """Whether each object is either clear or not in the picture, which counts and lists require."""
        return all(each.is_clear or each.is_hidden for each in self.seen)

    @cached_property
    def shows_all(self) -> bool:
        """Whether every object of the scene is clear, so that all possible obstacles are visible."""
        return all(each.is_clear for each in self.seen)

    def view_of_object(self, name: str) -> ObjectInPicture:
        """Return the view of an object."""
        return next(each for each in self.seen if each.thing.name == name)

    def pixel(self, point_m: np.ndarray) -> tuple[float, float, float]:
        """Return the column, row and depth (m) of a world point."""
        pixels, depth_m = project(np.asarray(point_m, float)[None], self.camera)
        return float(pixels[0, 0]), float(pixels[0, 1]), float(depth_m[0])


def posed_objects_of(scene: SceneTruth, shape_of: Callable[[str], TwinShape]) -> list[PosedObject]:
    """Return the objects of a scene; raises TwinError."""
    return [
        PosedObject(placed, scene.ids[placed.name], shape, object_pose(placed), sure_color(shape.twin))
        for placed in scene.record.objects
        for shape in (shape_of(placed.twin_id),)
    ]


def picture_views(scene: SceneTruth, things: list[PosedObject]) -> list[View]:
    """Return the pictures of a scene with their views of all objects."""
    return [
        View(picture, tuple(ObjectInPicture(thing, picture.views[thing.name], picture) for thing in things))
        for picture in scene.pictures
    ]


def sure_color(twin: Twin) -> str | None:
    """Return the leading colour word of a twin, such as ``dark green``; None if there is none."""
    if twin.record.language is None:
        return None
    found: list[tuple[str, float]] = []
    for text in twin.record.language.color.split(", "):
        match = _SHARE.match(text)
        if match is None or "unknown" in text:
            return None
        found.append((match["word"], int(match["percent"] or 100)))
    return leading(found)


def inner_point(mask: np.ndarray) -> tuple[Point, float]:
    """Return the pixel centre deepest inside a mask ``(H, W) bool``, in shares of its size, and its depth (px).

    The border of the picture counts as a border of the mask, since nothing is known beyond it.
    """
    padded = np.pad(mask.astype(np.uint8), 1)
    depth = cv2.distanceTransform(padded, cv2.DIST_L2, 3)[1:-1, 1:-1]
    row, column = np.unravel_index(int(depth.argmax()), depth.shape)
    height, width = mask.shape
    return ((float(column) + 0.5) / width, (float(row) + 0.5) / height), float(depth.max())


def part_alone_px(thing: PosedObject, part: Part, camera: Camera, step_px: int = 2) -> float:
    """Return approximately how many pixels a part alone would cover, by ray casts at every ``step_px``-th pixel."""
    caster, corners = thing.shape.part_casters[part.id]
    pixels, depth_m = project(transform_points(thing.pose, corners), camera)
    if not (depth_m > 0).all():
        return 0.0
    low = np.clip(np.floor(pixels.min(0)), 0, [camera.width_px, camera.height_px])
    high = np.clip(np.ceil(pixels.max(0)), 0, [camera.width_px, camera.height_px])
    columns, rows = np.meshgrid(np.arange(low[0], high[0], step_px) + 0.5, np.arange(low[1], high[1], step_px) + 0.5)
    directions = np.stack(
        [
            (columns - camera.width_px / 2) / camera.focal_px,
            -(rows - camera.height_px / 2) / camera.focal_px,
            -np.ones_like(columns),
        ],
        -1,
    ).reshape(-1, 3)
    if not len(directions):
        return 0.0
    camera_to_thing = inverse(thing.pose) @ camera.camera_to_object
    directions = directions @ camera_to_thing[:3, :3].T
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origins = np.broadcast_to(camera_to_thing[:3, 3], directions.shape)
    return float((caster.first_hits(origins, directions)[1] >= 0).sum() * step_px**2)
