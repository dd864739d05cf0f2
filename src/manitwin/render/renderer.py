"""Rendering of meshes with SAPIEN: colour and depth, with studio lighting fixed to the camera.

Since the lights move with the camera, all views are exposed alike. The custom shader ``shaders/gbuffer.frag`` takes 0.02 CPU-s
per megapixel on lavapipe and 0.2 for the first image, where SAPIEN's ``minimal`` shaders take 0.13 and 11 (measured). Normals
and faces are not rendered; ``manitwin.render.raycast`` computes them exactly.
"""

from __future__ import annotations

import atexit
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import trimesh

from manitwin.geometry.poses import transform
from manitwin.render.cameras import Camera, sapien_axes
from manitwin.render.device import RenderDevice, render_scene, require_renderer
from manitwin.render.surfaces import RenderSurface, front_faces, render_surface, triangle_mesh_shape

BACKDROP = (233, 235, 238)  # light enough to be neutral, dark enough for white objects to stand out
SUPERSAMPLE = 2  # SAPIEN does not antialias; rendering at twice the size removes visible steps
TEXELS_A_PIXEL = 1.2
SHADERS = Path(__file__).parent / "shaders"
DARKENING_RADIUS = 0.035  # fraction of the image height: radius of depth darkening
DARKENING_STRENGTH = 2.6
DARKENING_MOST = 0.55

_shared: tuple[int, Renderer] | None = None


def shared_renderer() -> Renderer:
    """Return this process's renderer, created on first use. Raises RendererMissing if no device renders.

    Creation takes half a CPU-second, most of it for importing SAPIEN.
    """
    global _shared
    if _shared is None or _shared[0] != os.getpid():
        _shared = os.getpid(), Renderer()
        atexit.register(_release)
    return _shared[1]


def _release() -> None:
    """Release the renderer before interpreter shutdown, as SAPIEN 3.0.3 crashes if it is released later."""
    global _shared
    if _shared is not None and _shared[0] == os.getpid():
        _shared[1].close()
    _shared = None


class Renderer:
    """A reusable SAPIEN scene, filled anew for each object. Use ``shared_renderer``."""

    def __init__(self) -> None:
        self.device: RenderDevice = require_renderer()
        self._sapien, self._scene = render_scene({"Color": "R8G8B8A8Unorm"})
        self._size: tuple[int, int] | None = None
        self._camera: Any = None
        self._mount: Any = None

    def render(
        self,
        parts: Sequence[trimesh.Trimesh],
        cameras: Sequence[Camera],
        *,
        background: tuple[int, int, int] = BACKDROP,
        supersample: int = SUPERSAMPLE,
        with_backs: bool = True,
    ) -> list[Frame]:
        """Render ``parts``, meshes in the object frame, from each camera over a background colour.

        Without ``with_backs`` back faces are culled, which takes a sixth less time; for meshes with ``is_closed_and_outward``.
        ``supersample`` antialiases ``rgb``. With 1, ``depth`` is that of the rays through the pixel centres (measured error:
        1e-7 m on an object of 0.1 m); with 2 it deviates slightly at creases and edges.
        """
        points = np.concatenate([np.asarray(part.vertices, np.float32) for part in parts])
        low, high = points.min(0), points.max(0)
        # the object is enclosed in a sphere of radius 1
        center, scale = (low + high) / 2, 2 / float(np.linalg.norm(high - low))
        del points
        texels_a_unit = TEXELS_A_PIXEL * max_pixels_per_unit(cameras, center, 1 / scale)
        surfaces = [render_surface(part, texels_a_unit=texels_a_unit) for part in parts]
        if not with_backs:
            surfaces = [front_faces(surface) for surface in surfaces]
        entities, textured = [], any(surface.color_map is not None for surface in surfaces)
        while surfaces:  # removed one by one to save memory, as textures are large
            entities.append(self._entity(surfaces.pop(0), center, scale))
            self._scene.add_entity(entities[-1])
        try:
            return [self._capture_frame(camera, center, scale, background, supersample) for camera in cameras]
        finally:
            for entity in entities:
                self._scene.remove_entity(entity)
            del entities
            if textured and self._camera is not None:
                self._let_go()

    def _let_go(self) -> None:
        """Render an empty image, because the renderer holds the previous image's resources until then (40 MB for a scan)."""
        self._scene.update_render()
        self._camera.take_picture()

    def close(self) -> None:
        """Release the driver's resources."""
        self._camera = self._mount = None
        self._scene.clear()
        del self._scene

    def _entity(self, s: RenderSurface, center: np.ndarray, scale: float) -> Any:
        vertices = ((s.vertices - center) * scale).astype(np.float32)
        body = self._sapien.render.RenderBodyComponent()
        body.attach(triangle_mesh_shape(self._sapien.render, replace(s, vertices=vertices)))
        entity = self._sapien.Entity()
        entity.add_component(body)
        return entity

    def _camera_of(self, width: int, height: int) -> tuple[Any, Any]:
        """Return a camera component and its entity, reused for the same image size. Each pixel takes 17 bytes."""
        if self._size != (width, height):
            if self._mount is not None:
                self._scene.remove_entity(self._mount)
            self._camera = self._sapien.render.RenderCameraComponent(width, height, str(SHADERS))
            self._mount = self._sapien.Entity()
            self._mount.add_component(self._camera)
            self._scene.add_entity(self._mount)
            self._size = width, height
        return self._camera, self._mount

    def _capture_frame(
        self, camera: Camera, center: np.ndarray, scale: float, background: tuple[int, int, int], k: int
    ) -> Frame:
        component, entity = self._camera_of(camera.width_px * k, camera.height_px * k)
        position = (camera.position - center) * scale
        distance = float(np.linalg.norm(position))
        near, far = max(0.02, distance - 1.05), distance + 1.05
        component.set_fovy(camera.fov_y_rad, True)
        component.near, component.far = near, far
        entity.set_pose(self._sapien.Pose(transform(sapien_axes(camera), position)))
        self._scene.update_render()
        component.take_picture()
        return reduced_frame(
            component.get_picture("Color"),
            component.get_picture("GbufferDepth").reshape(camera.height_px * k, camera.width_px * k),
            nearest=near / scale,
            farthest=far / scale,
            background=background,
            supersample=k,
            radius=1 / scale,
        )


