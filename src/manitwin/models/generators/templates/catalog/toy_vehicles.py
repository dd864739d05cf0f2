"""Toy vehicles, standing with their front towards -Y."""

from __future__ import annotations

from itertools import product

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
    rounded,
)
from manitwin.geometry.solids.sweep import arc
from manitwin.models.generators.templates.template import Model, template


def slab_across(side: list[Point], width_m: float, radius_m: float) -> Manifold:
    """Return an outline (y, z) extruded along X to a width, centred."""
    slab = prism(polygon(side, radius_m=radius_m), width_m, radius_m=radius_m)
    return slab.translate((0, 0, -0.5 * width_m)).rotate((90, 0, 90))


def _wheel(radius_m: float, thick_m: float, x_m: float, y_m: float) -> Manifold:
    """Return a wheel on the ground whose outer face is at ``x_m``."""
    turned = cylinder(radius_m, thick_m, sides=chords(40)) + cylinder(0.4 * radius_m, 1.12 * thick_m, sides=chords(24))
    return turned.translate((0, 0, -thick_m)).rotate((0, 90 if x_m > 0 else -90, 0)).translate((x_m, y_m, radius_m))


@template("toy truck")
def toy_truck(*, length_m: float, width: float, height: float, cab: float, wheel: float) -> Model:
    """Build a truck with an open bed behind its cab; ``cab`` and the wheel's diameter ``wheel`` are relative to the length."""
    n, x, h = length_m, width * length_m, height * length_m
    r, front = 0.5 * wheel * length_m, (cab - 0.5) * length_m
    floor = 1.25 * r
    model = Model().add("chassis", box(0.7 * x, 0.98 * n, 0.5 * r).translate((0, 0, 0.8 * r)), "chassis")
    side = [
        (-0.5 * n, floor),
        (front - 0.01 * n, floor),
        (front - 0.01 * n, h),
        (-0.5 * n + 0.32 * cab * n, h),
        (-0.5 * n, 0.52 * h + 0.48 * floor),
    ]
    model.add("cab", slab_across(side, x, 0.012 * n), "")
    glass = [
        (-0.5 * n + 0.3 * cab * n, 0.6 * h),
        (front - 0.12 * cab * n, 0.6 * h),
        (front - 0.12 * cab * n, 0.9 * h),
        (-0.5 * n + 0.42 * cab * n, 0.9 * h),
    ]
    model.add("windows", slab_across(glass, 1.01 * x, 0.003 * n), "windows")
    long = 0.5 * n - front - 0.01 * n
    tray = box(x, long, 0.6 * (h - floor), radius_m=0.006 * n).translate((0, 0.5 * n - 0.5 * long, floor))
    model.add("tray", tray, "tray")
    wall = 0.05 * x
    hollow = box(x - 2 * wall, long - 2 * wall, h).translate((0, 0.5 * n - 0.5 * long, floor + wall))
    model.cut("tray inside", hollow, "tray")
    for at, sign in product((-0.3 * n, 0.16 * n, 0.36 * n), (-1.0, 1.0)):
        model.add("wheels", _wheel(r, 0.22 * x, sign * 0.5 * x, at), "wheels")
    model.point("roof", "face", "cab", (0.0, -0.5 * n + 0.66 * cab * n, h), (0.0, 0.0, 1.0))
    return model.point(
        "tray", "opening", "tray inside", (0.0, 0.5 * n - 0.5 * long, floor + 0.6 * (h - floor)), (0.0, 0.0, 1.0)
    )


@template("toy train")
def toy_train(*, length_m: float, width: float, height: float, boiler: float, wheel: float) -> Model:
    """Build a steam engine: a boiler with a chimney in front of a cab; ``boiler`` is its share, ``wheel`` as for a truck."""
    n, x, h = length_m, width * length_m, height * length_m
    r, back = 0.5 * wheel * length_m, (boiler - 0.5) * length_m
    floor = 1.2 * r
    model = Model().add("frame", box(0.82 * x, n, 0.6 * r, radius_m=0.006 * n).translate((0, 0, 0.75 * r)), "frame")
    tank = min(0.42 * x, 0.34 * (h - floor))
    drum = cylinder(tank, back + 0.48 * n, sides=chords(48)).rotate((-90, 0, 0)).translate((0, -0.48 * n, floor + tank))
    model.add("boiler", drum, "")
    cabin = box(0.94 * x, 0.5 * n - back, 0.9 * (h - floor), radius_m=0.01 * n).translate(
        (0, 0.25 * n + 0.5 * back, floor)
    )
    model.add("cab", cabin, "cab")
    roof = box(1.04 * x, 0.56 * n - back, 0.1 * (h - floor), radius_m=0.012 * n)
    model.add("roof", roof.translate((0, 0.25 * n + 0.5 * back, h - 0.1 * (h - floor))), "roof")
    for sign in (-1.0, 1.0):
        pane = box(0.1 * x, 0.55 * (0.5 * n - back), 0.3 * (h - floor), radius_m=0.003 * n)
        model.cut(
            "windows", pane.translate((sign * 0.5 * x, 0.25 * n + 0.5 * back, floor + 0.48 * (h - floor))), "frame"
        )
    top = floor + 2 * tank
    rise = max(0.88 * h - top, 0.06 * h)
    chimney = cylinder(0.32 * tank, rise + 0.3 * tank, top_radius_m=0.46 * tank, sides=chords(32))
    model.add("chimney", chimney.translate((0, -0.36 * n, top - 0.3 * tank)), "roof")
    for at, sign in product((-0.34 * n, -0.05 * n, 0.3 * n), (-1.0, 1.0)):
        model.add("wheels", _wheel(r, 0.16 * x, sign * 0.5 * x, at), "wheels")
    model.point("chimney", "tip", "chimney", (0.0, -0.36 * n, top + rise), (0.0, 0.0, 1.0))
    return model.point("roof", "face", "roof", (0.0, 0.25 * n + 0.5 * back, h), (0.0, 0.0, 1.0))


