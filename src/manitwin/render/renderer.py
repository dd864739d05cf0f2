"""Pictures of meshes with SAPIEN: colour and depth, lit like an object on a turntable in a studio.

The object turns, the lights do not: they hang on the camera, so every view is exposed alike. The studio is a shader of
our own, ``shaders/gbuffer.frag``: a picture of a megapixel costs 0.02 CPU-s on lavapipe and the first one 0.2, where
SAPIEN's ``minimal`` shaders cost 0.13 and 11 (measured). Normals and faces are not drawn: ``manitwin.render.raycast``
gives exact ones.
"""

from __future__ import annotations

import atexit
import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from manitwin.geometry.poses import transform
from manitwin.render.cameras import Camera
from manitwin.render.device import RenderDevice, require_renderer
from manitwin.render.frame import Frame, reduced_frame
from manitwin.render.surfaces import Surface, surface

BACKDROP = (233, 235, 238)  # light enough to be no colour, dark enough that white things stand out
SUPERSAMPLE = 2  # SAPIEN's edges are not antialiased; twice the size each way removes the steps that are seen
SHADERS = Path(__file__).parent / "shaders"

_shared: tuple[int, Renderer] | None = None


def shared_renderer() -> Renderer:
    """Return this process's renderer, made at the first call; raises RendererMissing where nothing renders.

    Making one costs half a CPU-second, most of it for importing SAPIEN.
    """
    global _shared
    if _shared is None or _shared[0] != os.getpid():
        _shared = os.getpid(), Renderer()
        atexit.register(_release)
    return _shared[1]


def _release() -> None:
    """Drop the renderer while the interpreter is whole: SAPIEN 3.0.3 crashes when it is dropped later."""
    global _shared
    if _shared is not None and _shared[0] == os.getpid():
        _shared[1].close()
    _shared = None


class Renderer:
    """A SAPIEN scene that is kept and filled anew for each object. Use ``shared_renderer``."""

    def __init__(self) -> None:
        self.device: RenderDevice = require_renderer()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # SAPIEN warns of drivers that it looks for and does not need
            import sapien
            import sapien.render
        self._sapien: Any = sapien
        sapien.render.set_log_level("error")
        sapien.render.set_picture_format("Color", "R8G8B8A8Unorm")
        self._scene: Any = sapien.Scene([sapien.render.RenderSystem()])
        self._cameras: dict[tuple[int, int], tuple[Any, Any]] = {}

    def render(
        self,
        parts: Sequence[trimesh.Trimesh],
        cameras: Sequence[Camera],
        *,
        background: tuple[int, int, int] = BACKDROP,
        supersample: int = SUPERSAMPLE,
    ) -> list[Frame]:
        """Draw ``parts``, meshes in the object frame, from each camera, over a background colour.

        ``supersample`` smooths the edges of ``rgb``; with 1, ``depth`` is that of the rays through the pixels' centres
        (measured: 1e-7 m on an object of 0.1 m), with 2 it is a little off at creases and edges.
        """
        surfaces = [surface(part) for part in parts]
        points = np.concatenate([s.vertices for s in surfaces])
        low, high = points.min(0), points.max(0)
        center, scale = (low + high) / 2, 2 / float(np.linalg.norm(high - low))  # a sphere of radius 1 holds everything
        entities = [self._entity(s, center, scale) for s in surfaces]
        for entity in entities:
            self._scene.add_entity(entity)
        try:
            return [self._shoot(camera, center, scale, background, supersample) for camera in cameras]
        finally:
            for entity in entities:
                self._scene.remove_entity(entity)

    def close(self) -> None:
        """Give back what the driver holds."""
        self._cameras.clear()
        self._scene.clear()
        del self._scene

    def _entity(self, s: Surface, center: np.ndarray, scale: float) -> Any:
        render = self._sapien.render
        material = render.RenderMaterial()
        material.base_color = [*s.color, 1.0]
        material.metallic, material.roughness, material.specular = s.metallic, s.roughness, 0.5
        if s.color_map is not None:
            material.base_color_texture = self._texture(s.color_map, "R8G8B8A8Unorm", srgb=True)
        if s.roughness_map is not None:
            material.roughness_texture = self._texture(s.roughness_map, "R8Unorm", srgb=False)
        if s.metallic_map is not None:
            material.metallic_texture = self._texture(s.metallic_map, "R8Unorm", srgb=False)
        vertices = ((s.vertices - center) * scale).astype(np.float32)
        body = render.RenderBodyComponent()
        body.attach(render.RenderShapeTriangleMesh(vertices, s.faces, s.normals, s.uv, material))
        entity = self._sapien.Entity()
        entity.add_component(body)
        return entity

    def _texture(self, image: np.ndarray, pixel_format: str, *, srgb: bool) -> Any:
        array = np.ascontiguousarray(image if image.ndim == 3 else image[..., None])
        return self._sapien.render.RenderTexture2D(array=array, format=pixel_format, srgb=srgb)

    def _camera(self, width: int, height: int) -> tuple[Any, Any]:
        if (width, height) not in self._cameras:
            component, entity = (
                self._sapien.render.RenderCameraComponent(width, height, str(SHADERS)),
                self._sapien.Entity(),
            )
            entity.add_component(component)
            self._scene.add_entity(entity)
            self._cameras[width, height] = component, entity
        return self._cameras[width, height]

    def _shoot(
        self, camera: Camera, center: np.ndarray, scale: float, background: tuple[int, int, int], k: int
    ) -> Frame:
        component, entity = self._camera(camera.width_px * k, camera.height_px * k)
        position = (camera.position - center) * scale
        distance = float(np.linalg.norm(position))
        near, far = max(0.02, distance - 1.05), distance + 1.05
        component.set_fovy(camera.fov_y_rad, True)
        component.near, component.far = near, far
        right, up, backward = camera.camera_to_object[:3, :3].T
        entity.set_pose(self._sapien.Pose(transform(np.stack([-backward, -right, up], 1), position)))
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
