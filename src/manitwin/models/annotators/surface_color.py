"""The colours of a thing, measured by area of its surface: texture images hold much that no face shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from manitwin.formats.meshes.textures import linear_to_srgb, material_of, uv_of
from manitwin.geometry.sampling import sample_surface
from manitwin.models.annotators.color_names import color_name, lab_from_srgb

UNTEXTURED = "unknown color (untextured)"

_SAMPLES = 3000
_CLUSTERS = 8
_SAME_COLOR = 16.0  # CIELAB distance under which clusters are shades of one colour
_LEAST_SHARE = 0.12  # of the surface, to be named beside the main colour
_MOST_NAMES = 3

# Base colours that readers and modelling tools write where nobody has chosen one: white (glTF 2.0, 5.22.2) and the grey
# of 0.8 (the default Kd of OBJ material libraries and of Blender).
_DEFAULT_COLORS = ((255, 255, 255), (204, 204, 204))


@dataclass(frozen=True)
class ColorShare:
    """A named colour and its share of the coloured surface."""

    name: str
    share: float


def measure_colors(parts: tuple[trimesh.Trimesh, ...], rng: np.random.Generator) -> list[ColorShare]:
    """Return up to three named colours, the largest first; empty where nothing gives the surface a colour.

    ``parts`` are visual parts with PBR materials. Colours are the base colours, without light.
    """
    colored = [part for part in parts if _has_color(part)]
    areas = np.array([part.area for part in colored])
    if not colored or areas.sum() <= 0:
        return []
    counts = np.maximum(np.round(_SAMPLES * areas / areas.sum()).astype(int), 1)
    samples = np.vstack([_base_colors(part, count, rng) for part, count in zip(colored, counts, strict=True)])
    return _named_shares(lab_from_srgb(samples))


def _has_color(part: trimesh.Trimesh) -> bool:
    material = material_of(part)
    if material.baseColorTexture is not None and uv_of(part) is not None:
        return True
    color = tuple(int(c) for c in np.asarray(material.baseColorFactor)[:3])
    named_white = color == _DEFAULT_COLORS[0] and material.name not in (None, "", "material", "material_0")
    return color not in _DEFAULT_COLORS or named_white


def _base_colors(part: trimesh.Trimesh, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return the base colour ``(count, 3)`` as sRGB in 0..1 at points spread evenly over the part's surface."""
    material, uv = material_of(part), uv_of(part)
    factor = np.asarray(material.baseColorFactor, dtype=float)[:3] / 255  # linear, as glTF has it
    if material.baseColorTexture is None or uv is None:
        return np.repeat(linear_to_srgb(factor)[None], count, axis=0)
    points, _, faces = sample_surface(part, count, rng)
    corners = trimesh.triangles.points_to_barycentric(part.triangles[faces], points)
    at = np.einsum("ni,nij->nj", corners, uv[part.faces[faces]])
    image = np.asarray(material.baseColorTexture.convert("RGB"))
    height, width = image.shape[:2]
    column = np.floor((at[:, 0] % 1.0) * width).astype(int) % width
    row = np.floor(((1.0 - at[:, 1]) % 1.0) * height).astype(int) % height
    texture = image[row, column] / 255
    linear = np.where(texture <= 0.04045, texture / 12.92, ((texture + 0.055) / 1.055) ** 2.4)
    return np.clip(linear_to_srgb(linear * factor), 0, 1)


def _named_shares(lab: np.ndarray) -> list[ColorShare]:
    centers, labels = _merged(*_k_means(lab))
    shares: dict[str, float] = {}
    for index in range(len(centers)):
        name = color_name(np.median(lab[labels == index], axis=0))
        shares[name] = shares.get(name, 0.0) + float((labels == index).mean())
    ranked = sorted((ColorShare(name, share) for name, share in shares.items()), key=lambda c: (-c.share, c.name))
    return [ranked[0], *(c for c in ranked[1:_MOST_NAMES] if c.share >= _LEAST_SHARE)]


def _k_means(lab: np.ndarray, rounds: int = 15) -> tuple[np.ndarray, np.ndarray]:
    """Cluster colours ``(N, 3)``: Lloyd's k-means from far-apart starts, so that equal input gives equal clusters."""
    centers = [np.median(lab, axis=0)]
    distance = np.linalg.norm(lab - centers[0], axis=1)
    while len(centers) < _CLUSTERS and distance.max() > _SAME_COLOR / 2:
        centers.append(lab[int(distance.argmax())])
        distance = np.minimum(distance, np.linalg.norm(lab - centers[-1], axis=1))
    middle = np.array(centers)
    for _ in range(rounds):
        labels = np.linalg.norm(lab[:, None] - middle, axis=2).argmin(1)
        middle = np.array([lab[labels == i].mean(0) if (labels == i).any() else middle[i] for i in range(len(middle))])
    labels = np.linalg.norm(lab[:, None] - middle, axis=2).argmin(1)
    return middle, labels


def _merged(centers: np.ndarray, labels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Merge clusters that are shades of one colour, nearest pair first; drop empty ones."""
    sizes = np.bincount(labels, minlength=len(centers)).astype(float)
    groups = [[i] for i in range(len(centers)) if sizes[i]]
    means = [centers[g[0]] for g in groups]
    while len(groups) > 1:
        gap = np.linalg.norm(np.array(means)[:, None] - np.array(means), axis=2) + 1e9 * np.eye(len(means))
        a, b = sorted(int(i) for i in np.unravel_index(int(gap.argmin()), gap.shape))
        if gap[a, b] >= _SAME_COLOR:
            break
        groups[a] += groups.pop(b)
        means.pop(b)
        means[a] = np.average(centers[groups[a]], axis=0, weights=sizes[groups[a]])
    relabel = np.zeros(len(centers), dtype=int)
    for new, members in enumerate(groups):
        relabel[members] = new
    return np.array(means), relabel[labels]