@template("toy boat")
def toy_boat(*, length_m: float, width: float, height: float, hull: float, cabin: float) -> Model:
    """Build a boat with its bow towards -Y.

    ``hull`` is the deck's height relative to the boat's, ``cabin`` the cabin's length relative to the boat's.
    """
    n, x, h = length_m, 0.5 * width * length_m, height * length_m
    deck = hull * h
    bow = arc([(0, -0.5 * n, 0), (0.62 * x, -0.3 * n, 0), (x, 0.0, 0), (0.94 * x, 0.42 * n, 0), (0.86 * x, 0.5 * n, 0)])
    outline = polygon(np.concatenate([bow[:, :2], (bow * [-1, 1, 1])[::-1, :2]]))
    keel = prism(outline.scale((0.72, 0.86)), 0.002)
    body = Manifold.batch_hull([keel, prism(outline, 0.002).translate((0, 0, deck - 0.002))])
    model = Model().add("body", body)
    model.cut("deck", prism(outline.offset(-0.05 * x), deck).translate((0, 0, 0.88 * deck)), "deck")
    long, high = cabin * n, 0.62 * (h - deck)
    house = box(1.1 * x, long, high + 0.14 * deck, radius_m=0.008 * n).translate((0, 0.14 * n, 0.86 * deck))
    model.add("cabin", house, "cabin")
    funnel = cylinder(0.24 * x, h - deck - 0.9 * high, sides=chords(32)).translate((0, 0.18 * n, deck + 0.9 * high))
    model.add("funnel", funnel, "funnel")
    model.point("funnel", "face", "funnel", (0.0, 0.18 * n, h), (0.0, 0.0, 1.0))
    return model.point("bow", "edge", "body", (0.0, -0.5 * n, 0.99 * deck), (0.0, -1.0, 0.0))


@template("toy airplane")
def toy_airplane(*, length_m: float, span: float, chord: float, body: float, tail: float) -> Model:
    """Build an aeroplane on three wheels with its nose to -Y; ``span`` and ``tail`` are the spans of its wings.

    ``chord`` is the depth of the wings.
    """
    n, r = length_m, 0.5 * body * length_m
    low = 0.9 * r
    profile = [
        (0.0, -0.5 * n),
        (0.5 * r, -0.48 * n),
        (0.9 * r, -0.4 * n),
        (r, -0.25 * n),
        (0.95 * r, 0.1 * n),
        (0.4 * r, 0.46 * n),
        (0.22 * r, 0.5 * n),
        (0.0, 0.5 * n),
    ]
    hull = lathe(rounded(profile, 0.4 * r)).rotate((-90, 0, 0)).translate((0, 0, low + r))
    model = Model().add("body", hull)
    w, c = 0.5 * span * n, chord * n
    wing = polygon(
        [(-w, -0.02 * n), (-w, 0.55 * c), (0.0, c), (w, 0.55 * c), (w, -0.02 * n), (0.0, -0.4 * c)], radius_m=0.012 * n
    )
    thick = 0.28 * r
    model.add("wings", prism(wing, thick, radius_m=0.4 * thick).translate((0, -0.1 * n, low + 0.55 * r)), "wings")
    t = 0.5 * tail * n
    back = polygon([(-t, 0.44 * n), (-t, 0.5 * n), (t, 0.5 * n), (t, 0.44 * n), (0.0, 0.36 * n)], radius_m=0.006 * n)
    model.add("tail", prism(back, 0.8 * thick, radius_m=0.3 * thick).translate((0, 0, low + 1.05 * r)), "wings")
    fin = [(0.34 * n, low + r), (0.5 * n, low + r), (0.5 * n, low + 3.1 * r), (0.44 * n, low + 3.1 * r)]
    model.add("fin", slab_across(fin, 0.8 * thick, 0.1 * thick), "wings")
    canopy = ellipsoid(1.3 * r, 0.24 * n, 1.2 * r).translate((0, -0.22 * n, low + 1.75 * r))
    model.add("canopy", canopy, "windows")
    for at, along in ((-0.6 * r, -0.02 * n), (0.6 * r, -0.02 * n), (0.0, -0.36 * n)):
        leg = cylinder(0.12 * r, low + 0.7 * r, sides=chords(16)).translate((at, along, 0.4 * r))
        tyre = cylinder(0.42 * r, 0.24 * r, sides=chords(28)).translate((0, 0, -0.12 * r)).rotate((0, 90, 0))
        model.add("wheels", leg, "wheels").add("wheels", tyre.translate((at, along, 0.42 * r)), "wheels")
    model.point("wing", "edge", "wings", (w, -0.05 * n, low + 0.55 * r + 0.5 * thick), (1.0, 0.0, 0.0))
    return model.point("end", "tip", "body", (0.0, -0.5 * n, low + r), (0.0, -1.0, 0.0))
