"""Photos of objects with known shape: templates rendered on a table, with light, shadow and noise, and their truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import trimesh

from manitwin.geometry.poses import transform
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import ObjectDescription
from manitwin.models.generators.templates.look_phrases import LookRequest
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.models.generators.templates.template_object import TemplateObject, visual_parts
from manitwin.render.cameras import Camera, framing_camera
from manitwin.render.procedural_textures import procedural_texture, textured_box
from manitwin.render.scene_lighting import DirectionalLight, Lighting
from manitwin.render.scene_renderer import SceneRenderer, ShadowRegion, Surroundings

WIDTH_PX, HEIGHT_PX = 1024, 768
ELEVATIONS_DEG = (10.0, 30.0, 55.0)
FRONT_AZIMUTH_DEG = -90.0  # templates face -Y
FOV_Y_DEG = (22.0, 42.0)  # 60 to 31 mm on a sensor 24 mm high
PULLED_BACK = (1.25, 1.7)  # of the distance at which the object fills the picture
TURNED_DEG = 40.0  # people turn an object so that its front is visible, but rarely exactly
NOISE = 1.5  # grey values, of a phone in good light
TABLE_EVERY = 4
TABLE_TOP_M = 0.02
LEAST_DRAWN_M = (
    0.5  # of small things' scenes larger ones of the same look are drawn: shadow maps have least steps in metres
)
# sRGB of floor and backdrop: papers, table tops and walls
GROUNDS = (
    ((236, 236, 234), (240, 240, 240)),
    ((206, 205, 202), (216, 218, 221)),
    ((222, 210, 188), (232, 226, 214)),
    ((172, 184, 196), (190, 200, 210)),
    ((128, 130, 132), (150, 152, 155)),
    ((70, 72, 76), (92, 94, 98)),
    ((150, 176, 150), (176, 196, 176)),
)
TABLES = ("wood", "cloth", "marble")


@dataclass(frozen=True)
class TemplatePhoto:
    """A photo with its truth: ``rgb (H, W, 3) uint8``, ``mask (H, W) bool``, the object and the camera's direction.

    ``azimuth_deg`` is that of the camera in the object's frame, 0 along +X, counter-clockwise; ``ground`` is a name.
    """

    rgb: np.ndarray
    mask: np.ndarray
    made: TemplateObject
    camera: Camera
    elevation_deg: float
    azimuth_deg: float
    ground: str

    @property
    def truth(self) -> trimesh.Trimesh:
        """Return the object's closed mesh in its frame, metres."""
        return trimesh.Trimesh(self.made.mesh.vertices, self.made.mesh.faces, process=False)


def photograph(
    category: str,
    seed: int,
    elevations_deg: Sequence[float] = ELEVATIONS_DEG,
    *,
    turns_deg: Sequence[float] = (0.0,),
    wish: LookRequest | None = None,
) -> list[TemplatePhoto]:
    """Photograph one object of a category from each elevation and each turn about the vertical; the seed determines the rest.

    ``wish`` is the colour or material of the whole object; raises UsageError where it cannot be made so.
    """
    rng = np.random.default_rng([seed, *category.encode()])
    made = make_object(load_templates()[category], ObjectDescription(category, {} if wish is None else {"": wish}), rng)
    shots = photographed(visual_parts(made), rng, elevations_deg, turns_deg=turns_deg)
    return [TemplatePhoto(shot.rgb, shot.mask, made, shot.camera, *shot.seen_from, shot.ground) for shot in shots]


@dataclass(frozen=True)
class Shot:
    """A photo of any object: ``rgb (H, W, 3) uint8``, ``mask (H, W) bool``; ``seen_from`` is elevation and azimuth, degrees."""

    rgb: np.ndarray
    mask: np.ndarray
    camera: Camera
    seen_from: tuple[float, float]
    ground: str


