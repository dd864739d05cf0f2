"""Small machine and workshop parts: nails, rods, pipes, bearings, pulleys, springs, hinges. Long ones lie along X."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import (
    chords,
    cylinder,
    ellipsoid,
    lathe,
    prism,
    rectangle,
    rounded,
    torus,
    union,
)
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.organic import lay_along_x
from manitwin.models.generators.templates.template import Model, template


@template("nail")
def nail(*, length_m: float, width: float, head: float) -> Model:
    """Build a lying nail with its tip towards +X; ``width`` of the shank is relative to the length, ``head`` to the shank."""
    r, end = 0.5 * width * length_m, 0.5 * length_m
    shank = [(r, -end + 0.8 * r), (r, end - 4.4 * r), (0.12 * r, end)]
    model = Model().add("shank", lay_along_x(lathe([(0, -end + 0.8 * r), *shank, (0, end)], sides=chords(20))))
    cap = rounded(
        [(0, -end), (head * r, -end), (head * r, -end + 0.7 * r), (r, -end + 1.6 * r), (0, -end + 1.6 * r)], 0.2 * r
    )
    model.add("head", lay_along_x(lathe(cap, sides=chords(28))))
    model.region("tip", "shank", lambda c: c[:, 0] > end - 4.4 * r)
    model.point("tip", "tip", "tip", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    model.point("shank", "surface", "shank", (0.0, 0.0, r), (0.0, 0.0, 1.0))
    return model.point("head", "face", "head", (-end, 0.0, 0.0), (-1.0, 0.0, 0.0)).rest_on_ground()


def _rod(model: Model, length_m: float, radius_m: float) -> Model:
    """Add points at both ends and in the middle of a round rod along X."""
    end = 0.5 * length_m
    model.point("end", "surface", "body", (end - 0.001, 0.0, radius_m), (0.0, 0.0, 1.0))
    model.point("middle", "surface", "body", (0.0, 0.0, radius_m), (0.0, 0.0, 1.0))
    return model.point("other end", "surface", "body", (-end + 0.001, 0.0, radius_m), (0.0, 0.0, 1.0)).rest_on_ground()


@template("dowel")
def dowel(*, length_m: float, width_m: float, grooves: float) -> Model:
    """Build a lying dowel with bevelled ends; ``grooves`` is the number of grooves along it (0 for a smooth one)."""
    r, end = 0.5 * width_m, 0.5 * length_m
    bevel = 0.25 * r
    body = lathe(
        [(0, -end), (r - bevel, -end), (r, -end + bevel), (r, end - bevel), (r - bevel, end), (0, end)],
        sides=chords(40),
    )
    model, count = Model().add("body", lay_along_x(body)), round(grooves)
    if count >= 6:
        bar = lay_along_x(cylinder(0.06 * r, 2 * length_m, sides=8)).translate((-length_m, 0, r))
        model.cut("grooves", union([bar.rotate((360 * (k + 0.5) / count, 0, 0)) for k in range(count)]))
    return _rod(model, length_m, r)


@template("pipe")
def pipe(*, length_m: float, width_m: float, wall: float) -> Model:
    """Build a lying piece of pipe; ``wall`` is the wall thickness relative to the width."""
    r = 0.5 * width_m
    body = lay_along_x(cylinder(r, length_m, sides=chords(48))).translate((-0.5 * length_m, 0, 0))
    hole = lay_along_x(cylinder((0.5 - wall) * width_m, 2 * length_m, sides=chords(48))).translate((-length_m, 0, 0))
    return _rod(Model().add("body", body).cut("inside", hole), length_m, r)


@template("bearing")
def bearing(*, width_m: float, bore: float, height: float, seal: float) -> Model:
    """Build a lying ball bearing; ``bore`` and ``height`` are relative to the width, ``seal`` is the depth of its seals."""
    r, inner, h = 0.5 * width_m, 0.5 * bore * width_m, height * width_m
    step = 0.22 * (r - inner)
    edge = 0.04 * (r - inner)
    model = Model().add("body", lathe(rounded([(0, 0), (r, 0), (r, h), (0, h)], edge), sides=chords(72)))
    race = cylinder(r - step, h, sides=chords(72)) - cylinder(inner + step, 2 * h, sides=chords(60)).translate(
        (0, 0, -0.5 * h)
    )
    model.cut("seals", race.translate((0, 0, (1 - seal) * h)) + race.translate((0, 0, (seal - 1) * h)), "seals")
    model.cut("bore", cylinder(inner, 3 * h, sides=chords(60)).translate((0, 0, -h)))
    model.point("inner side", "hole", "bore", (0.0, 0.0, 0.5 * h), (0.0, 0.0, 1.0))
    return model.point("outer side", "surface", "body", (0.0, -r, 0.5 * h), (0.0, -1.0, 0.0))


@template("pulley")
def pulley(*, width_m: float, bore: float, height: float, groove: float) -> Model:
    """Build a lying grooved wheel with holes in its web; ``groove`` is the depth of the groove relative to the radius."""
    r, inner, h = 0.5 * width_m, 0.5 * bore * width_m, height * width_m
    low = (1 - groove) * r
    side = [
        (0, 0),
        (0.96 * r, 0),
        (r, 0.06 * h),
        (r, 0.14 * h),
        (low, 0.4 * h),
        (low, 0.6 * h),
        (r, 0.86 * h),
        (r, 0.94 * h),
    ]
    model = Model().add("body", lathe([*side, (0.96 * r, h), (0, h)], sides=chords(72)))
    hub = 1.9 * inner
    web = cylinder(0.86 * low, h, sides=chords(60)) - cylinder(hub, 2 * h).translate((0, 0, -0.5 * h))
    model.cut("web", web.translate((0, 0, 0.68 * h)) + web.translate((0, 0, -0.68 * h)))
    hole = cylinder(0.3 * (0.86 * low - hub), 3 * h, sides=chords(24)).translate((0.5 * (0.86 * low + hub), 0, -h))
    model.cut("holes", union([hole.rotate((0, 0, 72 * k)) for k in range(5)]))
    model.cut("bore", cylinder(inner, 3 * h, sides=chords(36)).translate((0, 0, -h)), "bore")
    model.point("inner side", "hole", "bore", (0.0, 0.0, 0.5 * h), (0.0, 0.0, 1.0))
    return model.point("outer side", "surface", "body", (0.0, -r, 0.1 * h), (0.0, -1.0, 0.0))


@template("spring")
def spring(*, length_m: float, width: float, wire: float, turns: float) -> Model:
    """Build a lying coil spring with closed ends; ``width`` is relative to the length, ``wire`` to the width."""
    t = 0.5 * wire * width * length_m
    r, count = 0.5 * width * length_m - t, round(turns)
    share = np.linspace(0.0, 1.0, 26 * count + 1)
    rise = np.interp(
        share, [0, 1.1 / count, 1 - 1.1 / count, 1], [0.0, 2.06 * t, length_m - 4.06 * t, length_m - 2 * t]
    )
    angle = 2 * np.pi * count * share
    path = np.column_stack([rise - 0.5 * length_m + t, r * np.cos(angle), r * np.sin(angle)])
    model = Model().add("body", tube(path, t, sides=chords(12), across=(1, 0, 0)))
    model.region("ends", "body", lambda c: np.abs(c[:, 0]) > 0.5 * length_m - 2.2 * t)
    places = {"end": float(path[-1 - 13, 0]), "other end": float(path[13, 0])}
    for label, x in places.items():
        model.point(label, "surface", "ends", (x, -r - t, 0.0), (0.0, -1.0, 0.0))
    return model.point("middle", "axis", "body", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)).rest_on_ground()


@template("hinge")
def hinge(*, height_m: float, width: float, thick_m: float, pin_m: float) -> Model:
    """Build an open lying hinge with three holes in each leaf; ``width`` is that of both leaves relative to the height."""
    w, r = 0.5 * width * height_m, 0.5 * pin_m
    leaf = prism(rectangle(w, height_m, radius_m=0.05 * height_m), thick_m).translate((0.5 * w + 0.4 * r, 0, -r))
    model = Model().add("body", leaf + leaf.mirror((1, 0, 0)))
    barrel = cylinder(r, height_m, sides=chords(28)).rotate((90, 0, 0)).translate((0, 0.5 * height_m, 0))
    model.add("pin", barrel, "pin")
    gap = union(
        [
            torus(r, 0.0004, sides=chords(28))
            .rotate((90, 0, 0))
            .translate((0, (k - 2) * height_m / 5 + 0.1 * height_m, 0))
            for k in range(4)
        ]
    )
    model.cut("joints", gap, "pin")
    hole = cylinder(
        0.032 * height_m + 0.0008, 4 * r, top_radius_m=0.045 * height_m + 0.0014, sides=chords(20)
    ).translate((0, 0, -2.5 * r))
    at = [(side * (0.55 + 0.2 * (k % 2)) * w, (k - 1) * 0.34 * height_m) for side in (-1, 1) for k in range(3)]
    model.cut("holes", union([hole.translate((*place, 0)) for place in at]), "pin")
    model.point("leaf", "face", "body", (0.5 * w, 0.17 * height_m, thick_m - r), (0.0, 0.0, 1.0))
    return model.point(
        "edge", "surface", "body", (w + 0.4 * r, 0.0, 0.5 * thick_m - r), (1.0, 0.0, 0.0)
    ).rest_on_ground()


@template("carabiner")
def carabiner(*, length_m: float, width: float, thick: float, taper: float) -> Model:
    """Build a lying carabiner with its gate towards -Y; ``taper`` is the small end's width relative to the large end's."""
    t = 0.5 * thick * length_m
    x, y = 0.5 * length_m - t, 0.5 * width * length_m - t
    bend = [(x - y, y), (x - 0.2 * y, 0.85 * y), (x, 0.1 * y), (x - 0.25 * y, -0.8 * y), (x - 0.8 * y, -y)]
    small = taper * y
    bend += [
        (0.1 * x, -0.5 * (y + small) - 0.25 * (y - small)),
        (-x + 0.8 * small, -small),
        (-x + 0.1 * small, -0.6 * small),
    ]
    bend += [(-x, 0.1 * small), (-x + 0.3 * small, 0.8 * small), (-x + small, 0.6 * (y + small) * 0.9)]
    points = [(px, py, 0.0) for px, py in bend]
    loop = arc([*points, points[0]], samples=72)
    frame = tube(loop[:38], t, sides=chords(18), across=(0, 0, 1)) + tube(
        np.vstack([loop[36:], loop[1:3]]), t, sides=chords(18), across=(0, 0, 1)
    )
    model = Model().add("body", frame)
    lower = loop[(loop[:, 1] < -0.4 * y) & (np.abs(loop[:, 0]) < 0.62 * x)]
    gate = lower[np.argsort(lower[:, 0])]
    model.add("gate", tube(gate, 1.16 * t, sides=chords(18), across=(0, 0, 1)), "gate")
    middle = gate[len(gate) // 2]
    model.point("top", "surface", "gate", (float(middle[0]), float(middle[1]), 1.16 * t), (0.0, 0.0, 1.0))
    far = loop[int(loop[:, 0].argmax())]
    model.point("end", "surface", "body", (float(far[0]) + t, float(far[1]), 0.0), (1.0, 0.0, 0.0))
    return model.point("base", "surface", "body", (float(far[0]), float(far[1]), -t), (0.0, 0.0, -1.0)).rest_on_ground()


@template("chalk")
def chalk(*, length_m: float, width_m: float, taper: float) -> Model:
    """Build a lying stick of chalk, worn at the end towards +X; ``taper`` is the relative width there."""
    r, end = 0.5 * width_m, 0.5 * length_m
    body = rounded([(0, -end), (r, -end), (r, 0.1 * length_m), (taper * r, end), (0, end)], 0.0012)
    model = Model().add("body", lay_along_x(lathe(body, sides=chords(32))))
    model.region("tip", "body", lambda c: c[:, 0] > 0.42 * length_m)
    model.point("tip", "surface", "tip", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    model.point("barrel", "surface", "body", (-0.1 * length_m, 0.0, r), (0.0, 0.0, 1.0))
    return model.point("blunt end", "face", "body", (-end, 0.0, 0.0), (-1.0, 0.0, 0.0)).rest_on_ground()


@template("spinning top")
def spinning_top(*, width_m: float, tall: float, peg: float, stem: float) -> Model:
    """Build a spinning top lying on its rim and its peg, which points to +X; ``peg`` and ``stem`` are shares of its height."""
    r, h = 0.5 * width_m, tall * width_m
    foot, top = peg * h, (1 - stem) * h
    tilt = float(np.arctan2(r, 0.62 * top))  # makes the line from tip to rim horizontal

    def laid(solid: Manifold) -> Manifold:
        return solid.rotate((0, -90 - float(np.degrees(tilt)) + 180, 0)).mirror((1, 0, 0))

    body = rounded(
        [(0, 0.8 * foot), (0.12 * r, 0.8 * foot), (r, 0.62 * top), (r, 0.74 * top), (0.3 * r, top), (0, top)], 0.06 * r
    )
    model = Model().add("body", laid(lathe(body, sides=chords(64))))
    model.add("end", laid(lathe([(0, 0.0), (0.03 * r, 0.0), (0.11 * r, foot), (0, foot)])), "peg")
    model.add(
        "stem", laid(lathe(rounded([(0, top - 0.001), (0.1 * r, top - 0.001), (0.13 * r, h), (0, h)], 0.03 * r))), "peg"
    )
    up, across = float(np.sin(tilt)), float(np.cos(tilt))
    axis = np.array([-across, 0.0, up])  # from the tip upward
    at = 0.68 * top
    model.region("rim", "body", lambda c: np.linalg.norm(c - (c @ axis)[:, None] * axis, axis=1) > 0.92 * r, "rim")
    model.point("end", "tip", "end", (0.0, 0.0, 0.0), (across, 0.0, -up))
    model.point("top", "surface", "rim", (r * up - at * across, 0.0, at * up + r * across), (up, 0.0, across))
    return model.point(
        "base", "surface", "rim", (-r * up - at * across, 0.0, at * up - r * across), (-up, 0.0, -across)
    ).rest_on_ground()


@template("bauble")
def bauble(*, width_m: float, cap: float, loop: float) -> Model:
    """Build a bauble with its cap and loop on top; ``cap`` and ``loop`` are widths relative to its own."""
    r = 0.5 * width_m
    model = Model().add("body", ellipsoid(width_m, width_m, width_m, sides=chords(64)))
    z = float(np.sqrt(1 - cap**2)) * r
    crimp = cylinder(1.04 * cap * r, 0.16 * r, top_radius_m=0.94 * cap * r, sides=chords(36)).translate(
        (0, 0, z - 0.03 * r)
    )
    model.add("cap", crimp, "cap")
    ring = torus(0.5 * loop * width_m, 0.0009, sides=chords(28)).rotate((90, 0, 0))
    model.add("loop", ring.translate((0, 0, z + 0.13 * r + 0.45 * loop * width_m)), "cap")
    model.point("top", "surface", "cap", (0.0, -0.7 * cap * r, z + 0.13 * r), (0.0, 0.0, 1.0))
    return model.point("side", "surface", "body", (0.0, -r, 0.0), (0.0, -1.0, 0.0)).rest_on_ground()


@template("cardboard tube")
def cardboard_tube(*, length_m: float, width_m: float, wall_m: float) -> Model:
    """Build a lying cardboard tube."""
    r = 0.5 * width_m
    body = lay_along_x(cylinder(r, length_m, sides=chords(48))).translate((-0.5 * length_m, 0, 0))
    hole = lay_along_x(cylinder(r - wall_m, 2 * length_m, sides=chords(48))).translate((-length_m, 0, 0))
    return _rod(Model().add("body", body).cut("inside", hole, "inside"), length_m, r)
