"""Composites whose mask is known exactly: things of templates on grounds of the project's own making.

A picture has a ground plane and sometimes a wall behind it, with the texture in perspective; the thing's own shadow on the ground
(its mesh projected along the light, from several points of a lamp of some extent); light that falls off; the blur, noise
and JPEG of a camera. Kinds: ``single`` (one whole thing: to be accepted), ``cut`` (the frame cuts it off) and ``several``
(two or three things of like size): to be rejected. Same part and number: same picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from manitwin.errors import ManiTwinError
from manitwin.geometry.poses import inverse, transform_points
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.made import make, visual_parts
from manitwin.models.generators.templates.text import Wanted, Wish
from manitwin.render.cameras import Camera, framing_camera
from manitwin.render.procedural_textures import periodic_noise, procedural_texture
from manitwin.render.renderer import shared_renderer

Part = Literal["tuning", "held-out", "calibration", "training"]
Kind = Literal["single", "cut", "several"]

WIDTH_PX, HEIGHT_PX = 640, 512
GROUNDS: dict[Part, tuple[str, ...]] = {
    "tuning": ("plain", "plain", "plain", "paper", "paper", "wood", "cloth", "concrete"),
    "held-out": ("plain", "plain", "plain", "paper", "wood", "marble", "metal", "carpet", "tiles", "felt"),
    "calibration": (
        *("plain", "plain", "plain", "paper", "wood", "cloth", "concrete"),
        *("terrazzo", "linen", "leather", "checks"),
    ),
    "training": (
        *("plain", "plain", "plain", "paper", "wood", "cloth", "concrete"),
        *("terrazzo", "linen", "leather", "checks"),
    ),
}
SEEDS: dict[Part, int] = {"tuning": 0, "held-out": 1, "calibration": 2, "training": 3}
UNSEEN = 4  # one of so many categories is in no picture of the training part
FLAT = 0.3  # height over footprint, below which a thing lies and is photographed from above
CLEAR = ("glass", "wine glass", "glass bottle", "jar", "vase", "bottle", "water bottle", "measuring cup")


@dataclass(frozen=True)
class Composite:
    """``rgb (H, W, 3) uint8``; ``truth (H, W) bool``: where the thing covers at least half of the pixel.

    ``setting`` is the ground's family, with ``wall``, ``clutter``, ``same colour`` or ``clear`` where that is so.
    """

    rgb: np.ndarray
    truth: np.ndarray
    kind: Kind
    category: str
    setting: str


@dataclass(frozen=True)
class _Thing:
    """A thing seen by ``camera``: ``rgb`` linear light times ``coverage``, vertices (N, 3) and faces, object frame."""

    rgb: np.ndarray
    coverage: np.ndarray
    vertices: np.ndarray
    faces: np.ndarray
    camera: Camera
    category: str
    clear: bool


def composite(part: Part, number: int) -> Composite:
    """Make a picture of one of the parts by its number."""
    rng = np.random.default_rng([number, SEEDS[part]])
    drawn = rng.random()
    kind: Kind = "single" if drawn < 0.72 else "cut" if drawn < 0.86 else "several"
    things = [_thing(rng, None, part)]
    main = things[0]
    placements = [_placement(rng, main, kind)]
    if kind == "several":
        for _ in range(int(rng.integers(1, 3))):
            other = _thing(rng, main, part)
            places = [_placement(rng, other, "single", scale=float(rng.uniform(0.35, 0.5))) for _ in range(30)]
            apart = [p for p in places if not _overlap(things, placements, other, p)]
            if apart:
                things.append(other)
                placements.append(apart[0])
        kind = "several" if len(things) > 1 else "single"
    ground, setting = _ground(rng, part, main, placements[0])
    light = ground.copy()
    lamp = _lamp(rng, main.camera)
    for thing, placement in zip(things, placements, strict=True):
        light *= _shadow(rng, thing, placement, lamp)
    truth = np.zeros((HEIGHT_PX, WIDTH_PX), bool)
    for thing, placement in zip(things, placements, strict=True):
        smooth = 0.45 * max(0.0, 1 / placement[0, 0] - 1) + 1e-3  # what is smaller than a pixel would flicker
        rgb, coverage = (
            cv2.warpAffine(cv2.GaussianBlur(x, (0, 0), smooth), placement, (WIDTH_PX, HEIGHT_PX))
            for x in (thing.rgb, thing.coverage)
        )
        light = _over(rng, light, rgb, coverage, clear=thing.clear)
        truth |= coverage > 0.5
    if main.clear:
        setting += ", clear"
    return Composite(_photographed(rng, light), truth, kind, main.category, setting)


def is_unseen(category: str) -> bool:
    """Return whether a category is kept out of the training part."""
    return sorted(load_templates()).index(category) % UNSEEN == 0


def _thing(rng: np.random.Generator, beside: _Thing | None, part: Part) -> _Thing:
    templates = load_templates()
    names = [name for name in sorted(templates) if part != "training" or not is_unseen(name)]
    while True:
        category = names[int(rng.integers(len(names)))]
        wish = Wish(rgb=tuple(rng.uniform(0.03, 0.97, 3))) if rng.random() < 0.3 else Wish()  # type: ignore[arg-type]
        try:
            made = make(templates[category], Wanted(category, {"": wish}), rng)
        except ManiTwinError:
            continue
        break
    parts = visual_parts(made)
    vertices = made.mesh.vertices
    extents = np.ptp(vertices, axis=0)
    flat = extents[2] < FLAT * extents[:2].max()
    elevation = float(rng.uniform(40, 89) if flat else rng.triangular(3, 18, 60))
    camera = framing_camera(
        vertices,
        azimuth_deg=float(rng.uniform(0, 360)),
        elevation_deg=elevation if beside is None else _elevation_deg(beside.camera),
        fov_y_deg=float(rng.uniform(18, 45)),
        width_px=WIDTH_PX,
        height_px=HEIGHT_PX,
    )
    frame = shared_renderer().render(parts, [camera], background=(0, 0, 0))[0]
    rgb = _linear(frame.rgb) * np.float32(rng.uniform(0.75, 1.15))
    rgb *= _printed(rng, frame.coverage) * _sided(rng)[None, :, None]
    clear = category in CLEAR and rng.random() < 0.5
    return _Thing(rgb, frame.coverage, vertices, made.mesh.faces, camera, category, clear)


def _elevation_deg(camera: Camera) -> float:
    return float(np.rad2deg(np.arcsin(np.clip(camera.camera_to_object[2, 2], -1, 1))))


def _printed(rng: np.random.Generator, coverage: np.ndarray) -> np.ndarray:
    """Return factors (H, W, 3) of a print, a label or a pattern on half of the things, 1 elsewhere."""
    factors = np.full((*coverage.shape, 3), 100, np.uint8)  # of a hundred
    if rng.random() < 0.5:
        return np.ones(factors.shape, np.float32)
    ys, xs = np.nonzero(coverage > 0.5)
    if not len(xs):
        return factors
    low, high = np.array([xs.min(), ys.min()]), np.array([xs.max(), ys.max()])
    for _ in range(int(rng.integers(1, 5))):
        at = low + rng.uniform(0.1, 0.9, 2) * (high - low)
        size = rng.uniform(0.05, 0.35, 2) * (high - low)
        color = tuple(float(c) for c in rng.uniform(10, 160, 3))
        if rng.random() < 0.5:
            box = cv2.boxPoints((at.tolist(), size.tolist(), float(rng.uniform(-20, 20)))).astype(np.int32)
            cv2.fillConvexPoly(factors, box, color, lineType=cv2.LINE_AA)
        else:
            word = "".join(chr(int(c)) for c in rng.integers(65, 91, 5))
            cv2.putText(factors, word, at.astype(int).tolist(), 0, float(rng.uniform(0.5, 2.5)), color, 3, cv2.LINE_AA)
    return factors.astype(np.float32) / 100


def _sided(rng: np.random.Generator) -> np.ndarray:
    """Return light (W,) that comes more from one side."""
    return np.linspace(1, float(rng.uniform(0.7, 1.4)), WIDTH_PX, dtype=np.float32)


def _placement(rng: np.random.Generator, thing: _Thing, kind: Kind, scale: float | None = None) -> np.ndarray:
    """Return the map (2, 3) from the thing's own picture to the composite."""
    ys, xs = np.nonzero(thing.coverage > 0.5)
    low, high = np.array([xs.min(), ys.min()]), np.array([xs.max(), ys.max()]) + 1
    size = np.array([WIDTH_PX, HEIGHT_PX])
    scale = float(rng.uniform(0.4, 1.0)) if scale is None else scale
    room = size - scale * (high - low)
    corner = rng.uniform(0.05, 0.95, 2) * room
    if kind == "cut":
        side, share = int(rng.integers(4)), float(rng.uniform(0.15, 0.6))
        axis = side % 2
        extent = scale * (high - low)[axis]
        corner[axis] = -share * extent if side < 2 else size[axis] - (1 - share) * extent
    return np.array([[scale, 0, corner[0] - scale * low[0]], [0, scale, corner[1] - scale * low[1]]])


