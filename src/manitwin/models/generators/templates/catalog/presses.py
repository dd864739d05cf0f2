"""Kitchen presses: a standing coffee press and a lying garlic press."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import box, chords, cylinder, lathe, prism, rectangle, rounded, union
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.vessel import ear, shell
from manitwin.models.generators.templates.template import Model, template


@template("french press")
def french_press(*, height_m: float, width: float, knob: float, spout: float, wall_m: float) -> Model:
    """Build a coffee press with its plunger up: a glass in a frame, with spout towards -X and handle towards +X.

    ``knob`` is the share of the height by which rod and knob protrude from the lid, ``spout`` the lip's length relative to the
    radius.
    """
    r, top = 0.5 * width * height_m, (1 - knob) * height_m
    h, foot = 0.9 * top, 0.035 * top
    model, bar = Model(), 0.004
    profile = rounded([(0.94 * r, foot), (0.97 * r, foot + 0.004), (0.97 * r, h)], 0.004)
    outer, inner = shell(profile, wall_m, 1.5 * wall_m)
    lip = np.array([[-0.5 * r, 0, 0.83 * h], [-r, 0, 0.93 * h], [-(1 + spout) * r, 0, 0.99 * h]])
    thick = np.array([0.36, 0.33, 0.2]) * r
    model.add("body", outer).add("spout", tube(lip, thick, flatten=0.6))
    model.cut("inside", inner)
    model.cut(
        "inside", tube(np.vstack([lip, 2 * lip[-1] - lip[-2]]), np.append(thick, thick[-1]) - wall_m, flatten=0.6)
    )
    for level in (0.05, 0.74):
        band = cylinder(r + 0.0012, 0.07 * h, sides=chords(64)) - cylinder(0.965 * r, h).translate((0, 0, -0.1 * h))
        model.add("frame", band.translate((0, 0, level * h + foot)), "frame")
    for number in range(4):
        leg = box(0.003, 0.14 * r, 0.82 * h, radius_m=0.001).translate((r + 0.0005, 0, 0))
        model.add("frame", leg.rotate((0, 0, 45 + 90 * number)), "frame")
    name, grip = ear(model, r, 0.8 * h + foot, 0.1 * h + foot, 0.6 * r, 0.018)
    model.add(name, grip, "handle")
    cover = [(0, 0.965 * h), (0.93 * r, 0.965 * h), (0.93 * r, h), (1.06 * r, h), (1.06 * r, h + 0.012)]
    cover += [(0.8 * r, 0.985 * top), (0.3 * r, top), (0, top)]
    model.add("lid", lathe(rounded(cover, 0.005)), "frame")
    ball = 0.2 * r
    model.add("rod", cylinder(bar * 0.6, knob * height_m).translate((0, 0, top - 0.002)), "frame")
    bulb = [
        (0, height_m - 2 * ball),
        (0.5 * ball, height_m - 2 * ball),
        (ball, height_m - 1.2 * ball),
        (ball, height_m - 0.6 * ball),
    ]
    model.add("knob", lathe(rounded([*bulb, (0.6 * ball, height_m), (0, height_m)], 0.5 * ball)), "handle")
    model.region("base", "frame", lambda centers: centers[:, 2] < 0.001)
    model.point("spout", "tip", "spout", (float(lip[-1, 0]), 0.0, float(lip[-1, 2]) - 0.12 * r), (-0.85, 0.0, 0.53))
    return model.point("knob", "button", "knob", (0.0, 0.0, height_m), (0.0, 0.0, 1.0))


@template("garlic press")
def garlic_press(*, length_m: float, spread: float, chamber_m: float) -> Model:
    """Build a garlic press resting on its chamber, which is at +X with its holes below, with two handles towards -X.

    ``spread`` is the distance between the ends of the handles relative to the length.
    """
    end, r, deep = 0.5 * length_m, 0.5 * chamber_m, 0.024
    at, wall = end - 0.022 - r, 0.0016

    def oval(inset_m: float, low_m: float, high_m: float) -> Manifold:
        outline = rectangle(2.1 * r - 2 * inset_m, 1.7 * r - 2 * inset_m, radius_m=0.75 * r)
        return prism(outline, high_m - low_m).translate((at, 0, low_m))

    model = Model().add("chamber", oval(0, 0, deep)).add("chamber", oval(-0.0018, deep - 0.0025, deep))
    model.cut("inside", oval(wall, 1.3 * wall, deep + 0.001))
    pitch = 0.0043
    places = [(u * pitch, v * pitch) for u in range(-4, 5) for v in range(-4, 5)]
    holes = [
        cylinder(0.0011, 0.01, sides=10).translate((at + u, v, -0.005))
        for u, v in places
        if np.hypot(u / (1.05 * r - 0.004), v / (0.85 * r - 0.004)) < 1.0
    ]
    model.perforate("holes", lambda: union(holes))
    apart, low = spread * length_m, 0.0048
    hinge = (end - 0.0065, 0.0, deep + 0.0025)
    lower = arc(
        [(at - 0.95 * r, 0, 0.8 * deep), (at - 1.6 * r, 0, 0.74 * deep), (-0.1 * end, 0, 0.4 * deep), (-end, 0, low)]
    )
    lift = apart + low
    upper = arc(
        [hinge, (at, 0, deep + 0.022), (0.1 * end, 0, 0.5 * (deep + 0.024 + lift)), (-end, 0, lift)], samples=30
    )
    for path in (lower, upper):
        wide = np.interp(np.linspace(0, 1, len(path)), [0, 0.3, 0.6, 0.95, 1], [0.0048, 0.0055, 0.0078, 0.0082, 0.004])
        model.add("handle", tube(path, wide, flatten=0.58), "handle")
    lug = box(0.03, 0.011, 0.007, radius_m=0.002).translate((end - 0.015, 0, deep - 0.0045))
    model.add("joint", union([lug, box(0.012, 0.017, 0.012, radius_m=0.003).translate((hinge[0], 0, deep - 0.004))]))
    model.add(
        "joint", cylinder(0.0026, 0.0195, sides=24).translate((0, 0, -0.00975)).rotate((90, 0, 0)).translate(hinge)
    )
    stamp = oval(wall + 0.0011, 0.55 * deep, deep + 0.002)
    stem = box(0.009, 0.007, 0.024).translate((at, 0, deep - 0.002))
    model.add("plunger", stamp + stem)
    grip = upper[21]
    model.point("holes", "face", "chamber", (at, 0.85 * r - 0.0015, 0.0), (0.0, 0.0, -1.0))
    model.point("chamber", "surface", "chamber", (at, -0.85 * r, 0.5 * deep), (0.0, -1.0, 0.0))
    place = (float(grip[0]), 0.0, float(grip[2]) + 0.0046)
    return model.point("handles", "surface", "handle", place, (0.0, 0.0, 1.0)).rest_on_ground()
