"""Small kitchen items. Long ones lie along X with the working end towards +X."""

from __future__ import annotations

from itertools import product

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import chords, cylinder, ellipsoid, lathe, polygon, prism, rectangle, rounded
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.organic import lay_along_x
from manitwin.models.generators.templates.template import Model, template


@template("measuring spoon")
def measuring_spoon(*, length_m: float, bowl: float, deep: float, grip: float) -> Model:
    """Build a round bowl, open at the top, on a flat handle with a hole.

    ``bowl`` is the bowl's relative width, ``deep`` its depth relative to that.
    """
    n, r = length_m, 0.5 * bowl * length_m
    high, wall, thick = deep * bowl * length_m, 0.0013, 0.0022
    at = 0.5 * n - r
    turn = np.linspace(0, 0.5 * np.pi, 12)

    def cap(radius: float, depth: float) -> list[tuple[float, float]]:
        return [(float(radius * np.sin(a)), float(high - depth * np.cos(a))) for a in turn]

    flat = prism(rectangle(n - r, grip * n, radius_m=0.45 * grip * n), thick).translate((-0.5 * r, 0, high - thick))
    model = Model().add("handle", flat, "").add("bowl", lathe(cap(r, high)).translate((at, 0, 0)))
    model.cut("inside", lathe([*cap(r - wall, high - wall), (r - wall, high + 0.002)]).translate((at, 0, 0)))
    hole = cylinder(0.26 * grip * n, 1.0, sides=chords(24)).translate((-0.5 * n + 0.5 * grip * n, 0, -0.5))
    model.cut("hole", hole, "")
    model.point("bowl", "opening", "inside", (at, 0.0, high), (0.0, 0.0, 1.0))
    return model.point("handle", "face", "handle", (-0.25 * n, 0.0, high), (0.0, 0.0, 1.0)).rest_on_ground()


@template("basting brush")
def basting_brush(*, length_m: float, head: float, width: float, ferrule: float) -> Model:
    """Build a lying flat brush; ``head`` is the bristles' share of its length, ``ferrule`` that of the band behind them."""
    n, y = length_m, width * length_m
    start, band, thick = (0.5 - head) * n, ferrule * n, 0.22 * y
    half = [
        (-0.5, 0.2),
        (-0.46, 0.26),
        (-0.25, 0.24),
        (0.4 - head - ferrule, 0.32),
        (0.5 - head - ferrule, 0.46),
        (0.502 - head - ferrule, 0.46),
    ]
    outline = [(n * a, -y * b) for a, b in half] + [(n * a, y * b) for a, b in reversed(half)]
    model = Model().add("handle", prism(polygon(outline, radius_m=0.04 * y), thick, radius_m=0.3 * thick), "")
    grip = prism(rectangle(band, y, radius_m=0.1 * y), 1.08 * thick, radius_m=0.002)
    model.add("ferrule", grip.translate((start - 0.5 * band, 0, -0.04 * thick)), "ferrule")
    tuft = prism(
        polygon([(start - 0.001, -0.44 * y), (0.5 * n, -0.5 * y), (0.5 * n, 0.5 * y), (start - 0.001, 0.44 * y)]),
        0.7 * thick,
    )
    model.add("bristles", tuft.translate((0, 0, 0.15 * thick)), "bristles")
    hole = cylinder(0.09 * y, 1.0, sides=chords(20)).translate((-0.44 * n, 0, -0.5))
    model.cut("hole", hole, "")
    model.point("bristles", "edge", "bristles", (0.5 * n, 0.0, 0.5 * thick), (1.0, 0.0, 0.0))
    return model.point("handle", "face", "handle", (-0.25 * n, 0.0, thick), (0.0, 0.0, 1.0)).rest_on_ground()


@template("corkscrew")
def corkscrew(*, length_m: float, handle: float, coil: float, turns: float) -> Model:
    """Build a lying T of a wooden bar and a helix.

    ``handle`` is the bar's length relative to the whole, ``coil`` the helix's width.
    """
    n = length_m
    bar, thick = handle * n, 0.07 * n
    r = 0.5 * coil * n
    wire = max(0.0016, 0.28 * r)
    profile = [
        (0.0, -0.5 * bar),
        (0.75 * thick, -0.5 * bar),
        (thick, -0.3 * bar),
        (0.8 * thick, 0.0),
        (thick, 0.3 * bar),
        (0.75 * thick, 0.5 * bar),
        (0.0, 0.5 * bar),
    ]
    grip = lathe(rounded(profile, 0.4 * thick)).rotate((90, 0, 0)).translate((-0.5 * n + thick, 0, 0))
    model = Model().add("handle", grip)
    start = -0.02 * n
    model.add(
        "shank",
        lay_along_x(cylinder(1.25 * wire, 0.5 * n - thick + start + wire, sides=chords(20))).translate(
            (-0.5 * n + thick, 0, 0)
        ),
        "worm",
    )
    a = np.linspace(0, 2 * np.pi * turns, round(26 * turns))
    grow = np.clip(a / np.pi, 0, 1)
    x = start + (0.5 * n - start) * a / a[-1]
    path = np.column_stack([x, r * grow * np.cos(a), r * grow * np.sin(a)])
    radii = wire * np.interp(np.linspace(0, 1, len(a)), [0, 0.85, 1], [1, 1, 0.25])
    model.add("worm", tube(path, radii, sides=chords(12)), "worm")
    end = tuple(float(v) for v in path[-1])
    model.point("worm", "tip", "worm", (end[0], end[1], end[2]), (1.0, 0.0, 0.0))
    return model.point("handle", "surface", "handle", (-0.5 * n, 0.25 * bar, 0.0), (-1.0, 0.0, 0.0)).rest_on_ground()