def _overlap(things: list[_Thing], placements: list[np.ndarray], other: _Thing, placement: np.ndarray) -> bool:
    size = (WIDTH_PX, HEIGHT_PX)
    mask = cv2.dilate(cv2.warpAffine(other.coverage, placement, size), np.ones((25, 25))) > 0.1
    return any(
        bool((mask & (cv2.warpAffine(t.coverage, p, size) > 0.1)).any())
        for t, p in zip(things, placements, strict=True)
    )


def _ground(rng: np.random.Generator, part: Part, thing: _Thing, placement: np.ndarray) -> tuple[np.ndarray, str]:
    """Return the empty scene (H, W, 3), linear light, and what it is called."""
    family = GROUNDS[part][int(rng.integers(len(GROUNDS[part])))]
    setting = family
    scale = placement[0, 0]
    camera = thing.camera
    y, x = np.mgrid[:HEIGHT_PX, :WIDTH_PX] + 0.5
    seen = np.stack([(x - placement[0, 2]) / scale, (y - placement[1, 2]) / scale], -1)
    rays = (
        np.stack(
            [
                (seen[..., 0] - WIDTH_PX / 2) / camera.focal_px,
                -(seen[..., 1] - HEIGHT_PX / 2) / camera.focal_px,
                -np.ones_like(x),
            ],
            -1,
        )
        @ camera.camera_to_object[:3, :3].T
    )
    size_m = float(np.ptp(thing.vertices, axis=0).max())
    with np.errstate(divide="ignore"):
        reach = np.where(rays[..., 2] < -1e-6, (thing.vertices[:, 2].min() - camera.position[2]) / rays[..., 2], np.inf)
    reach_limit = float(np.linalg.norm(camera.position)) + float(rng.uniform(1.2, 4)) * size_m
    floor = reach < reach_limit
    place = camera.position[:2] + np.where(floor, reach, reach_limit)[..., None] * rays[..., :2]
    colour = _base_colour(rng, thing)
    if colour[1]:
        setting += ", same colour"
    picture = _textured(rng, family, place / size_m, colour[0])
    if not floor.all():
        if family in ("plain", "paper") and rng.random() < 0.6:  # a sheet of paper that bends up: no line behind
            depth = np.clip((np.minimum(reach, 4 * reach_limit) / reach_limit - 0.6) / 1.5, 0, 1)[..., None]
            picture = picture * (1 - depth * rng.uniform(-0.15, 0.3))
        else:
            setting += ", wall"
            wall = _textured(rng, "plain", np.stack([x, y], -1) / 200, _base_colour(rng, thing)[0])
            line = cv2.GaussianBlur(floor.astype(np.float32), (0, 0), float(rng.uniform(0.7, 4)))[..., None]
            picture = picture * line + wall * (1 - line)
    if rng.random() < 0.08:
        setting += ", clutter"
        picture = _cluttered(rng, picture, part)
    return (picture * _falloff(rng)).astype(np.float32), setting


