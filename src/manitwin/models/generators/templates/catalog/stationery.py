"""Paper goods and office items to write on, store, fix, stamp and look at."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import (
    Point,
    box,
    cylinder,
    ellipsoid,
    lathe,
    polygon,
    prism,
    rectangle,
    rounded,
    union,
)
from manitwin.geometry.solids.sweep import tube
from manitwin.models.generators.templates.template import Model, template


def _lathe_along_x(profile: list[Point], sides: int = 36) -> Manifold:
    """Return a solid of revolution whose axis lies along X."""
    return lathe(profile, sides=sides).rotate((0, 90, 0))


@template("crayon")
def crayon(*, length_m: float, width: float, sleeve: float) -> Model:
    """Build a wax crayon in its paper sleeve, with the tip towards +X."""
    end, r = 0.5 * length_m, 0.5 * width * length_m
    tip = end - 2.2 * r
    body = [(0, -end), (r, -end), (r, tip), (0.8 * r, tip + 0.0005), (0.34 * r, end), (0, end)]
    model = Model().add("barrel", _lathe_along_x(body))
    model.region("tip", "barrel", lambda centers: centers[:, 0] > tip + 0.0004)
    start, stop = -sleeve * end, min(sleeve * end, tip - 0.002)
    model.add("sleeve", _lathe_along_x([(0, start), (1.04 * r, start), (1.04 * r, stop), (0, stop)]), "sleeve")
    model.point("tip", "tip", "tip", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("barrel", "surface", "sleeve", (0.0, 0.0, 1.04 * r), (0.0, 0.0, 1.0)).rest_on_ground()


@template("paper clip")
def paper_clip(*, length_m: float, width: float, wire_m: float) -> Model:
    """Build a lying clip of bent wire with its outer loop towards +X."""
    end, half = 0.5 * length_m, 0.5 * width * length_m
    inner = 0.66 * half

    def turn(x: float, y: float, radius: float, start: float, stop: float) -> list[list[float]]:
        angles = np.radians(np.linspace(start, stop, 12))
        return [[x + radius * float(np.cos(a)), y + radius * float(np.sin(a)), 0.0] for a in angles]

    wide, mid, small = half, 0.5 * (half + inner), inner
    path = [
        [-0.3 * end, -wide, 0.0],
        *turn(end - wide, 0.0, wide, -90, 90),
        *turn(-end + mid, wide - mid, mid, 90, 270),
        *turn(0.62 * end - small, wide - 2 * mid + small, small, -90, 90),
        [-0.5 * end, wide - 2 * mid + 2 * small, 0.0],
    ]
    return _wire(np.array(path), end, wire_m)


def _wire(path: np.ndarray, end: float, wire_m: float) -> Model:
    model = Model().add("wire", tube(path, 0.5 * wire_m, across=(0, 0, 1), sides=10))
    model.point("loop", "surface", "wire", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "opening", "surface", "wire", (float(path[0, 0]), float(path[0, 1]), 0.5 * wire_m), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("sticky notes")
def sticky_notes(*, length_m: float, width: float, thick_m: float, curl: float) -> Model:
    """Build a lying pad of notes whose upper sheets curl up towards -Y."""
    across = width * length_m
    model = Model().add("pad", box(length_m, across, thick_m))
    share = np.linspace(0, 1, 16)
    lift = curl * across * np.maximum(share - 0.35, 0) ** 2
    y = 0.5 * across - across * share
    upper = [*zip(y, thick_m + lift + 0.0008, strict=True)]
    lower = [*zip(y[::-1], (thick_m + lift)[::-1] - 0.0002, strict=True)]
    sheet = prism(polygon([*upper, *lower]), length_m).rotate((90, 0, 90)).translate((-0.5 * length_m, 0, 0))
    model.add("top sheet", sheet, "top")
    model.point("surface", "face", "top sheet", (0.0, 0.2 * across, thick_m + 0.0008), (0.0, 0.0, 1.0))
    free = float(lift[-1])
    return model.point("free edge", "edge", "top sheet", (0.0, -0.5 * across, thick_m + free), (0.0, -1.0, 0.0))


@template("envelope")
def envelope(*, length_m: float, width: float, thick_m: float, flap: float) -> Model:
    """Build a closed lying envelope containing a letter, with its flap up and opening from -Y."""
    across = width * length_m
    model = Model().add("body", prism(rectangle(length_m, across, radius_m=0.002), thick_m))
    reach, half = flap * across, 0.5 * length_m
    corners = [
        (-half + 0.002, 0.5 * across),
        (-0.05 * length_m, 0.5 * across - reach),
        (0.05 * length_m, 0.5 * across - reach),
        (half - 0.002, 0.5 * across),
    ]
    model.add("flap", prism(polygon(corners[::-1], radius_m=0.003), 0.0007).translate((0, 0, thick_m - 0.0001)), "flap")
    model.point("flap", "edge", "flap", (0.0, 0.5 * across - reach, thick_m + 0.0003), (0.0, -1.0, 0.0))
    return model.point("front", "face", "body", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("folder")
def folder(*, length_m: float, width: float, thick_m: float, tab: float, reach: float) -> Model:
    """Build a closed lying folder with papers in it, the fold towards -X and a tab or none towards +X."""
    across, cover = width * length_m, 0.0012
    model = Model().add(
        "papers",
        box(0.93 * across, 0.93 * length_m, thick_m - cover).translate((-0.01 * across, 0, 0.5 * cover)),
        "papers",
    )
    lower = rectangle(across, length_m, radius_m=0.006)
    model.add("cover", prism(lower, cover)).add(
        "cover",
        prism(rectangle(across - 0.004, length_m, radius_m=0.006), cover).translate((-0.002, 0, thick_m - cover)),
    )
    leaf = prism(rectangle((0.03 + reach) * across, tab * length_m, radius_m=0.008), cover)
    model.add("tab", leaf.translate(((0.485 + 0.5 * reach) * across, 0.24 * length_m, 0)))
    model.add("fold", box(cover, length_m, thick_m).translate((-0.5 * across + 0.5 * cover, 0, 0)))
    model.point("front", "face", "cover", (0.0, 0.0, thick_m), (0.0, 0.0, 1.0))
    if reach > 0.02:
        model.point("tab", "edge", "tab", ((0.5 + reach) * across, 0.24 * length_m, 0.5 * cover), (1.0, 0.0, 0.0))
    return model.point("fold", "face", "fold", (-0.5 * across, 0.0, 0.5 * thick_m), (-1.0, 0.0, 0.0))


@template("hole punch")
def hole_punch(*, length_m: float, depth: float, height: float) -> Model:
    """Build a punch for two holes with its slot towards -Y and its lever on top."""
    deep, high = depth * length_m, height * length_m
    foot, bed = 0.16 * high, 0.3 * high
    model = Model().add("base", prism(rectangle(length_m, deep, radius_m=0.01), foot, radius_m=0.003), "base")
    block = box(0.9 * length_m, 0.56 * deep, 0.62 * high - foot, radius_m=0.004).translate(
        (0, 0.12 * deep, foot - 0.001)
    )
    model.add("body", block)
    model.cut("slot", box(2 * length_m, 0.42 * deep, 0.0035).translate((0, -0.16 * deep - 0.02 * deep, bed)), "base")
    for side in (-1.0, 1.0):
        model.add(
            "punches",
            cylinder(0.004, 0.4 * high).translate((side * 0.33 * length_m, -0.08 * deep, 0.5 * high)),
            "punches",
        )
    ends = [
        (0.34 * deep, 0.6 * high, 0.1 * high),
        (-0.04 * deep, 0.86 * high, 0.07 * high),
        (-0.42 * deep, 0.95 * high, 0.05 * high),
    ]
    rods = [
        cylinder(r, 0.78 * length_m, sides=20).rotate((0, 90, 0)).translate((-0.39 * length_m, y, z))
        for y, z, r in ends
    ]
    model.add("lever", union([(one + other).hull() for one, other in pairwise(rods)]), "lever")
    model.point("lever", "surface", "lever", (0.0, -0.36 * deep, 0.95 * high + 0.045 * high), (0.0, -0.3, 0.95))
    model.point("slot", "edge", "body", (0.0, -0.16 * deep, bed + 0.006), (0.0, -1.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("stamp")
def stamp(*, height_m: float, length: float, width: float, block: float) -> Model:
    """Build a rubber stamp standing on its rubber: a block with a turned handle."""
    x, h = length * height_m, height_m
    y, thick = width * x, block * height_m
    model = Model().add("block", box(x, y, thick, radius_m=0.0015).translate((0, 0, 0.0035)))
    model.add("rubber", box(0.94 * x, 0.9 * y, 0.005), "rubber")
    foot, r = thick + 0.002, min(0.2 * h, 0.42 * y)
    profile = [
        (0, foot),
        (0.8 * r, foot),
        (0.5 * r, foot + 0.14 * h),
        (0.5 * r, foot + 0.24 * h),
        (r, h - 0.2 * h),
        (0.9 * r, h - 0.05 * h),
        (0.4 * r, h),
        (0, h),
    ]
    model.add("handle", lathe(rounded(profile, 0.012)), "handle")
    model.point("rubber", "face", "rubber", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return model.point("handle", "surface", "handle", (0.0, 0.0, h), (0.0, 0.0, 1.0))


_LAND = (
    (50, -105, 62, 40), (66, -45, 22, 16), (20, -100, 16, 22), (-8, -62, 34, 30), (-32, -66, 14, 34), (6, 18, 44, 38),
    (-18, 24, 24, 32), (48, 18, 40, 22), (58, 70, 80, 34), (35, 95, 60, 34), (18, 78, 16, 26), (-25, 134, 34, 24),
    (-84, 0, 40, 40),
)  # fmt: skip
"""Patches of land: latitude and longitude, and extents to the east and the north, in degrees."""


def _land(radius_m: float) -> Manifold:
    """Return land as patches raised slightly above a sphere whose axis is tilted by 23.5 degrees."""
    patches = []
    for north, east, wide, high in _LAND:
        half_y, half_z = (
            radius_m * np.sin(np.radians(0.5 * reach)) for reach in (wide * np.cos(np.radians(north)) ** 0.5, high)
        )
        patch = ellipsoid(0.6 * radius_m, 2 * float(half_y), 2 * float(half_z), sides=32).translate((radius_m, 0, 0))
        patches.append(patch.rotate((0, -north, 0)).rotate((0, 0, east - 62)))
    shell = ellipsoid(*(3 * (2.012 * radius_m,)), sides=64) - ellipsoid(*(3 * (1.9 * radius_m,)), sides=32)
    return (union(patches) ^ shell).rotate((0, 23.5, 0))


@template("globe")
def globe(*, height_m: float, ball: float, base: float) -> Model:
    """Build a globe in its bow on a round foot, with its axis tilted towards +X."""
    h, r = height_m, 0.5 * ball * height_m
    foot, middle = 0.5 * base * height_m, height_m - 0.5 * ball * height_m - 0.035 * height_m
    model = Model().add(
        "base",
        lathe(
            rounded(
                [(0, 0), (foot, 0), (foot, 0.012 * h), (0.35 * foot, 0.05 * h), (0.12 * foot, 0.07 * h), (0, 0.07 * h)],
                0.006,
            )
        ),
        "stand",
    )
    bow = 1.09 * r
    angles = np.radians(np.linspace(66.5, -113.5, 40))
    path = np.stack([bow * np.cos(angles), 0 * angles, middle + bow * np.sin(angles)], 1)
    model.add("bow", tube(path, 0.012 * h, flatten=0.6), "stand")
    model.add("stem", cylinder(0.022 * h, middle - bow + 0.02 * h).translate((0, 0, 0.02 * h)), "stand")
    axis = np.array([np.cos(np.radians(66.5)), 0, np.sin(np.radians(66.5))])
    pin = tube(np.outer([-1.12 * r, 1.12 * r], axis) + np.array([0, 0, middle]), 0.008 * h)
    model.add("pins", pin, "stand")
    sphere = ellipsoid(2 * r, 2 * r, 2 * r, sides=64).rotate((0, 23.5, 0)).translate((0, 0, middle))
    model.add("ball", sphere).add("land", _land(r).translate((0, 0, middle)), "land")
    model.point("ball", "surface", "ball", (0.0, -r, middle), (0.0, -1.0, 0.0))
    return model.point("base", "face", "base", (0.5 * foot, 0.0, 0.0), (0.0, 0.0, -1.0)).rest_on_ground()


@template("paperweight")
def paperweight(*, width_m: float, height: float, foot: float) -> Model:
    """Build a glass dome with a flat underside."""
    r, high = 0.5 * width_m, height * width_m
    turn = np.linspace(-0.45, 0.5 * np.pi, 24)
    low = float(np.sin(-0.45))
    dome = [(foot * r, 0.0), *((float(r * np.cos(a)), float(high * (np.sin(a) - low) / (1 - low))) for a in turn[1:])]
    model = Model().add("dome", lathe([(0, 0), *dome, (0, high)]))
    model.region("base", "dome", lambda centers: centers[:, 2] < 1e-5, "felt")
    model.point("top", "surface", "dome", (0.0, 0.0, high), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("whiteboard eraser")
def whiteboard_eraser(*, length_m: float, width: float, height: float, felt: float) -> Model:
    """Build an eraser lying on its felt with its grip up."""
    across, high = width * length_m, height * length_m
    soft = felt * high
    model = Model().add("felt", box(0.97 * length_m, 0.94 * across, soft + 0.002), "felt")
    outline = polygon(
        [
            (-0.5 * across, soft),
            (0.5 * across, soft),
            (0.5 * across, soft + 0.26 * high),
            (0.36 * across, high),
            (-0.36 * across, high),
            (-0.5 * across, soft + 0.26 * high),
        ],
        radius_m=0.003,
    )
    grip = prism(outline, length_m).rotate((90, 0, 90)).translate((-0.5 * length_m, 0, 0))
    model.add("grip", grip)
    for side in (-1.0, 1.0):
        groove = cylinder(0.1 * across, 0.7 * length_m, sides=24).rotate((0, 90, 0))
        model.cut("groove", groove.translate((-0.35 * length_m, side * 0.52 * across, soft + 0.42 * high)))
    model.point("felt", "face", "felt", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return model.point("grip", "surface", "grip", (0.0, 0.0, high), (0.0, 0.0, 1.0))


@template("clipboard")
def clipboard(*, length_m: float, width: float, thick_m: float, clip: float) -> Model:
    """Build a lying board with its clip towards +X; ``width`` and the clip's width ``clip`` are relative to the length."""
    across, broad = width * length_m, clip * length_m
    model = Model().add("board", prism(rectangle(length_m, across, radius_m=0.012), thick_m))
    place = 0.5 * length_m - 0.032
    plate = box(0.036, broad, 0.0035, radius_m=0.0012).translate((place, 0, thick_m - 0.0005))
    lever = box(0.024, 0.7 * broad, 0.004, radius_m=0.0015).rotate((0, -24, 0))
    lever = lever.translate((place + 0.012, 0, thick_m + 0.0045))
    spring = (
        cylinder(0.0048, 0.8 * broad, sides=20).rotate((90, 0, 0)).translate((place, 0.4 * broad, thick_m + 0.0045))
    )
    model.add("clip", plate, "clip").add("clip", spring, "clip").add("clip", lever, "clip")
    top = thick_m + 0.0093
    model.point("clip", "surface", "clip", (place, 0.0, top), (0.0, 0.0, 1.0))
    model.point("board", "face", "board", (-0.1 * length_m, 0.0, thick_m), (0.0, 0.0, 1.0))
    return model.point("edge", "edge", "board", (-0.5 * length_m, 0.0, 0.5 * thick_m), (-1.0, 0.0, 0.0))
