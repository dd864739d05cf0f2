"""Snacks: sweets on sticks, ice cream cones, butter, sushi, pretzels. Sticks and cones lie with their tip towards +X."""

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
    torus,
    union,
)
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.organic import lay_along_x, scale_radially
from manitwin.models.generators.templates.template import Model, template


@template("lollipop")
def lollipop(*, width_m: float, thick: float, stick_m: float, stick_width_m: float) -> Model:
    """Build a lollipop with a spiral lying on its flat side; ``stick_m`` is the visible length of its stick."""
    r, h = 0.5 * width_m, thick * width_m
    disc = ellipsoid(width_m, width_m, 2 * h) ^ box(2 * width_m, 2 * width_m, h).translate((0, 0, -0.5 * h))
    model = Model().add("body", disc)
    turn = np.linspace(0.6, 5.5 * np.pi, 120)
    off = 0.86 * r * turn / turn[-1]
    rise = np.minimum(h * np.sqrt(1 - (off / r) ** 2), 0.5 * h)
    spiral = np.column_stack([off * np.cos(turn), off * np.sin(turn), rise])
    for sign in (1.0, -1.0):
        line = tube(spiral * [1, 1, sign], 0.05 * r, sides=8, across=(0, 0, 1))
        model.add("spiral", line ^ box(3 * r, 3 * r, 1.06 * h).translate((0, 0, -0.53 * h)), "spiral")
    rod = lay_along_x(cylinder(0.5 * stick_width_m, stick_m + 0.5 * r)).translate((0.5 * r, 0, 0))
    model.add("stick", rod, "stick")
    model.point("top", "surface", "body", (0.0, 0.0, 0.5 * h), (0.0, 0.0, 1.0))
    return model.point("base", "surface", "body", (0.0, 0.0, -0.5 * h), (0.0, 0.0, -1.0)).rest_on_ground()


@template("popsicle")
def popsicle(*, length_m: float, width: float, thick: float, stick: float) -> Model:
    """Build a lying popsicle with its stick towards +X.

    ``width`` and ``stick`` are relative to the length, ``thick`` to the width.
    """
    ice, wide = (1 - stick) * length_m, width * length_m
    h, low = thick * width * length_m, -0.5 * length_m
    turn = np.linspace(0.5 * np.pi, 1.5 * np.pi, 16)
    head = [(low + 0.5 * wide + 0.5 * wide * float(np.cos(a)), 0.5 * wide * float(np.sin(a))) for a in turn]
    outline = polygon([*head, (low + ice, -0.5 * wide), (low + ice, 0.5 * wide)], radius_m=0.06 * wide)
    model = Model().add("body", prism(outline, h, radius_m=0.24 * h))
    groove = box(0.62 * ice, 0.12 * wide, h).translate((low + 0.55 * ice, 0, 0.93 * h))
    model.cut("grooves", union([groove.translate((0, side * 0.22 * wide, 0)) for side in (-1, 1)]))
    flat = rectangle(stick * length_m + 0.3 * ice, 0.2 * wide, radius_m=0.1 * wide)
    rod = prism(flat, 0.0022, radius_m=0.0006).translate(
        (0.5 * length_m - 0.5 * (stick * length_m + 0.3 * ice), 0, 0.5 * h - 0.0011)
    )
    model.add("stick", rod, "stick")
    model.point(
        "stick", "surface", "stick", (0.5 * length_m - 0.4 * stick * length_m, 0.0, 0.5 * h + 0.0011), (0.0, 0.0, 1.0)
    )
    return model.point("ice", "surface", "body", (low + 0.5 * ice, 0.0, h), (0.0, 0.0, 1.0)).rest_on_ground()


@template("ice cream cone")
def ice_cream_cone(*, length_m: float, width: float, scoop: float, tip: float) -> Model:
    """Build a cone with a scoop, lying on both, with its tip towards +X; ``scoop`` is its width over the cone's mouth."""
    mouth, ball = width * length_m, scoop * width * length_m
    depth = 0.5 * float(np.sqrt(ball**2 - mouth**2))  # from the scoop's centre down to the mouth
    long = length_m - 0.5 * ball - depth
    wall = lathe([(tip * mouth, 0.0), (0.5 * mouth, long), (0.54 * mouth, long + 0.006), (0.5 * mouth, long + 0.008)])
    ribs = [
        torus(float(r), 0.0009, sides=chords(40)).translate((0, 0, float(z)))
        for r, z in zip(np.linspace(tip, 0.5, 9)[1:] * mouth, np.linspace(0.0, long, 9)[1:], strict=True)
    ]
    cone = union([wall, *ribs])
    drip = scale_radially(torus(0.5 * mouth, 0.055 * mouth), lambda a: 1 + 0.05 * np.cos(7 * a)).translate(
        (0, 0, long + 0.004)
    )
    ice = ellipsoid(ball, ball, ball).translate((0, 0, long + depth)) + drip
    tilt = float(np.degrees(np.arctan2(0.5 * ball - tip * mouth, long + depth)))

    model = Model()
    for name, solid, slot in (("cone", cone, ""), ("ice cream", ice, "ice cream")):
        model.add(name, lay_along_x(solid.mirror((0, 0, 1))).rotate((0, tilt, 0)), slot)
    ahead = (float(np.cos(np.radians(tilt))), 0.0, -float(np.sin(np.radians(tilt))))
    model.region("tip", "cone", lambda c: c @ np.array(ahead) > -0.12 * long)
    model.point("cone tip", "tip", "tip", (0.0, 0.0, 0.0), ahead)
    center = -(long + depth) * np.array(ahead)
    top = (float(center[0]), 0.0, float(center[2]) + 0.5 * ball)
    return model.point("ice cream", "surface", "ice cream", top, (0.0, 0.0, 1.0)).rest_on_ground()