def _base_colour(rng: np.random.Generator, thing: _Thing) -> tuple[np.ndarray, bool]:
    """Return a ground's colour, linear: mostly light and pale; in one of ten pictures that of the thing, nearly."""
    if rng.random() < 0.1:
        mean = thing.rgb[thing.coverage > 0.5].mean(0)
        return np.clip(mean * np.exp(rng.normal(0, 0.12, 3)), 0.01, 0.95), True
    drawn = rng.random()
    lightness = rng.uniform(0.5, 0.95) if drawn < 0.6 else rng.uniform(0.02, 0.5)
    tint = rng.normal(0, 0.05 if rng.random() < 0.7 else 0.4, 3)
    return np.clip(lightness * np.exp(tint), 0.01, 0.95), False


def _textured(rng: np.random.Generator, family: str, place: np.ndarray, colour: np.ndarray) -> np.ndarray:
    """Return a surface (H, W, 3), linear light, whose texture repeats over ``place`` (H, W, 2) in sizes of the thing."""
    if family == "plain":
        return np.broadcast_to(colour, (*place.shape[:2], 3)).copy()
    seed, repeat = int(rng.integers(1 << 30)), float(rng.uniform(0.15, 0.6))
    if family in ("wood", "cloth", "marble", "metal"):
        texture = _linear(procedural_texture(family, seed, size_px=512).color)
    else:
        texture = colour * np.clip(1 + _noise_of(rng, family), 0.05, 3)[..., None]
        if family == "tiles":
            repeat *= 2
    angle = rng.uniform(0, np.pi)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    at = (place @ turn * repeat * 512).astype(np.float32) % 512
    # what is smaller than a pixel is blurred, or it would flicker
    step = float(np.median(np.abs(np.diff(place, axis=1)).max(-1))) * repeat * 512
    smooth = cv2.GaussianBlur(texture.astype(np.float32), (0, 0), max(0.3, 0.5 * step), borderType=cv2.BORDER_REFLECT)
    smooth = np.pad(smooth, ((0, 1), (0, 1), (0, 0)), mode="wrap")
    return np.asarray(cv2.remap(smooth, at[..., 0], at[..., 1], cv2.INTER_LINEAR))


