"""Rendering of scenes with many rigid objects: colour, depth, normals and ids, from several cameras at once.

Objects are uploaded once, and only their poses change between frames; a ``Drawable`` that is shown again, even by another
renderer, is not uploaded again. Colour is rendered by ``shaders/scene`` at twice the resolution: shading is evaluated once per
pixel on smooth surfaces and at each of its four samples elsewhere, with one shadow map per light and a height map for ambient
occlusion. Depth, normals and ids are rendered by ``shaders/geometry`` with one sample at each pixel's centre, so that no pixel
mixes two objects.
"""

from __future__ import annotations

import atexit
import weakref
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import trimesh

from manitwin.errors import UsageError
from manitwin.geometry.poses import transform
from manitwin.render.cameras import Camera, sapien_axes
from manitwin.render.device import render_scene
from manitwin.render.drawable import Drawable, prepare_drawable
from manitwin.render.scene_lighting import STUDIO, Lighting
from manitwin.render.surfaces import plain_part, render_surface, scene_shape

SHADERS = Path(__file__).parent / "shaders"
SUPERSAMPLE = 2  # shaders/scene shades blocks of 2 x 2
NEAR_M, FAR_M = 0.01, 30.0
MAX_LIGHTS = 5  # shaders/scene supports six, of which one looks down for the sky
SHADOW_MAP_PX = 1024
"""Largest side of the shadow map; the height map has half as many texels."""
SHADOW_TEXELS_A_PIXEL = 2.5
"""Texels of the shadow map's side per image pixel: an image spans about a third of the shadow region."""
PICTURE_FORMATS = {
    "Color": "R8G8B8A8Unorm",
    "Albedo": "R8G8B8A8Unorm",
    "Normal": "R8G8B8A8Unorm",
    "WorldNormal": "R32G32B32A32Sfloat",
    "Distance": "R32Sfloat",
}


@dataclass(frozen=True)
class Surroundings:
    """A level floor below a scene that fades into a uniform backdrop; colours in sRGB, ``floor_z_m`` in the world frame."""

    floor_z_m: float = -0.75
    floor: tuple[int, int, int] = (172, 170, 166)
    backdrop: tuple[int, int, int] = (214, 217, 221)


@dataclass(frozen=True)
class ShadowRegion:
    """The sphere in which shadows are rendered (world frame, metres); smaller is sharper. ``map_px``: side of the shadow map."""

    center_m: tuple[float, float, float] = (0.3, 0.0, 0.3)
    radius_m: float = 1.3
    map_px: int = SHADOW_MAP_PX

    def for_pictures_of(self, picture_px: int) -> ShadowRegion:
        """Return this region with as many texels as images with a side of ``picture_px`` can show."""
        return replace(self, map_px=min(round(SHADOW_TEXELS_A_PIXEL * picture_px), SHADOW_MAP_PX))


@dataclass(frozen=True)
class SceneFrame:
    """An image of size (H, W) from one camera; all fields but ``rgb`` are None unless requested.

    ``rgb (H, W, 3) uint8`` sRGB. For the surface at each pixel's centre: ``depth_m (H, W) float32`` along the viewing axis (0:
    no surface), ``normals (H, W, 3) float32``, the unit shading normal in the world frame facing the camera, and ``ids (H, W)
    uint16``, 0 for floor and backdrop.
    """

    rgb: np.ndarray
    depth_m: np.ndarray | None = None
    normals: np.ndarray | None = None
    ids: np.ndarray | None = None


