"""Household items: packages, baskets, brushes, rolls, candles, boards."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import (
    box,
    cylinder,
    ellipsoid,
    lathe,
    polygon,
    prism,
    rectangle,
    rounded,
)
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.template import Model, template


@template("box")
def closed_box(*, height_m: float, width: float, depth: float) -> Model:
    """Build a standing closed package with its front towards -Y."""
    x, y = width * height_m, depth * height_m
    model = Model().add("body", box(x, y, height_m, radius_m=0.0008))
    model.region("front", "body", lambda centers: centers[:, 1] < -0.499 * y)
    model.region("top", "body", lambda centers: centers[:, 2] > 0.999 * height_m)
    model.point("front", "face", "front", (0.0, -0.5 * y, 0.5 * height_m), (0.0, -1.0, 0.0))
    return model.point("top", "face", "top", (0.0, 0.0, height_m), (0.0, 0.0, 1.0))


@template("basket")
def basket(*, length_m: float, width: float, height: float, wall_m: float) -> Model:
    """Build an open basket with slots in its walls and two handles."""
    across, high = width * length_m, height * length_m
    outer = prism(rectangle(length_m, across, radius_m=0.02), high)
    inner = prism(rectangle(length_m - 2 * wall_m, across - 2 * wall_m, radius_m=0.017), high).translate(
        (0, 0, 1.5 * wall_m)
    )
    model = Model().add("body", outer).cut("inside", inner)
    for side, reach, turn in ((length_m, across, 0.0), (across, length_m, 90.0)):
        count = int(0.8 * reach / 0.03)
        for number in range(count):
            y = (number - 0.5 * (count - 1)) * 0.03
            slot = box(2 * side, 0.012, 0.5 * high, radius_m=0.003).translate((0, y, 0.2 * high))
            model.cut("slots", slot.rotate((0, 0, turn)))
    model.cut("grips", box(2 * length_m, 0.09, 0.02, radius_m=0.008).translate((0, 0, high - 0.032)))
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: centers[:, 2] > high - 0.002)
    return model.point("opening", "opening", "rim", (0.0, 0.0, high), (0.0, 0.0, 1.0))


@template("sponge")
def sponge(*, length_m: float, width: float, thick: float) -> Model:
    """Build a lying sponge with its scouring side up."""
    across, high = width * length_m, thick * length_m
    model = Model().add("body", box(length_m, across, high - 0.004, radius_m=0.003))
    model.add(
        "scourer",
        prism(rectangle(0.99 * length_m, 0.99 * across, radius_m=0.003), 0.008).translate((0, 0, high - 0.008)),
        "scourer",
    )
    return model.point("scouring side", "face", "scourer", (0.0, 0.0, high), (0.0, 0.0, 1.0))


@template("cleaning brush")
def cleaning_brush(*, length_m: float, head_m: float, hair_m: float) -> Model:
    """Build a dish brush lying on its bristles."""
    end = 0.5 * length_m
    at = end - 0.5 * head_m
    path = arc([(at - 0.3 * head_m, 0, 0.007), (0, 0, 0.024), (-end, 0, 0.03)])
    half = np.interp(np.linspace(0, 1, len(path)), [0, 0.4, 0.9, 1], [0.009, 0.0095, 0.011, 0.006])
    model = (
        Model()
        .add("head", cylinder(0.5 * head_m, 0.016).translate((at, 0, 0)))
        .add("handle", tube(path, half, flatten=0.6))
    )
    model.add(
        "bristles",
        cylinder(0.5 * head_m - 0.003, hair_m + 0.002, top_radius_m=0.5 * head_m - 0.006).translate((at, 0, -hair_m)),
        "bristles",
    )
    model.point("bristles", "face", "bristles", (at, 0.0, -hair_m), (0.0, 0.0, -1.0))
    middle = path[16]
    return model.point(
        "handle", "surface", "handle", (float(middle[0]), 0.0, float(middle[2]) + 0.006), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("toilet paper")
def toilet_paper(*, height_m: float, width: float, core_m: float) -> Model:
    """Build a roll that stands on its end."""
    r = 0.5 * width * height_m
    model = (
        Model()
        .add("body", cylinder(r, height_m))
        .cut("core", cylinder(0.5 * core_m, 3 * height_m).translate((0, 0, -height_m)), "core")
    )
    model.point("core", "hole", "core", (0.0, 0.0, height_m), (0.0, 0.0, 1.0))
    return model.point("paper", "surface", "body", (0.0, -r, 0.5 * height_m), (0.0, -1.0, 0.0))


@template("candle")
def candle(*, height_m: float, width: float, wick_m: float) -> Model:
    """Build a pillar candle with its wick."""
    r = 0.5 * width * height_m
    model = Model().add(
        "body",
        lathe(rounded([(0, 0), (r, 0), (r, height_m), (0.6 * r, height_m - 0.003), (0, height_m - 0.004)], 0.003)),
    )
    model.add("wick", cylinder(0.0014, wick_m + 0.006, sides=10).translate((0, 0, height_m - 0.008)), "wick")
    return model.point("wick", "tip", "wick", (0.0, 0.0, height_m - 0.002 + wick_m), (0.0, 0.0, 1.0))


@template("clothes hanger")
def clothes_hanger(*, length_m: float, height: float, thick_m: float) -> Model:
    """Build a hanger lying flat, its hook towards +Y."""
    x, y = 0.5 * length_m, height * length_m
    path = np.array([(-x, 0, 0), (-0.1 * x, 0.94 * y, 0), (0, y, 0), (0.1 * x, 0.94 * y, 0), (x, 0, 0)])
    bar = np.array([(-x, 0, 0), (0, -0.02 * y, 0), (x, 0, 0)])
    model = (
        Model()
        .add("shoulders", tube(path, 0.5 * thick_m, across=(0, 0, 1)))
        .add("bar", tube(bar, 0.45 * thick_m, across=(0, 0, 1)))
    )
    model.add("shoulders", ellipsoid(thick_m, thick_m, thick_m).translate((-x, 0, 0))).add(
        "shoulders", ellipsoid(thick_m, thick_m, thick_m).translate((x, 0, 0))
    )
    hook = arc(
        [
            (0, 0.95 * y, 0),
            (0, y + 0.02, 0),
            (0.016, y + 0.034, 0),
            (0.02, y + 0.055, 0),
            (0, y + 0.072, 0),
            (-0.02, y + 0.055, 0),
        ],
        samples=40,
    )
    model.add("hook", tube(hook, 0.0018, across=(0, 0, 1), sides=10), "hook")
    return model.point("hook", "surface", "hook", (0.0, y + 0.0738, 0.0), (0.0, 1.0, 0.0)).rest_on_ground()


@template("plunger")
def plunger(*, height_m: float, width_m: float, stick_m: float) -> Model:
    """Build a plunger that stands on its cup."""
    r, cup = 0.5 * width_m, 0.62 * width_m
    model = Model().add(
        "cup",
        lathe(
            rounded(
                [(0, 0), (r, 0), (r, 0.012), (0.8 * r, 0.6 * cup), (0.3 * r, 0.85 * cup), (0.3 * r, cup), (0, cup)],
                0.01,
            )
        ),
    )
    model.cut("inside", lathe(rounded([(0, -0.01), (0.92 * r, -0.01), (0.72 * r, 0.55 * cup), (0, 0.7 * cup)], 0.015)))
    model.add("handle", cylinder(0.5 * stick_m, height_m - 0.72 * cup).translate((0, 0, 0.72 * cup)), "handle")
    model.point("cup", "opening", "cup", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return model.point("handle", "surface", "handle", (0.0, -0.5 * stick_m, 0.75 * height_m), (0.0, -1.0, 0.0))


@template("dustpan")
def dustpan(*, length_m: float, width: float, wall_m: float) -> Model:
    """Build a dustpan lying on its floor, with its lip towards +X and its handle towards -X."""
    across, long, high = width * length_m, 0.6 * length_m, 0.16 * length_m
    end = 0.5 * length_m
    side = polygon([(end - long, 0), (end, 0), (end, 0.006), (end - 0.8 * long, high), (end - long, high)])
    solid = prism(side, across).rotate((90, 0, 0)).translate((0, 0.5 * across, 0))
    hollow = box(long, across - 3 * wall_m, 2 * high).translate((end - 0.5 * long + 2 * wall_m, 0, wall_m))
    model = Model().add("pan", solid).cut("inside", hollow)
    path = arc([(end - long + 0.004, 0, 0.7 * high), (-0.3 * length_m, 0, 0.9 * high), (-end, 0, 0.8 * high)])
    model.add("handle", tube(path, 0.0135, flatten=0.6))
    model.point("lip", "edge", "inside", (end, 0.0, wall_m), (1.0, 0.0, 0.0))
    middle = path[14]
    return model.point(
        "handle", "surface", "handle", (float(middle[0]), 0.0, float(middle[2]) + 0.008), (0.0, 0.0, 1.0)
    )


@template("bell")
def bell(*, height_m: float, width: float, wall_m: float) -> Model:
    """Build a hand bell that stands on its mouth."""
    h, r, top = height_m, 0.5 * width * height_m, 0.55 * height_m
    outer = rounded(
        [(r, 0), (0.93 * r, 0.02 * h), (0.72 * r, 0.3 * h), (0.6 * r, 0.85 * top), (0.2 * r, top), (0, top)], 0.015
    )
    inner = [
        (0, -0.01),
        (r - wall_m, -0.01),
        (r - wall_m, 0.0),
        (0.93 * r - wall_m, 0.03 * h),
        (0.68 * r - wall_m, 0.3 * h),
        (0.5 * r - wall_m, 0.7 * top),
        (0, 0.76 * top),
    ]
    model = Model().add("body", lathe(outer)).cut("inside", lathe(inner))
    model.add("clapper", cylinder(0.002, 0.7 * top, sides=10).translate((0, 0, 0.2 * top))).add(
        "clapper", ellipsoid(0.3 * r, 0.3 * r, 0.3 * r).translate((0, 0, 0.2 * top))
    )
    model.add(
        "handle",
        lathe(
            rounded(
                [(0, 0.9 * top), (0.006, 0.9 * top), (0.005, top + 0.01), (0.012, 0.8 * h), (0.01, h), (0, h)], 0.008
            )
        ),
        "handle",
    )
    model.point("mouth", "opening", "body", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return model.point("handle", "surface", "handle", (0.0, 0.0, h), (0.0, 0.0, 1.0))


@template("cutting board")
def cutting_board(*, length_m: float, width: float, thick_m: float) -> Model:
    """Build a lying board with a hanging hole towards -X."""
    across = width * length_m
    model = Model().add("body", prism(rectangle(length_m, across, radius_m=0.02), thick_m, radius_m=0.003))
    hole = prism(rectangle(0.018, 0.07, radius_m=0.0085), 3 * thick_m).translate((-0.44 * length_m, 0, -thick_m))
    model.cut("hole", hole).region("top", "body", lambda centers: centers[:, 2] > 0.999 * thick_m)
    model.point("surface", "face", "top", (0.0, 0.0, thick_m), (0.0, 0.0, 1.0))
    return model.point("hole", "hole", "hole", (-0.44 * length_m, 0.0, thick_m), (0.0, 0.0, 1.0))


@template("funnel")
def funnel(*, height_m: float, width: float, spout: float, wall_m: float) -> Model:
    """Build a funnel standing upside down on its mouth."""
    h, r, neck = height_m, 0.5 * width * height_m, (1 - spout) * height_m
    model = Model().add("cone", lathe([(0, 0), (r, 0), (r, 0.006), (0.0095, neck), (0.006, h), (0, h)]))
    model.cut(
        "inside",
        lathe(
            [
                (0, -0.001),
                (r - wall_m, -0.001),
                (r - wall_m, 0.004),
                (0.0095 - wall_m, neck),
                (0.006 - wall_m, h + 0.001),
                (0, h + 0.001),
            ]
        ),
    )
    model.region("spout", "cone", lambda centers: centers[:, 2] > neck)
    model.point("mouth", "opening", "cone", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return model.point("spout", "tip", "spout", (0.006 - 0.5 * wall_m, 0.0, h), (0.0, 0.0, 1.0))


@template("tennis ball")
def tennis_ball(*, width_m: float) -> Model:
    """Build a ball."""
    model = Model().add("body", ellipsoid(width_m, width_m, width_m).translate((0, 0, 0.5 * width_m)))
    return model.point("surface", "surface", "body", (0.0, 0.0, width_m), (0.0, 0.0, 1.0)).rest_on_ground()