def _noise_of(rng: np.random.Generator, family: str) -> np.ndarray:
    """Return the relief (512, 512) of a material as deviations from its mean light."""
    if family == "paper":
        return 0.012 * periodic_noise(rng, 512, wavelengths=(0.05, 0.05), slope=0.4)
    if family == "concrete":
        clouds = periodic_noise(rng, 512, wavelengths=(0.5, 0.5), slope=1.2)
        return 0.06 * clouds + 0.03 * periodic_noise(rng, 512, wavelengths=(0.01, 0.01), slope=0.2)
    if family == "carpet":
        return 0.12 * periodic_noise(rng, 512, wavelengths=(0.02, 0.02), slope=0.2)
    if family == "felt":
        return 0.05 * periodic_noise(rng, 512, wavelengths=(0.05, 0.02), slope=0.3)
    if family == "terrazzo":
        chips = periodic_noise(rng, 512, wavelengths=(0.04, 0.04), slope=1.5)
        return float(rng.uniform(0.08, 0.3)) * np.clip(6 * (np.abs(chips) - 1.2), 0, 1) * np.sign(chips)
    if family == "linen":
        phase = 2 * np.pi * 48 * (np.arange(512) + 0.5) / 512
        threads = np.sin(phase)[:, None] * np.sin(phase)[None]
        return 0.04 * threads + 0.03 * periodic_noise(rng, 512, wavelengths=(0.3, 0.01), slope=0.4)
    if family == "leather":
        grain = np.abs(periodic_noise(rng, 512, wavelengths=(0.04, 0.04), slope=1.2))
        return np.asarray(0.1 * np.minimum(grain, 0.6) + 0.02 * periodic_noise(rng, 512, wavelengths=(0.6, 0.6)))
    if family == "checks":
        bands = np.sign(np.sin(2 * np.pi * 4 * (np.arange(512) + 0.5) / 512))
        return float(rng.uniform(0.03, 0.2)) * (bands[:, None] + bands[None]) / 2 + 0.01 * periodic_noise(
            rng, 512, wavelengths=(0.02, 0.02), slope=0.2
        )
    tiles = 0.03 * periodic_noise(rng, 512, wavelengths=(0.4, 0.4), slope=1.0)
    tiles[::128] = tiles[1::128] = tiles[:, ::128] = tiles[:, 1::128] = -float(rng.uniform(0.2, 0.6))
    return tiles


