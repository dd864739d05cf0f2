"""Instruments to measure, speak, grip and fill with: long ones lie with the working end towards +X."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import (
    Point,
    box,
    chords,
    cylinder,
    ellipsoid,
    lathe,
    polygon,
    prism,
    rectangle,
    rounded,
    union,
)
from manitwin.geometry.solids.sweep import arc, sweep
from manitwin.models.generators.templates.template import Model, template


def _lathe_along_x(profile: list[Point], sides: int = 36) -> Manifold:
    """Return a solid of revolution whose axis lies along X."""
    return lathe(profile, sides=sides).rotate((0, 90, 0))


@template("microphone")
def microphone(*, length_m: float, head_m: float, grip: float) -> Model:
    """Build a lying hand-held microphone with its grille towards +X."""
    end, r = 0.5 * length_m, 0.5 * head_m
    neck, handle = end - 1.75 * r, grip * r
    turn = np.linspace(-0.95, 0.5 * np.pi, 16)
    ball = [(float(r * np.cos(a)), float(end - r + r * np.sin(a))) for a in turn]
    grille = [(0.0, neck), (ball[0][0], neck), *ball, (0.0, end)]
    model = Model().add("grille", _lathe_along_x(grille), "grille")
    model.add(
        "ring",
        _lathe_along_x([(0, end - 1.1 * r), (1.04 * r, end - 1.1 * r), (1.04 * r, end - 0.9 * r), (0, end - 0.9 * r)]),
        "ring",
    )
    shaft = [
        (0, -end),
        (0.8 * handle, -end),
        (0.84 * handle, -0.4 * end),
        (1.15 * handle, neck - 0.004),
        (0, neck + 0.004),
    ]
    model.add("body", _lathe_along_x(rounded([*shaft[:-1], (0.8 * r, neck + 0.004), shaft[-1]], 0.004)))
    at = neck - 0.28 * length_m
    switch = box(0.014, 0.007, 0.004, radius_m=0.001).translate((at, 0, 0.95 * handle - 0.0015))
    model.add("switch", switch, "ring")
    model.cut("connector", cylinder(0.55 * handle, 0.014).rotate((0, 90, 0)).translate((-end - 0.001, 0, 0)), "ring")
    model.point("grille", "tip", "grille", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    model.point("switch", "button", "switch", (at, 0.0, 0.95 * handle + 0.0025), (0.0, 0.0, 1.0))
    return model.point("body", "surface", "body", (-0.4 * end, 0.0, 0.84 * handle), (0.0, 0.0, 1.0)).rest_on_ground()


@template("multimeter")
def multimeter(*, length_m: float, width: float, thick_m: float, screen: float) -> Model:
    """Build a lying multimeter with its display towards +X and its sockets towards -X."""
    across = width * length_m
    frame = box(length_m, across, thick_m, radius_m=0.2 * thick_m)
    model = Model().add("body", frame)
    face = thick_m + 0.0012
    panel = prism(rectangle(0.9 * length_m, 0.82 * across, radius_m=0.1 * across), face)
    model.add("panel", panel, "panel")
    high = screen * length_m
    at = 0.42 * length_m - 0.5 * high
    model.add("screen", box(high, 0.66 * across, face + 0.0006).translate((at, 0, 0)), "screen")
    keys = [
        box(0.035 * length_m, 0.13 * across, 0.004, radius_m=0.001).translate(
            (at - 0.5 * high - 0.045 * length_m, y, face - 0.002)
        )
        for y in (-0.28 * across, -0.1 * across, 0.1 * across, 0.28 * across)
    ]
    model.add("buttons", union(keys), "buttons")
    r, middle = 0.25 * across, -0.08 * length_m
    knob = cylinder(r, 0.006, top_radius_m=0.94 * r).translate((middle, 0, face - 0.002))
    ridge = box(1.7 * r, 0.32 * r, 0.009, radius_m=0.002).translate((middle, 0, face - 0.001))
    model.add("dial", knob + ridge, "dial")
    places = [(-0.38 * length_m, y) for y in (-0.25 * across, 0.0, 0.25 * across)]
    model.add(
        "socket rings", union([cylinder(0.0062, 0.003).translate((x, y, face - 0.0015)) for x, y in places]), "sockets"
    )
    model.cut("sockets", union([cylinder(0.0027, 0.03).translate((x, y, face - 0.012)) for x, y in places]), "sockets")
    model.point("dial", "button", "dial", (middle, 0.0, face + 0.008), (0.0, 0.0, 1.0))
    model.point("screen", "face", "screen", (at, 0.0, face + 0.0006), (0.0, 0.0, 1.0))
    return model.point("socket", "hole", "sockets", (-0.38 * length_m, 0.0, face + 0.0015), (0.0, 0.0, 1.0))


@template("thermometer")
def thermometer(*, length_m: float, width: float, thick_m: float) -> Model:
    """Build a lying clinical thermometer with its probe towards +X."""
    end, half = 0.5 * length_m, 0.5 * width * length_m
    outline = polygon(
        [(-end, -0.8 * half), (-0.2 * end, -half), (0.3 * end, -0.6 * half), (0.86 * end, -0.0022), (0.86 * end, 0.0022),
         (0.3 * end, 0.6 * half), (-0.2 * end, half), (-end, 0.8 * half)],
        radius_m=0.0015,
    )  # fmt: skip
    model = Model().add("body", prism(outline, thick_m, radius_m=0.25 * thick_m))
    probe = rounded([(0, 0.5 * end), (0.0019, 0.5 * end), (0.0019, end), (0, end)], 0.0018)
    model.add("probe", _lathe_along_x(probe, sides=20).translate((0, 0, 0.5 * thick_m)), "probe")
    window = box(0.36 * end, 1.1 * half, 0.002).translate((-0.12 * end, 0, thick_m - 0.0014))
    model.add("screen", window, "screen")
    model.add("button", cylinder(0.5 * half, 0.003, sides=24).translate((-0.7 * end, 0, thick_m - 0.0016)), "button")
    model.point("tip", "tip", "probe", (end, 0.0, 0.5 * thick_m), (1.0, 0.0, 0.0))
    model.point("screen", "face", "screen", (-0.12 * end, 0.0, thick_m + 0.0006), (0.0, 0.0, 1.0))
    return model.point("button", "button", "button", (-0.7 * end, 0.0, thick_m + 0.0014), (0.0, 0.0, 1.0))


@template("syringe")
def syringe(*, length_m: float, width: float, drawn: float, needle_m: float) -> Model:
    """Build a lying syringe with its needle towards +X; the plunger is drawn out by ``drawn`` of the barrel."""
    end, r = 0.5 * length_m, 0.5 * width * length_m
    barrel = (length_m - needle_m - 0.012) / (1 + drawn)
    front = end - needle_m - 0.01
    back = front - barrel
    profile = [(0, back), (r, back), (r, front - 0.003), (0.0028, front), (0.002, front + 0.01), (0, front + 0.01)]
    model = Model().add("barrel", _lathe_along_x(rounded(profile, 0.001)))
    model.add("flange", box(0.0022, 4.2 * r, 2.0 * r, radius_m=0.001).translate((back + 0.001, 0, -r)))
    rod = _lathe_along_x([(0, -end + 0.001), (0.5 * r, -end + 0.001), (0.5 * r, back + 0.004), (0, back + 0.004)])
    model.add("plunger", rod, "plunger")
    model.add(
        "plunger", _lathe_along_x([(0, -end), (1.15 * r, -end), (1.15 * r, -end + 0.002), (0, -end + 0.002)]), "plunger"
    )
    model.add(
        "needle",
        cylinder(0.0008, needle_m + 0.006, top_radius_m=0.0005, sides=12)
        .rotate((0, 90, 0))
        .translate((end - needle_m - 0.006, 0, 0)),
        "needle",
    )
    model.point("tip", "tip", "needle", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    model.point("plunger", "button", "plunger", (-end, 0.0, 0.0), (-1.0, 0.0, 0.0))
    return model.point("barrel", "surface", "barrel", (0.5 * (front + back), 0.0, r), (0.0, 0.0, 1.0)).rest_on_ground()


@template("tweezers")
def tweezers(*, length_m: float, spread: float, width_m: float) -> Model:
    """Build tweezers lying on an edge of their arms, with the tips towards +X."""
    end, open_m = 0.5 * length_m, 0.5 * spread * length_m
    section = np.array([(-1, -0.24), (1, -0.24), (1, 0.24), (-1, 0.24)])
    model = Model()
    for side in (-1.0, 1.0):
        path = arc(
            [
                (-end, side * 0.0004, 0),
                (-0.5 * end, 0.55 * side * open_m, 0),
                (0.1 * end, side * open_m, 0),
                (end, 0.3 * side * open_m, 0),
            ]
        )
        half = np.interp(np.linspace(0, 1, len(path)), [0, 0.3, 0.6, 1], np.array([0.4, 0.5, 0.4, 0.1]) * width_m)
        model.add("arms", sweep(path, section, half, across=(0, 0, 1)))
    model.region("tips", "arms", lambda centers: centers[:, 0] > 0.8 * end)
    model.region("joint", "arms", lambda centers: centers[:, 0] < -0.86 * end)
    model.point("tips", "tip", "tips", (end, 0.3 * open_m, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "arms", "surface", "arms", (0.1 * end, open_m + 0.11 * width_m, 0.0), (0.0, 1.0, 0.0)
    ).rest_on_ground()


@template("test tube")
def test_tube(*, length_m: float, width: float, wall_m: float) -> Model:
    """Build a lying test tube with its open end towards +X."""
    end, r = 0.5 * length_m, 0.5 * width * length_m

    def capsule(radius: float, start: float, stop: float) -> list[Point]:
        turn = np.linspace(-0.5 * np.pi, 0, 10)
        bottom = [(float(radius * np.cos(a)), float(start + radius + radius * np.sin(a))) for a in turn]
        return [*bottom, (radius, stop), (0.0, stop)]

    model = Model().add("body", _lathe_along_x(capsule(r, -end, end)))
    lip = _lathe_along_x(rounded([(0, end - 0.004), (1.14 * r, end - 0.004), (1.14 * r, end), (0, end)], 0.0015))
    model.add("rim", lip).cut("inside", _lathe_along_x(capsule(r - wall_m, -end + wall_m, end + 0.01)))
    model.region("bottom", "body", lambda centers: centers[:, 0] < -end + r)
    model.point("opening", "opening", "rim", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("body", "surface", "body", (-0.1 * end, 0.0, r), (0.0, 0.0, 1.0)).rest_on_ground()


@template("alarm clock")
def alarm_clock(*, height_m: float, width: float, depth: float, bell: float) -> Model:
    """Build a clock with two bells on two feet, with its dial towards -Y; ``bell`` is a bell's width over the case's."""
    h = height_m
    r, deep = 0.5 * width * h, depth * h
    middle = 0.08 * h + r
    case = [
        (0, 0),
        (0.9 * r, 0),
        (r, 0.08 * deep),
        (r, 0.94 * deep),
        (0.97 * r, deep),
        (0.9 * r, deep),
        (0.88 * r, 0.94 * deep),
    ]

    def facing(solid: Manifold) -> Manifold:  # built upward from its back, rotated to face -Y
        return solid.rotate((90, 0, 0)).translate((0, 0.5 * deep, middle))

    model = Model().add("body", facing(lathe(rounded([*case, (0, 0.94 * deep)], 0.004), sides=chords(72))))
    face = 0.94 * deep
    model.add("dial", facing(cylinder(0.885 * r, 0.0012, sides=chords(72)).translate((0, 0, face - 0.0004))), "dial")
    marks = []
    for hour in range(12):
        long = 0.13 * r if hour % 3 == 0 else 0.08 * r
        mark = box(0.05 * r, long, 0.0012).translate((0, 0.8 * r - 0.5 * long, face + 0.0002))
        marks.append(mark.rotate((0, 0, 30 * hour)))
    model.add("hands", facing(union(marks)), "hands")
    for angle, long, wide in ((55.0, 0.42 * r, 0.07 * r), (-60.0, 0.62 * r, 0.05 * r)):  # ten past ten
        hand = box(wide, long + 0.1 * r, 0.0016, radius_m=0.0004).translate((0, 0.5 * long - 0.05 * r, face + 0.0004))
        model.add("hands", facing(hand.rotate((0, 0, angle))), "hands")
    model.add("hands", facing(cylinder(0.06 * r, 0.0034, sides=chords(24)).translate((0, 0, face))), "hands")
    cup = 0.5 * bell * 2 * r
    dome = [(0, 0), (cup, 0), (cup, 0.12 * cup), (0.88 * cup, 0.42 * cup), (0.55 * cup, 0.68 * cup), (0, 0.78 * cup)]
    for side in (-1.0, 1.0):
        lean = side * 33.0
        rod = cylinder(0.05 * r + 0.0008, 0.3 * r, sides=chords(20)).translate((0, 0, 0.94 * r))
        dish = lathe(rounded(dome, 0.1 * cup), sides=chords(48)).translate((0, 0, 1.1 * r))
        nut = ellipsoid(0.22 * cup, 0.22 * cup, 0.3 * cup, sides=chords(20)).translate((0, 0, 1.1 * r + 0.8 * cup))
        model.add("bells", union([rod, dish, nut]).rotate((0, lean, 0)).translate((0, 0, middle)), "bells")
        foot = cylinder(0.05 * r + 0.001, 0.42 * r, top_radius_m=0.06 * r + 0.002, sides=chords(24))
        tilted = foot.translate((0, 0, -1.3 * r)).rotate((0, side * -30, 0)).translate((0, 0, middle))
        model.add("feet", tilted, "bells")
        heel = ellipsoid(0.22 * r, 0.3 * r, 0.16 * r, sides=chords(24))
        place = (
            -side * -1.28 * r * float(np.sin(np.radians(30))),
            0.0,
            middle - 1.26 * r * float(np.cos(np.radians(30))),
        )
        model.add("feet", heel.translate(place), "bells")
    prop = cylinder(0.045 * r + 0.001, 1.1 * r, sides=chords(24)).translate((0, 0, -1.1 * r)).rotate((24, 0, 0))
    model.add(
        "feet",
        prop.translate((0, 0.36 * deep, middle - 0.86 * r * 0.3))
        ^ box(4 * r, 4 * r, 8 * r).translate((0, 0, middle - 1.171 * r)),
        "bells",
    )
    hammer = cylinder(0.035 * r + 0.0006, 0.42 * r, sides=chords(16)).translate((0, 0, middle + 0.95 * r))
    model.add(
        "hammer",
        hammer + ellipsoid(0.3 * r, 0.16 * r, 0.16 * r, sides=chords(24)).translate((0, 0, middle + 1.36 * r)),
        "bells",
    )
    knob = facing(cylinder(0.16 * r, 0.1 * deep, sides=chords(24)).translate((0, 0, -0.09 * deep)))
    model.add("knob", knob, "bells")
    front = -0.5 * deep + 0.06 * deep - 0.0008
    model.point("dial", "face", "dial", (0.0, front, middle - 0.3 * r), (0.0, -1.0, 0.0))
    model.point("knob", "button", "knob", (0.0, 0.59 * deep, middle), (0.0, 1.0, 0.0))
    top = middle + 1.44 * r
    return model.point("hammer", "surface", "hammer", (0.0, 0.0, top), (0.0, 0.0, 1.0)).rest_on_ground()