@template("egg carton")
def egg_carton(*, length_m: float, width: float, height: float, cups: float) -> Model:
    """Build a closed pulp carton for two rows of ``cups`` eggs, with bosses in its lid and the flap towards -Y."""
    x, y, h = length_m, width * length_m, height * length_m
    count, seam = max(round(cups), 2), 0.5 * height * length_m
    model = Model()
    brim = prism(rectangle(x, y, radius_m=0.006), 0.003)
    model.add("body", brim.translate((0, 0, seam - 0.003)))
    px, py = x / count, 0.5 * y
    for i, j in product(range(count), (-0.5, 0.5)):
        at = ((i - 0.5 * (count - 1)) * px, j * py, 0.0)
        cup = cylinder(0.33 * min(px, py), seam - 0.001, top_radius_m=0.485 * min(px, py), sides=chords(24))
        model.add("body", cup.translate(at))
    lid = Manifold.batch_hull(
        [
            brim.translate((0, 0, seam)),
            prism(rectangle(0.93 * x, 0.86 * y, radius_m=0.01), 0.002).translate((0, 0, h - 0.006)),
        ]
    )
    model.add("lid", lid, "lid")
    for i, j in product(range(count), (-0.5, 0.5)):
        boss = ellipsoid(0.62 * px, 0.56 * py, 0.024).translate(
            ((i - 0.5 * (count - 1)) * 0.94 * px, j * 0.92 * py, h - 0.012)
        )
        model.add("lid", boss, "lid")
    flap = prism(rectangle(0.5 * x, 0.006, radius_m=0.002), 0.02).translate((0, -0.5 * y - 0.001, seam - 0.008))
    model.add("flap", flap, "lid")
    model.point("flap", "surface", "flap", (0.0, -0.5 * y - 0.004, seam), (0.0, -1.0, 0.0))
    return model.point(
        "base", "surface", "body", (0.5 * px if count % 2 == 0 else 0.0, 0.5 * py, 0.0), (0.0, 0.0, -1.0)
    ).rest_on_ground()


@template("coffee pot")
def moka_pot(*, height_m: float, width: float, waist: float, handle: float) -> Model:
    """Build an octagonal moka pot: a boiler, a jug with a spout towards -X, a lid with a knob, and a handle towards +X."""
    h, r = height_m, 0.5 * width * height_m
    top, middle = 0.9 * h, 0.44 * h
    boiler = lathe([(0, 0), (0.94 * r, 0), (r, 0.02 * h), (0.86 * r, middle), (0, middle)], sides=8)
    ring = cylinder(0.84 * r, 0.05 * h).translate((0, 0, middle - 0.005 * h))
    jug = lathe([(0, middle + 0.03 * h), (waist * r, middle + 0.03 * h), (0.92 * r, top), (0, top)], sides=8)
    beak = prism(polygon([(-0.3 * r, -0.34 * r), (-1.18 * r, 0.0), (-0.3 * r, 0.34 * r)], radius_m=0.002), 0.14 * h)
    slope = polygon(
        [(-0.6 * r, top - 0.16 * h), (-1.25 * r, top - 0.02 * h), (-1.25 * r, top - 0.3 * h), (-0.6 * r, top - 0.3 * h)]
    )
    beak = beak.translate((0, 0, top - 0.14 * h)) - prism(slope, 2 * r).rotate((90, 0, 0)).translate((0, r, 0))
    model = Model().add("body", boiler).add("ring", ring).add("jug", jug).add("spout", beak)
    cover = lathe(
        [
            (0, top - 0.001),
            (0.95 * r, top - 0.001),
            (0.95 * r, top + 0.012 * h),
            (0.25 * r, h - 0.05 * h),
            (0, h - 0.05 * h),
        ],
        sides=8,
    )
    model.add("lid", cover)
    knob = lathe(rounded([(0, 0.94 * h), (0.12 * r, 0.94 * h), (0.17 * r, 0.98 * h), (0.1 * r, h), (0, h)], 0.003))
    model.add("lid", knob, "handle")
    reach, thick = handle * h, 0.075 * r + 0.003
    path = arc(
        [
            (0.82 * r, 0, top - 0.08 * h),
            (0.95 * r + reach, 0, top - 0.05 * h),
            (0.92 * r + 0.96 * reach, 0, middle + 0.12 * h),
            (0.84 * r + 0.9 * reach, 0, middle - 0.06 * h),
        ]
    )
    model.add("handle", tube(path, thick, flatten=1.25), "handle")
    model.point("spout", "tip", "spout", (-1.16 * r, 0.0, top), (-1.0, 0.0, 0.0))
    at = path[len(path) // 2 + 2]
    return model.point("handle", "surface", "handle", (float(at[0]) + thick, 0.0, float(at[2])), (1.0, 0.0, 0.0))


@template("drinking straw")
def drinking_straw(*, length_m: float, width: float, bore: float) -> Model:
    """Build a lying straight straw."""
    n, r = length_m, 0.5 * width * length_m
    model = Model().add("body", lay_along_x(cylinder(r, n, sides=chords(28)).translate((0, 0, -0.5 * n))))
    model.cut("bore", lay_along_x(cylinder(bore * r, 2 * n, sides=chords(28)).translate((0, 0, -n))), "")
    model.point("end", "hole", "bore", (0.5 * n, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("middle", "surface", "body", (0.0, 0.0, r), (0.0, 0.0, 1.0)).rest_on_ground()
