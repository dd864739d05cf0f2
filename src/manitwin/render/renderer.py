"""Pictures of meshes with SAPIEN: colour, depth and part ids, lit like an object on a turntable in a studio.

The object turns, the lights do not: they hang on the camera, so every view is exposed alike. SAPIEN's ``minimal``
shaders are used: forward shading costs 0.13 CPU-s a megapixel on lavapipe where the deferred ``default`` ones cost 0.3
(measured). Normals are not drawn: ``manitwin.render.raycast`` gives exact ones.
"""

from __future__ import annotations

import atexit
import os
import tempfile
import warnings
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
import trimesh

from manitwin.geometry.poses import transform
from manitwin.render.cameras import Camera
from manitwin.render.device import RenderDevice, require_renderer
from manitwin.render.frame import Frame, reduced_frame
from manitwin.render.surfaces import Surface, surface

BACKDROP = (233, 235, 238)  # light enough to be no colour, dark enough that white things stand out
SUPERSAMPLE = 2  # SAPIEN's edges are not antialiased; twice the size each way removes the steps that are seen

# Direction of light and its irradiance, in the camera's axes (x right, y up, -z forward): key and fill. White paper
# that faces the camera gets 0.9 of what the picture can show, paper that faces the key light all of it.
LIGHTS = (((0.55, -0.75, -0.75), 1.8), ((-0.9, -0.1, -0.75), 0.8))
AMBIENT = 0.18
SKY, HORIZON, GROUND = 0.30, 0.18, 0.10  # the studio's own glow, from above, around and below (linear radiance)


_shared: tuple[int, Renderer] | None = None


def shared_renderer() -> Renderer:
    """Return this process's renderer, made at the first call; raises RendererMissing where nothing renders.

    Making one costs some 10 CPU-seconds, a picture with it a tenth of one.
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
        sapien.render.set_camera_shader_dir("minimal")
        self._scene: Any = sapien.Scene([sapien.render.RenderSystem()])
        self._scene.set_ambient_light([AMBIENT] * 3)
        self._rig: Any = sapien.Entity()
        for direction, irradiance in LIGHTS:
            light = sapien.render.RenderDirectionalLightComponent()
            light.color = [irradiance] * 3
            light.shadow = False
            light.local_pose = sapien.Pose(
                q=sapien.math.shortest_rotation([1, 0, 0], _sapien_axes(np.array(direction)))
            )
            self._rig.add_component(light)
        self._scene.add_entity(self._rig)
        self._cameras: dict[tuple[int, int], tuple[Any, Any]] = {}
        with tempfile.TemporaryDirectory() as folder:
            self._scene.render_system.cubemap = sapien.render.RenderCubemap(*_studio_cubemap(folder))
            self._scene.update_render()
            self._camera(16, 16)[0].take_picture()  # the files are read only now; so are the pipelines compiled

    def render(
        self,
        parts: Sequence[trimesh.Trimesh],
        cameras: Sequence[Camera],
        *,
        background: tuple[int, int, int] = BACKDROP,
        supersample: int = SUPERSAMPLE,
    ) -> list[Frame]:
        """Draw ``parts``, meshes in the object frame, from each camera, over a background colour.

        ``supersample`` smooths the edges of ``rgb``; with 1, ``depth`` and ``ids`` are those of the rays through the
        pixels' centres (measured: 1e-7 m on an object of 0.1 m), with 2 they are a little off at creases and edges.
        """
        surfaces = [surface(part) for part in parts]
        points = np.concatenate([s.vertices for s in surfaces])
        low, high = points.min(0), points.max(0)
        center, scale = (low + high) / 2, 2 / float(np.linalg.norm(high - low))  # a sphere of radius 1 holds everything
        entities = [self._entity(s, center, scale) for s in surfaces]
        for entity in entities:
            self._scene.add_entity(entity)
        try:
            ids = np.full(max(entity.per_scene_id for entity in entities) + 1, -1, dtype=np.int32)
            ids[[entity.per_scene_id for entity in entities]] = np.arange(len(entities))
            return [self._shoot(camera, center, scale, ids, background, supersample) for camera in cameras]
        finally:
            for entity in entities:
                self._scene.remove_entity(entity)

    def close(self) -> None:
        """Give back what the driver holds."""
        self._cameras.clear()
        self._scene.clear()
        del self._rig, self._scene

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
            component, entity = self._sapien.render.RenderCameraComponent(width, height), self._sapien.Entity()
            entity.add_component(component)
            self._scene.add_entity(entity)
            self._cameras[width, height] = component, entity
        return self._cameras[width, height]

    def _shoot(
        self,
        camera: Camera,
        center: np.ndarray,
        scale: float,
        ids: np.ndarray,
        background: tuple[int, int, int],
        k: int,
    ) -> Frame:
        component, entity = self._camera(camera.width_px * k, camera.height_px * k)
        position = (camera.position - center) * scale
        distance = float(np.linalg.norm(position))
        near, far = max(0.02, distance - 1.05), distance + 1.05
        component.set_fovy(camera.fov_y_rad, True)
        component.near, component.far = near, far
        backward, right, up = (
            camera.camera_to_object[:3, 2],
            camera.camera_to_object[:3, 0],
            camera.camera_to_object[:3, 1],
        )
        pose = self._sapien.Pose(transform(np.stack([-backward, -right, up], 1), position))
        entity.set_pose(pose)
        self._rig.set_pose(pose)
        self._scene.update_render()
        component.take_picture()
        color = component.get_picture("Color")[..., :3]
        part = ids[np.clip(component.get_picture("PositionSegmentation")[..., 3], 0, len(ids) - 1)]
        buffer = component.get_picture("GbufferDepth").reshape(part.shape).astype(np.float64)
        depth = near * far / (far - buffer * (far - near)) / scale
        return reduced_frame(color, part, depth, background=background, supersample=k, radius=1 / scale)


def _sapien_axes(direction: np.ndarray) -> np.ndarray:
    """Turn a direction in OpenGL's camera axes into SAPIEN's (x forward, y left, z up)."""
    return np.array([-direction[2], -direction[0], direction[1]]) / np.linalg.norm(direction)


def _studio_cubemap(folder: str) -> list[str]:
    """Write the soft surroundings that shiny things mirror: six faces, y up, which SAPIEN takes from files only."""
    size = 64
    across = np.linspace(-1, 1, size)
    height = -across[:, None] / np.sqrt(1 + across[:, None] ** 2 + across[None] ** 2)
    side = np.where(height > 0, HORIZON + (SKY - HORIZON) * height, HORIZON + (HORIZON - GROUND) * height)
    top, bottom = np.full((size, size), SKY), np.full((size, size), GROUND)
    paths = []
    for name, level in (("px", side), ("nx", side), ("py", top), ("ny", bottom), ("pz", side), ("nz", side)):
        paths.append(os.path.join(folder, f"{name}.png"))
        srgb = np.rint(np.repeat(level[..., None], 3, 2) ** (1 / 2.2) * 255).astype(np.uint8)
        cv2.imwrite(paths[-1], srgb)
    return paths
