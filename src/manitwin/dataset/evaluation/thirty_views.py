"""The 30 views for evaluating generation (paper, "Evaluation Metrics"): colours, normals and silhouettes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.embedders.appearance import GREY
from manitwin.render.cameras import Camera, framing_camera
from manitwin.render.raycast import cast_camera, merge_parts
from manitwin.render.renderer import shared_renderer
from manitwin.twin.loaded_twin import Twin

RINGS = ((10.0, 12), (35.0, 10), (65.0, 6), (89.0, 1), (-89.0, 1))
"""Elevation (degrees) and number of views around; the paper states the number of views, not their poses."""
VIEWS = sum(count for _, count in RINGS)
SIDE_PX, FOV_Y_DEG = 224, 30.0
WHITE = 255


@dataclass(frozen=True)
class View:
    """A view: ``rgb`` and ``normals (S, S, 3) uint8`` on white, ``grey`` the colours on grey, ``coverage (S, S)`` in 0..1.

    A normal (x right, y up, z to the viewer) is encoded as ``(n + 1) / 2``.
    """

    rgb: np.ndarray
    grey: np.ndarray
    normals: np.ndarray
    coverage: np.ndarray


def cameras(points_m: np.ndarray) -> list[Camera]:
    """Return the cameras of the 30 views, each framing all ``points_m (N, 3)``."""
    return [
        framing_camera(
            points_m,
            azimuth_deg=360 / count * place,
            elevation_deg=elevation,
            fov_y_deg=FOV_Y_DEG,
            width_px=SIDE_PX,
            height_px=SIDE_PX,
        )
        for elevation, count in RINGS
        for place in range(count)
    ]


def thirty_views(twin: Twin) -> list[View]:
    """Render a twin's surface from 30 sides; raises RendererMissing without a renderer."""
    around = cameras(np.concatenate([part.vertices for part in twin.visual]))
    caster = RayCaster(merge_parts(twin.visual))
    grey, white = (GREY,) * 3, (WHITE,) * 3
    frames = shared_renderer().render(twin.visual, around, background=grey)
    return [
        View(frame.composited_over(grey, white), frame.rgb, normal_picture(caster, camera), frame.coverage)
        for frame, camera in zip(frames, around, strict=True)
    ]


def normal_picture(caster: RayCaster, camera: Camera) -> np.ndarray:
    """Return the visible normals in the camera frame, encoded as colours ``(H, W, 3) uint8`` on white."""
    _, normals, face = cast_camera(caster, camera)
    seen = normals @ camera.camera_to_object[:3, :3]
    colors = np.rint((seen + 1) / 2 * 255)
    return np.where(face[..., None] >= 0, colors, WHITE).astype(np.uint8)