def photographed(
    parts: Sequence[trimesh.Trimesh],
    rng: np.random.Generator,
    elevations_deg: Sequence[float] = ELEVATIONS_DEG,
    *,
    turns_deg: Sequence[float] = (0.0,),
) -> list[Shot]:
    """Photograph the visual parts of an object that stands on z = 0 of its frame with its front towards -Y."""
    points = np.concatenate([part.vertices for part in parts])
    drawn = max(1.0, LEAST_DRAWN_M / float(np.linalg.norm(np.ptp(points, axis=0))))
    size_m = drawn * float(np.linalg.norm(np.ptp(points, axis=0)))
    start_deg = FRONT_AZIMUTH_DEG + rng.uniform(-TURNED_DEG, TURNED_DEG)
    fov_deg, back = rng.uniform(*FOV_Y_DEG), rng.uniform(*PULLED_BACK)
    number = int(rng.integers(TABLE_EVERY * len(GROUNDS)))
    floor, backdrop = GROUNDS[number % len(GROUNDS)]
    table = number // len(GROUNDS) == 0
    shots = []
    with SceneRenderer(
        _lighting(rng, start_deg),
        surroundings=Surroundings(-0.0005 * size_m - (drawn * TABLE_TOP_M if table else 0.0), floor, backdrop),
        shadows=ShadowRegion((0.0, 0.0, size_m / 2), 1.2 * size_m),
    ) as scene:
        ground = "plain"
        if table:
            ground = TABLES[int(rng.integers(len(TABLES)))]
            texture = procedural_texture(ground, int(rng.integers(8)))
            top = textured_box(np.array([1.5, 1.5, TABLE_TOP_M / 2]), texture)
            below_m = drawn * TABLE_TOP_M / 2 + 0.0004 * size_m
            scene.add("table", [top.apply_scale(drawn)], transform(np.eye(3), [0, 0, -below_m]))
        number = scene.add("thing", [part.copy().apply_scale(drawn) for part in parts])
        for elevation in elevations_deg:
            for turn in turns_deg:
                azimuth = start_deg + turn
                camera = _pulled_back(points, azimuth, elevation, fov_deg, back)
                frame = scene.render([_scaled(camera, drawn)], geometry=True)[0]
                assert frame.ids is not None
                rgb = _exposed(frame.rgb, rng)
                shots.append(Shot(rgb, frame.ids == number, camera, (elevation, azimuth), ground))
    return shots


def _pulled_back(points: np.ndarray, azimuth_deg: float, elevation_deg: float, fov_deg: float, by: float) -> Camera:
    camera = framing_camera(
        points,
        azimuth_deg=azimuth_deg,
        elevation_deg=elevation_deg,
        fov_y_deg=fov_deg,
        width_px=WIDTH_PX,
        height_px=HEIGHT_PX,
    )
    center = (points.min(0) + points.max(0)) / 2
    pose = camera.camera_to_object.copy()
    backward = pose[:3, 2]
    pose[:3, 3] += (by - 1) * float((pose[:3, 3] - center) @ backward) * backward
    return Camera(pose, camera.fov_y_rad, WIDTH_PX, HEIGHT_PX)


def _scaled(camera: Camera, by: float) -> Camera:
    """Return the camera for a scene scaled by a factor."""
    pose = camera.camera_to_object.copy()
    pose[:3, 3] *= by
    return Camera(pose, camera.fov_y_rad, camera.width_px, camera.height_px)


def _lighting(rng: np.random.Generator, camera_azimuth_deg: float) -> Lighting:
    """Return the light of a window on one side above, and of the room."""
    side = np.deg2rad(camera_azimuth_deg + rng.choice([-1, 1]) * rng.uniform(25, 75))
    height = rng.uniform(0.9, 1.8)
    toward = np.array([-np.cos(side), -np.sin(side), -height])
    strength = rng.uniform(0.7, 1.5)
    warm = np.array([1.0, rng.uniform(0.94, 1.0), rng.uniform(0.85, 1.0)])
    return Lighting(np.array([0.5, 0.51, 0.53]), (DirectionalLight(toward, strength * warm, casts_shadow=True),))


def _exposed(rgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the picture with a slight lens blur and sensor noise."""
    soft = cv2.GaussianBlur(rgb.astype(np.float32), (0, 0), 0.7)
    noise = rng.normal(0, NOISE, rgb.shape).astype(np.float32)
    return np.clip(np.rint(soft + noise), 0, 255).astype(np.uint8)