@template("butter stick")
def butter_stick(*, length_m: float, width: float, height: float) -> Model:
    """Build a block of butter in its paper, with folds at its ends."""
    w, h = width * length_m, height * length_m
    model = Model().add("body", box(length_m, w, h, radius_m=0.0025))
    for side in (-1.0, 1.0):
        flap = polygon([(-0.46 * w, 0.06 * h), (0.46 * w, 0.06 * h), (0.0, 0.72 * h)], radius_m=0.001)
        fold = prism(flap, 0.0016).rotate((90, 0, 90)).translate((side * 0.5 * length_m - 0.0008, 0, 0))
        model.add("folds", fold, "folds")
    model.region("label", "body", lambda c: (np.abs(c[:, 0]) < 0.32 * length_m) & (c[:, 2] > 0.998 * h), "label")
    model.point("top", "face", "label", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    model.point("base", "face", "body", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return model.point("side", "face", "body", (0.0, -0.5 * w, 0.5 * h), (0.0, -1.0, 0.0))


@template("sushi")
def sushi(*, length_m: float, width: float, rice: float, fish: float) -> Model:
    """Build a piece of nigiri: fish over rice and a band around both; ``rice`` and ``fish`` are heights relative to the width."""
    w = width * length_m
    low, thick = rice * w, fish * w
    body = ellipsoid(0.92 * length_m, w, 2 * low) ^ box(2 * length_m, 2 * w, 0.86 * low)
    lumpy = box(0.86 * length_m, 0.9 * w, 0.9 * low, radius_m=0.3 * low)
    model = Model().add("rice", (body + lumpy).scale((1, 0.97, 1)))
    share = np.linspace(-0.5, 0.5, 24)
    path = np.column_stack([share * length_m, 0 * share, low * (0.96 - 1.15 * np.abs(share) ** 2.6 * 2)])
    model.add(
        "body",
        tube(
            path,
            0.47 * w * np.interp(np.abs(share), [0, 0.4, 0.5], [1.0, 0.95, 0.7]),
            flatten=thick / w,
            across=(0, 1, 0),
        ),
        "fish",
    )
    band = box(0.13 * length_m, 1.03 * w, low + 0.62 * thick, radius_m=0.001).translate((0.03 * length_m, 0, 0))
    model.add("band", band, "band")
    at = -0.25 * length_m
    z = float(np.interp(at, path[:, 0], path[:, 2])) + 0.47 * thick
    model.point("top", "surface", "body", (at, 0.0, z), (0.0, 0.0, 1.0))
    return model.point("base", "face", "rice", (at, 0.0, 0.0), (0.0, 0.0, -1.0)).rest_on_ground()


@template("pretzel")
def pretzel(*, width_m: float, thick: float, tall: float) -> Model:
    """Build a lying pretzel with its crossed ends towards -Y; ``thick`` is its strand's width relative to its own."""
    w, d, r = 0.5 * width_m, tall * width_m, 0.5 * thick * width_m
    x = w - r
    points = [(-0.4 * x, -0.36 * d), (-0.04 * x, -0.06 * d), (0.28 * x, 0.26 * d), (0.62 * x, 0.43 * d)]
    points += [(0.95 * x, 0.2 * d), (0.9 * x, -0.16 * d), (0.52 * x, -0.4 * d), (0.0, -0.5 * d + r)]
    right = arc([(px, py, r) for px, py in points], samples=48)
    share = np.linspace(0, 1, 48)
    thickness = r * np.interp(share, [0, 0.4, 0.7, 1], [0.7, 0.85, 1.2, 1.25])
    one = tube(right, thickness, sides=chords(20), across=(0, 0, 1))
    model = Model().add("body", one + one.mirror((1, 0, 0)))
    salt = []
    for number in range(12):
        at = right[20 + 2 * number]
        for side in (-1.0, 1.0):
            grain = box(0.0022, 0.0018, 0.0018).rotate((20.0 * number, 31.0 * number, 0))
            salt.append(
                grain.translate(
                    (side * float(at[0]), float(at[1]), float(at[2]) + 0.93 * float(thickness[20 + 2 * number]))
                )
            )
    model.add("salt", union(salt), "salt")
    edge = int(right[:, 0].argmax())
    model.point(
        "outer side",
        "surface",
        "body",
        (float(right[edge, 0] + thickness[edge]), float(right[edge, 1]), r),
        (1.0, 0.0, 0.0),
    )
    model.region("hole", "body", lambda c: np.hypot(c[:, 0] - 0.55 * x, c[:, 1]) < 0.36 * x)
    return model.point("inner side", "hole", "hole", (0.55 * x, 0.0, r), (0.0, 0.0, 1.0)).rest_on_ground()
