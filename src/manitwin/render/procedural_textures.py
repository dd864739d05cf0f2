"""Procedural textures of wood, metal, marble and cloth: seamless and seeded; and textured furniture boxes at true scale.

All noise is generated in the frequency domain, which makes a texture continuous across its edges.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import cv2
import numpy as np
import scipy.fft
import trimesh
from PIL import Image

from manitwin.errors import UsageError, unknown_name_message
from manitwin.formats.meshes.textures import make_part, pbr_material

TEXTURE_PX = 1024


@dataclass(frozen=True)
class ProceduralTexture:
    """A square texture that repeats every ``size_m`` metres.

    ``color (H, W, 3) uint8`` sRGB and ``roughness (H, W) uint8`` (255: matt) as in glTF 2.0; the first row is the top (v = 1).
    The grain runs along u. ``metallic`` is 0 or 1.
    """

    color: np.ndarray
    roughness: np.ndarray
    metallic: float
    size_m: float


@lru_cache(maxsize=32)  # 4 MB each
def procedural_texture(material: str, seed: int, *, size_px: int = TEXTURE_PX) -> ProceduralTexture:
    """Generate a texture of ``wood``, ``metal`` (brushed), ``marble`` or ``cloth``; tone, scale and pattern depend on the seed.

    Raises UsageError for another material. Equal material, seed and size give equal pixels.
    """
    if material not in _MAKERS:
        raise UsageError(unknown_name_message("furniture material", material, _MAKERS))
    return _MAKERS[material](np.random.default_rng([seed, sorted(_MAKERS).index(material)]), size_px)


def periodic_noise(
    rng: np.random.Generator, size_px: int, *, wavelengths: tuple[float, float], slope: float = 1.0
) -> np.ndarray:
    """Return periodic noise ``(size, size)`` with mean 0 and deviation 1; amplitudes fall with frequency to the power ``slope``.

    ``wavelengths`` are the longest along u and v, as shares of the square; unequal values stretch the noise.
    """
    u, v = (np.asarray(f(size_px, 1 / size_px), np.float32) for f in (scipy.fft.rfftfreq, scipy.fft.fftfreq))
    squared = (u * wavelengths[0]) ** 2 + ((v * wavelengths[1]) ** 2)[:, None]
    spectrum = np.maximum(squared, 1) ** np.float32(-(slope + 1) / 2) * np.exp(
        np.complex64(2j * np.pi) * rng.random(squared.shape, dtype=np.float32)
    )
    spectrum[0, 0] = 0
    noise = scipy.fft.irfft2(spectrum, s=(size_px, size_px))
    return np.asarray(noise / noise.std(), np.float32)


def _wood(rng: np.random.Generator, size: int) -> ProceduralTexture:
    """Boards side by side, each from another log: growth rings, fine fibres, pores."""
    dark, light = _WOODS[int(rng.integers(len(_WOODS)))]
    boards = int(rng.integers(6, 11))
    rings = float(rng.uniform(2.5, 5.0))  # across a board
    edges = np.rint(np.linspace(0, size, boards + 1)).astype(int)
    warp = periodic_noise(rng, size, wavelengths=(1.2, 0.12), slope=1.6)
    fibre = periodic_noise(rng, size, wavelengths=(0.15, 0.004), slope=0.5)
    pores = periodic_noise(rng, size, wavelengths=(0.03, 0.003), slope=0.2)
    grain, tone, joint = np.empty((size, size)), np.empty((size, size)), np.zeros((size, size))
    across = np.arange(size)[:, None]
    for low, high in pairwise(edges):
        inside = slice(low, high)
        shift = int(rng.integers(size))
        y = (across[inside] - low) / (high - low)
        depth = y * rings + 0.55 * np.roll(warp, shift, axis=1)[inside] + rng.uniform(0, 1)
        ring = depth % 1.0
        # gradual in spring, ending sharply in autumn
        grain[inside] = np.where(ring < 0.82, ring / 0.82, (1 - ring) / 0.18)
        tone[inside] = rng.normal(0.0, 0.10)
        joint[low] = 1.0
    gap = np.minimum(cv2.GaussianBlur(np.vstack([joint] * 3), (0, 0), size / 1024 * 0.9)[size : 2 * size] * 2.2, 1)
    share = np.clip(0.62 - 0.30 * grain + tone + 0.10 * fibre - 0.10 * np.maximum(pores - 1.2, 0), 0, 1)
    color = _mixed(dark, light, share) * (1 - 0.75 * gap)[..., None]
    roughness = 0.46 + 0.10 * (1 - share) + 0.25 * gap
    return _texture(color * _tint(rng, 0.05), roughness, 0.0, 1.0)


def _metal(rng: np.random.Generator, size: int) -> ProceduralTexture:
    """Sheet metal brushed along u: streaks, and patches of wear."""
    base = _METALS[int(rng.integers(len(_METALS)))]
    streaks = periodic_noise(rng, size, wavelengths=(0.5, 0.002), slope=0.15)
    wear = periodic_noise(rng, size, wavelengths=(0.5, 0.5), slope=1.2)
    color = base * (1 + 0.035 * streaks + 0.02 * wear)[..., None]
    roughness = rng.uniform(0.34, 0.46) + 0.03 * streaks + 0.025 * wear
    return _texture(color * _tint(rng, 0.02), roughness, 1.0, 1.0)


def _marble(rng: np.random.Generator, size: int) -> ProceduralTexture:
    """Clouds with veins: lines where a warped field crosses zero (after Perlin 1985, "An Image Synthesizer")."""
    ground, cloud, vein = _MARBLES[int(rng.integers(len(_MARBLES)))]
    clouds = periodic_noise(rng, size, wavelengths=(0.5, 0.5), slope=1.1)
    veins = np.zeros((size, size))
    for length, width, strength in ((0.9, 0.030, 1.0), (0.45, 0.020, 0.55), (0.2, 0.018, 0.25)):
        field = periodic_noise(rng, size, wavelengths=(length, length), slope=1.0)
        patches = np.clip(periodic_noise(rng, size, wavelengths=(0.4, 0.4), slope=1.0) * 0.5 + 0.4, 0, 1)
        veins = np.maximum(veins, strength * patches * np.exp(-np.abs(field) / width))
    color = _mixed(ground, cloud, np.clip(0.35 + 0.3 * clouds, 0, 1))
    color += (vein - color) * np.clip(veins, 0, 1)[..., None] * 0.8
    roughness = 0.20 + 0.05 * np.clip(veins, 0, 1) + 0.01 * clouds
    return _texture(color * _tint(rng, 0.03), roughness, 0.0, float(rng.uniform(0.9, 1.3)))


def _cloth(rng: np.random.Generator, size: int) -> ProceduralTexture:
    """Plain weave of uneven yarns, in one colour (half of the seeds), or in stripes or checks of two."""
    first = _CLOTHS[int(rng.integers(len(_CLOTHS)))]
    second = first * 0.55 + 0.42 if first.max() < 0.55 else first * 0.72
    threads = size // 8  # eight pixels per period of two yarns
    across, along = np.meshgrid(*[(np.arange(size) + 0.5) * threads / size] * 2)
    over = (np.floor(across * 2) + np.floor(along * 2)) % 2 < 1  # whether warp or weft is on top
    warp, weft = np.abs(np.sin(2 * np.pi * across)), np.abs(np.sin(2 * np.pi * along))
    height = np.where(over, weft * (0.6 + 0.4 * warp), warp * (0.6 + 0.4 * weft))
    yarn = np.where(
        over,
        periodic_noise(rng, size, wavelengths=(0.3, 0.004), slope=0.3),
        periodic_noise(rng, size, wavelengths=(0.004, 0.3), slope=0.3),
    )
    bands = int(rng.integers(8, 18)) * 2
    pattern, stripes = int(rng.integers(4)), lambda x: np.floor(x * bands / threads) % 2
    dyed = {0: 0 * across, 1: 0 * across, 2: stripes(along), 3: 0.5 * (stripes(along) + stripes(across))}[pattern]
    color = _mixed(first, second, dyed) * (0.80 + 0.20 * height + 0.05 * yarn)[..., None]
    return _texture(color * _tint(rng, 0.08), 0.92 - 0.06 * height, 0.0, 0.5)


def _mixed(zero: np.ndarray, one: np.ndarray, share: np.ndarray) -> np.ndarray:
    return zero + (one - zero) * share[..., None]


def _tint(rng: np.random.Generator, spread: float) -> np.ndarray:
    """Return factors ``(3,)`` that shift hue and lightness slightly."""
    return np.exp(rng.normal(0, spread) + rng.normal(0, spread / 2, 3))


def _texture(color: np.ndarray, roughness: np.ndarray, metallic: float, size_m: float) -> ProceduralTexture:
    def to_bytes(image: np.ndarray) -> np.ndarray:
        pixels = np.rint(np.clip(image, 0, 1) * 255).astype(np.uint8)
        pixels.flags.writeable = False  # shared through the cache
        return pixels

    return ProceduralTexture(to_bytes(color), to_bytes(roughness), metallic, size_m)


def _srgb(*hexes: str) -> tuple[np.ndarray, ...]:
    return tuple(np.array([int(code[i : i + 2], 16) for i in (0, 2, 4)]) / 255 for code in hexes)


# sRGB, chosen by eye
_WOODS = (  # autumn and spring wood of oak, beech, walnut, birch, cherry
    _srgb("8a6238", "c9a26b"),
    _srgb("a9744a", "dcb488"),
    _srgb("4a2f1e", "8a6243"),
    _srgb("c2a070", "ead4aa"),
    _srgb("7d4226", "b9764a"),
)
_METALS = _srgb("b4b2ae", "c6c8ca", "c3b48f")  # steel, aluminium, brass
_MARBLES = (  # ground, cloud and vein of white, cream, green and black marble
    _srgb("f0eeea", "d8d8d6", "77777a"),
    _srgb("eadfc8", "d9c6a2", "9a7247"),
    _srgb("2f4a40", "1f352e", "b9c9bd"),
    _srgb("2a2a2c", "1b1b1d", "d0c8b8"),
)
_CLOTHS = _srgb("c9c2b4", "3c5a78", "8c3b36", "5d7356", "d8b45a", "55565c", "e6e2d8", "6a4f74")

_MAKERS: dict[str, Callable[[np.random.Generator, int], ProceduralTexture]] = {
    "cloth": _cloth,
    "marble": _marble,
    "metal": _metal,
    "wood": _wood,
}


# Corners of the faces seen from outside, counter-clockwise from the lower left, in half extents; then the face's horizontal and
# vertical axis in the image. On the top face, +X is to the right and +Y up.
_FACES = (
    (((1, -1, -1), (1, 1, -1), (1, 1, 1), (1, -1, 1)), 1, 2),
    (((-1, 1, -1), (-1, -1, -1), (-1, -1, 1), (-1, 1, 1)), 1, 2),
    (((1, 1, -1), (-1, 1, -1), (-1, 1, 1), (1, 1, 1)), 0, 2),
    (((-1, -1, -1), (1, -1, -1), (1, -1, 1), (-1, -1, 1)), 0, 2),
    (((-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)), 0, 1),
    (((-1, 1, -1), (1, 1, -1), (1, -1, -1), (-1, -1, -1)), 0, 1),
)


@dataclass(frozen=True)
class TexturedBox:
    """A box with half extents ``(3,)`` about ``center_m (3,)``, with the texture shifted by ``offset_m``."""

    half_extents_m: np.ndarray
    center_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    offset_m: tuple[float, float] = (0.0, 0.0)


def textured_box(
    half_extents_m: np.ndarray, texture: ProceduralTexture, *, offset_m: tuple[float, float] = (0.0, 0.0)
) -> trimesh.Trimesh:
    """Return a box about its origin as a visual part, with the grain along its longest side.

    ``offset_m`` shifts the texture, so that boards of one wood differ.
    """
    return textured_boxes([TexturedBox(np.asarray(half_extents_m, float), offset_m=offset_m)], texture)


def textured_boxes(boxes: Sequence[TexturedBox], texture: ProceduralTexture) -> trimesh.Trimesh:
    """Return boxes with one texture as a single visual part, as every part uploads its own texture."""
    vertices, uv, normals = [], [], []
    for box in boxes:
        grain = int(box.half_extents_m.argmax())
        for corners, right, up in _FACES:
            points = np.array(corners) * box.half_extents_m
            axes = (right, up) if right == grain or up != grain else (up, right)
            vertices.append(points + box.center_m)
            uv.append((points[:, axes] + box.offset_m) / texture.size_m)
            normals.append(np.cross(points[1] - points[0], points[3] - points[0]))
    quads = np.arange(4 * len(vertices)).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    normal = np.repeat(np.array(normals) / np.linalg.norm(normals, axis=1)[:, None], 4, axis=0)
    # glTF 2.0, section 3.9.2: roughness is green, metallic is blue
    metal = np.full_like(texture.roughness, round(texture.metallic * 255))
    material = pbr_material(
        "furniture",
        metallic=1.0,
        roughness=1.0,
        base_color_texture=Image.fromarray(texture.color),
        metallic_roughness_texture=Image.fromarray(np.stack([metal * 0, texture.roughness, metal], -1)),
    )
    return make_part(
        np.concatenate(vertices), faces, material=material, name="box", uv=np.concatenate(uv), normals=normal
    )
