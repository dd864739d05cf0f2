"""Regions of a template's object where a label of the priors belongs: parts, or regions of the template's own frame.

A template knows its parts. Its +Z is up, lying objects point their working end to +X, and the front of standing objects faces -Y.
A label that names a part is judged by that part (``PARTS_OF``). A label that applies to every object (its top, a side, the end
away from the tip) is judged by a region of the surface (``REGIONS``). Nothing is measured in the way in which the rules under
test measure it. A label that names neither on an object gives None: it is not judged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from manitwin.geometry.sampling import sample_surface
from manitwin.models.generators.templates.template_object import TemplateObject

NEAR_SHARE = 0.03
"""Accepted distance relative to the longest side. Candidates are about this far apart and rarely lie on a thin rim."""
_SAMPLES = 12000
_TURNED_AWAY = -0.3  # cosine: the other side of a thin wall is near, but a different place

_BODIES = (
    "body", "tube", "bulb", "bowl", "cone", "roller", "barrel", "stem", "shaft", "cover", "legs", "neck", "blade",
    "label", "dome", "posts", "bulbs",
)  # fmt: skip
PARTS_OF: dict[str, tuple[str, ...]] = {
    "opening": ("rim", "mouth"), "inside": ("inside",), "rim": ("rim",), "cooking surface": ("inside",),
    "surface": ("top", "inside"), "handle": ("handle", "knob", "grips", "pull handle"), "handles": ("handle",),
    "handle end": ("handle",), "base": ("base", "foot"), "foot": ("foot",), "stem": ("stem",), "cap": ("cap",), "teat": ("teat",),
    "neck": ("neck", "collar", "stem"), "lid": ("cap", "lid", "panel", "top", "tab"), "spout": ("spout",),
    "blade": ("blade", "edge"), "wick": ("wick",), "tip": ("tip", "lead", "tines"), "bristles": ("bristles",),
    "jaw": ("jaw", "jaws", "mouth"), "jaws": ("jaw", "jaws", "mouth", "pads"), "joint": ("joint",), "spring joint": ("spring",),
    "striking face": ("face", "other face", "edge"), "blade edge": ("edge",), "tines": ("tines",), "grip": ("handle", "switch"),
    "housing": ("body",), "shoulder": ("shoulders",),
    "head": (
        "head", "face", "claw", "blade", "bowl", "jaw", "pan", "edge", "wires", "tines", "neck", "glass", "frame", "channel",
        "forehand", "backhand", "mane", "strings",
    ),
    "working end": ("outlet",), "ear cup": ("cups",), "headband": ("band",), "core": ("core",), "outside": ("body",),
    "inner side": ("bore", "hole"), "barrel": ("barrel", "sleeve"), "lens": ("lens", "glass"), "switch": ("switch",),
    "cap end": ("eraser", "button", "ferrule", "cap", "clip"), "nozzle": ("nozzle", "spout", "head"),
    "tissue": ("tissue",), "flap": ("top", "flap", "fin"), "bow": ("bow", "hole"), "cup": ("cup", "inside"), "bulb": ("bulb",),
    "screw base": ("base",), "roller": ("roller",), "positive end": ("pole",), "body": _BODIES, "shaft": _BODIES,
    "bowl": ("bowl", "inside"), "finger holes": ("handle",), "blades": ("blade", "blades"),
    "stem end": ("stem", "leaves", "dimple"), "roof": ("cabin",), "underside": ("wheels",),
    "chamber": ("chamber", "holes", "inside", "plunger"), "lever": ("lever",), "drawer": ("drawer", "inside", "heads"),
    "terminals": ("positive terminal", "negative terminal", "top"),
    "teeth": ("teeth",), "chuck": ("chuck", "bit"), "shank": ("shank",), "frame": ("frame",),
    "hook": ("hook", "claw"), "chisel end": ("chisel",), "cutting head": ("head", "wheel", "key"), "slots": ("slots",),
    "grating face": ("body", "holes", "slots"), "grinding end": ("tip",),
    "lenses": ("lenses",), "bridge": ("bridge",), "toe": ("toe",), "sole": ("sole",), "valve": ("valve", "lever", "bracket"),
    "grille": ("grille",), "connector": ("connector",), "tips": ("tips",), "arms": ("arms",), "plunger": ("plunger", "knob"),
    "crown": ("crown", "button"), "brim": ("brim", "visor"), "knob": ("knob",), "spine": ("spine",),
    "weight": ("weights",), "dial": ("dial", "hands", "case"), "screen": ("screen", "case"), "strap": ("strap", "buckle"),
}  # fmt: skip
"""The template parts that each label refers to."""

_WORKING = ("tip", "lead", "bristles", "head", "jaws", "cap", "outlet", "blade")  # the far end is opposite these


@dataclass(frozen=True)
class Known:
    """A built object with samples of its surface: positions ``(N, 3)`` m, normals ``(N, 3)``, and part numbers ``(N,)``."""

    made: TemplateObject
    positions_m: np.ndarray
    normals: np.ndarray
    part: np.ndarray

    @classmethod
    def of(cls, made: TemplateObject) -> Known:
        """Sample the surface of an object."""
        solid = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
        positions, normals, faces = sample_surface(solid, _SAMPLES, np.random.default_rng(0))
        return cls(made, positions, normals, made.mesh.part[faces])

    @cached_property
    def height(self) -> np.ndarray:
        """Height of each sample as a share of the total height ``(N,)``."""
        z = self.positions_m[:, 2]
        return (z - z.min()) / max(float(np.ptp(z)), 1e-9)

    @cached_property
    def longest_m(self) -> float:
        """Longest side of the axis-aligned box, metres."""
        return float(np.ptp(self.made.mesh.vertices, axis=0).max())

    def on(self, *names: str) -> np.ndarray:
        """Return which samples ``(N,)`` lie on one of the named parts."""
        return np.isin(self.part, [self.made.mesh.names.index(name) for name in names if name in self.made.mesh.names])

    def right(self, label: str, chosen: int, positions_m: np.ndarray, normals: np.ndarray) -> bool | None:
        """Tell whether the candidate ``chosen`` of ``(N, 3)`` is where its label belongs; None if the object has no such place.

        The accepted distance is 3 % of the longest side, or 6 % where no candidate is nearer.
        """
        place = self.on(*PARTS_OF.get(label, ()))
        region = not place.any() and label in REGIONS
        if region:
            place = REGIONS[label](self)
        if not place.any():
            return None
        if region or label in _FACES:
            place = place & (self.normals @ normals[chosen] > _TURNED_AWAY)
            if not place.any():
                return False
        distances_m = cKDTree(self.positions_m[place]).query(positions_m)[0]
        near_m = NEAR_SHARE * self.longest_m
        return bool(distances_m[chosen] <= min(max(near_m, float(distances_m.min())), 2 * near_m))


_FACES = frozenset({"inside", "cooking surface", "surface", "cup"})
"""Labels for which a candidate on the other side of the wall does not count."""

Region = Callable[[Known], np.ndarray]


def _underside(known: Known) -> np.ndarray:
    lowest = known.positions_m[:, 2] - known.positions_m[:, 2].min()
    return (lowest < 0.02 * known.longest_m) & (known.normals[:, 2] < -0.3)


def _upper_side(known: Known) -> np.ndarray:
    return (known.height > 0.75) & (known.normals[:, 2] > 0.3)


def _known_opening(known: Known) -> np.ndarray:
    """Return the samples in the plane of the first known opening, or the upper side if there is none."""
    openings = [point for point in known.made.points if point.kind == "opening"]
    if not openings:
        return _upper_side(known)
    along = (known.positions_m - np.array(openings[0].position_m)) @ np.array(openings[0].direction)
    return np.abs(along) < 0.01 * known.longest_m


def _sides(known: Known) -> np.ndarray:
    return (np.abs(known.normals[:, 2]) < 0.6) & (known.height > 0.05) & (known.height < 0.95)


def _lies(known: Known) -> bool:
    extents = np.ptp(known.positions_m, axis=0)
    return bool(extents[2] <= extents[:2].min())


def _front(known: Known) -> np.ndarray:
    if _lies(known):
        return (known.normals[:, 2] > 0.7) & (known.height > 0.4)
    y = known.positions_m[:, 1]
    return (known.normals[:, 1] < -0.7) & (y < np.median(y))


def _back(known: Known) -> np.ndarray:
    if _lies(known):
        return (known.normals[:, 2] < -0.7) & (known.height < 0.6)
    y = known.positions_m[:, 1]
    return (known.normals[:, 1] > 0.7) & (y > np.median(y))


def _narrow_edge(known: Known) -> np.ndarray:
    if _lies(known):
        return np.abs(known.normals[:, 2]) < 0.6
    return np.abs(known.normals[:, 1]) < 0.6


def _far_end(known: Known) -> np.ndarray:
    working = known.on(*_WORKING)
    if not working.any():
        return working
    distance = np.linalg.norm(known.positions_m - known.positions_m[working].mean(0), axis=1)
    return distance > 0.85 * distance.max()


def _nearer_spring(known: Known) -> np.ndarray:
    """Return the jaws of a clothespin: the short legs on one side of the spring."""
    spring, x = known.on("spring"), known.positions_m[:, 0]
    if not spring.any():
        return spring
    at = float(x[spring].mean())
    beyond = x > at if x.max() - at < at - x.min() else x < at
    return known.on("legs") & beyond


def _away_from_jaws(known: Known) -> np.ndarray:
    return known.on("legs") & ~_nearer_spring(known) if known.on("spring").any() else known.on("legs")


def _hole(known: Known) -> np.ndarray:
    """Return the inside of a ring: the surface that faces the centre."""
    inward = known.positions_m.mean(0) - known.positions_m
    return known.on("band", "body", "strap") & (
        np.einsum("ij,ij->i", known.normals, inward) > 0.2 * np.linalg.norm(inward, axis=1)
    )


def _rim_of_the_band(known: Known) -> np.ndarray:
    outward = known.positions_m - known.positions_m.mean(0)
    return np.einsum("ij,ij->i", known.normals, outward) > 0.2 * np.linalg.norm(outward, axis=1)


def _working_end(known: Known) -> np.ndarray:
    """Return the working end of a lying object, which points to +X."""
    x = known.positions_m[:, 0]
    along_x = np.ptp(x) >= np.ptp(known.positions_m, axis=0).max() - 1e-9
    return x > x.max() - 0.08 * np.ptp(x) if along_x else np.zeros(len(x), dtype=bool)


def _either_end(known: Known) -> np.ndarray:
    across = np.ptp(known.positions_m[:, :2], axis=0)
    if across.max() > np.ptp(known.positions_m[:, 2]) and across.max() < 1.01 * across.min():
        return _outermost(known)  # a round lying object has no ends except its edge
    along = known.positions_m[:, int(np.ptp(known.positions_m, axis=0).argmax())]
    return (along > along.max() - 0.1 * np.ptp(along)) | (along < along.min() + 0.1 * np.ptp(along))


def _outermost(known: Known) -> np.ndarray:
    radius = np.linalg.norm(known.positions_m[:, :2] - known.positions_m[:, :2].mean(0), axis=1)
    return radius > 0.93 * radius.max()


REGIONS: dict[str, Region] = {
    "base": _underside, "foot": _underside, "top": _upper_side, "controls": _upper_side, "upper side": _upper_side,
    "opening": _known_opening, "lid": _upper_side, "cap": _upper_side, "nozzle": _upper_side, "surface": _front,
    "side": _sides, "outside": _sides, "edge": _narrow_edge, "front": _front, "back": _back,
    "far end": _far_end, "shaft end": _far_end, "body end": _far_end,
    "handle end": _far_end, "seam": _far_end, "blunt end": _far_end, "inner side": _hole, "hole": _hole,
    "outer side": _rim_of_the_band,
    "other end": _either_end, "jaws": _nearer_spring, "handles": _away_from_jaws, "end": _either_end, "tip": _working_end,
    "front edge": _working_end, "cup edge": _underside, "inside": _upper_side, "rim": _outermost, "wick": _upper_side,
    "bowl tip": _working_end, "blade tip": _working_end, "blade tips": _working_end, "wiping face": _front,
    "back face": _back,
}  # fmt: skip
"""The region of each label that names no part, by a property that holds for such a place."""
