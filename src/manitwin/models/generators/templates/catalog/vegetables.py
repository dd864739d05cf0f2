"""Further fruit and vegetables: standing ones have their stem up, lying ones have it towards +X."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import chords, cylinder, lathe
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.organic import (
    furrow,
    lay_along_x,
    leaves,
    scale_radially,
    smooth_revolution,
    stalk,
)
from manitwin.models.generators.templates.template import Model, template


@template("plum")
def plum(*, length_m: float, width: float, cleft: float) -> Model:
    """Build a lying plum with the stem cavity towards +X and a shallow cleft along its upper side."""
    wide = width * length_m
    profile = [(0, 0.0), (0.2, 0.008), (0.58, 0.08), (0.88, 0.25), (1, 0.48), (0.93, 0.72), (0.68, 0.91), (0.4, 0.985)]
    body = smooth_revolution([*profile, (0.24, 0.985), (0.08, 0.945), (0, 0.94)], wide, length_m, sides=80)
    laid = lay_along_x(scale_radially(body, furrow(cleft, 0.12, np.pi)).translate((0, 0, -0.5 * length_m)))
    scar = lay_along_x(cylinder(0.06 * wide, 0.03 * length_m, sides=chords(14))).translate((0.42 * length_m, 0, 0))
    model = Model().add("body", laid).add("stem", scar, "stem")
    model.point("upper side", "surface", "body", (0.0, 0.12 * wide, 0.485 * wide), (0.0, 0.25, 0.968))
    return model.point(
        "side", "surface", "body", (-0.02 * length_m, -0.5 * wide, 0.0), (0.0, -1.0, 0.0)
    ).rest_on_ground()


@template("avocado")
def avocado(*, length_m: float, width: float, neck: float) -> Model:
    """Build a lying avocado with its stem towards +X; ``neck`` is the neck's thickness relative to the belly's."""
    wide = width * length_m
    profile = [(0, 0.0), (0.3, 0.012), (0.72, 0.1), (0.95, 0.26), (1, 0.38), (0.9, 0.56), (0.5 * (0.9 + neck), 0.68)]
    profile += [(neck, 0.8), (0.74 * neck, 0.92), (0.38 * neck, 0.985), (0, 1.0)]
    tilt = _resting_tilt(np.array(profile) * [0.5 * wide, length_m])

    def laid(solid: Manifold) -> Manifold:
        return lay_along_x(solid.translate((0, 0, -0.5 * length_m))).rotate((0, float(np.degrees(tilt)), 0))

    model = Model().add("body", laid(smooth_revolution(profile, wide, length_m, sides=56)))
    nub = cylinder(0.07 * wide, 0.04 * length_m, top_radius_m=0.085 * wide, sides=chords(16))
    model.add("stem", laid(nub.translate((0, 0, 0.975 * length_m))), "stem")
    ahead = (float(np.cos(tilt)), 0.0, -float(np.sin(tilt)))
    end, broad = 0.515 * length_m, -0.12 * length_m
    model.point("stem end", "tip", "stem", (end * ahead[0], 0.0, end * ahead[2]), ahead)
    place = (broad * ahead[0], -0.5 * wide, broad * ahead[2])
    return model.point("side", "surface", "body", place, (0.0, -1.0, 0.0)).rest_on_ground()


def _resting_tilt(profile_m: np.ndarray) -> float:
    """Return the rotation (rad) about Y of a solid of revolution with profile (radius, z) lying at rest along +X.

    It rests where its centre of mass is lowest, which is the direction near the radial one with the smallest extent.
    """
    radius, z = arc([(r, 0.0, at) for r, at in profile_m], samples=200)[:, [0, 2]].T
    center_m = np.trapezoid(radius**2 * z, z) / np.trapezoid(radius**2, z)
    angles = np.linspace(-0.5, 0.5, 401)
    reach = np.max(np.cos(angles)[:, None] * radius + np.sin(angles)[:, None] * (z - center_m), axis=1)
    return float(angles[reach.argmin()])


@template("cucumber")
def cucumber(*, length_m: float, width: float, bend: float) -> Model:
    """Build a lying cucumber with its stem towards +X.

    ``bend`` is the distance of its middle from the line through its ends, relative to the length.
    """
    r = 0.5 * width * length_m
    along = np.linspace(0, 1, 40)
    ends = [0.0, 0.015, 0.05, 0.12, 0.3, 0.7, 0.88, 0.96, 0.99, 1.0]
    half = r * np.interp(along, ends, [0.2, 0.5, 0.8, 0.95, 1.0, 1.0, 0.9, 0.68, 0.45, 0.25])
    path = np.column_stack([(along - 0.5) * length_m, bend * length_m * (4 * (along - 0.5) ** 2), 0 * along])
    model = Model().add("body", tube(path, half, sides=chords(36)))
    model.region("tip", "body", lambda c: c[:, 0] < -0.47 * length_m)
    x, y = float(path[-1, 0]), float(path[-1, 1])
    end = (x + 0.045 * length_m, y + 0.02 * length_m, 0.0)
    nub = stalk([(x - 0.01 * length_m, y, 0), (x + 0.02 * length_m, y + 0.006 * length_m, 0), end], 0.17 * r, 0.14 * r)
    model.add("stem", nub, "stem")
    model.point("stem", "tip", "stem", end, (0.95, 0.31, 0.0))
    model.point("body", "surface", "body", (0.0, 0.0, r), (0.0, 0.0, 1.0))
    tip = (-0.5 * length_m, float(path[0, 1]), 0.0)
    return model.point("tip", "tip", "tip", tip, (-1.0, 0.0, 0.0)).rest_on_ground()


@template("corn")
def corn(*, length_m: float, width: float, rows: float, husk: float) -> Model:
    """Build a lying ear of corn with its stalk towards +X, with ``rows`` rows of kernels and ``husk`` of its length in leaves."""
    r, around = 0.5 * width * length_m, 2 * round(0.5 * rows)
    share = [0.0, 0.04, 0.14, 0.4, 0.8, 0.95, 1.0]
    levels = np.linspace(0.0, 1.0, chords(88) + 1)
    radii = r * np.interp(levels, share, [0.3, 0.58, 0.8, 0.97, 1.0, 0.9, 0.5])
    kernel = 1.6 * np.pi * r / around  # length along the ear is four fifths of the width

    def grained(vertices: np.ndarray) -> np.ndarray:
        angle, z = np.arctan2(vertices[:, 1], vertices[:, 0]), vertices[:, 2]
        across = np.abs(np.sin(0.5 * around * angle)) ** 0.5
        lengthwise = np.abs(np.sin(np.pi * z / kernel)) ** 0.5
        scale = 0.93 + 0.07 * across * lengthwise
        return np.column_stack([vertices[:, :2] * scale[:, None], z])

    ear = lathe(np.column_stack([radii, levels * length_m]), sides=chords(8 * around)).warp_batch(grained)
    model = Model().add("body", lay_along_x(ear.translate((0, 0, -0.5 * length_m))))
    model.region("tip", "body", lambda c: c[:, 0] < -0.45 * length_m)
    end = 0.5 * length_m
    long = husk * length_m
    outline = [(0.0, 0.012), (0.7 * r, 0.004), (1.0 * r, -0.25 * long), (1.04 * r, -0.6 * long), (1.22 * r, -long)]
    model.add("husk", lay_along_x(leaves(7, outline, 0.5 * r, 0.0018)).translate((end, 0, 0)), "husk")
    stem = arc([(end - 0.01, 0, 0), (end + 0.09 * length_m, 0, 0)], samples=4)
    model.add("stem", tube(stem, np.linspace(0.36 * r, 0.28 * r, 4), sides=16), "husk")
    model.point("stem", "tip", "stem", (end + 0.09 * length_m, 0.0, 0.0), (1.0, 0.0, 0.0))
    model.point("body", "surface", "body", (-0.1 * length_m, 0.0, 0.97 * r), (0.0, 0.0, 1.0))
    return model.point("tip", "tip", "tip", (-0.5 * length_m, 0.0, 0.0), (-1.0, 0.0, 0.0)).rest_on_ground()


@template("bell pepper")
def bell_pepper(*, width_m: float, tall: float, ribs: float, stem_m: float) -> Model:
    """Build a bell pepper standing on its four lobes with its stem up; ``ribs`` is the depth of its furrows."""
    r, h = 0.5 * width_m, tall * width_m
    profile = [(0, 0.09), (0.2, 0.05), (0.45, 0.0), (0.74, 0.07), (0.87, 0.28), (0.96, 0.58), (1, 0.76), (0.9, 0.94)]
    body = smooth_revolution([*profile, (0.66, 1.0), (0.36, 0.955), (0.14, 0.86), (0, 0.84)], width_m, h, sides=96)
    model = Model().add(
        "body", scale_radially(body, lambda a: 1 - ribs * (1 - np.abs(np.sin(2 * a)) ** 0.6) + 0.03 * np.sin(a))
    )
    top = (0.14 * r, 0.0, 0.84 * h + stem_m)
    path = arc([(0, 0, 0.8 * h), (0, 0, 0.9 * h), (0.05 * r, 0, 0.9 * h + 0.5 * stem_m), top], samples=12)
    half = 0.1 * r * np.interp(np.linspace(0, 1, 12), [0, 0.3, 0.8, 1], [2.6, 1.5, 1.0, 1.25])
    model.add("stem", tube(path, half, sides=14), "stem")
    model.point("stem end", "tip", "stem", top, (0.3, 0.0, 0.954))
    turn = np.radians(-45)
    side = (0.985 * r * float(np.cos(turn)), 0.985 * r * float(np.sin(turn)), 0.72 * h)
    return model.point(
        "side", "surface", "body", side, (float(np.cos(turn)), float(np.sin(turn)), 0.0)
    ).rest_on_ground()
