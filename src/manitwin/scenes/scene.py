"""Scene file: poses of twins, furniture, lights and cameras. Positions are in metres in the world frame, +Z up."""

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
"""Version 2 adds the digest of each twin at the time of settling (``body_sha256``); version 1 has only its revision."""
SCENE_SCHEMA_VERSIONS = (1, SCENE_SCHEMA_VERSION)
"""The versions that are read. A scene is never rewritten, because tasks refer to it by its digest."""
SCENE = "scene.json"


MOST_METRES = 1e6
"""Limit of all numbers in a scene: a coordinate of 1e300 would break simulation and rendering without a clear error."""


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
    """A horizontal rectangle on which objects may stand, along the world axes; ``name`` is that of its box.

    ``clearance_m`` is the free height above it; None if nothing is above.
    """

    name: Name
    center_m: tuple[Number, Number]
    half_extents_m: tuple[Number, Number]
    height_m: Number
    clearance_m: Number | None = None


class Furniture(_Record):
    """Furniture of ``kind`` table, shelf or tray.

    Objects stand on the ``supports``; ``support_height_m`` is the height of the lowest one, 0 for a table. The table top is
    larger than the sampled region on it, because the base of a robot stands beside that region.
    """

    kind: str
    support_height_m: Number
    boxes: tuple[SurfaceBox, ...]
    supports: tuple[SupportRegion, ...] = ()


class SceneObject(_Record):
    """A twin at rest in the scene. ``supported_by`` is another object's name, or None for the furniture; ``relation`` on or in.

    ``placement`` is the index of the twin's placement; None for an object that settled after a drop into a container.
    ``surface`` names the support below the object or its container. ``body_sha256`` is the digest of what determines the twin's
    rest (``manitwin.twin.record_digests``); None in scenes of earlier versions, which lack the key.
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
    """A directional light; ``color`` is linear RGB times its intensity."""

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
    """Physical measurements: motion and rotation of objects while settling, penetration and remaining gaps."""

    max_moved_m: Number
    max_turned_rad: Number
    max_penetration_m: Number
    min_gap_m: Number | None


class SceneRecord(_Record):
    """One layout; ``robot`` is the robot for whose workspace it was sampled."""

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
