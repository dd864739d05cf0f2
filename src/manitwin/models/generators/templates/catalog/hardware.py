"""Small solid objects: hardware, rings, coins, dice, weights."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import (
    box,
    cylinder,
    ellipsoid,
    lathe,
    polygon,
    prism,
    rounded,
    torus,
    union,
)
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.template import Model, template


@template("roll of tape")
def roll_of_tape(*, width_m: float, height: float, core: float) -> Model:
    """Build a roll of tape lying on its side; ``height`` and ``core`` are relative to its width."""
    high = height * width_m
    model = (
        Model()
        .add("body", cylinder(0.5 * width_m, high))
        .cut("core", cylinder(0.5 * core * width_m, 3 * high).translate((0, 0, -high)), "core")
    )
    model.point("core", "hole", "core", (0.0, 0.0, high), (0.0, 0.0, 1.0))
    return model.point("tape", "surface", "body", (0.0, -0.5 * width_m, 0.5 * high), (0.0, -1.0, 0.0))


@template("clothespin")
def clothespin(*, length_m: float, thick_m: float, open: float) -> Model:
    """Build a clothespin lying on its side, its mouth towards +X."""
    end = 0.5 * length_m
    model = Model()
    for side in (1.0, -1.0):
        leg = polygon(
            [
                (-end, side * open * length_m),
                (-end, side * (open * length_m - 0.006)),
                (0.1 * end, 0.0003 * side),
                (end, 0.0003 * side),
                (end, side * 0.0055),
                (0.1 * end, side * 0.0075),
            ][:: int(side)]
        )
        model.add("legs", prism(leg, thick_m).translate((0, 0, -0.5 * thick_m)))
    coil = cylinder(0.0042, thick_m + 0.002).translate((0.08 * end, 0, -0.5 * thick_m - 0.001))
    model.add("spring", coil, "spring")
    model.point("mouth", "tip", "legs", (end, 0.002, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "legs", "button", "legs", (-0.9 * end, open * length_m * 0.92, 0.0), (0.0, 1.0, 0.0)
    ).rest_on_ground()


@template("brick")
def brick(*, length_m: float, width: float, height: float) -> Model:
    """Build a brick with three holes."""
    across, high = width * length_m, height * length_m
    model = Model().add("body", box(length_m, across, high, radius_m=0.002))
    for place in (-0.28, 0.0, 0.28):
        model.cut("holes", cylinder(0.17 * across, 3 * high).translate((place * length_m, 0, -high)))
    return model.point("top", "face", "body", (0.14 * length_m, 0.0, high), (0.0, 0.0, 1.0))


@template("nut")
def nut(*, width_m: float, height: float, hole: float) -> Model:
    """Build a lying hexagonal nut; ``width_m`` is measured across its corners."""
    high = height * width_m
    body = cylinder(0.5 * width_m, high, sides=6) ^ lathe(
        [
            (0, 0),
            (0.43 * width_m, 0),
            (0.52 * width_m, 0.2 * high),
            (0.52 * width_m, 0.8 * high),
            (0.43 * width_m, high),
            (0, high),
        ]
    )
    model = Model().add("body", body).cut("hole", cylinder(0.5 * hole * width_m, 3 * high).translate((0, 0, -high)))
    return model.point("hole", "hole", "hole", (0.0, 0.0, high), (0.0, 0.0, 1.0))


@template("gear")
def gear(*, width_m: float, height: float, teeth: float) -> Model:
    """Build a spur gear lying flat."""
    count, r, high = round(teeth), 0.5 * width_m, height * width_m
    points = []
    for tooth in range(count):
        for share, radius in ((-0.3, 0.84), (-0.16, 1.0), (0.16, 1.0), (0.3, 0.84)):
            angle = 2 * np.pi * (tooth + share) / count
            points.append((radius * r * np.cos(angle), radius * r * np.sin(angle)))
    model = (
        Model()
        .add("teeth", prism(polygon(points), high))
        .cut("bore", cylinder(0.2 * r, 3 * high).translate((0, 0, -high)))
    )
    return model.point("bore", "hole", "bore", (0.0, 0.0, high), (0.0, 0.0, 1.0))


@template("dice")
def dice(*, length_m: float, edge: float) -> Model:
    """Build a die with one on top, two towards -Y and three towards +X; opposite sides sum to seven."""
    a = length_m
    model = Model().add("body", box(a, a, a, radius_m=edge * a))
    spots = {1: [(0, 0)], 2: [(-1, -1), (1, 1)], 3: [(-1, -1), (0, 0), (1, 1)], 4: [(-1, -1), (-1, 1), (1, -1), (1, 1)]}
    spots[5], spots[6] = [*spots[4], (0, 0)], [*spots[4], (-1, 0), (1, 0)]
    turns = {1: (0, 0, 0), 6: (180, 0, 0), 2: (90, 0, 0), 5: (-90, 0, 0), 3: (0, 90, 0), 4: (0, -90, 0)}
    pips = []
    for number, turn in turns.items():
        for x, y in spots[number]:
            ball = ellipsoid(0.19 * a, 0.19 * a, 0.12 * a, sides=12).translate((0.25 * a * x, 0.25 * a * y, 0.5 * a))
            pips.append(ball.rotate(turn).translate((0, 0, 0.5 * a)))
    model.cut("pips", union(pips), "pips")
    return model.point("top", "face", "body", (0.2 * a, 0.0, a), (0.0, 0.0, 1.0))


@template("dumbbell")
def dumbbell(*, length_m: float, width: float, grip_m: float) -> Model:
    """Build a hexagonal dumbbell lying along X."""
    r, end = 0.5 * width * length_m, 0.5 * length_m
    weight = 0.28 * length_m
    model = Model()
    for place in (-end, end - weight):
        head = cylinder(r, weight, sides=6).rotate((0, 0, 30)).rotate((0, 90, 0)).translate((place, 0, 0))
        model.add("weights", head)
    model.add(
        "handle",
        cylinder(0.5 * grip_m, length_m - weight).rotate((0, 90, 0)).translate((-end + 0.5 * weight, 0, 0)),
        "handle",
    )
    return model.point("handle", "surface", "handle", (0.0, 0.0, 0.5 * grip_m), (0.0, 0.0, 1.0)).rest_on_ground()


@template("padlock")
def padlock(*, width_m: float, height: float, depth: float, shackle: float) -> Model:
    """Build a closed padlock standing on its keyhole side."""
    high, y, over = height * width_m, depth * width_m, shackle * width_m
    model = Model().add("body", box(width_m, y, high, radius_m=0.003))
    x = 0.3 * width_m
    path = arc(
        [
            (-x, 0, high - 0.006),
            (-x, 0, high + 0.5 * over),
            (0, 0, high + over),
            (x, 0, high + 0.5 * over),
            (x, 0, high - 0.006),
        ],
        samples=40,
    )
    model.add("shackle", tube(path, 0.085 * width_m), "shackle")
    model.cut("keyhole", box(0.05 * width_m, 0.5 * y, 0.012).translate((0, 0, -0.004)))
    model.point("keyhole", "hole", "keyhole", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return model.point("shackle", "surface", "shackle", (0.0, 0.0, high + over + 0.085 * width_m), (0.0, 0.0, 1.0))


@template("key")
def key(*, length_m: float, bow: float, thick_m: float) -> Model:
    """Build a flat key, its blade towards +X."""
    r, end = 0.5 * bow * length_m, 0.5 * length_m
    start = -end + 2 * r
    blade = polygon(
        [
            (start - 0.3 * r, -0.0038),
            (end - 0.003, -0.0038),
            (end, -0.001),
            (end - 0.004, 0.003),
            (end - 0.009, 0.0015),
            (end - 0.014, 0.0035),
            (end - 0.019, 0.001),
            (start, 0.0038),
            (start - 0.3 * r, 0.0038),
        ]
    )
    model = Model().add("bow", cylinder(r, thick_m).translate((-end + r, 0, 0))).add("blade", prism(blade, thick_m))
    model.cut("hole", cylinder(0.28 * r, 0.02).translate((-end + 0.5 * r, 0, -0.01)))
    model.point("blade", "tip", "blade", (end, -0.001, 0.5 * thick_m), (1.0, 0.0, 0.0))
    return model.point("bow", "face", "bow", (-end + 1.4 * r, 0.0, thick_m), (0.0, 0.0, 1.0))


@template("curtain ring")
def curtain_ring(*, width_m: float, thick: float) -> Model:
    """Build a plain ring lying flat."""
    tube_m = thick * width_m
    model = Model().add("body", torus(0.5 * (width_m - tube_m), 0.5 * tube_m))
    return model.point("hole", "hole", "body", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)).rest_on_ground()


@template("coin")
def coin(*, width_m: float, thick: float) -> Model:
    """Build a coin with a raised rim."""
    r, high = 0.5 * width_m, thick * width_m
    low = 0.12 * high
    profile = [
        (0, low),
        (0.86 * r, low),
        (0.88 * r, 0),
        (r, 0),
        (r, high),
        (0.88 * r, high),
        (0.86 * r, high - low),
        (0, high - low),
    ]
    model = Model().add("body", lathe(profile))
    return model.point("face", "face", "body", (0.0, 0.0, high - low), (0.0, 0.0, 1.0))


@template("bolt")
def bolt(*, length_m: float, width: float, head: float, shank: float) -> Model:
    """Build a lying hexagonal bolt with its head towards -X.

    ``width`` is relative to the length, ``head`` and ``shank`` to the width.
    """
    wide = width * length_m
    high, thin = head * wide, 0.5 * shank * wide
    hexagon = (
        cylinder(0.5 * wide, high, sides=6).rotate((0, 0, 30)).rotate((0, 90, 0)).translate((-0.5 * length_m, 0, 0))
    )
    pitch = max(0.22 * thin, 0.0009)
    z = np.arange(0.0, length_m - high - 0.4 * thin, 0.5 * pitch)
    ridges = [(thin if row % 2 == 0 else thin - 0.45 * pitch, float(height)) for row, height in enumerate(z)]
    rod = lathe([*ridges, (0.7 * thin, length_m - high)]).rotate((0, 90, 0)).translate((high - 0.5 * length_m, 0, 0))
    model = Model().add("head", hexagon).add("thread", rod)
    model.point("head", "face", "head", (-0.5 * length_m, 0.0, 0.0), (-1.0, 0.0, 0.0))
    return model.point("tip", "tip", "thread", (0.5 * length_m, 0.0, 0.0), (1.0, 0.0, 0.0)).rest_on_ground()


@template("washer")
def washer(*, width_m: float, hole: float, thick: float) -> Model:
    """Build a lying flat ring; ``hole`` and ``thick`` are relative to its width."""
    high = thick * width_m
    edge = 0.2 * high
    model = Model().add(
        "body", lathe(rounded([(0.0, 0.0), (0.5 * width_m, 0.0), (0.5 * width_m, high), (0.0, high)], edge))
    )
    model.cut("hole", cylinder(0.5 * hole * width_m, 3 * high).translate((0, 0, -high)))
    return model.point("hole", "hole", "hole", (0.0, 0.0, high), (0.0, 0.0, 1.0))
