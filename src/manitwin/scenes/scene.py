"""The scene file: which twins stand where, on what, under which lights. Positions in metres, world frame, +Z up."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

SCENE_SCHEMA_VERSION = 1
SCENE = "scene.json"


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class SurfaceBox(_Record):
    """A box of the furniture; ``material`` names a procedural texture: wood, metal, marble, cloth."""

    name: str
    center_m: tuple[float, float, float]
    half_extents_m: tuple[float, float, float]
    material: str


class SupportRegion(_Record):
    """A level rectangle that objects may stand on, along the world's axes; ``name`` is that of its box.

    ``clearance_m`` is the free height above it; None where nothing is above.
    """

    name: str
    center_m: tuple[float, float]
    half_extents_m: tuple[float, float]
    height_m: float
    clearance_m: float | None = None


class Furniture(_Record):
    """The furniture that objects stand on: ``kind`` table, shelf or tray.

    Objects stand on the ``supports``; ``support_height_m`` is the height of the lowest of these, 0 for a table. The table's
    top is larger than the region on it that is sampled: a robot's base stands beside that.
    """

    kind: str
    support_height_m: float
    boxes: tuple[SurfaceBox, ...]
    supports: tuple[SupportRegion, ...] = ()


class SceneObject(_Record):
    """A twin in the scene, at rest. ``supported_by`` is another object's name, or None for the furniture; ``relation`` on or in.

    ``placement`` is the index of the twin's placement that it stands in; None for what came to rest as it fell, in a
    container. ``surface`` names the support that it, or what holds it, stands on.
    """

    name: str
    twin_id: str
    revision: str
    category: str
    placement: int | None
    position_m: tuple[float, float, float]
    quaternion_wxyz: tuple[float, float, float, float]
    supported_by: str | None = None
    relation: Literal["on", "in"] = "on"
    surface: str = "table"


class Light(_Record):
    """A directional light; ``color`` is linear RGB with its strength."""

    direction: tuple[float, float, float]
    color: tuple[float, float, float]
    casts_shadow: bool = False


class SceneCamera(_Record):
    """A pinhole camera that looks from a position at a target, +Z up in the picture."""

    name: str
    position_m: tuple[float, float, float]
    target_m: tuple[float, float, float]
    fov_y_rad: float


class SceneMeasures(_Record):
    """Measurements by physics: how far objects moved and turned as they settled, and what was left of gaps."""

    max_moved_m: float
    max_turned_rad: float
    max_penetration_m: float
    min_gap_m: float | None


class SceneRecord(_Record):
    """One layout; ``robot`` is whose workspace it was sampled for."""

    schema_version: int
    scene_id: str
    seed: int
    number: int
    robot: str | None
    clutter: str
    furniture: Furniture
    objects: tuple[SceneObject, ...]
    ambient: tuple[float, float, float]
    lights: tuple[Light, ...]
    cameras: tuple[SceneCamera, ...]
    measures: SceneMeasures
    repairs: int
