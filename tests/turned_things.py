"""Cut-outs of a thing without symmetry that is turned before a camera that stays."""

from __future__ import annotations

from functools import cache

import numpy as np
import trimesh

from manitwin.geometry.ray_caster import RayCaster
from manitwin.render.cameras import Camera
from manitwin.render.raycast import cast_camera

SIDES = np.array([[200, 40, 40], [40, 160, 60], [50, 70, 200], [220, 190, 60], [150, 150, 150], [90, 60, 30]], np.uint8)
FOV_DEG = 40.0


@cache
def turned_thing() -> trimesh.Trimesh:
    """A foot, a leg and an arm to one side: no symmetry tells two of its sides apart wrongly. Its middle is the origin."""
    parts = [
        trimesh.creation.box((0.08, 0.05, 0.03)).apply_translation((0, 0, 0.015)),
        trimesh.creation.box((0.03, 0.03, 0.08)).apply_translation((-0.015, 0, 0.06)),
        trimesh.creation.box((0.02, 0.05, 0.02)).apply_translation((-0.015, -0.035, 0.085)),
    ]
    return trimesh.boolean.union(parts).apply_translation((0, 0, -0.05))


def turned_photo(turn_deg: float, elevation_deg: float, *, aside_m: float = 0.0) -> np.ndarray:
    """An RGBA picture of the thing, each direction in its own colour; the axis is ``aside_m`` left of the middle."""
    azimuth, elevation = np.deg2rad([turn_deg - 90, elevation_deg])
    toward = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(toward, right), toward])
    pose[:3, 3] = 0.25 * toward + aside_m * right
    _, normals, face = cast_camera(RayCaster(turned_thing()), Camera(pose, np.deg2rad(FOV_DEG), 320, 240))
    axes = np.concatenate([normals, -normals], axis=2)
    return np.dstack([SIDES[axes.argmax(axis=2)], np.where(face >= 0, 255, 0).astype(np.uint8)])
