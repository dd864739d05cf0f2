"""Small appliances and fixtures of a room, which stand on a foot, a soleplate or a base."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import box, cylinder, ellipsoid, lathe, polygon, prism, rounded, union
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.template import Model, template


def _rod(start: tuple[float, float, float], end: tuple[float, float, float], radius_m: float) -> Manifold:
    """Return a round rod between two points."""
    return tube(np.array([start, end]), radius_m)


@template("desk lamp")
def desk_lamp(*, height_m: float, base: float, reach: float, shade: float) -> Model:
    """Build a lamp on a jointed arm over its round foot, the shade towards +X and open downwards."""
    h, foot, r = height_m, 0.5 * base * height_m, 0.5 * shade * height_m
    model = Model().add("base", lathe(rounded([(0, 0), (foot, 0), (0.94 * foot, 0.05 * h), (0, 0.055 * h)], 0.004)))
    start = (-0.35 * foot, 0.0, 0.05 * h)
    elbow = (-0.35 * foot - 0.28 * reach * h, 0.0, 0.56 * h)
    top = (0.62 * reach * h, 0.0, 0.92 * h)
    thin = 0.016 * h
    model.add("arm", _rod((start[0], 0, 0.03 * h), elbow, thin), "arm").add("arm", _rod(elbow, top, thin), "arm")
    for x, _, z in (start, elbow, top):
        joint = cylinder(2.1 * thin, 3.4 * thin).rotate((90, 0, 0)).translate((x, 1.7 * thin, z))
        model.add("joints", joint, "joint")
    deep, wall = 1.15 * r, 0.0022
    cone = [(0, deep), (0.3 * r, deep), (0.34 * r, 0.72 * deep), (r, 0), (r - wall, 0), (0.34 * r - wall, 0.7 * deep)]
    tilt = 24.0
    angle = np.radians(tilt)

    def hung(solid: Manifold) -> Manifold:
        return solid.translate((0, 0, -0.9 * deep)).rotate((0, -tilt, 0)).translate((top[0] + 0.02 * h, 0, top[2]))

    model.add("shade", hung(lathe([*cone, (0, 0.7 * deep)])), "shade")
    bulb = ellipsoid(0.72 * r, 0.72 * r, 0.9 * r).translate((0, 0, 0.38 * deep))
    model.add("bulb", hung(bulb + cylinder(0.16 * r, 0.5 * deep).translate((0, 0, 0.35 * deep))), "bulb")
    model.add("switch", box(0.022, 0.013, 0.012, radius_m=0.002).translate((0.55 * foot, 0, 0.045 * h)), "joint")
    drop = 0.9 * deep - 0.38 * deep + 0.45 * r
    down = (top[0] + 0.02 * h + drop * float(np.sin(angle)), 0.0, top[2] - drop * float(np.cos(angle)))
    model.point("switch", "button", "switch", (0.55 * foot, 0.0, 0.045 * h + 0.012), (0.0, 0.0, 1.0))
    model.point("bulb", "surface", "bulb", down, (float(np.sin(angle)), 0.0, -float(np.cos(angle))))
    middle = (0.5 * (elbow[0] + top[0]), -thin, 0.5 * (elbow[2] + top[2]))
    model.point("arm", "surface", "arm", middle, (0.0, -1.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("iron")
def iron(*, length_m: float, width: float, height: float) -> Model:
    """Build a steam iron on its soleplate, with the tip towards +X and the handle above."""
    end, half, high = 0.5 * length_m, 0.5 * width * length_m, height * length_m
    share = np.linspace(0, 1, 16)
    sides = half * np.interp(share, [0, 0.08, 0.3, 0.55, 0.8, 0.93, 1], [0.8, 0.95, 1, 0.92, 0.55, 0.24, 0.03])
    x = -end + length_m * share
    outline = polygon([*zip(x, -sides, strict=True), *zip(x[::-1], sides[::-1], strict=True)], radius_m=0.001)
    model = Model().add("sole plate", prism(outline, 0.01, radius_m=0.002), "sole")
    layers = [(0.98, 0.008, 0.0), (0.94, 0.2 * high, -0.02), (0.7, 0.42 * high, -0.07), (0.56, 0.5 * high, -0.1)]
    slabs = [
        prism(outline, 0.001).scale((grow, grow, 1)).translate((shift * length_m, 0, z)) for grow, z, shift in layers
    ]
    model.add("body", union([(low + up).hull() for low, up in pairwise(slabs)]))
    top = high - 0.017
    handle = arc(
        [
            (-0.8 * end, 0, 0.1 * high), (-0.86 * end, 0, 0.6 * high), (-0.7 * end, 0, 0.97 * top),
            (-0.1 * end, 0, top), (0.26 * end, 0, 0.86 * top), (0.34 * end, 0, 0.62 * high), (0.26 * end, 0, 0.3 * high),
        ],
        samples=40,
    )  # fmt: skip
    model.add("handle", tube(handle, 0.016, flatten=1.05, across=(0, 1, 0)), "handle")
    dial_z = 0.5 * high
    model.add("dial", cylinder(0.2 * length_m * width, 0.012).translate((-0.2 * end, 0, dial_z - 0.004)), "dial")
    steam = box(0.02, 0.014, 0.01, radius_m=0.003).translate((0.2 * end, 0, 0.87 * top + 0.011))
    model.add("steam button", steam, "dial")
    model.add(
        "cord",
        tube(arc([(-0.82 * end, 0, 0.55 * high), (-end, 0, 0.62 * high), (-1.06 * end, 0, 0.6 * high)]), 0.006),
        "dial",
    )
    model.point("sole plate", "face", "sole plate", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    model.point("handle", "surface", "handle", (-0.3 * end, 0.0, top + 0.0168), (0.0, 0.0, 1.0))
    model.point("tip", "tip", "sole plate", (end - 0.002, 0.0, 0.005), (1.0, 0.0, 0.0))
    return model.point("dial", "button", "dial", (-0.2 * end, 0.15 * length_m * width, dial_z + 0.008), (0.0, 0.0, 1.0))


@template("fire extinguisher")
def fire_extinguisher(*, height_m: float, width: float, valve: float) -> Model:
    """Build a standing extinguisher, with levers and hose towards +X and the gauge towards -Y."""
    r, top = 0.5 * width * height_m, (1 - valve) * height_m
    profile = [
        (0, 0),
        (0.9 * r, 0),
        (r, 0.02 * height_m),
        (r, top - 0.8 * r),
        (0.8 * r, top - 0.3 * r),
        (0.24 * r, top),
        (0, top),
    ]
    model = Model().add("body", lathe(rounded(profile, 0.5 * r)))
    foot = lathe([(0, 0), (0.96 * r, 0), (1.02 * r, 0.004), (1.02 * r, 0.04 * height_m), (0, 0.04 * height_m)])
    model.add("base", foot, "valve")
    band = lathe([(0, 0.3 * top), (1.004 * r, 0.3 * top), (1.004 * r, 0.62 * top), (0, 0.62 * top)])
    model.add("label", band, "label")
    neck = cylinder(0.3 * r, 0.5 * valve * height_m + 0.01).translate((0, 0, top - 0.01))
    model.add("valve", neck, "brass")
    low, high = top + 0.3 * valve * height_m, height_m - 0.006
    grip = box(1.5 * r, 0.34 * r, 0.008, radius_m=0.003).translate((0.6 * r, 0, low))
    model.add("handle", grip, "valve")
    lever = box(1.6 * r, 0.34 * r, 0.007, radius_m=0.003).rotate((0, -12, 0)).translate((0.62 * r, 0, high - 0.2 * r))
    bracket = box(0.3 * r, 0.3 * r, high - 0.3 * r - low).translate((-0.02 * r, 0, low))
    model.add("bracket", bracket, "brass").add("lever", lever, "valve")
    model.add(
        "gauge",
        cylinder(0.24 * r, 0.3 * r).rotate((90, 0, 0)).translate((0, -0.12 * r, top + 0.18 * valve * height_m)),
        "label",
    )
    path = arc(
        [(-0.1 * r, 0, top + 0.2 * valve * height_m), (-0.9 * r, 0, top + 0.1 * valve * height_m),
         (-1.22 * r, 0, 0.8 * top), (-1.12 * r, 0, 0.5 * top), (-1.1 * r, 0, 0.4 * top)],
        samples=30,
    )  # fmt: skip
    model.add("hose", tube(path, 0.1 * r + 0.002), "hose")
    horn = cylinder(0.26 * r, 0.22 * top, top_radius_m=0.13 * r).translate((-1.12 * r, 0, 0.19 * top))
    model.add("nozzle", horn, "hose")
    model.point("lever", "surface", "lever", (0.9 * r, 0.0, high - 0.13 * r), (0.0, 0.0, 1.0))
    model.point("nozzle", "tip", "nozzle", (-1.12 * r, 0.0, 0.19 * top), (0.0, 0.0, -1.0))
    model.point("handle", "surface", "handle", (0.9 * r, 0.0, low), (0.0, 0.0, -1.0))
    return model.point("base", "face", "base", (0.4 * r, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("phone stand")
def phone_stand(*, width_m: float, height: float, depth: float, lip: float) -> Model:
    """Build a stand whose back leans towards +Y; the phone stands on the lip in front."""
    high, deep, t = height * width_m, depth * width_m, 0.004
    front, back = -0.5 * deep, 0.5 * deep
    low = 0.24 * high
    cradle, heel = front + 0.12 * deep, front + 0.36 * deep
    top = (0.32 * deep, high)

    def plate(start: tuple[float, float], end: tuple[float, float], across_m: float) -> Manifold:
        ends = [
            cylinder(0.5 * t, across_m, sides=12).rotate((0, 90, 0)).translate((-0.5 * across_m, y, z))
            for y, z in (start, end)
        ]
        return (ends[0] + ends[1]).hull()

    model = Model().add("base", box(width_m, deep, t, radius_m=0.0015))
    model.add("back", plate((heel, low), top, 0.92 * width_m), "back")
    model.add(
        "back",
        plate((0.28 * deep, 0.5 * t), (heel + 0.55 * (top[0] - heel), low + 0.55 * (high - low)), 0.6 * width_m),
        "back",
    )
    model.add("lip", plate((cradle, low - 0.2 * (heel - cradle)), (heel, low), 0.92 * width_m), "back")
    model.add(
        "lip",
        plate((cradle, low - 0.2 * (heel - cradle)), (cradle - 0.1 * lip * high, low + lip * high), 0.92 * width_m),
        "back",
    )
    model.add("base", plate((heel, low), (front + 0.3 * deep, 0.5 * t), 0.6 * width_m))
    lean = np.array([high - low, -(top[0] - heel)])
    lean = lean / np.linalg.norm(lean)
    middle = (0.5 * (heel + top[0]) - 0.5 * t * lean[0], 0.5 * (low + high) - 0.5 * t * lean[1])
    model.point(
        "back", "face", "back", (0.0, float(middle[0]), float(middle[1])), (0.0, -float(lean[0]), -float(lean[1]))
    )
    model.point(
        "cradle",
        "surface",
        "lip",
        (0.0, 0.5 * (cradle + heel), low - 0.1 * (heel - cradle) + 0.5 * t),
        (0.0, -0.2, 0.98),
    )
    return model.point("base", "face", "base", (0.0, back - 0.1 * deep, 0.0), (0.0, 0.0, -1.0))


@template("door knob")
def door_knob(*, width_m: float, reach: float, rose: float) -> Model:
    """Build a knob that stands on its mounting plate."""
    r, high, plate = 0.5 * width_m, reach * width_m, 0.5 * rose * width_m
    model = Model().add(
        "plate",
        lathe(
            rounded([(0, 0), (plate, 0), (0.92 * plate, 0.1 * high), (0.4 * r, 0.14 * high), (0, 0.14 * high)], 0.003)
        ),
    )
    model.add(
        "neck",
        lathe(
            rounded(
                [
                    (0, 0.1 * high),
                    (0.42 * r, 0.1 * high),
                    (0.34 * r, 0.3 * high),
                    (0.5 * r, 0.5 * high),
                    (0, 0.5 * high),
                ],
                0.004,
            )
        ),
    )
    ball = [
        (0, 0.4 * high),
        (0.4 * r, 0.42 * high),
        (0.92 * r, 0.52 * high),
        (r, 0.72 * high),
        (0.9 * r, 0.92 * high),
        (0.5 * r, high),
        (0, high),
    ]
    model.add("knob", lathe(rounded(ball, 0.4 * r)), "knob")
    for side in (-1.0, 1.0):
        model.cut("screw holes", cylinder(0.0022, 0.1, sides=16).translate((side * 0.76 * plate, 0, -0.05)))
    model.point("knob", "surface", "knob", (0.0, 0.0, high), (0.0, 0.0, 1.0))
    return model.point("plate", "face", "plate", (0.3 * plate, 0.0, 0.0), (0.0, 0.0, -1.0))
