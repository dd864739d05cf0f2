"""Shallow open things to bake on and to keep soap in: standing, their longer side along X."""

from __future__ import annotations

import numpy as np
from manifold3d import CrossSection

from manitwin.geometry.solids.shapes import SIDES, box, chords, polygon, prism, rectangle
from manitwin.models.generators.templates.template import Model, template


@template("baking tray")
def baking_tray(*, length_m: float, width: float, height: float, lip: float) -> Model:
    """Build a tray of sheet with flaring walls and a flat ``lip`` all around, a share of the length."""
    sheet, flare, across, high, edge = 0.0012, 0.9, width * length_m, height * length_m, lip * length_m
    long, wide = length_m - 2 * edge, across - 2 * edge
    corner, top = 0.06 * wide, high - 1.5 * sheet
    outer = prism(rectangle(flare * long, flare * wide, radius_m=corner), high, top=1 / flare)
    inner = prism(rectangle(flare * long - 2 * sheet, flare * wide - 2 * sheet, radius_m=corner), high, top=1 / flare)
    rim = prism(rectangle(length_m, across, radius_m=corner + edge), 1.5 * sheet).translate((0, 0, top))
    model = Model().add("body", outer).add("rim", rim).cut("inside", inner.translate((0, 0, sheet)))
    model.region("base", "body", lambda centers: centers[:, 2] < 0.1 * sheet)
    model.point("inside", "face", "inside", (0.0, 0.0, sheet), (0.0, 0.0, 1.0))
    for side in (-0.5, 0.5):
        model.point("rim", "edge", "rim", (side * length_m, 0.0, top + 0.75 * sheet), (2 * side, 0.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


def _oval(x_m: float, y_m: float) -> CrossSection:
    """Return a rectangle whose shorter sides are half circles."""
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, chords(SIDES) // 2)
    right = np.stack([0.5 * (x_m - y_m) + 0.5 * y_m * np.cos(turn), 0.5 * y_m * np.sin(turn)], axis=1)
    return polygon(np.concatenate([right, -right]))


@template("soap dish")
def soap_dish(*, length_m: float, width: float, height: float, wall_m: float) -> Model:
    """Build an oval dish with ribs on its floor and holes that water runs off through."""
    across, high = width * length_m, height * length_m
    outline, hollow = _oval(length_m, across), _oval(length_m - 2 * wall_m, across - 2 * wall_m)
    floor = 1.6 * wall_m
    model = Model().add("body", prism(outline, high, radius_m=0.25 * wall_m))
    model.cut("inside", prism(hollow, high).translate((0, 0, floor)))
    for place in np.linspace(-0.26, 0.26, 5):
        rib = box(0.004, 0.66 * across, 0.3 * high, radius_m=0.0015).translate(
            (float(place) * length_m, 0, floor - 0.001)
        )
        model.add("ribs", rib)
    for place in np.linspace(-0.195, 0.195, 4):
        hole = box(0.004, 0.4 * across, 0.1, radius_m=0.0015).translate((float(place) * length_m, 0, -0.05))
        model.cut("holes", hole)
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: centers[:, 2] > 0.97 * high)
    model.region("base", "body", lambda centers: centers[:, 2] < 0.02 * high)
    model.point("ribs", "face", "ribs", (0.0, 0.0, floor - 0.001 + 0.3 * high), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.3 * length_m, 0.0, 0.0), (0.0, 0.0, -1.0))
