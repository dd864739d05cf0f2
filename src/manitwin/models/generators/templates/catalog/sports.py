"""Things to play with: standing where they stand, lying where they lie, a handle towards -X."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import box, cylinder, lathe
from manitwin.models.generators.templates.catalog.hand_tools import grip
from manitwin.models.generators.templates.catalog.vessel import bulge
from manitwin.models.generators.templates.template import Model, template


@template("bowling pin")
def bowling_pin(*, height_m: float, width: float, neck: float, head: float) -> Model:
    """Build a pin with a belly, a ``neck`` and a round ``head``, both over the belly's width."""
    h, r = height_m, 0.5 * width * height_m
    side = [(0.47 * r, 0.0), (0.86 * r, 0.15 * h), (r, 0.3 * h), (0.76 * r, 0.5 * h), (neck * r, 0.68 * h)]
    crown = np.linspace(0.0, 0.5 * np.pi, 6)
    ball = 1.0 - head * r / h  # where the head is broadest, its upper half round
    profile = bulge([*side, (head * r, ball * h)], rows=12)
    profile += [(head * r * float(np.cos(a)), (ball + (1 - ball) * float(np.sin(a))) * h) for a in crown[1:]]
    model = Model().add("body", lathe(profile))
    levels = np.linspace(0.64, 0.73, 7) * h
    band = np.interp(levels, [z for _, z in profile], [radius for radius, _ in profile]) + 0.0004
    model.add("neck", lathe(np.stack([band, levels], axis=1)), "stripes")
    model.region("base", "body", lambda centers: centers[:, 2] < 0.001 * h)
    model.point("neck", "surface", "neck", (0.0, -neck * r - 0.0004, 0.68 * h), (0.0, -1.0, 0.0))
    model.point("head", "surface", "body", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("table tennis paddle")
def table_tennis_paddle(*, length_m: float, blade: float, width: float, thick_m: float) -> Model:
    """Build a paddle that lies, its handle towards -X, with rubber on both sides; ``blade`` and ``width`` over the length."""
    long, across = blade * length_m, width * length_m
    at = 0.5 * (length_m - long)
    wood = cylinder(0.5, thick_m).scale((long, across, 1)).translate((at, 0, -0.5 * thick_m))
    model = Model().add("blade", wood)
    edge = at - 0.36 * long
    trimmed = box(length_m, across, 0.1).translate((edge + 0.5 * length_m, 0, -0.05))
    for side in (-1.0, 1.0):
        sheet = cylinder(0.5, 0.002).scale((0.985 * long, 0.985 * across, 1))
        sheet = sheet.translate((at, 0, side * (0.5 * thick_m + 0.0008) - 0.001))
        name = "forehand" if side > 0 else "backhand"
        model.add(name, sheet ^ trimmed, name)
    start, end = -0.5 * length_m, edge + 0.004
    model.add("handle", grip(start, end, 0.0145, flatten=0.78, swell=0.06), "handle")
    top = 0.5 * thick_m + 0.0018
    model.point("forehand", "face", "forehand", (at, 0.0, top), (0.0, 0.0, 1.0))
    model.point("handle", "surface", "handle", (0.5 * (start + end), 0.0, 0.0119), (0.0, 0.0, 1.0))
    return model.laid()