def _cluttered(rng: np.random.Generator, picture: np.ndarray, part: Part) -> np.ndarray:
    """Put other things, far out of focus, behind."""
    layer = picture.copy()
    for _ in range(int(rng.integers(2, 5))):
        other = _thing(rng, None, part)
        moved = np.array([[0.5, 0, rng.uniform(-0.2, 0.8) * WIDTH_PX], [0, 0.5, rng.uniform(-0.4, 0.1) * HEIGHT_PX]])
        rgb, coverage = (cv2.warpAffine(x, moved, (WIDTH_PX, HEIGHT_PX)) for x in (other.rgb, other.coverage))
        layer = layer * (1 - coverage[..., None]) + rgb
    return np.asarray(cv2.GaussianBlur(layer, (0, 0), float(rng.uniform(10, 22))))


def _falloff(rng: np.random.Generator) -> np.ndarray:
    """Return the light (H, W, 1) of a lamp beside, and the vignette of a lens."""
    y, x = np.mgrid[-1 : 1 : HEIGHT_PX * 1j, -1 : 1 : WIDTH_PX * 1j]
    direction, strength = rng.uniform(0, 2 * np.pi), rng.uniform(0, 0.3)
    slope = 1 + strength * (np.cos(direction) * x + np.sin(direction) * y)
    spot = 1 + rng.uniform(-0.1, 0.35) * np.exp(-((x - rng.uniform(-1, 1)) ** 2 + (y - rng.uniform(-1, 1)) ** 2) / 0.8)
    return np.asarray(slope * spot * (1 - rng.uniform(0, 0.18) * (x**2 + y**2)))[..., None]


@dataclass(frozen=True)
class _Lamp:
    """``towards (3,)`` from the light; ``extent`` of the lamp in its distance: 0.02 is hard; ``depth (3,)`` of its shadow,
    which other lights tint."""

    towards: np.ndarray
    extent: float
    depth: np.ndarray
    ambient: float


def _lamp(rng: np.random.Generator, camera: Camera) -> _Lamp:
    azimuth, elevation = rng.uniform(0, 2 * np.pi), np.deg2rad(rng.uniform(35, 80))
    towards = -np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    hard = rng.random() < 0.3
    depth = np.clip(rng.uniform(0.0, 0.55) * (1 + rng.normal(0, 0.08, 3)), 0, 0.7)
    return _Lamp(
        towards, float(rng.uniform(0.02, 0.1) if hard else rng.uniform(0.25, 0.8)), depth, float(rng.uniform(0.1, 0.5))
    )


def _shadow(rng: np.random.Generator, thing: _Thing, placement: np.ndarray, lamp: _Lamp) -> np.ndarray:
    """Return the light (H, W, 3) that a thing leaves on the ground: of a lamp, and of the sky around the contact."""
    ground_z = thing.vertices[:, 2].min()
    lamps = 6
    shade = np.zeros((HEIGHT_PX, WIDTH_PX), np.float32)
    for _ in range(lamps):
        towards = lamp.towards + lamp.extent * rng.uniform(-0.5, 0.5, 3)
        towards[2] = min(towards[2], -0.25)
        shade += _fallen(thing, placement, ground_z, towards) / lamps
    size_px = placement[0, 0] * HEIGHT_PX
    shade = cv2.GaussianBlur(shade, (0, 0), 0.6 + 0.012 * lamp.extent * size_px)
    sky = np.zeros((HEIGHT_PX, WIDTH_PX), np.float32)
    for step in range(7):
        around = 2 * np.pi * step / 7
        sky += _fallen(thing, placement, ground_z, np.array([np.cos(around), np.sin(around), -1.0])) / 7
    sky = cv2.GaussianBlur(sky, (0, 0), 0.02 * size_px)
    return np.asarray((1 - lamp.depth * shade[..., None]) * (1 - lamp.ambient * sky[..., None]))


