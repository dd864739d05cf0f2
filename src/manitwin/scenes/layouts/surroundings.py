"""Surroundings of a layout: tables, shelves and trays with their support regions, lights, and cameras."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manitwin.scenes.scene import Furniture, Light, SceneCamera, SupportRegion, SurfaceBox

MATERIALS = ("wood", "metal", "marble", "cloth")
BOARD_M = 0.02
TABLE_M = 0.04

_TABLE_CENTER_M, _TABLE_HALF_M = (0.4, 0.0), (0.65, 0.7)
_ON_TABLE = SupportRegion(name="table", center_m=(0.62, 0.0), half_extents_m=(0.4, 0.67), height_m=0.0)
"""Of the 1.3 m long table, which begins at x = -0.25, the part at least 0.22 m in front of the origin, where a robot's base
stands.
"""

_TRAY_HALF_M, _TRAY_FLOOR_M, _RIM_M, _RIM_WALL_M = (0.22, 0.32), 0.01, 0.03, 0.01
_SHELF_HALF_M, _SHELF_RISE_M, _SHELF_BOARDS = (0.17, 0.5), 0.34, 2

FOV_Y_RAD = 0.7
# of its overview; 0.75 rad is the limit at which the back of a shelf is visible
SHELF_ASIDE_RAD, SHELF_ELEVATION_RAD = 0.25, 0.35
LEAST_REACH_M = 0.2
"""Keeps a picture from showing nothing but a single small object, such as a dice."""


def make_furniture(kind: str, rng: np.random.Generator) -> Furniture:
    """Return a table with its top at z = 0, or one with a tray or shelf on it; materials and positions are drawn."""
    table = _box("table", (*_TABLE_CENTER_M, -TABLE_M / 2), (*_TABLE_HALF_M, TABLE_M / 2), _material(rng))
    if kind == "table":
        return Furniture(kind=kind, support_height_m=0.0, boxes=(table,), supports=(_ON_TABLE,))
    if kind == "tray":
        return _tray(table, rng)
    return _shelf(table, rng)


def _tray(table: SurfaceBox, rng: np.random.Generator) -> Furniture:
    """Return a tray with a rim of 3 cm above its floor."""
    material = _material(rng)
    x, y = _rounded(rng.uniform(0.48, 0.62)), _rounded(rng.uniform(-0.15, 0.15))
    half_x, half_y = _TRAY_HALF_M
    floor = _box("tray", (x, y, _TRAY_FLOOR_M / 2), (half_x, half_y, _TRAY_FLOOR_M / 2), material)
    wall, rise = _RIM_WALL_M / 2, (_TRAY_FLOOR_M + _RIM_M) / 2
    rims = [
        _box(f"tray_rim_{i}", (x + sx * (half_x + wall), y, rise), (wall, half_y + 2 * wall, rise), material)
        for i, sx in enumerate((-1, 1))
    ] + [
        _box(f"tray_rim_{i + 2}", (x, y + sy * (half_y + wall), rise), (half_x, wall, rise), material)
        for i, sy in enumerate((-1, 1))
    ]
    inside = SupportRegion(name="tray", center_m=(x, y), half_extents_m=_TRAY_HALF_M, height_m=_TRAY_FLOOR_M)
    return Furniture(kind="tray", support_height_m=_TRAY_FLOOR_M, boxes=(table, floor, *rims), supports=(inside,))


def _shelf(table: SurfaceBox, rng: np.random.Generator) -> Furniture:
    """Return two boards between two sides with a back; open at the top and at the front, where the robot is."""
    material = _material(rng)
    x = _rounded(rng.uniform(0.55, 0.65))
    half_x, half_y = _SHELF_HALF_M
    tops = [BOARD_M + i * _SHELF_RISE_M for i in range(_SHELF_BOARDS)]
    boards = [
        _box(f"shelf_{i}", (x, 0.0, top - BOARD_M / 2), (half_x, half_y, BOARD_M / 2), material)
        for i, top in enumerate(tops)
    ]
    height, wall = tops[-1] + 0.1, BOARD_M / 2
    sides = [
        _box(f"shelf_side_{i}", (x, sy * (half_y + wall), height / 2), (half_x, wall, height / 2), material)
        for i, sy in enumerate((-1, 1))
    ]
    back = _box("shelf_back", (x + half_x + wall, 0.0, height / 2), (wall, half_y + 2 * wall, height / 2), material)
    supports = tuple(
        SupportRegion(
            name=f"shelf_{i}",
            center_m=(x, 0.0),
            half_extents_m=_SHELF_HALF_M,
            height_m=top,
            clearance_m=_SHELF_RISE_M - BOARD_M if i + 1 < _SHELF_BOARDS else None,
        )
        for i, top in enumerate(tops)
    )
    return Furniture(kind="shelf", support_height_m=tops[0], boxes=(table, *boards, *sides, back), supports=supports)


def _box(
    name: str, center_m: tuple[float, float, float], half_m: tuple[float, float, float], material: str
) -> SurfaceBox:
    return SurfaceBox(name=name, center_m=center_m, half_extents_m=half_m, material=material)


def _material(rng: np.random.Generator) -> str:
    return MATERIALS[int(rng.integers(len(MATERIALS)))]


def _rounded(value: float) -> float:
    return round(float(value), 4)


def make_lights(rng: np.random.Generator) -> tuple[tuple[float, float, float], tuple[Light, ...]]:
    """Return the ambient light and one to three directional lights from above; the first and strongest casts shadows."""
    count = int(rng.integers(1, 4))
    ambient = tuple(round(float(v), 4) for v in np.full(3, rng.uniform(0.25, 0.45)))
    lights = []
    for number in range(count):
        steep, around = rng.uniform(0.6, 1.3), rng.uniform(-np.pi, np.pi)  # elevation of 34 to 74 degrees
        toward = -np.array([np.cos(steep) * np.cos(around), np.cos(steep) * np.sin(around), np.sin(steep)])
        strength = rng.uniform(1.6, 2.4) / (1 if number == 0 else 3) / count**0.5
        warmth = rng.uniform(-0.08, 0.08)
        color = strength * np.array([1 + warmth, 1.0, 1 - warmth])
        lights.append(Light(direction=_triple(toward), color=_triple(color), casts_shadow=number == 0))
    return (ambient[0], ambient[1], ambient[2]), tuple(lights)


def make_cameras(kind: str, low_m: np.ndarray, high_m: np.ndarray, rng: np.random.Generator) -> tuple[SceneCamera, ...]:
    """Return ``front`` (from beyond the table, towards the robot), ``oblique`` and ``overview`` (from above).

    Each sees the whole bounding box of the objects, from ``low_m (3,)`` to ``high_m (3,)``. All look at a shelf from its open
    side, and ``overview`` from so low that no board hides the objects below it.
    """
    target = (low_m + high_m) / 2
    reach = max(float(np.linalg.norm(high_m - low_m)) / 2, LEAST_REACH_M)
    front = np.pi if kind == "shelf" else 0.0
    over = (front - SHELF_ASIDE_RAD, SHELF_ELEVATION_RAD) if kind == "shelf" else (front, 1.45)
    cameras = []
    for name, azimuth, elevation in (("front", front, 0.55), ("oblique", front + 0.8, 0.75), ("overview", *over)):
        around, up = azimuth + rng.uniform(-0.1, 0.1), elevation + rng.uniform(-0.08, 0.08)
        away = np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])
        distance = reach / np.sin(FOV_Y_RAD / 2) * rng.uniform(1.0, 1.1)
        cameras.append(
            SceneCamera(
                name=name, position_m=_triple(target + distance * away), target_m=_triple(target), fov_y_rad=FOV_Y_RAD
            )
        )
    return tuple(cameras)


def camera_axes(position_m: Sequence[float], target_m: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return the right and up directions ``(3,)`` of a picture that looks from a position at a target."""
    forward = np.subtract(target_m, position_m)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    return right, up / np.linalg.norm(up)


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (round(float(v), 6) for v in values)
    return x, y, z
