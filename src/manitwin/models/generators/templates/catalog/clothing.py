"""Clothing for feet and heads, and a suitcase."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import box, cylinder, ellipsoid, lathe, polygon, prism, rectangle, rounded, union
from manitwin.geometry.solids.sweep import arc, loft, tube
from manitwin.models.generators.templates.template import Model, template

_SHARES = np.array([0.0, 0.03, 0.1, 0.25, 0.42, 0.58, 0.72, 0.84, 0.93, 0.98, 1.0])
"""Positions along a shoe, relative to its length, from the heel."""
_WIDTHS = np.array([0.2, 0.5, 0.68, 0.74, 0.78, 0.92, 1.0, 0.94, 0.72, 0.42, 0.12])
_HEIGHTS = np.array([0.6, 0.86, 1.0, 1.0, 0.92, 0.74, 0.56, 0.44, 0.36, 0.26, 0.12])


def _shoe(length_m: float, width_m: float, height_m: float, inset_m: float, low_m: float) -> Manifold:
    """Return the upper of a shoe, inset by ``inset_m`` on all sides, standing on z = ``low_m`` with the toe towards +X."""
    shares = np.linspace(0, 1, 28)
    x = (-0.5 * length_m + inset_m) + (length_m - 2 * inset_m) * shares
    half = np.maximum(0.5 * width_m * np.interp(shares, _SHARES, _WIDTHS) - inset_m, 0.0015)
    high = np.maximum(height_m * np.interp(shares, _SHARES, _HEIGHTS) - inset_m, 0.003)
    turn = np.linspace(0, np.pi, 18)
    y, z = np.sign(np.cos(turn)) * np.abs(np.cos(turn)) ** 0.7, np.sin(turn) ** 0.8
    rings = np.stack([np.broadcast_to(x[:, None], (28, 18)), half[:, None] * y, low_m + high[:, None] * z], axis=2)
    return loft(rings)


@template("shoe")
def shoe(*, length_m: float, width: float, height: float, sole_m: float) -> Model:
    """Build a low shoe with laces on its sole, the toe towards +X."""
    wide, high = width * length_m, height * length_m
    shares = np.linspace(0, 1, 28)
    x = length_m * (shares - 0.5)
    half = 0.53 * wide * np.interp(shares, _SHARES, np.maximum(_WIDTHS, 0.16))
    outline = polygon([*zip(x, -half, strict=True), *zip(x[::-1], half[::-1], strict=True)], radius_m=0.006)
    model = Model().add("sole", prism(outline, sole_m, radius_m=0.004), "sole")
    model.add("upper", _shoe(0.985 * length_m, wide, high - sole_m, 0.0, sole_m - 0.003))
    wall = 0.005
    hollow = _shoe(0.985 * length_m, wide, high - sole_m, wall, sole_m + 0.002)
    mouth = (
        cylinder(1.0, 2 * high)
        .scale((0.17 * length_m, 0.27 * wide, 1))
        .translate((-0.24 * length_m, 0, sole_m + 0.3 * high))
    )
    model.cut("inside", hollow + mouth, "lining")
    for number in range(5):
        share = 0.46 + 0.065 * number
        top = sole_m - 0.003 + (high - sole_m) * float(np.interp(share, _SHARES, _HEIGHTS))
        reach = 0.24 * wide
        lace = arc(
            [(0, -reach, -0.006), (0, -0.5 * reach, 0.0005), (0, 0.5 * reach, 0.0005), (0, reach, -0.006)], samples=10
        )
        band = tube(lace, 0.0035, flatten=0.6, across=(1, 0, 0), sides=8).translate((length_m * (share - 0.5), 0, top))
        model.add("laces", band, "laces")
    model.region("toe", "upper", lambda centers: centers[:, 0] > 0.38 * length_m)
    model.region("heel", "upper", lambda centers: centers[:, 0] < -0.44 * length_m)
    rim = sole_m - 0.003 + high - sole_m
    model.region("rim", "inside", lambda centers: (centers[:, 2] > rim - 0.14 * high) & (centers[:, 0] < 0))
    model.point("opening", "opening", "rim", (-0.24 * length_m, 0.0, rim - 0.03 * high), (0.0, 0.0, 1.0))
    model.point("toe", "surface", "toe", (0.49 * length_m, 0.0, sole_m + 0.005), (1.0, 0.0, 0.0))
    model.point("sole", "face", "sole", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return model.point("heel", "surface", "heel", (-0.4925 * length_m, 0.0, sole_m + 0.2 * high), (-1.0, 0.0, 0.0))


@template("hat")
def hat(*, length_m: float, crown: float, height: float, waist: float) -> Model:
    """Build a hat that lies on its brim, a ribbon around its crown."""
    brim, r, high, t = 0.5 * length_m, 0.5 * crown * length_m, height * length_m, 0.003
    top = waist * r
    outer = [
        (0, high - 0.012),
        (0.3 * top, high - 0.008),
        (0.8 * top, high),
        (top, high - 0.014),
        (r, t + 0.006),
        (1.12 * r, t),
        (brim, t),
        (brim, 0),
        (0, 0),
    ]
    inner = [(0, -0.01), (r - t, -0.01), (r - t, t + 0.004), (0.97 * top - t, high - 0.026), (0, high - 0.018)]
    model = Model().add("crown", lathe(rounded(outer[:-2], 0.016) + outer[-2:]))
    model.add(
        "ribbon",
        lathe(
            [
                (0, t + 0.004),
                (r + 0.001, t + 0.004),
                (r - 0.2 * (r - top) + 0.0012, t + 0.2 * high),
                (0, t + 0.2 * high),
            ]
        ),
        "ribbon",
    )
    model.cut("inside", lathe(inner))
    model.region("brim", "crown", lambda centers: np.hypot(centers[:, 0], centers[:, 1]) > 1.13 * r)
    model.point("crown", "surface", "crown", (0.0, 0.0, high - 0.012), (0.0, 0.0, 1.0))
    model.point("brim", "edge", "brim", (0.0, -brim, 0.5 * t), (0.0, -1.0, 0.0))
    return model.point("opening", "opening", "inside", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("cap")
def cap(*, length_m: float, width: float, height: float, visor: float) -> Model:
    """Build a peaked cap that lies on its edge, the visor towards -Y."""
    reach = visor * length_m
    deep, wide, high, t = length_m - reach, width * length_m, height * length_m, 0.0025
    above = box(2 * length_m, 2 * length_m, length_m)
    middle = 0.5 * reach
    dome = ellipsoid(wide, deep, 2 * high).translate((0, middle, 0)) ^ above
    model = Model()
    bow, out = 0.95 * wide, middle - 0.5 * deep
    plate = cylinder(bow, 2 * length_m) - cylinder(bow - 0.0032, 3 * length_m).translate((0, 0, -0.5 * length_m))
    plate = plate.rotate((90, 0, 0)).translate((0, length_m, 0.006 - bow))
    outline = ellipsoid(0.86 * wide, 2 * (reach + 0.12 * deep), 1.0).translate((0, out + 0.12 * deep, 0)) ^ box(
        1.0, 2 * length_m, 0.2
    ).translate((0, out + 0.12 * deep - length_m, -0.1))
    model.add("visor", plate ^ outline, "visor")
    model.add("crown", dome)
    inner = ellipsoid(wide - 2 * t, deep - 2 * t, 2 * (high - t)).translate((0, middle, 0))
    model.cut("inside", inner ^ box(2 * length_m, 2 * length_m, 2 * length_m).translate((0, 0, -length_m)))
    model.add("button", ellipsoid(0.016, 0.016, 0.008).translate((0, middle, high)))
    model.point("visor", "edge", "visor", (0.0, out - reach, 0.0045), (0.0, -1.0, 0.0))
    model.point("crown", "surface", "crown", (0.0, middle + 0.3 * deep, 0.8 * high), (0.0, 0.6, 0.8))
    return model.point("opening", "opening", "inside", (0.0, middle, 0.0), (0.0, 0.0, -1.0)).rest_on_ground()


@template("suitcase")
def suitcase(*, height_m: float, width: float, depth: float, ribs: float) -> Model:
    """Build a suitcase that stands on four wheels, its ribbed front towards -Y, a handle on top and one at its side."""
    wheel = 0.062 * height_m
    x, y, high = width * height_m, depth * height_m, height_m - wheel - 0.02
    model = Model().add("body", box(x, y, high, radius_m=0.16 * y).translate((0, 0, wheel)))
    count, pitch = round(ribs), 0.78 * x / round(ribs)
    grooves = [
        box(0.32 * pitch, 0.008, 0.84 * high).translate(
            ((number - 0.5 * (count - 1)) * pitch, side * 0.5 * y, wheel + 0.08 * high)
        )
        for number in range(count)
        for side in (-1.0, 1.0)
    ]
    model.cut("grooves", union(grooves))
    seam = box(2 * x, 0.005, 2 * high).translate((0, 0, -0.5 * high)) - prism(
        rectangle(x - 0.006, 1.0, radius_m=0.0), high - 0.006
    ).translate((0, 0, wheel + 0.003))
    model.cut("seam", seam, "trim")
    for side in (-1.0, 1.0):
        for deep in (-1.0, 1.0):
            turned = (
                cylinder(0.5 * wheel, 0.6 * wheel)
                .rotate((0, 90, 0))
                .translate((side * 0.38 * x - 0.3 * wheel, deep * 0.3 * y, 0.5 * wheel))
            )
            mount = cylinder(0.34 * wheel, 0.8 * wheel + 0.01).translate((side * 0.38 * x, deep * 0.3 * y, 0.5 * wheel))
            model.add("wheels", turned + mount, "trim")
    top = wheel + high
    rods = [cylinder(0.008, 0.03).translate((side * 0.24 * x, 0.3 * y, top - 0.02)) for side in (-1.0, 1.0)]
    pull = box(0.6 * x, 0.03, 0.015, radius_m=0.006).translate((0, 0.3 * y, height_m - 0.015))
    model.add("pull handle", union([*rods, pull]), "trim")
    grip = arc(
        [
            (-0.2 * x, -0.02, top - 0.004),
            (-0.15 * x, -0.02, top + 0.016),
            (0.15 * x, -0.02, top + 0.016),
            (0.2 * x, -0.02, top - 0.004),
        ]
    )
    model.add("handle", tube(grip, 0.011, flatten=0.4, across=(0, 1, 0)), "trim")
    side_grip = arc(
        [
            (0.5 * x - 0.004, 0, top - 0.72 * high),
            (0.5 * x + 0.014, 0, top - 0.68 * high),
            (0.5 * x + 0.014, 0, top - 0.46 * high),
            (0.5 * x - 0.004, 0, top - 0.42 * high),
        ]
    )
    model.add("side handle", tube(side_grip, 0.011, flatten=0.4, across=(0, 1, 0)), "trim")
    model.point("handle", "surface", "handle", (0.0, -0.02, top + 0.02), (0.0, 0.0, 1.0))
    model.point("pull handle", "surface", "pull handle", (0.0, 0.3 * y, height_m), (0.0, 0.0, 1.0))
    model.point(
        "front", "face", "body", (0.5 * pitch if count % 2 else 0.0, -0.5 * y, wheel + 0.5 * high), (0.0, -1.0, 0.0)
    )
    return model.point("wheels", "surface", "wheels", (0.38 * x, -0.3 * y, 0.0), (0.0, 0.0, -1.0))
