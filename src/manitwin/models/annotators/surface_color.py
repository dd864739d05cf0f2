"""Measurement and naming of surface colours in CIELAB, by visible area: texture images contain regions that no face uses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import trimesh

from manitwin.formats.meshes.textures import linear_to_srgb, material_of, uv_of
from manitwin.geometry.openness import unoccluded_share
from manitwin.geometry.sampling import sample_surface

# (name, sRGB hex). Several shades share a name. Names and regions follow the ISCC-NBS centroid colours (Kelly and Judd 1955,
# level 2) and the basic colour terms of Berlin and Kay 1969; the shades are chosen by eye within those regions. Black and dark
# grey are the centroids 267 and 266: between them lies L* 25, the Munsell value 2.5 at which ISCC-NBS separates the two. The
# last six pinks are the yellowish pinks (25, 26, 28 to 30, 32), commonly called pink, salmon, coral or peach; the greyish one
# (32) has slightly more chroma here, and brownish pink and yellowish grey (33, 93) are beige, because cloth and stone were
# named pink otherwise. The paler oranges are 53 and 52, because crusts of bread and buns were named pink and tan otherwise.
_SHADES: tuple[tuple[str, str], ...] = (
    ("blue", "0a18f0"), ("blue", "1e3cbe"), ("dark blue", "0a0a8c"), ("dark red", "8c0808"),
    ("black", "0a0a0a"), ("black", "222222"), ("dark grey", "555555"),
    ("grey", "787878"), ("grey", "929292"), ("light grey", "b0b0b0"), ("light grey", "cccccc"),
    ("white", "e6e6e6"), ("white", "fdfdfd"), ("cream", "f3ead2"), ("cream", "fff5d9"),
    ("beige", "e0cda9"), ("beige", "c9b48e"), ("tan", "b8946a"), ("tan", "c8a27a"),
    ("brown", "8b5a2b"), ("brown", "7a4a32"), ("brown", "6b4226"), ("brown", "94704c"),
    ("dark brown", "3e2a1c"), ("dark brown", "4a3426"), ("red", "d01c1f"), ("red", "b3202a"),
    ("red", "e23b30"), ("dark red", "7d1416"), ("dark red", "5c1a1b"), ("pink", "f2a7b8"),
    ("pink", "e87ba0"), ("pink", "f6cfd6"), ("pink", "ffb7a5"), ("pink", "f99379"), ("pink", "f4c2c2"),
    ("pink", "d9a6a9"), ("pink", "c48379"), ("pink", "ccaaa3"), ("beige", "c2ac99"), ("beige", "bfb8a5"),
    ("orange", "f07c1c"), ("orange", "d9661f"),
    ("orange", "f79b3e"), ("orange", "d99058"), ("orange", "fab57f"), ("dark orange", "b0521c"),
    ("gold", "c79a2b"), ("gold", "b58a3c"),
    ("yellow", "f5d328"), ("yellow", "e3c01c"), ("yellow", "fae36b"), ("light yellow", "fbf0a5"),
    ("olive", "77762c"), ("olive", "5d5c26"), ("yellow-green", "a8c43a"), ("yellow-green", "c9d94f"),
    ("green", "2f9440"), ("green", "4aa84e"), ("green", "5c8a4c"), ("light green", "9bd49a"),
    ("light green", "b9e3b4"), ("dark green", "14512a"), ("dark green", "2d4a30"), ("teal", "0f8080"),
    ("teal", "2a6b70"), ("turquoise", "3fc4bf"), ("light blue", "9cc9ea"), ("light blue", "bcd9ee"),
    ("blue", "1f63c0"), ("blue", "3a86d4"), ("blue", "2a4fb0"), ("blue", "5a86b5"),
    ("dark blue", "14285c"), ("dark blue", "1f3557"), ("grey-blue", "76899c"), ("purple", "6b3fa0"),
    ("purple", "8552b0"), ("dark purple", "3d2352"), ("lavender", "c0a8dc"), ("magenta", "c2278a"),
    ("magenta", "9c2a74"), ("grey-brown", "7d7064"), ("grey-green", "77826f"),
)  # fmt: skip

_FAMILIES: dict[str, str] = {
    **{f"{shade} {name}": name for name in ("grey", "red", "orange", "yellow", "green", "blue", "purple", "brown")
       for shade in ("dark", "light")},
    "grey-blue": "blue", "grey-green": "green", "yellow-green": "green", "grey-brown": "brown", "tan": "beige",
}  # fmt: skip
"""Colour family of shades that people do not distinguish when they name an object by its colour."""
_NEUTRAL = frozenset({"black", "dark grey", "grey", "light grey", "white"})
_TELLING = (
    1 / 3
)  # of the largest neutral colour's share: a chromatic colour of this share comes first; a red box with white letters is red
_METALLIC = 0.5
_GOLDEN_HUE_RAD, _GOLDEN_CHROMA = (np.deg2rad(75.0), np.deg2rad(97.0)), (29.0, 50.0)
"""CIELAB hue and chroma of gold and brass in photos, at any lightness (docs/measured/annotations.md).

