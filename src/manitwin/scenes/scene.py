"""The scene file: which twins stand where, on what, under which lights. Positions in metres, world frame, +Z up."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    AllowInfNan,
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
)

SCENE_SCHEMA_VERSION = 2
"""Version 2 says what each object's twin was as it came to rest (``body_sha256``); version 1, its revision alone."""
SCENE_SCHEMA_VERSIONS = (1, SCENE_SCHEMA_VERSION)
"""Those that are read. A scene stays as it was written: tasks name it by its digest."""
SCENE = "scene.json"


MOST_METRES = 1e6
"""No number of a scene is larger: a coordinate of 1e300 ends simulations and pictures, not with one line."""


def _name(text: str) -> str:
    if not text or text in (".", "..") or "/" in text or not text.isprintable() or len(text) > 200:
        raise ValueError(f"{text[:40]!r} is no name")
    return text


Name = Annotated[str, AfterValidator(_name)]
Number = Annotated[float, AllowInfNan(False), Field(ge=-MOST_METRES, le=MOST_METRES)]
_Vector = tuple[Number, Number, Number]


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class SurfaceBox(_Record):
    """A box of the furniture; ``material`` names a procedural texture: wood, metal, marble, cloth."""

    name: Name
    center_m: _Vector
    half_extents_m: _Vector
    material: str


class SupportRegion(_Record):
    """A level rectangle that objects may stand on, along the world's axes; ``name`` is that of its box.

    ``clearance_m`` is the free height above it; None where nothing is above.
    """

    name: Name
    center_m: tuple[Number, Number]
    half_extents_m: tuple[Number, Number]
    height_m: Number
    clearance_m: Number | None = None


class Furniture(_Record):
    """The furniture that objects stand on: ``kind`` table, shelf or tray.

    Objects stand on the ``supports``; ``support_height_m`` is the height of the lowest of these, 0 for a table. The table's
    top is larger than the region on it that is sampled: a robot's base stands beside that.
    """

    kind: str
    support_height_m: Number
    boxes: tuple[SurfaceBox, ...]
    supports: tuple[SupportRegion, ...] = ()


class SceneObject(_Record):
    """A twin in the scene, at rest. ``supported_by`` is another object's name, or None for the furniture; ``relation`` on or in.

    ``placement`` is the index of the twin's placement that it stands in; None for what came to rest as it fell, in a
    container. ``surface`` names the support that it, or what holds it, stands on. ``body_sha256`` is the digest of what decides
    how the twin comes to rest (``manitwin.twin.record_digests``); None in scenes of earlier versions, which do not have the key.
    """

    name: Name
    twin_id: Name
    revision: str
    category: str
    placement: int | None
    position_m: _Vector
    quaternion_wxyz: tuple[Number, Number, Number, Number]
    supported_by: str | None = None
    relation: Literal["on", "in"] = "on"
    surface: str = "table"
    body_sha256: str | None = None

    @model_serializer(mode="wrap")
    def _as_read(self, written: SerializerFunctionWrapHandler) -> dict[str, Any]:
        said: dict[str, Any] = written(self)
        if self.body_sha256 is None:
            del said["body_sha256"]
        return said


class Light(_Record):
    """A directional light; ``color`` is linear RGB with its strength."""

    direction: _Vector
    color: _Vector
    casts_shadow: bool = False


class SceneCamera(_Record):
    """A pinhole camera that looks from a position at a target, +Z up in the picture."""

    name: Name
    position_m: _Vector
    target_m: _Vector
    fov_y_rad: Number


class SceneMeasures(_Record):
    """Measurements by physics: how far objects moved and turned as they settled, and what was left of gaps."""

    max_moved_m: Number
    max_turned_rad: Number
    max_penetration_m: Number
    min_gap_m: Number | None


class SceneRecord(_Record):
    """One layout; ``robot`` is whose workspace it was sampled for."""

    schema_version: int
    scene_id: Name
    seed: int
    number: int
    robot: str | None
    clutter: str
    furniture: Furniture
    objects: tuple[SceneObject, ...]
    ambient: _Vector
    lights: tuple[Light, ...]
    cameras: tuple[SceneCamera, ...]
    measures: SceneMeasures
    repairs: int
