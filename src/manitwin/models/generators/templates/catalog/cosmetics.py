"""Cosmetics: small closed containers that stand with the front towards -Y."""

from __future__ import annotations

from manitwin.geometry.solids.shapes import box, cylinder, lathe, prism, rectangle, rounded
from manitwin.models.generators.templates.template import Model, template


@template("lipstick")
def lipstick(*, height_m: float, width: float, case: float, stick: float) -> Model:
    """Build an open lipstick: a ``case``, a narrower sleeve and an obliquely cut ``stick``, as shares of the height."""
    h, r = height_m, 0.5 * width * height_m
    low, high = case * h, (1 - stick) * h
    model = Model().add("case", lathe(rounded([(0.0, 0.0), (r, 0.0), (r, low), (0.0, low)], 0.001)))
    model.add("sleeve", cylinder(0.86 * r, high - low + 0.001).translate((0, 0, low - 0.001)), "sleeve")
    bullet = cylinder(0.7 * r, h - high + 0.001).translate((0, 0, high - 0.001))
    slope = box(8 * r, 8 * r, 8 * r).rotate((38, 0, 0)).translate((0, 0.7 * r, h))
    model.add("stick", bullet - slope, "stick")
    model.region("base", "case", lambda centers: centers[:, 2] < 0.005 * h)
    model.region("tip", "stick", lambda centers: centers[:, 2] > h - 1.2 * r)
    model.point("case", "surface", "case", (0.0, -r, 0.5 * low), (0.0, -1.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("nail polish bottle")
def nail_polish_bottle(*, height_m: float, width: float, body: float, cap: float) -> Model:
    """Build a short bottle with a long, slim cap.

    ``body`` is relative to the height, ``cap`` to the width.
    """
    h, r = height_m, 0.5 * width * height_m
    top, c = body * h, cap * 0.5 * width * height_m
    neck = 0.06 * h
    profile = [(0.0, 0.0), (r, 0.0), (r, 0.8 * top), (0.8 * c, top), (0.8 * c, top + neck)]
    model = Model().add("body", lathe(rounded(profile, 0.2 * r)))
    lid = [(0.0, top + 0.3 * neck), (c, top + 0.3 * neck), (0.84 * c, h), (0.0, h)]
    model.add("cap", lathe(rounded(lid, 0.0015)), "cap")
    model.region("base", "body", lambda centers: centers[:, 2] < 0.01 * h)
    model.point("cap", "surface", "cap", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("perfume bottle")
def perfume_bottle(*, height_m: float, width: float, depth: float, body: float, cap: float) -> Model:
    """Build a flat glass flask with a cap; ``depth`` and ``cap`` are relative to the width, the rest to the height."""
    h, wide = height_m, width * height_m
    deep, top = depth * wide, body * h
    model = Model().add("body", prism(rectangle(wide, deep, radius_m=0.16 * deep), top, radius_m=0.06 * deep))
    across = min(cap * wide, 0.92 * deep)
    collar = cylinder(0.42 * across, 0.05 * h + 0.002).translate((0, 0, top - 0.001))
    model.add("collar", collar, "collar")
    lid = cylinder(0.5 * across, h - top - 0.03 * h)
    model.add("cap", lid.translate((0, 0, top + 0.03 * h)), "cap")
    model.region("base", "body", lambda centers: centers[:, 2] < 0.005 * h)
    model.region("front", "body", lambda centers: centers[:, 1] < -0.499 * deep)
    model.point("cap", "surface", "cap", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    model.point("front", "face", "front", (0.0, -0.5 * deep, 0.5 * top), (0.0, -1.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