def _fallen(thing: _Thing, placement: np.ndarray, ground_z: float, towards: np.ndarray) -> np.ndarray:
    drop = (thing.vertices[:, 2] - ground_z) / -towards[2]
    fallen = thing.vertices + drop[:, None] * towards
    camera = thing.camera
    seen = transform_points(inverse(camera.camera_to_object), fallen)
    mask = np.zeros((HEIGHT_PX // 2, WIDTH_PX // 2), np.uint8)
    with np.errstate(divide="ignore", invalid="ignore"):
        pixels = camera.focal_px * seen[:, :2] / -seen[:, 2:] * [1, -1] + [WIDTH_PX / 2, HEIGHT_PX / 2]
    good = (seen[:, 2] < -1e-3)[thing.faces].all(1)
    pixels = pixels * placement[0, 0] + placement[:, 2]
    corners = np.clip(np.nan_to_num(pixels) / 2, -4000, 4000).astype(np.int32)[thing.faces[good]]
    edges = corners[:, [1, 2]] - corners[:, [0]]
    turned = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    for corner in corners[turned > 0]:  # of a closed solid, one side covers all
        cv2.fillConvexPoly(mask, corner, 1)
    return cv2.resize(mask.astype(np.float32), (WIDTH_PX, HEIGHT_PX))


def _over(
    rng: np.random.Generator, light: np.ndarray, rgb: np.ndarray, coverage: np.ndarray, *, clear: bool
) -> np.ndarray:
    """Lay a thing over what is there; through a clear one the ground is seen, shifted, but at its rim."""
    if not clear:
        return light * (1 - coverage[..., None]) + rgb
    shift = np.array([[1, 0, rng.uniform(-9, 9)], [0, 1, rng.uniform(-9, 9)]])
    through = cv2.warpAffine(light, shift, (WIDTH_PX, HEIGHT_PX), borderMode=cv2.BORDER_REPLICATE)
    depth = cv2.distanceTransform((coverage > 0.5).astype(np.uint8), cv2.DIST_L2, 5)
    rim = np.exp(-depth / float(rng.uniform(2, 8)))[..., None]
    tint = rng.uniform(0.6, 1.0, 3)
    body = through * tint * (1 - float(rng.uniform(0.3, 0.7)) * rim)
    share = float(rng.uniform(0.1, 0.6))
    mixed = (1 - share) * body * coverage[..., None] + share * rgb
    return np.asarray(light * (1 - coverage[..., None]) + mixed)


def _photographed(rng: np.random.Generator, light: np.ndarray) -> np.ndarray:
    """Return what a camera makes of linear light: lens blur, noise of photons and reading, sRGB, JPEG."""
    light = np.asarray(cv2.GaussianBlur(light.astype(np.float32), (0, 0), float(rng.uniform(0.35, 1.0))))
    light = light * np.exp(rng.normal(0, 0.04, 3)).astype(np.float32)
    gain = float(rng.uniform(0.2, 2.5)) * 1e-4
    light = light + rng.standard_normal(light.shape, dtype=np.float32) * np.sqrt(gain * np.maximum(light, 0) + 1e-6)
    rgb = _SRGB[np.rint(4095 * np.clip(light, 0, 1)).astype(np.int16)]
    encoded = cv2.imencode(".jpg", rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(70, 97))])[1]
    return np.ascontiguousarray(cv2.imdecode(encoded, cv2.IMREAD_COLOR)[..., ::-1])


def _linear(rgb: np.ndarray) -> np.ndarray:
    return np.asarray(_LINEAR[rgb])


# IEC 61966-2-1, both ways
_LINEAR = np.array(
    [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in np.arange(256) / 255], np.float32
)
_SRGB = np.array(
    [round(255 * (12.92 * c if c <= 0.0031308 else 1.055 * c ** (1 / 2.4) - 0.055)) for c in np.arange(4096) / 4095],
    np.uint8,
)
