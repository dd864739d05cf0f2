"""Feature vectors of inputs for near-duplicate detection: appearance of pictures, shape of meshes.

Pictures: features of EfficientNet-Lite0 and the colours of ``models.embedders.looks``, reduced to 256 numbers by a fixed random
projection (Johnson and Lindenstrauss 1984). Meshes: square roots of the D2 shape distribution, the histogram of distances of
random pairs of surface points (Osada et al. 2002), and the side lengths of the box along the principal axes. The shape vector is
invariant to scale and rotation.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from manitwin.errors import ManiTwinError
from manitwin.formats.image_file import read_image
from manitwin.formats.meshes.read import read_mesh
from manitwin.formats.meshes.source import MeshLimits
from manitwin.geometry.sampling import sample_surface
from manitwin.models.embedders.appearance import LENGTH, appearance_descriptor
from manitwin.render.raycast import merge_parts
from manitwin.twin.import_record import IMPORTED_MESH

VERSION = 1
"""Version of the vectors; those of other versions are recomputed."""
PICTURE, SHAPE = "picture", "shape"
ALIKE = {PICTURE: 0.93, SHAPE: 0.995}
"""Similarity at or above which two inputs are duplicates. The values lie between the similarities of re-encoded or re-exported
copies and those of different objects (``benchmarks/alike.py``, on public assets).
"""
NEAR_SIDES = 0.03
"""Maximum difference of corresponding box sides, relative to the longest side."""
_KEPT = 256
_SIDE_PX = 448
_POINTS, _PAIRS, _BINS, _ALMOST_ALL = 4000, 200_000, 64, 0.999
_LIMITS = MeshLimits(max_bytes=1 << 28, max_faces=2_000_000, decode_textures=False, shading=False)


def look_of_input(place: str, kind: str) -> bytes | None:
    """Return the feature vector of a file as little-endian ``float16`` bytes; None if the file is broken or shows nothing."""
    try:
        vector = picture_feature(_rgb(Path(place))) if kind == "image" else _shape(Path(place), kind)
    except (ManiTwinError, ValueError):
        return None
    return vector.astype("<f2").tobytes()


def similarity(first: np.ndarray, others: np.ndarray, by: str) -> np.ndarray:
    """Return the similarity of a vector ``(L,)`` to others ``(N, L)``, 1 for equal ones; 0 for shapes whose box sides differ."""
    if by == PICTURE:
        return np.asarray(others @ first)
    apart = np.abs(others[:, _BINS:] - first[_BINS:]).max(1)
    return np.where(apart <= NEAR_SIDES, others[:, :_BINS] @ first[:_BINS], 0.0)


def _rgb(path: Path) -> np.ndarray:
    """Return a photo composited on white ``(H, W, 3) uint8``."""
    pixels = read_image(path, max_side_px=_SIDE_PX).pixels
    if pixels.shape[2] == 3:
        return pixels
    share = pixels[..., 3:].astype(np.float32) / 255
    return np.asarray(np.rint(pixels[..., :3] * share + 255 * (1 - share)), np.uint8)


def picture_feature(rgb: np.ndarray) -> np.ndarray:
    """Return the unit feature vector ``(256,) float32`` of a picture ``(H, W, 3) uint8``."""
    whole = appearance_descriptor(rgb, np.ones(rgb.shape[:2], np.float32))
    projected = _projection() @ whole
    return np.asarray(projected / max(float(np.linalg.norm(projected)), 1e-9), np.float32)


def _projection() -> np.ndarray:
    return np.random.default_rng(VERSION).normal(size=(_KEPT, LENGTH)).astype(np.float32)


def _shape(path: Path, kind: str) -> np.ndarray:
    file = path / IMPORTED_MESH if kind == "asset" else path
    mesh = merge_parts(read_mesh(file, limits=_LIMITS).parts)
    return shape_feature(mesh)


def shape_feature(mesh: trimesh.Trimesh) -> np.ndarray:
    """Return the shape vector ``(67,) float32`` of a surface; raises ValueError for a surface without area."""
    if not float(mesh.area) > 0:
        raise ValueError("a surface without area has no shape")
    rng = np.random.default_rng(VERSION)
    points = sample_surface(mesh, _POINTS, rng)[0]
    first, second = rng.integers(0, len(points), (2, _PAIRS))
    apart = np.linalg.norm(points[first] - points[second], axis=1)
    shares = (
        np.histogram(np.minimum(apart / np.quantile(apart, _ALMOST_ALL), 1.0), bins=_BINS, range=(0, 1))[0] / _PAIRS
    )
    centered = points - points.mean(0)
    axes = np.linalg.svd(centered, full_matrices=False)[2]
    sides = np.sort(np.ptp(centered @ axes.T, axis=0))[::-1]
    return np.concatenate([np.sqrt(shares), sides / sides[0]]).astype(np.float32)
