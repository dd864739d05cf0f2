"""Objects that stand about a home: an ashtray, a piggy bank, an hourglass, kitchen paper, a soap dish."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from manifold3d import CrossSection

from manitwin.geometry.solids.shapes import (
    SIDES,
    box,
    chords,
    cylinder,
    ellipsoid,
    lathe,
    polygon,
    prism,
    rounded,
    union,
)
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.template import Model, template


@template("ashtray")
def ashtray(*, width_m: float, height: float, wall: float, rests: float) -> Model:
    """Build a thick round dish with notches in its rim."""
    r, high, count = 0.5 * width_m, height * width_m, round(rests)
    inner = (1 - wall) * r
    model = Model().add("body", lathe(rounded([(0, 0), (0.92 * r, 0), (r, high), (0, high)], 0.006)))
    hollow = lathe(
        rounded([(0, 0.3 * high), (0.85 * inner, 0.3 * high), (inner, high + 0.02), (0, high + 0.02)], 0.008)
    )
    model.cut("inside", hollow)
    notch = cylinder(0.0048, 1.2 * r, sides=20).rotate((0, 90, 0)).translate((0, 0, high - 0.0004))
    turns = [360.0 * number / count - 90.0 for number in range(count)]
    model.cut("rests", union([notch.rotate((0, 0, turn)) for turn in turns]))
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: centers[:, 2] > 0.82 * high)
    model.region("base", "body", lambda centers: centers[:, 2] < 0.02 * high)
    model.point("opening", "opening", "rim", (0.0, 0.0, high), (0.0, 0.0, 1.0))
    model.point("inside", "face", "inside", (0.0, 0.0, 0.3 * high), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.4 * r, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("piggy bank")
def piggy_bank(*, length_m: float, width: float, height: float) -> Model:
    """Build a pig on four legs with its snout towards -Y and a coin slot in its back."""
    wide, high = width * length_m, height * length_m
    leg, long = 0.2 * high, 0.86 * length_m
    middle = leg + 0.5 * (high - leg) - 0.02 * high
    tall = high - leg - 0.02 * high
    model = Model().add("body", ellipsoid(wide, long, tall).translate((0, 0.05 * length_m, middle)))
    for x in (-1.0, 1.0):
        for y in (-1.0, 1.0):
            foot = cylinder(0.13 * wide, 0.5 * middle, top_radius_m=0.17 * wide)
            model.add("legs", foot.translate((x * 0.26 * wide, 0.05 * length_m + y * 0.23 * long, 0)))
    front = -0.5 * length_m
    snout = lathe(rounded([(0, 0), (0.17 * wide, 0), (0.19 * wide, 0.18 * length_m), (0, 0.18 * length_m)], 0.004))
    model.add("snout", snout.rotate((-90, 0, 0)).translate((0, front, middle)), "snout")
    for side in (-1.0, 1.0):
        nostril = (
            cylinder(0.035 * wide, 0.008, sides=16)
            .rotate((90, 0, 0))
            .translate((side * 0.065 * wide, front + 0.004, middle))
        )
        model.cut("nostrils", nostril, "snout")
        eye = ellipsoid(0.07 * wide, 0.06 * wide, 0.08 * wide)
        place = np.array([side * 0.4, -0.82, 0.4])
        place = place / np.linalg.norm(place) * (0.5 * wide, 0.5 * long, 0.5 * tall)
        model.add(
            "eyes",
            eye.translate((float(place[0]), float(place[1]) + 0.05 * length_m, middle + float(place[2]))),
            "eyes",
        )
        ear = (
            cylinder(0.14 * wide, 0.3 * wide, top_radius_m=0.012 * wide, sides=20)
            .scale((1, 0.42, 1))
            .rotate((24, side * 24, 0))
        )
        model.add("ears", ear.translate((side * 0.24 * wide, -0.2 * long + 0.05 * length_m, middle + 0.36 * tall)))
    turn = np.linspace(0, 2.6 * np.pi, 30)
    curl = np.stack(
        [
            0.07 * wide * np.sin(turn),
            0.5 * long + 0.03 * length_m + 0.012 * length_m * turn / 2,
            middle + 0.07 * wide * np.cos(turn),
        ],
        1,
    )
    model.add("tail", tube(curl, 0.022 * wide, sides=10))
    slot = box(0.0045, 0.034 + 0.05 * length_m, 0.2 * tall).translate((0, 0.05 * length_m, middle + 0.4 * tall))
    model.cut("slot", slot, "slot")
    model.point("slot", "hole", "slot", (0.0, 0.05 * length_m, middle + 0.5 * tall), (0.0, 0.0, 1.0))
    return model.point("body", "surface", "body", (0.5 * wide, 0.05 * length_m, middle), (1.0, 0.0, 0.0))


@template("hourglass")
def hourglass(*, height_m: float, width: float, neck_m: float, sand: float) -> Model:
    """Build an hourglass between two discs on three posts, with a part of its sand run through."""
    h, r, disc = height_m, 0.5 * width * height_m, 0.07 * height_m
    low, high, middle, bulb = disc - 0.001, h - disc + 0.001, 0.5 * h, 0.72 * r
    share = np.linspace(0, 1, 14)
    waist = 0.5 * neck_m + (bulb - 0.5 * neck_m) * np.sin(0.5 * np.pi * np.minimum(1.25 * share, 1.0)) ** 1.3
    upper = [(float(w), float(middle + (high - middle) * s)) for w, s in zip(waist, share, strict=True)]
    lower = [(float(w), float(middle - (middle - low) * s)) for w, s in zip(waist, share, strict=True)]
    model = Model().add("bulbs", lathe([(0, low), *lower[::-1], *upper[1:], (0, high)]), "glass")
    level = low + sand * (middle - low)
    model.region("sand", "bulbs", lambda centers: centers[:, 2] < level, "sand")
    plate = lathe(rounded([(0, 0), (r, 0), (r, disc), (0, disc)], 0.2 * disc))
    model.add("foot", plate).add("top", plate.translate((0, 0, h - disc)))
    for turn in np.radians([30.0, 150.0, 270.0]):
        x, y = 0.86 * r * float(np.cos(turn)), 0.86 * r * float(np.sin(turn))
        t = 0.07 * r
        post = lathe(
            rounded(
                [
                    (0, disc - 0.002),
                    (1.3 * t, disc - 0.002),
                    (t, 0.3 * h),
                    (1.5 * t, 0.5 * h),
                    (t, 0.7 * h),
                    (1.3 * t, h - disc + 0.002),
                    (0, h - disc + 0.002),
                ],
                0.01,
            ),
            sides=16,
        )
        model.add("posts", post.translate((x, y, 0)))
    model.point("top", "face", "top", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    model.point("base", "face", "foot", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return model.point("glass", "surface", "bulbs", (0.0, -bulb, high - 0.1 * (high - middle)), (0.0, -1.0, 0.0))


@template("paper towel")
def paper_towel(*, height_m: float, width: float, core_m: float) -> Model:
    """Build a roll of kitchen paper standing on its end, with its last sheet hanging down towards +X."""
    r = 0.5 * width * height_m
    model = Model().add("body", cylinder(r, height_m))
    sheet = arc(
        [(0.5 * r, -0.872 * r, 0), (0.85 * r, -0.62 * r, 0), (1.06 * r, -0.2 * r, 0), (1.12 * r, 0.1 * r, 0)],
        samples=14,
    )
    strip = [cylinder(0.0009, height_m - 0.001, sides=8).translate((float(x), float(y), 0.0005)) for x, y, _ in sheet]
    model.add("sheet", union([(one + other).hull() for one, other in pairwise(strip)]))
    model.cut("core", cylinder(0.5 * core_m, 3 * height_m).translate((0, 0, -height_m)), "core")
    model.point("core", "hole", "core", (0.0, 0.0, height_m), (0.0, 0.0, 1.0))
    model.point("sheet", "edge", "sheet", (1.12 * r, 0.1 * r, 0.5 * height_m), (0.2, 0.98, 0.0))
    return model.point("outside", "surface", "body", (-r, 0.0, 0.5 * height_m), (-1.0, 0.0, 0.0))


def _stadium(x_m: float, y_m: float) -> CrossSection:
    """Return a rectangle whose shorter sides are semicircles."""
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, chords(SIDES) // 2)
    right = np.stack([0.5 * (x_m - y_m) + 0.5 * y_m * np.cos(turn), 0.5 * y_m * np.sin(turn)], axis=1)
    return polygon(np.concatenate([right, -right]))


@template("soap dish")
def soap_dish(*, length_m: float, width: float, height: float, wall_m: float) -> Model:
    """Build an oval dish with ribs on its floor and drain holes."""
    across, high = width * length_m, height * length_m
    outline, hollow = _stadium(length_m, across), _stadium(length_m - 2 * wall_m, across - 2 * wall_m)
    floor = 1.6 * wall_m
    model = Model().add("body", prism(outline, high, radius_m=0.25 * wall_m))
    model.cut("inside", prism(hollow, high).translate((0, 0, floor)))
    for place in np.linspace(-0.26, 0.26, 5):
        rib = box(0.004, 0.66 * across, 0.3 * high, radius_m=0.0015).translate(
            (float(place) * length_m, 0, floor - 0.001)
        )
        model.add("ribs", rib)
    for place in np.linspace(-0.195, 0.195, 4):
        hole = box(0.004, 0.4 * across, 0.1, radius_m=0.0015).translate((float(place) * length_m, 0, -0.05))
        model.cut("holes", hole)
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: centers[:, 2] > 0.97 * high)
    model.region("base", "body", lambda centers: centers[:, 2] < 0.02 * high)
    model.point("ribs", "face", "ribs", (0.0, 0.0, floor - 0.001 + 0.3 * high), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.3 * length_m, 0.0, 0.0), (0.0, 0.0, -1.0))
