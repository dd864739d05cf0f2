"""Souvenirs, prizes and ornaments, and boxes for jewellery and tools, standing with the front towards -Y."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import (
    box,
    chords,
    cylinder,
    ellipsoid,
    lathe,
    polygon,
    prism,
    rectangle,
    rounded,
    torus,
)
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.template import Model, template


@template("snow globe")
def snow_globe(*, height_m: float, base: float, foot: float) -> Model:
    """Build a glass ball on a stepped base, which is ``base`` of the height; ``foot`` is its width relative to the ball's."""
    h, low = height_m, base * height_m
    r = 0.5 * (h - 0.86 * low)
    wide = foot * r
    side = [(wide, 0.0), (wide, 0.3 * low), (0.93 * wide, 0.42 * low), (0.8 * wide, 0.86 * low), (0.74 * wide, low)]
    model = Model().add("pedestal", lathe(rounded([(0.0, 0.0), *side, (0.0, low)], 0.0025)), "base")
    model.add("globe", ellipsoid(2 * r, 2 * r, 2 * r).translate((0, 0, h - r)))
    model.region("base", "pedestal", lambda centers: centers[:, 2] < 1e-5)
    model.point("globe", "surface", "globe", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("christmas ornament")
def christmas_ornament(*, width_m: float, tall: float, cap: float, band: float) -> Model:
    """Build a bauble in its resting pose on its side, with its cap and wire loop towards +X.

    ``tall`` is the ball's length, ``cap`` the cap's width and ``band`` the width of a band around it, all relative to its width.
    """
    r, half = 0.5 * width_m, 0.5 * tall * width_m
    model = Model().add("body", ellipsoid(2 * half, 2 * r, 2 * r))
    model.region("band", "body", lambda centers: abs(centers[:, 0]) < 0.5 * band * width_m, "band")
    start, wide = 0.94 * half, cap * r
    long = 0.34 * r
    collar = cylinder(wide, long, top_radius_m=0.94 * wide, sides=chords(32)).rotate((0, 90, 0))
    model.add("cap", collar.translate((start, 0, 0)), "cap")
    loop = torus(0.42 * wide, 0.0007, sides=chords(32)).translate((start + long + 0.34 * wide, 0, 0))
    model.add("hanger", loop, "cap")
    end = start + long + 0.76 * wide
    model.point("hanger", "tip", "hanger", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("body", "surface", "body", (-0.3 * half, 0.0, 0.953 * r), (0.0, 0.0, 1.0)).rest_on_ground()


@template("trophy")
def trophy(*, height_m: float, width: float, base: float, bowl: float) -> Model:
    """Build a cup with two handles on a block.

    ``base`` and ``bowl`` are their shares of the height; ``width`` is the cup's width relative to the height.
    """
    h, r = height_m, 0.5 * width * height_m
    low, start, side = base * h, (1 - bowl) * h, 1.15 * width * height_m
    model = Model().add("pedestal", box(side, side, low, radius_m=0.003), "base")
    stem = [(0.78 * r, low - 0.001), (0.7 * r, low + 0.02 * h), (0.2 * r, low + 0.3 * (start - low)), (0.16 * r, start)]
    cup = [
        (0.5 * r, start + 0.08 * bowl * h),
        (0.86 * r, start + 0.3 * bowl * h),
        (0.96 * r, h - 0.3 * bowl * h),
        (r, h),
    ]
    wall = max(0.0015, 0.04 * r)
    inner = [(radius - wall, z) for radius, z in cup[1:]]
    model.add("body", lathe(rounded([*stem, *cup], 0.01)))
    for turn in (0, 180):
        path = arc(
            [
                (0.9 * r, 0, h - 0.12 * bowl * h),
                (1.42 * r, 0, h - 0.1 * bowl * h),
                (1.5 * r, 0, h - 0.45 * bowl * h),
                (0.78 * r, 0, start + 0.2 * bowl * h),
            ]
        )
        model.add("handles", tube(path, max(0.0022, 0.06 * r)).rotate((0, 0, turn)), "")
    hollow = lathe(
        [(0.0, start + 0.16 * bowl * h), (0.4 * r, start + 0.18 * bowl * h), *inner[:-1], (r - wall, h + 0.001)]
    )
    model.cut("inside", hollow)
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: centers[:, 2] > 0.985 * h)
    model.region("base", "pedestal", lambda centers: centers[:, 2] < 1e-5)
    model.point("top", "opening", "rim", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    model.point(
        "stem", "surface", "body", (0.0, -0.17 * r, 0.5 * (low + start) + 0.1 * (start - low)), (0.0, -1.0, 0.0)
    )
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("medal")
def medal(*, width_m: float, thick: float, rim: float, ring: float) -> Model:
    """Build a lying medal with a raised rim and a star, and with the ring for its ribbon towards +X."""
    r, t = 0.5 * width_m, thick * width_m
    model = Model().add("body", cylinder(r, t))
    angle = np.linspace(0, 2 * np.pi, 10, endpoint=False)
    reach = np.where(np.arange(10) % 2 == 0, 0.62, 0.28) * r
    star = np.column_stack([reach * np.cos(angle), reach * np.sin(angle)])
    model.cut("face", cylinder((1 - rim) * r, t).translate((0, 0, 0.8 * t)))
    model.add("star", prism(polygon(star), 0.3 * t).translate((0, 0, 0.75 * t)))
    bore = ring * r
    eye = torus(bore, max(0.0009, 0.3 * t), sides=chords(32)).translate((r + 0.75 * bore, 0, 0.5 * t))
    model.add("ring", eye, "ring")
    model.point("ring", "hole", "ring", (r + 0.75 * bore, 0.0, 0.5 * t), (0.0, 0.0, 1.0))
    model.point("front", "face", "star", (0.0, 0.0, 1.05 * t), (0.0, 0.0, 1.0))
    return model.rest_on_ground()


@template("jewelry box")
def jewelry_box(*, length_m: float, width: float, height: float, lid: float) -> Model:
    """Build a closed chest whose lid, ``lid`` of its height, has its hinge at +Y and its latch towards -Y."""
    x, y, h = length_m, width * length_m, height * length_m
    split = (1 - lid) * h
    model = Model().add("body", box(x, y, h, radius_m=0.002))
    rind = box(2 * x, 2 * y, 0.0008) - box(x - 0.0016, y - 0.0016, 0.1).translate((0, 0, -0.05))
    model.cut("seam", rind.translate((0, 0, split)), "seam")
    model.region("lid", "body", lambda centers: centers[:, 2] > split + 0.0005, "lid")
    latch = box(0.1 * x, 0.004, 0.16 * h, radius_m=0.001).translate((0, -0.5 * y - 0.0008, split - 0.09 * h))
    model.add("latch", latch, "latch")
    for side in (-1.0, 1.0):
        foot = box(0.1 * x, 0.1 * x, 0.0032, radius_m=0.001)
        for across in (-1.0, 1.0):
            model.add("feet", foot.translate((side * 0.42 * x, across * (0.5 * y - 0.07 * x), -0.0025)), "latch")
    model.point("lid", "face", "lid", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    model.point("front", "surface", "latch", (0.0, -0.5 * y - 0.0028, split), (0.0, -1.0, 0.0))
    return model.rest_on_ground()


@template("tool box")
def tool_box(*, length_m: float, width: float, height: float, lid: float, handle: float) -> Model:
    """Build a closed tool box with two latches towards -Y and a raised handle along X.

    ``handle`` is the height of the handle relative to the box's.
    """
    x, y, h = length_m, width * length_m, height * length_m
    body = h / (1 + handle)
    split = (1 - lid) * body
    tub = prism(rectangle(x, y, radius_m=0.06 * y), split + 0.002, radius_m=0.004)
    cover = prism(rectangle(1.02 * x, 1.05 * y, radius_m=0.08 * y), body - split, radius_m=0.01)
    model = Model().add("body", tub).add("lid", cover.translate((0, 0, split)), "lid")
    for side in (-1.0, 1.0):
        latch = box(0.1 * x, 0.014, 0.3 * body, radius_m=0.003)
        model.add("latches", latch.translate((side * 0.3 * x, -0.525 * y - 0.003, split - 0.15 * body)), "latches")
    bar, reach = 0.05 * y + 0.004, 0.24 * x
    path = arc(
        [(-reach, 0, body - 0.004), (-0.93 * reach, 0, h - bar), (0.93 * reach, 0, h - bar), (reach, 0, body - 0.004)]
    )
    model.add("handle", tube(path, bar, flatten=0.8, across=(0.0, 1.0, 0.0)), "handle")
    top = float(path[len(path) // 2, 2]) + 0.8 * bar
    model.point("handle", "surface", "handle", (0.0, 0.0, top), (0.0, 0.0, 1.0))
    model.point("latch", "surface", "latches", (0.3 * x, -0.525 * y - 0.01, split), (0.0, -1.0, 0.0))
    return model


@template("glass ball")
def glass_ball(*, width_m: float) -> Model:
    """Build a glass ball."""
    model = Model().add("body", ellipsoid(width_m, width_m, width_m).translate((0, 0, 0.5 * width_m)))
    model.point("top", "surface", "body", (0.0, 0.0, width_m), (0.0, 0.0, 1.0))
    return model.point("side", "surface", "body", (0.0, -0.5 * width_m, 0.5 * width_m), (0.0, -1.0, 0.0))
