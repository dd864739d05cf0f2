"""Things to bake, sift and measure with: tins, a sieve, a scoop, a timer, and laboratory vessels. Handles point to +X."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import (
    box,
    chords,
    cylinder,
    lathe,
    polygon,
    prism,
    rectangle,
    rounded,
    torus,
    union,
)
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.vessel import assemble_from_profile, shell
from manitwin.models.generators.templates.template import Model, template


@template("cake pan")
def cake_pan(*, width_m: float, height: float, taper: float, wall_m: float) -> Model:
    """Build a round pan with a rolled rim; ``taper`` is the width at the foot relative to the rim."""
    r, h = 0.5 * width_m, height * width_m
    model = assemble_from_profile(
        Model(), rounded([(taper * r, 0.0), (taper * r, 0.002), (r, h)], 0.006), wall_m, wall_m
    )
    roll = torus(r, max(0.002, 1.6 * wall_m), sides=chords(72)).translate((0, 0, h - 0.001))
    return model.add("rim", roll - cylinder(r - wall_m, 2 * h)).rest_on_ground()


def _basin(length_m: float, width_m: float, height_m: float, wall_m: float, slope: float) -> tuple[Manifold, Manifold]:
    """Return the outer solid of an oblong pan, whose foot is ``slope`` times as large as its rim, and the solid to subtract from
    it.
    """
    corner = 0.12 * width_m

    def tapered(x_m: float, y_m: float, low_m: float) -> Manifold:
        solid = prism(rectangle(x_m * slope, y_m * slope, radius_m=corner), height_m - low_m + 0.004, top=1 / slope)
        return solid.translate((0, 0, low_m))

    outer = tapered(length_m, width_m, 0.0) ^ box(2 * length_m, 2 * width_m, height_m)
    return outer, tapered(length_m - 2 * wall_m, width_m - 2 * wall_m, wall_m)


@template("roasting pan")
def roasting_pan(*, length_m: float, width: float, height: float, wall_m: float, slope: float) -> Model:
    """Build an oblong pan with a flat rim and two upright handles; ``width`` and ``height`` are shares of the length."""
    w, h = width * length_m, height * length_m
    outer, inner = _basin(length_m, w, h, wall_m, slope)
    rim = prism(rectangle(length_m + 0.02, w + 0.02, radius_m=0.14 * w), 0.0022).translate((0, 0, h - 0.0022))
    model = Model().add("body", outer).add("rim", rim - inner)
    for side in (1.0, -1.0):
        x = side * (0.5 * length_m + 0.005)
        path = arc(
            [(x, -0.24 * w, h - 0.003), (x, -0.22 * w, h + 0.026), (x, 0.22 * w, h + 0.026), (x, 0.24 * w, h - 0.003)],
            samples=30,
        )
        model.add("handle", tube(path, 0.0042, across=(1, 0, 0)), "handle")
        model.point("handle", "surface", "handle", (x, 0.0, float(path[:, 2].max()) + 0.004), (0.0, 0.0, 1.0))
    model.cut("inside", inner)
    model.region("base", "body", lambda c: c[:, 2] < 0.02 * h)
    model.point("inside", "surface", "inside", (0.0, 0.0, wall_m), (0.0, 0.0, 1.0))
    model.point("rim", "surface", "rim", (0.0, -0.5 * w - 0.008, h), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("loaf pan")
def loaf_pan(*, length_m: float, width: float, height: float, wall_m: float, slope: float) -> Model:
    """Build a deep oblong tin with a flat rim; ``width`` and ``height`` are shares of its length."""
    w, h = width * length_m, height * length_m
    outer, inner = _basin(length_m, w, h, wall_m, slope)
    rim = prism(rectangle(length_m + 0.008, w + 0.008, radius_m=0.12 * w), 0.0024).translate((0, 0, h - 0.0024))
    model = Model().add("body", outer).add("rim", rim).cut("inside", inner)
    model.region("base", "body", lambda c: c[:, 2] < 0.02 * h)
    model.point("inside", "surface", "inside", (0.0, 0.0, wall_m), (0.0, 0.0, 1.0))
    model.point("rim", "surface", "rim", (0.0, -0.5 * w - 0.002, h), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("muffin tin")
def muffin_tin(*, pitch_m: float, columns: float, depth: float, wall_m: float) -> Model:
    """Build a sheet with ``columns`` by two thirds as many cups; ``pitch_m`` is the distance between cups, ``depth`` is relative
    to it.
    """
    nx = round(columns)
    ny, h, r = max(2, round(2 * nx / 3)), depth * pitch_m, 0.43 * pitch_m
    x, y = (nx + 0.12) * pitch_m, (ny + 0.12) * pitch_m
    sheet = prism(rectangle(x, y, radius_m=0.014), 0.003).translate((0, 0, h - 0.003))
    cup, hollow = lathe([(0.74 * r, 0.0), (r, h)]), lathe([(0.74 * r - wall_m, wall_m), (r - wall_m, h + 0.001)])
    at = [((u - 0.5 * (nx - 1)) * pitch_m, (v - 0.5 * (ny - 1)) * pitch_m) for u in range(nx) for v in range(ny)]
    model = Model().add("rim", sheet).add("body", union([cup.translate((*place, 0)) for place in at]))
    model.cut("inside", union([hollow.translate((*place, 0)) for place in at]))
    model.region("base", "body", lambda c: c[:, 2] < 0.02 * h)
    first = at[len(at) // 2]
    model.point("inside", "surface", "inside", (*first, wall_m), (0.0, 0.0, 1.0))
    model.point("rim", "surface", "rim", (0.0, -0.5 * y, h - 0.0015), (0.0, -1.0, 0.0))
    return model.point("base", "face", "base", (*first, 0.0), (0.0, 0.0, -1.0))


@template("sieve")
def sieve(*, width_m: float, depth: float, handle: float, mesh: float) -> Model:
    """Build a level kitchen sieve that stands on its mesh.

    ``depth`` and ``handle`` are relative to the width; ``mesh`` is a number of wires.
    """
    r, h, wall = 0.5 * width_m, depth * width_m, 0.0016
    turn = np.linspace(0.0, np.pi / 2, 12)
    side = [(float(r * np.sin(a)), float(h * (1 - np.cos(a)))) for a in turn[1:]]
    outer, inner = shell([(0.12 * r, 0.0), *side], wall, wall)
    model = Model().add("net", outer, "net")
    ring = lathe([(r - 0.001, h - 0.008), (r + 0.0012, h - 0.008), (r + 0.0012, h + 0.001), (r - 0.001, h + 0.001)])
    reach = r + handle * width_m
    grip = arc(
        [(r - 0.0005, 0, h - 0.004), (r + 0.3 * handle * width_m, 0, h - 0.002), (reach, 0, h + 0.004)], samples=20
    )
    model.add(
        "handle",
        tube(grip, np.interp(np.linspace(0, 1, 20), [0, 0.2, 0.5, 1], [0.005, 0.007, 0.011, 0.009]), flatten=0.5),
        "handle",
    )
    hook = arc(
        [
            (-r + 0.0005, -0.012, h - 0.004),
            (-r - 0.014, -0.01, h - 0.004),
            (-r - 0.014, 0.01, h - 0.004),
            (-r + 0.0005, 0.012, h - 0.004),
        ],
        samples=20,
    )
    model.add("rest", tube(hook, 0.0022, across=(0, 0, 1)), "rim")
    model.cut("inside", inner, "net")
    model.add("rim", ring - cylinder(r - 0.001, 2 * h), "rim")
    count = round(mesh)
    model.perforate("holes", lambda: _net_holes(r, h, count), "net")
    model.point("inside", "surface", "inside", (0.0, 0.0, wall), (0.0, 0.0, 1.0))
    model.point("rim", "surface", "rim", (0.0, -r - 0.001, h - 0.003), (0.0, -1.0, 0.0))
    middle = grip[12]
    return model.point(
        "handle", "surface", "handle", (float(middle[0]), 0.0, float(middle[2]) + 0.005), (0.0, 0.0, 1.0)
    ).rest_on_ground()


def _net_holes(r: float, h: float, rows: int) -> Manifold:
    """Return vertical pins through a bowl of radius ``r`` and depth ``h``, in ``rows`` along each direction."""
    pitch = 2 * r / rows
    pin = box(0.55 * pitch, 0.55 * pitch, 2 * h).translate((0, 0, -0.5 * h))
    at = (np.arange(rows) - 0.5 * (rows - 1)) * pitch
    return union(
        [pin.translate((float(x), float(y), 0)) for x in at for y in at if 0.16 * r < np.hypot(x, y) < 0.88 * r]
    )


@template("petri dish")
def petri_dish(*, width_m: float, height: float, wall_m: float) -> Model:
    """Build a laboratory dish without its lid."""
    r, h = 0.5 * width_m, height * width_m
    return assemble_from_profile(Model(), rounded([(0.985 * r, 0.0), (r, 0.001), (r, h)], 0.001), wall_m, wall_m)


@template("graduated cylinder")
def graduated_cylinder(*, height_m: float, width: float, foot: float, wall_m: float) -> Model:
    """Build a measuring cylinder with a scale, a spout towards -X, and a foot.

    ``foot`` is the foot's width relative to the tube's.
    """
    h, r = height_m, 0.5 * width * height_m
    low = 0.03 * h
    model = Model().add(
        "base", lathe(rounded([(0, 0), (foot * r, 0), (foot * r, 0.6 * low), (0.9 * r, low), (0, low)], 0.002)), "foot"
    )
    model.add("body", cylinder(r, h - 0.5 * low, sides=chords(48)).translate((0, 0, 0.5 * low)))
    flare = lathe([(r - 0.0005, h - 0.006), (r + 0.0022, h - 0.001), (r + 0.0022, h), (r - 0.0005, h)])
    lip = cylinder(0.42 * r, 0.0032, top_radius_m=0.5 * r).translate((-0.82 * r, 0, h - 0.0032))
    model.add("rim", flare + lip)
    hollow = cylinder(r - wall_m, h, sides=chords(48)).translate((0, 0, low + wall_m))
    notch = cylinder(0.3 * r, 0.01, top_radius_m=0.42 * r).translate((-0.86 * r, 0, h - 0.0022))
    model.cut("inside", hollow + notch)
    marks = []
    for number in range(20):
        z = 0.12 * h + 0.78 * h * number / 19
        turn = 0.9 if number % 5 == 0 else 0.5
        band = lathe([(r - 0.0004, z), (r + 0.00025, z), (r + 0.00025, z + 0.0006), (r - 0.0004, z + 0.0006)])
        wedge = box(2.4 * r * turn, 4 * r, 0.01).translate((0, -2 * r, z - 0.005))
        marks.append((band - cylinder(r - 0.0004, 2 * h)) ^ wedge)
    model.add("scale", union(marks), "scale")
    model.point("opening", "opening", "rim", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    model.point("body", "surface", "body", (0.0, r, 0.55 * h), (0.0, 1.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("test tube rack")
def test_tube_rack(*, columns: float, pitch_m: float, hole_m: float, height_m: float, board_m: float) -> Model:
    """Build three boards between two end plates, with ``columns`` by two holes in the upper boards."""
    count = round(columns)
    x, y = count * pitch_m + 0.5 * pitch_m, 2 * pitch_m + 0.3 * pitch_m
    end = box(board_m, y, height_m, radius_m=0.2 * board_m)
    model = Model()
    for side in (1.0, -1.0):
        model.add("side", end.translate((side * (0.5 * x + 0.5 * board_m - 0.001), 0, 0)))
    pins = [
        cylinder(0.5 * hole_m, 4 * board_m, sides=chords(24)).translate(
            ((u - 0.5 * (count - 1)) * pitch_m, (v - 0.5) * pitch_m, -board_m)
        )
        for u in range(count)
        for v in range(2)
    ]
    board = box(x, y, board_m)
    model.add("base", board)
    model.add("middle", (board - union(pins)).translate((0, 0, 0.48 * height_m)))
    model.add("top", (board - union(pins)).translate((0, 0, height_m - board_m)))
    model.point("top", "face", "top", (0.0 if count % 2 == 0 else 0.5 * pitch_m, 0.0, height_m), (0.0, 0.0, 1.0))
    model.point("side", "face", "side", (0.5 * x + board_m - 0.001, 0.0, 0.5 * height_m), (1.0, 0.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("kitchen timer")
def kitchen_timer(*, width_m: float, height: float, dial: float) -> Model:
    """Build a standing wind-up timer with a dial and grip above; ``height`` and ``dial`` are relative to the width."""
    r, h = 0.5 * width_m, height * width_m
    low = 0.42 * h
    model = Model().add("body", lathe(rounded([(0, 0), (0.92 * r, 0), (r, 0.2 * h), (r, low), (0, low)], 0.06 * r)))
    cap = rounded(
        [(0, low + 0.001), (0.99 * r, low + 0.001), (0.96 * r, 0.6 * h), (dial * r, 0.78 * h), (0, 0.78 * h)], 0.05 * r
    )
    model.add("dial", lathe(cap), "dial").add("gap", cylinder(0.94 * r, 0.004).translate((0, 0, low - 0.001)))
    fin = box(0.16 * width_m, 1.5 * dial * r, 0.3 * h, radius_m=0.05 * width_m).translate((0, 0, 0.7 * h))
    model.add("grip", fin, "dial")
    marks = []
    for k in range(30):
        bar = box(0.0008, 0.05 * r if k % 5 else 0.1 * r, 0.1 * h)
        marks.append(bar.translate((0, -0.97 * r, low + 0.02 * h)).rotate((0, 0, 12.0 * k)))
    model.add("marks", union(marks), "marks")
    model.point("controls", "surface", "grip", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    model.point("end", "surface", "body", (r, 0.0, 0.3 * h), (1.0, 0.0, 0.0))
    return model.point("base", "face", "body", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)).rest_on_ground()


@template("scoop")
def scoop(*, length_m: float, head: float, width: float, deep: float, wall_m: float) -> Model:
    """Build a lying flour scoop: a round trough, open in front.

    ``head`` is the trough's share of the length; ``width`` and ``deep`` are relative to the trough's length.
    """
    end, long = 0.5 * length_m, head * length_m
    r, h = 0.5 * width * long, deep * long
    start = end - long
    turn = np.linspace(np.pi, 2 * np.pi, 21)
    outer = [(r * float(np.cos(a)), h + h * float(np.sin(a))) for a in turn]
    inner = [((r - wall_m) * float(np.cos(a)), h + (h - wall_m) * float(np.sin(a))) for a in turn]

    def along(outline: list[tuple[float, float]], low: float, high: float) -> Manifold:
        return (
            prism(polygon([*outline, (r, 1.3 * h), (-r, 1.3 * h)]), high - low)
            .rotate((90, 0, 90))
            .translate((low, 0, 0))
        )

    trough = along(outer, start, end) ^ box(4 * length_m, 4 * r, h)
    nose = (
        prism(polygon([(end - 0.42 * long, h + 0.001), (end + 0.001, 0.16 * h), (end + 0.001, h + 0.001)]), 4 * r)
        .rotate((90, 0, 0))
        .translate((0, 2 * r, 0))
    )
    model = Model().add("bowl", trough - nose)
    t = 0.011
    hand = arc(
        [(start + 0.004, 0, 0.62 * h), (start - 0.35 * (start + end), 0, 0.68 * h), (-end, 0, 0.9 * h)], samples=16
    )
    model.add(
        "handle",
        tube(hand, np.interp(np.linspace(0, 1, 16), [0, 0.2, 0.6, 1], [0.7 * t, 0.75 * t, t, 0.8 * t]), flatten=0.75),
        "handle",
    )
    model.cut("inside", along(inner, start + wall_m, end + 0.1))
    model.region("bowl tip", "bowl", lambda c: c[:, 0] > end - 0.04 * long)
    model.point("bowl", "surface", "inside", (start + 0.5 * long, 0.0, wall_m), (0.0, 0.0, 1.0))
    model.point("bowl tip", "edge", "bowl tip", (end, 0.0, 0.5 * wall_m), (1.0, 0.0, 0.0))
    middle = hand[9]
    return model.point(
        "handle", "surface", "handle", (float(middle[0]), 0.0, float(middle[2]) + 0.72 * t), (0.0, 0.0, 1.0)
    ).rest_on_ground()