Brown paint has less hue, olive paint more, and yellow paint more chroma.
"""
_YELLOW_HUE_RAD = np.deg2rad(78.0)  # CIELAB hue between the centres of orange (70) and yellow (86)

_WHITE_D65 = np.array([0.95047, 1.0, 1.08883])
_LINEAR_SRGB_TO_XYZ = np.array(  # IEC 61966-2-1
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)

_NAMES = [name for name, _ in _SHADES]
UNTEXTURED = "unknown color (untextured)"
_SAMPLES = 3000
_CLUSTERS = 8
_SAME_COLOR = 16.0  # CIELAB distance below which clusters are shades of one colour
_NEAR = 25.0  # CIELAB distance of shades that are easily confused: dark grey and black, white and light grey
_LIGHTNESS = 0.5  # weight of a difference in lightness relative to one in chromaticity
_LEAST_OPEN = 1 / 3  # minimum open share of the surroundings; the bottom of a mug has less and is hardly visible
_LEAST_SEEN = (
    1 / 50
)  # of the samples: minimum visible share; a book with modelled leaves shows a twentieth, an inside-out mesh hardly any
_LEAST_SHARE = 0.12  # minimum share of the surface of a colour named besides the main one
_MOST_NAMES = 3
_MOST_OF = 2 / 3  # minimum share of a family for its largest member to give the name
# Default base colours of readers and modelling tools: white (glTF 2.0, 5.22.2) and the grey of 0.8 (default Kd of OBJ material
# libraries and of Blender).
_DEFAULT_COLORS = ((255, 255, 255), (204, 204, 204))


def lab_from_srgb(rgb: np.ndarray) -> np.ndarray:
    """Convert sRGB ``(..., 3)`` in [0, 1] to CIELAB (D65). Source: IEC 61966-2-1 and CIE 15:2004, 8.2.1."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = linear @ _LINEAR_SRGB_TO_XYZ.T / _WHITE_D65
    cube = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = cube[..., 0], cube[..., 1], cube[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def _srgb_from_hex(text: str) -> list[float]:
    return [int(text[i : i + 2], 16) / 255 for i in (0, 2, 4)]


_LAB = lab_from_srgb(np.array([_srgb_from_hex(shade) for _, shade in _SHADES]))


def color_name(lab: np.ndarray, *, metallic: bool = True, metal_in_a_photo: bool = False) -> str:
    """Return the everyday name of a CIELAB colour ``(3,)``; gold is used only for ``metallic`` colours.

    The lightness of metal in a photo depends on its reflections, so with ``metal_in_a_photo`` hue and chroma alone decide on
    gold.
    """
    hue_rad, chroma = np.arctan2(lab[2], lab[1]), np.hypot(lab[1], lab[2])
    (least_rad, most_rad), (least, most) = _GOLDEN_HUE_RAD, _GOLDEN_CHROMA
    if metal_in_a_photo and least_rad <= hue_rad <= most_rad and least <= chroma <= most:
        return "gold"
    name = _NAMES[int(np.linalg.norm(_LAB - lab, axis=1).argmin())]
    if name != "gold" or metallic:
        return name
    return "dark yellow" if hue_rad > _YELLOW_HUE_RAD else "orange"


def are_similar_colors(name: str, other: str) -> bool:
    """Tell whether two colour names are of one family, or have shades that are close in CIELAB."""
    if _family(name) == _family(other):
        return True
    one, two = (_LAB[[each == color for each in _NAMES]] for color in (name, other))
    if not len(one) or not len(two):  # a name without shades of its own cannot be compared
        return True
    return bool(np.linalg.norm(one[:, None] - two[None], axis=-1).min() < _NEAR)


def _family(name: str) -> str:
    return _FAMILIES.get(name, name)


@dataclass(frozen=True)
class ColorShare:
    """A named colour and its share of the coloured surface."""

    name: str
    share: float


def measure_colors(
    parts: tuple[trimesh.Trimesh, ...],
    rng: np.random.Generator,
    own_colors: Callable[[np.ndarray], np.ndarray] | None = None,
    *,
    metal_in_a_photo: bool = False,
) -> list[ColorShare]:
    """Return up to three named colours in the order in which people name them; empty if the surface has no colours.

    The largest colour comes first, except that a chromatic colour precedes black, grey and white unless these are much
    larger. A default white or grey counts if other parts have colours, because it was then left on purpose and is visible.
    ``parts`` are visual parts with PBR materials; their base colours are used. ``own_colors`` converts the colours of a
    photo's pixels (sRGB ``(N, 3)`` in [0, 1]) to the object's own, if the light of the photo is known. ``metal_in_a_photo``
    tells that the colours are those of a photographed all-metal object.
    """
    colored = list(parts) if any(_has_color(part) for part in parts) else []
    areas = np.array([part.area for part in colored])
    if not colored or areas.sum() <= 0:
        return []
    counts = np.maximum(np.round(_SAMPLES * areas / areas.sum()).astype(int), 1)
    samples = [_base_colors(part, count, rng) for part, count in zip(colored, counts, strict=True)]
    colors, points, normals = (np.vstack(each) for each in zip(*samples, strict=True))
    colors = colors if own_colors is None else own_colors(colors)
    seen = is_visible_outside(_concatenate_meshes(parts), points, normals)
    metallic = any(float(material_of(part).metallicFactor or 0.0) > _METALLIC for part in colored)
    return name_colors(lab_from_srgb(colors[seen]), metallic, metal_in_a_photo=metal_in_a_photo)


def is_visible_outside(mesh: trimesh.Trimesh, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return a mask (N,) of the surface points ``(N, 3)`` that are well visible from outside; all True if hardly any are."""
    seen = unoccluded_share(mesh, points, normals) >= _LEAST_OPEN
    return seen if seen.mean() >= _LEAST_SEEN else np.ones(len(points), dtype=bool)


def _concatenate_meshes(parts: tuple[trimesh.Trimesh, ...]) -> trimesh.Trimesh:
    vertices, faces = trimesh.util.append_faces([part.vertices for part in parts], [part.faces for part in parts])
    return trimesh.Trimesh(vertices, faces, process=False)


def _has_color(part: trimesh.Trimesh) -> bool:
    material = material_of(part)
    if material.baseColorTexture is not None and uv_of(part) is not None:
        return True
    color = tuple(int(c) for c in np.asarray(material.baseColorFactor)[:3])
    named_white = color == _DEFAULT_COLORS[0] and material.name not in (None, "", "material", "material_0")
    return color not in _DEFAULT_COLORS or named_white


def _base_colors(
    part: trimesh.Trimesh, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sample a part uniformly; return base colours (sRGB in [0, 1]), positions and outward normals, ``(count, 3)`` each."""
    points, normals, faces = sample_surface(part, count, rng)
    return base_colors_at(part, faces, points), points, normals


def base_colors_at(part: trimesh.Trimesh, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the base colours ``(N, 3)`` (sRGB in [0, 1]) of a part at points ``(N, 3)`` on its faces ``(N,)``."""
    material, uv = material_of(part), uv_of(part)
    factor = np.asarray(material.baseColorFactor, dtype=float)[:3] / 255  # linear, as in glTF
    if material.baseColorTexture is None or uv is None:
        return np.repeat(linear_to_srgb(factor)[None], len(points), axis=0)
    corners = trimesh.triangles.points_to_barycentric(part.triangles[faces], points)
    corners = np.nan_to_num(corners, nan=1 / 3)  # any corner is valid for a degenerate face
    at = np.einsum("ni,nij->nj", corners, uv[part.faces[faces]])
    image = np.asarray(material.baseColorTexture.convert("RGB"))
    height, width = image.shape[:2]
    column = np.floor((at[:, 0] % 1.0) * width).astype(int) % width
    row = np.floor(((1.0 - at[:, 1]) % 1.0) * height).astype(int) % height
    texture = image[row, column] / 255
    linear = np.where(texture <= 0.04045, texture / 12.92, ((texture + 0.055) / 1.055) ** 2.4)
    return np.clip(linear_to_srgb(linear * factor), 0, 1)


def name_colors(lab: np.ndarray, metallic: bool, *, metal_in_a_photo: bool = False) -> list[ColorShare]:
    """Return up to three named colours of observed surface colours ``(N, 3)`` in CIELAB, in the order in which people name them.

    Colours that one material may have under different light are merged, because the texture of a scan contains the light of
    its capture.
    """
    centers, labels = _merge_clusters(*_k_means(lab))
    shares: dict[str, float] = {}
    for index in range(len(centers)):
        name = color_name(np.median(lab[labels == index], axis=0), metallic=metallic, metal_in_a_photo=metal_in_a_photo)
        shares[name] = shares.get(name, 0.0) + float((labels == index).mean())
    ranked = _rank_colors(_merge_families(shares))
    return [ranked[0], *(c for c in ranked[1:_MOST_NAMES] if c.share >= _LEAST_SHARE)]


def _merge_families(shares: dict[str, float]) -> dict[str, float]:
    """Join shades of one family under the name of its dominant shade; a single shade keeps its name."""
    members: dict[str, list[str]] = {}
    for name in shares:
        members.setdefault(_FAMILIES.get(name, name), []).append(name)
    joined: dict[str, float] = {}
    for family, names in members.items():
        share, main = sum(shares[name] for name in names), max(names, key=lambda name: shares[name])
        joined[main if shares[main] >= _MOST_OF * share else family] = share
    return joined


def _rank_colors(shares: dict[str, float]) -> list[ColorShare]:
    neutral = max((share for name, share in shares.items() if name in _NEUTRAL), default=0.0)
    telling = {n for n, share in shares.items() if n not in _NEUTRAL and share >= max(_LEAST_SHARE, _TELLING * neutral)}
    order = sorted(shares, key=lambda name: (name not in telling, -shares[name], name))
    return [ColorShare(name, shares[name]) for name in order]


def _k_means(lab: np.ndarray, rounds: int = 15) -> tuple[np.ndarray, np.ndarray]:
    """Cluster colours ``(N, 3)`` with Lloyd's k-means from farthest-point starts, which is deterministic."""
    centers = [np.median(lab, axis=0)]
    distance = _material_distance(lab, centers[0])
    while len(centers) < _CLUSTERS and distance.max() > _SAME_COLOR / 2:
        centers.append(lab[int(distance.argmax())])
        distance = np.minimum(distance, _material_distance(lab, centers[-1]))
    middle = np.array(centers)
    for _ in range(rounds):
        labels = _material_distance(lab[:, None], middle).argmin(1)
        middle = np.array([lab[labels == i].mean(0) if (labels == i).any() else middle[i] for i in range(len(middle))])
    labels = _material_distance(lab[:, None], middle).argmin(1)
    return middle, labels


def _material_distance(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the distance of colours ``(..., 3)`` from being one material's under different light.

    Light scales XYZ, and thereby a* and b* in proportion to L* + 16 (CIE 15:2004, 8.2.1): both colours are compared as under
    the light of the darker one. Lightness counts half, as for acceptability in CMC(2:1) (Clarke, McDonald, Rigg 1984).
    """
    light_one, light_other = one[..., :1] + 16, other[..., :1] + 16
    darker = np.minimum(light_one, light_other)
    tint = one[..., 1:] * darker / light_one - other[..., 1:] * darker / light_other
    return np.asarray(np.sqrt((tint**2).sum(-1) + (_LIGHTNESS * (light_one - light_other)[..., 0]) ** 2))


def _merge_clusters(centers: np.ndarray, labels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Merge clusters that are shades of one colour, nearest pair first; drop empty ones."""
    sizes = np.bincount(labels, minlength=len(centers)).astype(float)
    groups = [[i] for i in range(len(centers)) if sizes[i]]
    means = [centers[g[0]] for g in groups]
    while len(groups) > 1:
        gap = _material_distance(np.array(means)[:, None], np.array(means)) + 1e9 * np.eye(len(means))
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
