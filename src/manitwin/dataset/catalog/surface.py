"""Sampled surface points of a twin with normals and colours, and views from all sides."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
import trimesh

from manitwin.geometry.sampling import sample_surface
from manitwin.models.annotators.surface_color import base_colors_at
from manitwin.render.cameras import Camera, framing_camera
from manitwin.render.renderer import BACKDROP, shared_renderer
from manitwin.twin.loaded_twin import Twin

POINTS = (10_000, 8_192)
"""Cloud sizes of OpenShape and ULIP; the smaller cloud is a prefix of the larger one."""
VIEWS, STEP_DEG = 30, 12
"""ULIP's views: one every 12 degrees of azimuth."""
ELEVATIONS_DEG = (30.0, 10.0, 50.0)
FOV_Y_DEG = 30.0


@dataclass(frozen=True)
class SurfacePoints:
    """``points_m (N, 3)``, outward unit ``normals (N, 3)`` and base colours ``rgb (N, 3) uint8`` sRGB, in the object frame."""

    points_m: np.ndarray
    normals: np.ndarray
    rgb: np.ndarray


@dataclass(frozen=True)
class View:
    """A picture ``rgb (H, W, 3) uint8``, its camera, and the depth along the optical axis ``depth_m (H, W)``, 0 for
    background.
    """

    azimuth_deg: int
    camera: Camera
    rgb: np.ndarray
    depth_m: np.ndarray


def surface_points(twin: Twin, count: int, seed: int) -> SurfacePoints:
    """Sample points uniformly by area on a twin's visual surface, each with its normal and base colour."""
    rng = np.random.default_rng([seed, zlib.crc32(twin.record.twin_id.encode())])
    vertices, faces = trimesh.util.append_faces(
        [part.vertices for part in twin.visual], [part.faces for part in twin.visual]
    )
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    points, normals, face = sample_surface(mesh, count, rng)
    rgb = np.zeros((count, 3), np.uint8)
    begin = 0
    for part in twin.visual:
        at = np.flatnonzero((face >= begin) & (face < begin + len(part.faces)))
        rgb[at] = _colors(part, face[at] - begin, points[at])
        begin += len(part.faces)
    return SurfacePoints(points, normals, rgb)


def _colors(part: trimesh.Trimesh, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the base colours ``(N, 3) uint8`` sRGB at points on faces of a visual part."""
    return np.rint(255 * base_colors_at(part, faces, points)).astype(np.uint8)


def views_around(twin: Twin, size_px: int) -> list[View]:
    """Render a standing twin every 12 degrees of azimuth, at elevations of 30, 10 and 50 degrees in turn."""
    points = np.concatenate([part.vertices for part in twin.visual])
    cameras = [
        framing_camera(
            points,
            azimuth_deg=float(STEP_DEG * number),
            elevation_deg=ELEVATIONS_DEG[number % len(ELEVATIONS_DEG)],
            fov_y_deg=FOV_Y_DEG,
            width_px=size_px,
            height_px=size_px,
        )
        for number in range(VIEWS)
    ]
    frames = shared_renderer().render(twin.visual, cameras, background=BACKDROP)
    return [
        View(STEP_DEG * number, camera, frame.rgb, frame.depth)
        for number, (camera, frame) in enumerate(zip(cameras, frames, strict=True))
    ]