class SceneRenderer:
    """A scene that is rendered repeatedly. Call ``close`` at the end, or use it in a ``with`` statement.

    Raises RendererMissing if no device renders.
    """

    def __init__(
        self,
        lighting: Lighting = STUDIO,
        *,
        surroundings: Surroundings | None = Surroundings(),
        shadows: ShadowRegion = ShadowRegion(),
    ) -> None:
        self._sapien, self._scene = render_scene(PICTURE_FORMATS)
        self._entities: dict[str, tuple[int, Any]] = {}
        self._casters: dict[str, Any] = {}
        self._cameras: dict[tuple[str, int, int, int], tuple[Any, Any]] = {}
        backdrop = np.zeros(3) if surroundings is None else np.array(surroundings.backdrop, np.float32)
        seen = (1 - np.arange(256, dtype=np.float32) / 255)[:, None] * backdrop
        self._backdrop_seen = np.rint(seen).astype(np.uint8)[:, None]  # (256, 1, 3), by opacity
        self._add_lights(lighting, shadows)
        self._floor_to_add = surroundings
        _open_renderers.add(self)

    def __enter__(self) -> SceneRenderer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the driver's resources."""
        _open_renderers.discard(self)
        self._cameras.clear()
        self._entities.clear()
        self._casters.clear()
        if self._scene is not None:
            self._scene.clear()
        self._scene = None

    @property
    def ids(self) -> dict[str, int]:
        """The ids of the objects by name, from 1 in the order in which they were added."""
        return {name: number for name, (number, _) in self._entities.items()}

    def add(self, name: str, thing: Drawable | Sequence[trimesh.Trimesh], pose: np.ndarray | None = None) -> int:
        """Add an object, or visual parts in their own frame, at ``thing_to_world (4, 4)``; return its id.

        Raises UsageError for a name in use.
        """
        if name in self._entities:
            raise UsageError(f"the scene has a thing {name!r} already; give each its own name")
        uploaded = _uploaded(self._sapien.render, thing if isinstance(thing, Drawable) else prepare_drawable(thing))
        number = len(self._entities) + 1
        seen = self._sapien.render.RenderBodyComponent()
        for each in uploaded.surfaces:
            seen.attach(each.clone())  # a shape belongs to one body; its clone shares vertices and textures
        entity = self._add_component(seen, np.eye(4) if pose is None else pose)
        _exclude_from_shadows(seen)
        self._entities[name] = number, entity
        self._casters[name] = self._shadow_caster(uploaded.shadow, entity.pose)
        return number

    def _shadow_caster(self, shape: Any, pose: Any) -> Any:
        """Add an invisible object that casts a shadow."""
        body = self._sapien.render.RenderBodyComponent()
        body.attach(shape.clone())
        entity = self._add_component(body, np.eye(4))
        entity.set_pose(pose)
        # rendered only by a second G-buffer pass, which shaders/scene lacks, and into shadow maps
        body.shading_mode = 1
        return entity

    def set_pose(self, name: str, pose: np.ndarray) -> None:
        """Move an object to ``thing_to_world (4, 4)``."""
        placed = self._sapien.Pose(pose)
        self._entities[name][1].set_pose(placed)
        self._casters[name].set_pose(placed)

    def render(self, cameras: Sequence[Camera], *, geometry: bool = False) -> list[SceneFrame]:
        """Render the scene from each camera (``camera_to_object`` is its pose in the world); with ``geometry``, all fields of a
        frame.
        """
        if self._floor_to_add is not None:  # added last, so that only its visible part is shaded
            self._add_floor(self._floor_to_add)
            self._floor_to_add = None
        color = [self._camera("scene", i, camera, SUPERSAMPLE) for i, camera in enumerate(cameras)]
        numbers = [self._camera("geometry", i, camera, 1) for i, camera in enumerate(cameras)] if geometry else []
        self._scene.update_render()
        for component in (*color, *numbers):
            component.take_picture()
        if not geometry:
            return [SceneFrame(self._rgb(c, camera)) for c, camera in zip(color, cameras, strict=True)]
        return [
            SceneFrame(self._rgb(c, camera), *self._geometry(g))
            for c, g, camera in zip(color, numbers, cameras, strict=True)
        ]

    def _rgb(self, component: Any, camera: Camera) -> np.ndarray:
        picture = component.get_picture("Color")[: camera.height_px, : camera.width_px]  # the rest is not rendered
        opacity, rgb = cv2.extractChannel(picture, 3), cv2.cvtColor(picture, cv2.COLOR_RGBA2RGB)
        if opacity.min() == 255:
            return np.asarray(rgb)
        return np.asarray(cv2.add(rgb, cv2.applyColorMap(opacity, self._backdrop_seen)))

    def _geometry(self, component: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        normals, entity = component.get_picture("WorldNormal"), component.get_picture("Segmentation")[..., 0]
        depth = component.get_picture("Distance").reshape(entity.shape)
        table = np.zeros(int(entity.max()) + 1, np.uint16)
        for number, thing in self._entities.values():
            if thing.per_scene_id < len(table):
                table[thing.per_scene_id] = number
        return depth, np.ascontiguousarray(normals[..., :3]), table[entity]

    def _camera(self, shader: str, slot: int, camera: Camera, k: int) -> Any:
        key = (shader, slot, camera.width_px * k, camera.height_px * k)
        if key not in self._cameras:
            component = self._sapien.render.RenderCameraComponent(key[2], key[3], str(SHADERS / shader))
            self._cameras[key] = component, self._add_component(component, np.eye(4))
        component, entity = self._cameras[key]
        component.set_fovy(camera.fov_y_rad, True)
        component.near, component.far = NEAR_M, FAR_M
        entity.set_pose(self._sapien.Pose(transform(sapien_axes(camera), camera.position)))
        return component

    def _add_component(self, component: Any, pose: np.ndarray) -> Any:
        entity = self._sapien.Entity()
        entity.add_component(component)
        entity.set_pose(self._sapien.Pose(pose))
        self._scene.add_entity(entity)
        return entity

    def _add_lights(self, lighting: Lighting, region: ShadowRegion) -> None:
        if len(lighting.lights) > MAX_LIGHTS:
            raise UsageError(
                f"a scene has at most {MAX_LIGHTS} directional lights; leave out some of the {len(lighting.lights)}"
            )
        if sum(light.casts_shadow for light in lighting.lights) > 1:
            raise UsageError("of a scene's directional lights one at most casts shadows; switch it off for the others")
        lighting = lighting.with_auto_exposure()
        self._scene.set_ambient_light(lighting.ambient.tolist())
        # the order expected by the shader: the one looking down, the one with shadows, the others
        self._add_shadowed(np.array([0.0, 0.0, -1.0]), np.zeros(3), region, region.map_px // 2)
        for light in sorted(lighting.lights, key=lambda light: not light.casts_shadow):
            if light.casts_shadow:
                self._add_shadowed(light.direction, light.color, region, region.map_px)
            else:
                self._scene.add_directional_light(light.direction.tolist(), light.color.tolist())

    def _add_shadowed(self, direction: np.ndarray, color: np.ndarray, region: ShadowRegion, map_px: int) -> None:
        self._scene.add_directional_light(
            direction.tolist(),
            color.tolist(),
            shadow=True,
            position=list(region.center_m),
            shadow_scale=region.radius_m,
            shadow_near=-2 * region.radius_m,
            shadow_far=2 * region.radius_m,
            shadow_map_size=map_px,
        )

    def _add_floor(self, surroundings: Surroundings) -> None:
        corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [12, 12, 1] + [
            0,
            0,
            surroundings.floor_z_m,
        ]
        floor = plain_part(
            trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False), surroundings.floor, roughness=0.9
        )
        shape = scene_shape(self._sapien.render, render_surface(floor))
        shape.material.set_emission([0.0, 0.0, 0.0, 1.0])  # tells the shader to fade it
        body = self._sapien.render.RenderBodyComponent()
        body.attach(shape)
        self._add_component(body, np.eye(4))
        _exclude_from_shadows(body)  # nothing is below it


def _exclude_from_shadows(body: Any) -> None:
    """Exclude a body in a scene from the shadow and height maps."""
    for part in body._internal_node.children:  # the only access in SAPIEN 3.0.3
        part.cast_shadow = False


@dataclass(frozen=True)
class _Uploaded:
    """SAPIEN's shapes of a Drawable."""

    surfaces: tuple[Any, ...]
    shadow: Any


def _uploaded(render: Any, thing: Drawable) -> _Uploaded:
    if thing not in _shapes:
        surfaces = tuple(scene_shape(render, each) for each in thing.surfaces)
        _shapes[thing] = _Uploaded(surfaces, scene_shape(render, thing.shadow))
    return _shapes[thing]


_shapes: weakref.WeakKeyDictionary[Drawable, _Uploaded] = weakref.WeakKeyDictionary()
_open_renderers: weakref.WeakSet[SceneRenderer] = weakref.WeakSet()


@atexit.register
def _close_all() -> None:
    """Release renderers and shapes before interpreter shutdown, as SAPIEN 3.0.3 crashes if they are released later."""
    for renderer in list(_open_renderers):
        renderer.close()
    _shapes.clear()
