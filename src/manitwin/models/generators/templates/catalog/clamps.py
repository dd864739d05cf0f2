"""Lying clamps: one closed by a spring, and one closed by a screw."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import (
    chords,
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


@template("clamp")
def spring_clamp(*, length_m: float, spread: float, thick: float, reach: float) -> Model:
    """Build a closed spring clamp with padded jaws towards +X and handles towards -X, ``spread`` of the length apart.

    ``thick`` is its thickness and ``reach`` the length of the jaws from the spring to their tips, both relative to the length.
    """
    n, z, end, half = length_m, thick * length_m, 0.5 * length_m, 0.5 * spread * length_m
    joint = end - reach * length_m
    coil = 0.085 * n
    model = Model().add(
        "spring", lathe(rounded([(0, -0.5 * z), (coil, -0.5 * z), (coil, 0.5 * z), (0, 0.5 * z)], 0.15 * z)), "spring"
    )
    model.cut("bore", cylinder(0.45 * coil, 2 * z, sides=chords(32)).translate((0, 0, -z)), "spring")
    model = Model(model.assembly.moved((joint, 0.0, 0.0)), dict(model.slots))
    for side in (1.0, -1.0):
        inner = [
            (joint, 0.5 * coil),
            (0.5 * (joint + end), 0.075 * n),
            (end - 0.1 * n, 0.042 * n),
            (end - 0.045 * n, 0.03 * n),
        ]
        outer = [
            (end - 0.035 * n, 0.062 * n),
            (end - 0.12 * n, 0.098 * n),
            (0.5 * (joint + end), 0.145 * n),
            (joint, 0.135 * n),
        ]
        jaw = polygon([(x, side * y) for x, y in [*inner, *outer]][:: int(side)], radius_m=0.006 * n)
        model.add("jaws", prism(jaw, 0.84 * z, radius_m=0.035 * z).translate((0, 0, -0.42 * z)))
        bend = [
            (joint + 0.05 * n, side * 0.1 * n, 0),
            (joint - 0.04 * n, side * 0.11 * n, 0),
            (-0.45 * end, side * 0.86 * half, 0),
        ]
        path = arc([*bend, (-0.8 * end, side * half, 0), (-end, side * 1.02 * half, 0)], samples=28)
        wide = np.interp(np.linspace(0, 1, 28), [0, 0.2, 0.6, 0.94, 1], [0.034, 0.034, 0.036, 0.034, 0.02]) * n
        model.add("handle", tube(path, wide, flatten=0.5 * z / (0.036 * n) * 0.96, across=(0, 1, 0)))
        sleeve = tube(path[17:], 1.08 * wide[17:], flatten=0.5 * z / (0.036 * n), across=(0, 1, 0))
        model.add("grips", sleeve, "pads")
        pad = prism(rectangle(0.085 * n, 0.036 * n, radius_m=0.01 * n), 0.96 * z, radius_m=0.03 * z)
        lean = side * -9.0
        model.add("pads", pad.rotate((0, 0, lean)).translate((end - 0.0425 * n, side * 0.0185 * n, -0.48 * z)), "pads")
    model.point("jaws", "tip", "pads", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    model.point("spring joint", "surface", "spring", (joint, 0.7 * coil, 0.5 * z), (0.0, 0.0, 1.0))
    place = (-0.8 * end, half + 0.036 * n, 0.0)
    return model.point("handles", "surface", "grips", place, (0.0, 1.0, 0.0)).rest_on_ground()


@template("c clamp")
def c_clamp(*, opening_m: float, throat: float, bar_m: float) -> Model:
    """Build a clamp lying on its side, with the fixed jaw towards +X and the screw along X through the other arm.

    ``opening_m`` is the distance from jaw to boss, ``throat`` the depth of the frame relative to it, and ``bar_m`` the width of
    the frame's bar.
    """
    gap, deep, thick = opening_m, throat * opening_m, 0.8 * bar_m
    right, left = 0.5 * gap, -0.5 * gap
    outer = [(left - bar_m, 0.5 * bar_m), (left - bar_m, -0.6 * bar_m), (left, -0.6 * bar_m), (left, deep - bar_m)]
    outer += [
        (right, deep - bar_m),
        (right, -0.6 * bar_m),
        (right + 0.8 * bar_m, -0.6 * bar_m),
        (right + 0.8 * bar_m, 0.0),
    ]
    outer += [(right + 1.1 * bar_m, deep - 0.7 * bar_m), (right + 0.4 * bar_m, deep), (left - 0.4 * bar_m, deep)]
    outer += [(left - 1.3 * bar_m, deep - 0.7 * bar_m)]
    frame = prism(polygon(outer, radius_m=0.0025), thick, radius_m=0.0025).translate((0, 0, -0.5 * thick))
    model = Model().add("frame", frame, "frame")
    r, boss = 0.3 * bar_m, 0.52 * bar_m
    model.add("frame", cylinder(boss, 1.1 * bar_m).rotate((0, 90, 0)).translate((left - 1.1 * bar_m, 0, 0)), "frame")
    jaw = cylinder(0.5 * bar_m, 0.4 * bar_m).rotate((0, 90, 0)).translate((right - 0.3 * bar_m, 0, 0))
    model.add("jaw", jaw, "frame")
    start, end = left - 1.05 * gap - bar_m, left + 0.32 * gap
    ridges = [(0.0, start)]
    for number in range(28):
        z = start + (end - start) * (number + 0.5) / 28
        ridges += [(0.88 * r, z - 0.3 * (end - start) / 28), (r, z)]
    screw = lathe([*ridges, (0.88 * r, end), (0.0, end)]).rotate((0, 90, 0))
    pad = cylinder(0.62 * bar_m, 0.32 * bar_m, top_radius_m=0.55 * bar_m).rotate((0, 90, 0))
    model.add("screw", screw, "screw").add("pad", pad.translate((end - 0.05 * bar_m, 0, 0)), "screw")
    across = 0.85 * deep
    bar = cylinder(0.2 * bar_m, across).rotate((90, 0, 0)).translate((start + 0.3 * bar_m, 0.5 * across, 0))
    model.add("handle", cylinder(0.5 * bar_m, 0.6 * bar_m).rotate((0, 90, 0)).translate((start, 0, 0)), "screw")
    model.add("handle", bar, "screw")
    for side in (-1.0, 1.0):
        model.add(
            "handle",
            ellipsoid(0.62 * bar_m, 0.62 * bar_m, 0.62 * bar_m).translate(
                (start + 0.3 * bar_m, side * 0.5 * across, 0)
            ),
            "screw",
        )
    model.point("fixed jaw", "face", "jaw", (right - 0.3 * bar_m, 0.0, 0.0), (-1.0, 0.0, 0.0))
    model.point("pad", "face", "pad", (end + 0.27 * bar_m, 0.0, 0.0), (1.0, 0.0, 0.0))
    model.point("handle", "surface", "handle", (start + 0.3 * bar_m, -0.3 * across, 0.2 * bar_m), (0.0, 0.0, 1.0))
    return model.point(
        "frame", "surface", "frame", (0.0, deep - 0.5 * bar_m, 0.5 * thick), (0.0, 0.0, 1.0)
    ).rest_on_ground()
