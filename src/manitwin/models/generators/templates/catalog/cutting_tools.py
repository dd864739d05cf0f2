"""Tools that cut, turn and pry, lying with the working end towards +X; a drill stands on its battery."""

from __future__ import annotations

import numpy as np
from manifold3d import CrossSection

from manitwin.geometry.solids.shapes import box, chords, cylinder, lathe, polygon, prism, rounded, torus, union
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.template import Model, template


def oval(x_m: float, y_m: float) -> CrossSection:
    """Return an ellipse about the origin with these half axes."""
    return CrossSection.circle(1.0, chords(48)).scale((x_m, y_m))


@template("scissors")
def scissors(
    *,
    length_m: float,
    blade: float,
    broad: float,
    ring: float,
    fingers: float,
    thumb: float,
    offset: float,
    gape: float,
) -> Model:
    """Build scissors whose blades are opened by ``gape`` (rad); ``blade`` of the length lies in front of the screw.

    ``broad`` is a blade's width and ``ring`` a finger ring's width, relative to the length. The ring towards +Y is for the
    fingers and takes ``fingers`` of the length behind the screw. The round ring is for the thumb and ends earlier by the share
    ``thumb``. Both are shifted to the thumb's side by the share ``offset`` of a ring.
    """
    long, back, wide, thick = blade * length_m, (1 - blade) * length_m, broad * length_m, 0.0125 * length_m
    at, half, band, high = 0.5 * length_m - long, 0.5 * ring * length_m, 0.038 * length_m, 0.05 * length_m
    model = Model()
    edge = [(-0.3 * back, -0.3 * wide), (0.0, -0.6 * wide), (0.2 * long, -0.42 * wide), (long, -0.05 * wide)]
    spine = [(long, 0.02 * wide), (0.55 * long, 0.44 * wide), (0.08 * long, 0.5 * wide), (-0.3 * back, -0.05 * wide)]
    for side in (1.0, -1.0):
        turn = 0.5 * side * np.degrees(gape)
        outline = [(x, side * y) for x, y in edge + spine]
        flat = prism(polygon(outline[:: round(side)]), thick + 1e-4).translate((0, 0, 0 if side > 0 else -thick))
        model.add("blades", flat.rotate((0, 0, turn)).translate((at, 0, 0)), "blade")
    for side in (1.0, -1.0):
        turn = 0.5 * side * np.degrees(gape)
        reach = 1.12 * half if side > 0 else max(0.5 * fingers * back, half)
        middle, away = reach - (1 - thumb if side > 0 else 1.0) * back, -side * (half + 0.3 * band) - 2 * offset * half
        loop = torus(half - 0.5 * band, 0.5 * band).scale((reach / half, 1.0, high / band)).translate((middle, away, 0))
        inner = oval(reach * (1 - band / half), half - band)
        path = [(-0.12 * back, 0, 0), (-0.3 * back, -side * 0.3 * half, 0), (middle + 0.9 * reach, 0.75 * away, 0)]
        thin = np.linspace(max(0.48 * wide, band), 0.85 * band, 24)
        arm = tube(arc(path), thin, flatten=0.45 * high / float(thin[0]))
        solid = (arm + loop) - prism(inner, 2 * high).translate((middle, away, -high))
        model.add("handle", solid.rotate((0, 0, turn)).translate((at, 0, 0)), "handle")
        angle = np.radians(turn)
        x, y = middle * np.cos(angle) - away * np.sin(angle), middle * np.sin(angle) + away * np.cos(angle)
        model.point("finger holes", "hole", "handle", (at + float(x), float(y), 0.0), (0.0, 0.0, 1.0))
    model.add("screw", cylinder(0.026 * length_m, 4.4 * thick).translate((at, 0, -2.2 * thick)), "blade")
    tip, middle = (at + long * np.cos(0.5 * gape), long * np.sin(0.5 * gape)), 0.45 * long
    model.point("blade tips", "tip", "blades", (float(tip[0]), float(tip[1]), 0.5 * thick), (1.0, 0.0, 0.0))
    return model.point(
        "blades", "surface", "blades", (at + middle, 0.45 * middle * gape, thick), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("saw")
def saw(*, length_m: float, width: float, grip: float) -> Model:
    """Build a hand saw lying on its side with its teeth towards -Y; ``width`` is the blade's width at the handle over the length.

    ``grip`` is the share of the handle in the length; the handle has a hole for the hand.
    """
    reach, wide, thick = grip * length_m, width * length_m, 0.0011
    start, end = reach - 0.5 * length_m, 0.5 * length_m
    count = 64
    x = np.linspace(start, end, 2 * count + 1)
    depth = 0.35 * (x[2] - x[0])
    toothed = [(float(place), -0.5 * wide + (depth if number % 2 else 0.0)) for number, place in enumerate(x)]
    outline = [(start - 0.3 * reach, -0.46 * wide), *toothed, (end, -0.1 * wide), (end - 0.05 * wide, -0.04 * wide)]
    outline += [(start - 0.3 * reach, 0.5 * wide)]
    model = Model().add("blade", prism(polygon(outline), thick).translate((0, 0, -0.5 * thick)), "blade")
    model.region("teeth", "blade", lambda centers: centers[:, 1] < -0.5 * wide + 1.5 * depth)
    high = max(1.3 * wide, 0.115)
    side = [(-0.05, 0.36), (-0.3, 0.5), (-0.72, 0.5), (-0.98, 0.56), (-0.9, 0.2), (-0.86, -0.1), (-1.0, -0.44)]
    side += [(-0.7, -0.52), (-0.3, -0.4), (-0.04, -0.42), (0.1, -0.1)]
    shape = polygon([(start + reach * u, high * v) for u, v in side], radius_m=0.007)
    hole = oval(0.17 * reach, 0.29 * high).rotate(-8).translate((start - 0.48 * reach, 0.02 * high))
    model.add("handle", prism(shape - hole, 0.022, radius_m=0.006).translate((0, 0, -0.011)), "handle")
    for v in (0.2, -0.2):
        nut = cylinder(0.006, 0.0236).translate((start - 0.12 * reach, v * high, -0.0118))
        model.add("nuts", nut, "blade")
    model.point("teeth", "edge", "teeth", (0.5 * (start + end), -0.5 * wide, 0.0), (0.0, -1.0, 0.0))
    model.point("blade tip", "tip", "blade", (end, -0.3 * wide, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "handle", "surface", "handle", (start - 0.8 * reach, 0.0, 0.011), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("drill")
def drill(*, length_m: float, height: float, body: float, battery: float, pack: float, bit: float) -> Model:
    """Build a cordless drill that stands on its battery, with the bit towards +X.

    ``bit`` is the share of the length by which the bit protrudes. ``height``, the housing's diameter ``body``, and the battery's
    length ``battery`` and height ``pack`` are relative to the rest.
    """
    long = (1 - bit) * length_m
    high, r, low = height * long, 0.5 * body * long, pack * long
    back, axis = -0.5 * length_m, high - r
    along = [(0, 0), (0.78 * r, 0), (r, 0.08 * long), (r, 0.46 * long), (0.88 * r, 0.56 * long), (0, 0.56 * long)]
    collar = [(0, 0), (0.86 * r, 0), (0.8 * r, 0.13 * long), (0, 0.13 * long)]
    jaws = [
        (0, 0),
        (0.66 * r, 0),
        (0.66 * r, 0.19 * long),
        (0.54 * r, 0.24 * long),
        (0.24 * r, 0.33 * long),
        (0, 0.33 * long),
    ]
    model = Model()
    for part, profile, x in (("body", rounded(along, 0.014), 0.0), ("collar", collar, 0.55), ("chuck", jaws, 0.67)):
        model.add(part, lathe(rounded(profile, 0.003)).rotate((0, 90, 0)).translate((back + x * long, 0, axis)), part)
    shank = cylinder(0.012 * long, bit * length_m + 0.06 * long).rotate((0, 90, 0))
    model.add("bit", shank.translate((back + 0.94 * long, 0, axis)), "bit")
    foot, top = back + 0.34 * long, low + 0.05 * long
    bend = [
        (back + 0.31 * long, axis - 0.5 * r),
        (back + 0.27 * long, 0.55 * axis + 0.4 * top),
        (foot - 0.08 * long, top - 0.03 * long),
    ]
    path = arc([(x, 0, z) for x, z in bend])
    model.add("handle", tube(path, 0.1 * long, flatten=0.8, across=(1, 0, 0)), "handle")
    deep, base = 0.38 * long, battery * long
    shoe = box(base, deep, 0.09 * long, radius_m=0.03 * long)
    model.add("body", shoe.translate((foot, 0, low - 0.04 * long)), "body")
    model.add("battery", box(0.98 * base, 0.94 * deep, low, radius_m=0.02 * long).translate((foot, 0, 0)), "battery")
    trigger = box(0.08 * long, 0.075 * long, 0.13 * long, radius_m=0.016 * long)
    model.add("trigger", trigger.translate((back + 0.4 * long, 0, axis - r - 0.12 * long)), "trigger")
    model.point("bit", "tip", "bit", (0.5 * length_m, 0.0, axis), (1.0, 0.0, 0.0))
    model.point("chuck", "surface", "chuck", (back + 0.76 * long, 0.0, axis + 0.66 * r), (0.0, 0.0, 1.0))
    model.point("trigger", "button", "trigger", (back + 0.44 * long, 0.0, axis - r - 0.055 * long), (1.0, 0.0, 0.0))
    middle = path[13]
    return model.point(
        "grip", "surface", "handle", (float(middle[0]), -0.08 * long, float(middle[2])), (0.0, -1.0, 0.0)
    )


@template("utility knife")
def utility_knife(*, length_m: float, blade: float, width_m: float) -> Model:
    """Build a knife whose blade is pushed out towards +X by ``blade`` of the length, with the edge towards -Y."""
    start, w, thick = (0.5 - blade) * length_m, width_m, 0.5 * width_m
    end, back = 0.5 * length_m, -0.5 * length_m
    side = [(back, -0.5), (back, 0.4), (back + 0.03, 0.5), (start - 0.02, 0.42), (start, 0.38), (start - 0.014, -0.42)]
    shape = polygon([(x, w * y) for x, y in [*side, (0.3 * back, -0.42), (0.7 * back, -0.5)]], radius_m=0.002)
    model = Model().add("handle", prism(shape, thick, radius_m=0.0035).translate((0, 0, -0.5 * thick)), "handle")
    flat = [(start - 0.03, -0.36), (end, -0.36), (end - 0.5 * w, 0.34), (start - 0.03, 0.34)]
    model.add("blade", prism(polygon([(x, w * y) for x, y in flat]), 0.0007).translate((0, 0, -0.00035)), "blade")
    model.region("edge", "blade", lambda centers: centers[:, 1] < -0.355 * w)
    at = start - 0.3 * (start - back)
    model.add("slider", box(0.024, 0.42 * w, 0.005, radius_m=0.0018).translate((at, 0, 0.5 * thick - 0.002)), "slider")
    for number in range(4):
        rib = box(0.002, 0.36 * w, 0.0016, radius_m=0.0006).translate(
            (at - 0.0075 + 0.005 * number, 0, 0.5 * thick + 0.0022)
        )
        model.add("slider", rib, "slider")
    model.point("blade", "edge", "edge", (0.5 * (start + end), -0.36 * w, 0.0), (0.0, -1.0, 0.0))
    model.point("slider", "button", "slider", (at, 0.0, 0.5 * thick + 0.003), (0.0, 0.0, 1.0))
    return model.point("handle", "surface", "handle", (0.5 * back, 0.0, 0.5 * thick), (0.0, 0.0, 1.0)).rest_on_ground()


@template("crowbar")
def crowbar(*, length_m: float, thick_m: float, hook: float) -> Model:
    """Build a crowbar lying on its side, with a hooked claw towards +X and a bent chisel towards -X.

    ``hook`` is the hook's diameter relative to the length.
    """
    half, r, end = 0.5 * thick_m, 0.5 * hook * length_m, 0.5 * length_m
    turn = np.linspace(-0.5 * np.pi, 0.72 * np.pi, 22)
    bend = [(end - r + r * np.cos(a), r + r * np.sin(a), 0.0) for a in turn]
    path = np.array([(-0.38 * length_m, 0, 0), (0.0, 0, 0), *bend])
    ahead = np.array([np.cos(turn[-1] + 0.5 * np.pi), np.sin(turn[-1] + 0.5 * np.pi)])
    model = Model().add("shaft", tube(path, 1.08 * half, sides=6, across=(0, 0, 1)))
    model.region("hook", "shaft", lambda centers: centers[:, 0] > end - 2 * r)
    reach = 2.4 * thick_m
    wedge = prism(
        polygon([(-1.2 * half, -half), (reach, -0.1 * half), (reach, 0.1 * half), (-1.2 * half, half)]), 2.6 * half
    )
    gap = prism(polygon([(0.25 * reach, 0), (1.1 * reach, -0.8 * half), (1.1 * reach, 0.8 * half)]), 4 * thick_m)
    fork = wedge.translate((0, 0, -1.3 * half)) - gap.rotate((90, 0, 0)).translate((0, 2 * thick_m, 0))
    degrees = float(np.degrees(np.arctan2(ahead[1], ahead[0])))
    model.add("claw", fork.rotate((0, 0, degrees)).translate((*path[-1][:2], 0)))
    tail, slope = 0.12 * length_m, 0.2
    flat = polygon([(0.1 * tail, -half), (-tail, -0.1 * half), (-tail, 0.1 * half), (0.1 * tail, half)])
    chisel = prism(flat, 2.6 * half).translate((0, 0, -1.3 * half)).rotate((0, 0, -np.degrees(slope)))
    model.add("chisel", chisel.translate((-0.38 * length_m, 0, 0)))
    tip = path[-1][:2] + reach * ahead
    model.point(
        "claw", "tip", "claw", (float(tip[0]), float(tip[1]), 0.9 * half), (float(ahead[0]), float(ahead[1]), 0.0)
    )
    low = (-0.38 * length_m - tail * np.cos(slope), tail * np.sin(slope), 0.0)
    model.point("chisel end", "tip", "chisel", (float(low[0]), float(low[1]), 0.0), (-1.0, 0.0, 0.0))
    return model.point(
        "shaft", "surface", "shaft", (-0.1 * length_m, 0.0, 1.08 * half), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("screw")
def screw(*, length_m: float, width: float, head: float) -> Model:
    """Build a lying wood screw with its point towards +X; ``width`` of the thread is relative to the length, ``head`` to the
    thread.
    """
    r, end = 0.5 * width * length_m, 0.5 * length_m
    top, turns = head * r, 16
    sink = 0.9 * (top - 0.7 * r)
    profile = [(0.0, -end), (top, -end), (top, -end + 0.12 * r), (0.72 * r, -end + sink), (0.72 * r, -0.2 * length_m)]
    pitch = 0.6 * length_m / turns
    for number in range(turns):
        z = -0.2 * length_m + (number + 0.5) * pitch
        profile += [(0.66 * r, z - 0.2 * pitch), (r, z), (0.66 * r, z + 0.2 * pitch)]
    profile += [(0.62 * r, end - 0.1 * length_m), (0.0, end)]
    model = Model().add("shank", lathe(profile).rotate((0, 90, 0)))
    model.region("head", "shank", lambda centers: centers[:, 0] < -end + sink)
    cross = union([box(0.6 * r, wide, deep) for wide, deep in ((0.26 * r, 1.1 * top), (1.1 * top, 0.26 * r))])
    cross = union(
        [
            box(0.6 * r, 0.26 * r, 1.1 * top).translate((0, 0, -0.55 * top)),
            box(0.6 * r, 1.1 * top, 0.26 * r).translate((0, 0, -0.13 * r)),
        ]
    )
    model.cut("recess", cross.translate((-end, 0, 0)))
    model.point("tip", "tip", "shank", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("recess", "hole", "recess", (-end, 0.0, 0.0), (-1.0, 0.0, 0.0)).rest_on_ground()
