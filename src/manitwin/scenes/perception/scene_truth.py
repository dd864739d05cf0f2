"""Ground truth of a scene's pictures as ``manitwin layout --pictures`` writes it, read as untrusted; all formats use it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from manitwin.errors import InputError, UsageError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.image_file import read_image
from manitwin.formats.json_file import MAX_JSON_BYTES, parse_json_object
from manitwin.formats.label_picture import MAX_PICTURE_BYTES, MAX_PICTURE_PX, parse_label_picture
from manitwin.formats.printable import printable_line
from manitwin.render.cameras import Camera
from manitwin.scenes.perception.object_views import Box, ObjectView
from manitwin.scenes.perception.scene_views import ScenePart, scene_camera
from manitwin.scenes.scene import Number, SceneRecord
from manitwin.scenes.scene_files import parse_scene

PICTURES_FOLDER = "pictures"
PICTURES_FACTS = "pictures.json"
REMEDY = "draw it again: manitwin layout DATASET -o SCENES --pictures"

_Pixels = Annotated[int, Field(ge=0, le=9 * MAX_PICTURE_PX**2)]


class _MetadataModel(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class _View(_MetadataModel):
    visible_px: _Pixels
    amodal_px: _Pixels
    amodal_in_frame_px: _Pixels
    visible_box: Box | None
    amodal_box: Box | None


class _Camera(_MetadataModel):
    width_px: Annotated[int, Field(ge=1, le=MAX_PICTURE_PX)]
    height_px: Annotated[int, Field(ge=1, le=MAX_PICTURE_PX)]
    K: tuple[tuple[Number, Number, Number], tuple[Number, Number, Number], tuple[Number, Number, Number]]
    objects: dict[str, _View]


class _Part(_MetadataModel):
    object: str
    category: str
    part_id: str
    name: str


class _Pictures(_MetadataModel):
    depth_unit_m: Annotated[float, Field(gt=0, le=1)]
    ids: dict[str, Annotated[int, Field(ge=1, le=65535)]]
    parts: dict[Annotated[int, Field(ge=1, le=65535)], _Part]
    cameras: dict[str, _Camera]


@dataclass(frozen=True)
class PictureTruth:
    """One picture of a scene: its camera (``camera_to_object`` is the pose in the world) and its view of each object.

    Arrays are read on access: ``rgb (H, W, 3) uint8``; ``ids (H, W)``, 0 for floor and backdrop; ``parts (H, W)``, 0 for none;
    ``depth_m (H, W)`` along the viewing axis, 0 for none; ``normals (H, W, 3)`` in the world frame. Each raises UsageError.
    """

    name: str
    camera: Camera
    intrinsics: np.ndarray
    views: Mapping[str, ObjectView]
    folder: Path
    depth_unit_m: float

    @cached_property
    def rgb(self) -> np.ndarray:
        """The sRGB colours ``(H, W, 3) uint8``; raises UsageError if unreadable."""
        path = self.folder / f"{self.name}_rgb.webp"
        try:
            pixels = read_image(path).pixels[..., :3]
        except InputError as error:
            raise UsageError(f"{path}: {error}; {REMEDY}") from error
        return self._of_size(pixels, path)

    @cached_property
    def ids(self) -> np.ndarray:
        """The id at each pixel's centre."""
        return self._numbers("ids")

    @cached_property
    def parts(self) -> np.ndarray:
        """The part number at each pixel's centre."""
        return self._numbers("parts")

    @cached_property
    def depth_m(self) -> np.ndarray:
        """The depth (m) at each pixel's centre."""
        return self._numbers("depth") * self.depth_unit_m

    @cached_property
    def normals(self) -> np.ndarray:
        """The unit normal at each pixel's centre; 0 for none."""
        path = self.folder / f"{self.name}_normals.png"
        try:
            pixels = self._of_size(read_image(path).pixels[..., :3], path)
        except InputError as error:
            raise UsageError(f"{path}: {error}; {REMEDY}") from error
        normals = pixels.astype(np.float32) / 127.5 - 1
        normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-6)
        return np.where(pixels.any(-1, keepdims=True), normals, np.float32(0))

    def _numbers(self, what: str) -> np.ndarray:
        path = self.folder / f"{self.name}_{what}.png"
        content = read_bytes(path, MAX_PICTURE_BYTES, UsageError, inside=self.folder, name=str(path))
        return self._of_size(parse_label_picture(content, str(path), UsageError, remedy=REMEDY), path)

    def _of_size(self, pixels: np.ndarray, path: Path) -> np.ndarray:
        wanted = (self.camera.height_px, self.camera.width_px)
        if pixels.shape[:2] != wanted:
            raise UsageError(
                f"{path}: {pixels.shape[1]} x {pixels.shape[0]} pixels, {PICTURES_FACTS} says {wanted[1]} x {wanted[0]};"
                f" {REMEDY}"
            )
        return pixels


@dataclass(frozen=True)
class SceneTruth:
    """A scene with its pictures: ``ids`` of objects and furniture by name, ``parts`` by number."""

    record: SceneRecord
    ids: Mapping[str, int]
    parts: Mapping[int, ScenePart]
    pictures: tuple[PictureTruth, ...]


def read_scene_truth(scene_file: Path) -> SceneTruth:
    """Read a scene file and the files of its pictures; raises UsageError naming the file, the cause and the remedy."""
    folder = scene_file.parent
    content = read_bytes(scene_file, MAX_JSON_BYTES, UsageError, inside=folder, name=str(scene_file))
    record = parse_scene(content, scene_file)
    facts_file = folder / PICTURES_FOLDER / PICTURES_FACTS
    if not facts_file.is_file():
        raise UsageError(f"{folder}: has no pictures; {REMEDY}")
    told = read_bytes(facts_file, MAX_JSON_BYTES, UsageError, inside=folder, name=str(facts_file))
    facts = _facts(parse_json_object(told, str(facts_file), UsageError, remedy=REMEDY), facts_file)
    cameras = {each.name: each for each in record.cameras}
    unknown = [name for name in facts.cameras if name not in cameras]
    missing = [thing.name for thing in record.objects if thing.name not in facts.ids]
    if unknown or missing:
        raise UsageError(f"{facts_file}: belongs to another scene ({(unknown + missing)[0]!r}); {REMEDY}")
    pictures = tuple(
        PictureTruth(
            name,
            scene_camera(cameras[name], each.width_px, each.height_px),
            np.array(each.K, float),
            {thing: ObjectView(**view.model_dump()) for thing, view in each.objects.items()},
            folder / PICTURES_FOLDER,
            facts.depth_unit_m,
        )
        for name, each in facts.cameras.items()
    )
    parts = {number: ScenePart(**part.model_dump()) for number, part in facts.parts.items()}
    return SceneTruth(record, facts.ids, parts, pictures)


def _facts(told: dict[str, object], file: Path) -> _Pictures:
    if "parts" not in told:
        raise UsageError(f"{file}: drawn by a version that did not store parts; {REMEDY}")
    try:
        return _Pictures.model_validate(told)
    except ValidationError as error:
        first = error.errors()[0]
        where = printable_line(".".join(map(str, first["loc"])), max_characters=80)
        raise UsageError(f"{file}: {where}: {first['msg']}; {REMEDY}") from error