def max_pixels_per_unit(cameras: Sequence[Camera], center: np.ndarray, radius: float) -> float:
    """Return the pixels per unit of length in an object's closest view; its sphere is ``center (3,)``, ``radius``."""
    distances = [max(float(np.linalg.norm(camera.position - center)), radius / 8) for camera in cameras]
    return max(camera.focal_px / far for camera, far in zip(cameras, distances, strict=True))


@dataclass(frozen=True)
class Frame:
    """An image of size (H, W).

    ``rgb (H, W, 3) uint8`` over the background; ``coverage (H, W) float32``, the share of each pixel covered by the object;
    ``depth (H, W) float32`` along the viewing axis in the object's unit, 0 where the object covers less than half a pixel.
    """

    rgb: np.ndarray
    coverage: np.ndarray
    depth: np.ndarray

    def composited_over(self, old: tuple[int, int, int], new: tuple[int, int, int]) -> np.ndarray:
        """Return ``rgb`` composited over the background ``new`` instead of ``old``."""
        empty, picture = 1 - self.coverage, np.empty_like(self.rgb)
        for channel, step in enumerate(np.array(new, np.float32) - np.array(old, np.float32)):
            moved = self.rgb[..., channel] + empty * step
            picture[..., channel] = np.rint(np.clip(moved, 0, 255, out=moved), out=moved)
        return picture


def reduced_frame(
    color: np.ndarray,
    buffer: np.ndarray,
    *,
    nearest: float,
    farthest: float,
    background: tuple[int, int, int],
    supersample: int,
    radius: float,
) -> Frame:
    """Downsample an image by ``supersample`` in each direction.

    ``color (H, W, 4) uint8`` is black and transparent where there is no object; ``buffer (H, W) float32`` is the depth buffer,
    linear in 1/depth from 0 at ``nearest`` to 1 at ``farthest``, and 1 without an object; ``radius`` is the object's. Colours
    are averaged over the background. As 1/depth is linear in the image of a plane, its mean over the covered samples is the
    inverse depth at the pixel centre.
    """
    size = (color.shape[1] // supersample, color.shape[0] // supersample)
    coverage = _averaged(cv2.extractChannel(color, 3).astype(np.float32), size) / np.float32(255)
    empty = np.float32(1) - coverage
    seen = coverage >= 0.5
    nearness = np.float32(1 / nearest) + _averaged(buffer, size) * np.float32(1 / farthest - 1 / nearest)
    at_center = np.zeros_like(coverage)
    np.divide(coverage, nearness - empty * np.float32(1 / farthest), out=at_center, where=seen)
    small, shade = _averaged(color, size), depth_shade(at_center, seen, radius)
    rgb = np.empty((*coverage.shape, 3), np.uint8)
    for channel, ground in enumerate(np.array(background, dtype=np.float32)):  # NumPy is slow over a last axis of three
        lit = small[..., channel] * shade + empty * ground
        rgb[..., channel] = np.rint(np.minimum(lit, 255, out=lit), out=lit)
    return Frame(rgb, coverage, at_center)


def _averaged(image: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))


def depth_shade(depth: np.ndarray, seen: np.ndarray, radius: float) -> np.ndarray:
    """Return a factor ``(H, W) float32`` that darkens surfaces behind their surroundings: cavities, contacts, overlaps.

    It approximates ambient occlusion, which a rasterizer lacks. Source: Luft, Colditz, Deussen 2006, "Image enhancement by
    unsharp masking the depth buffer", eq. 1-3 (depth darkening); the background is excluded from the blur.
    """
    sigma = DARKENING_RADIUS * depth.shape[0]
    weight = seen.astype(np.float32)
    # At a quarter of the size the wide blur costs a sixteenth.
    size = (max(1, depth.shape[1] // 4), max(1, depth.shape[0] // 4))
    small = [cv2.resize(image, size, interpolation=cv2.INTER_AREA) for image in (depth * weight, weight)]
    blurred, share = (cv2.GaussianBlur(image, (0, 0), sigma / 4) for image in small)
    around = cv2.resize(blurred / np.maximum(share, 1e-6), depth.shape[::-1], interpolation=cv2.INTER_LINEAR)
    behind = np.maximum(depth - around, 0.0) / radius
    return np.where(seen, 1 - np.minimum(DARKENING_STRENGTH * behind, DARKENING_MOST), 1.0).astype(np.float32)
