"""Small foods and a pizza. Long ones lie along X with the stem end towards +X."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import box, chords, cylinder, ellipsoid, lathe, rounded
from manitwin.geometry.solids.sweep import tube
from manitwin.models.generators.templates.catalog.organic import lay_along_x, smooth_revolution, stalk
from manitwin.models.generators.templates.catalog.vessel import smooth_profile
from manitwin.models.generators.templates.template import Model, template


@template("chili pepper")
def chili_pepper(*, length_m: float, width: float, bend: float, stem_m: float) -> Model:
    """Build a lying chili with its stem towards +X.

    ``bend`` is the displacement of its bent tip relative to the length.
    """
    n, r = length_m, 0.5 * width * length_m
    along = np.linspace(0, 1, 40)
    half = r * np.interp(along, [0, 0.03, 0.2, 0.6, 0.9, 0.98, 1.0], [0.06, 0.16, 0.5, 0.9, 1.0, 0.8, 0.5])
    path = np.column_stack([(along - 0.5) * n, bend * n * (1 - along) ** 2, 0 * along])
    model = Model().add("body", tube(path, half, sides=chords(24)))
    calyx = lay_along_x(cylinder(0.62 * r, 0.05 * n + 0.002, top_radius_m=0.3 * r, sides=chords(20)))
    model.add("calyx", calyx.translate((0.49 * n, 0, 0)), "stem")
    tip = (0.5 * n + stem_m, -0.12 * stem_m, 0.0)
    model.add(
        "stem",
        stalk([(0.5 * n, 0, 0), (0.5 * n + 0.5 * stem_m, 0, 0), tip], 0.26 * r + 0.0008, 0.2 * r + 0.0006),
        "stem",
    )
    model.region("tip", "body", lambda centers: centers[:, 0] < -0.4 * n)
    model.point("stem", "tip", "stem", tip, (1.0, 0.0, 0.0))
    return model.point(
        "body",
        "surface",
        "body",
        (0.2 * n, float(np.interp(0.7, along, path[:, 1])), float(np.interp(0.7, along, half))),
        (0.0, 0.0, 1.0),
    ).rest_on_ground()


@template("grape")
def grape(*, length_m: float, width: float, stem_m: float) -> Model:
    """Build a lying grape with the rest of its stalk towards +X."""
    n, y = length_m, width * length_m
    model = Model().add("body", ellipsoid(n, y, y))
    end = 0.5 * n + stem_m
    model.add("stem", stalk([(0.47 * n, 0, 0), (0.5 * n, 0, 0), (end, 0, 0)], 0.0011, 0.0009), "stem")
    model.point("stem end", "tip", "stem", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("side", "surface", "body", (0.0, -0.5 * y, 0.0), (0.0, -1.0, 0.0)).rest_on_ground()


@template("blueberry")
def blueberry(*, width_m: float, tall: float, crown: float) -> Model:
    """Build a blueberry with its crown on top; ``crown`` is its width relative to the berry's."""
    r, h = 0.5 * width_m, tall * width_m
    profile = [
        (0, 0.0),
        (0.34, 0.02),
        (0.74, 0.16),
        (0.98, 0.42),
        (0.98, 0.6),
        (0.78, 0.86),
        (0.42, 0.98),
        (0.2, 1.0),
        (0, 1.0),
    ]
    model = Model().add("body", smooth_revolution(profile, width_m, h))
    wide = crown * r
    rim = cylinder(0.9 * wide, 0.1 * h, top_radius_m=1.1 * wide, sides=10) - cylinder(
        0.62 * wide, 0.2 * h, sides=chords(16)
    )
    model.add("crown", rim.translate((0, 0, 0.95 * h)), "crown")
    model.point("crown", "surface", "crown", (0.0, -0.95 * wide, 1.03 * h), (0.0, -0.3, 0.954))
    return model.point("side", "surface", "body", (0.0, -r, 0.5 * h), (0.0, -1.0, 0.0)).rest_on_ground()


@template("snack bar")
def snack_bar(*, length_m: float, width: float, thick: float, crimp: float) -> Model:
    """Build a lying bar in its wrapper; the flat crimped ends take ``crimp`` of the length."""
    n, y, t = length_m, width * length_m, thick * length_m
    inner = (1 - 2 * crimp) * n
    pillow = box(inner, 0.92 * y, t, radius_m=0.4 * t)
    edges = [
        box(0.002, y, 0.0012).translate((side * 0.5 * (inner + 0.5 * crimp * n), 0, 0.5 * t - 0.0006))
        for side in (-1.0, 1.0)
    ]
    model = Model().add("body", Manifold.batch_hull([pillow, *edges]))
    for side in (-1.0, 1.0):
        end = box(crimp * n, y, 0.0012).translate((side * 0.5 * (n - crimp * n), 0, 0.5 * t - 0.0006))
        model.add("ends", end, "ends")
    model.point("front", "face", "body", (0.0, 0.0, t), (0.0, 0.0, 1.0))
    return model.point("end", "edge", "ends", (0.5 * n, 0.0, 0.5 * t), (1.0, 0.0, 0.0)).rest_on_ground()


@template("pizza")
def pizza(*, width_m: float, thick: float, rim: float, slices: float) -> Model:
    """Build a lying pizza with a raised ``rim`` around a topping with nine round slices.

    ``rim`` and the radius of a slice, ``slices``, are relative to the pizza's radius.
    """
    r, t = 0.5 * width_m, thick * width_m
    side = [
        (0.0, 0.0),
        (0.97 * r, 0.0),
        (r, 0.4 * t),
        ((1 - 0.4 * rim) * r, t),
        ((1 - rim) * r, 0.62 * t),
        (0.0, 0.6 * t),
    ]
    model = Model().add("body", lathe(rounded(side, 0.35 * t)))
    model.add("topping", cylinder((1 - 0.9 * rim) * r, 0.1 * t).translate((0, 0, 0.56 * t)), "topping")
    disk = slices * r
    for number in range(9):
        out = 0.0 if number == 0 else (0.4 if number % 2 else 0.62) * r
        a = 0.785 * number
        model.add(
            "slices",
            cylinder(disk, 0.12 * t, sides=chords(28)).translate((out * np.cos(a), out * np.sin(a), 0.6 * t)),
            "slices",
        )
    model.region("crust", "body", lambda centers: np.hypot(centers[:, 0], centers[:, 1]) > (1 - rim) * r)
    model.point("front", "face", "slices", (0.0, 0.0, 0.72 * t), (0.0, 0.0, 1.0))
    return model.point("edge", "edge", "crust", (0.0, -r, 0.4 * t), (0.0, -1.0, 0.0))


@template("burrito")
def burrito(*, length_m: float, width: float, foil: float) -> Model:
    """Build a lying wrap whose lower end towards -X is in foil up to ``foil`` of the length."""
    n, r = length_m, 0.5 * width * length_m
    side = smooth_profile([(0.86 * r, -0.5 * n), (0.98 * r, -0.25 * n), (r, 0.1 * n), (0.9 * r, 0.47 * n)])
    model = Model().add(
        "body", lay_along_x(lathe(rounded([(0.0, -0.5 * n), *side, (0.6 * r, 0.5 * n), (0.0, 0.5 * n)], 0.2 * r)))
    )
    edge = (foil - 0.5) * n
    wrap = smooth_profile([(0.88 * r, -0.505 * n), (1.01 * r, -0.25 * n), (1.03 * r, edge)])
    model.add("foil", lay_along_x(lathe([(0.0, -0.505 * n), *wrap, (0.0, edge)])), "foil")
    model.point("end", "face", "body", (0.5 * n, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("upper side", "surface", "body", (0.2 * n, 0.0, 0.97 * r), (0.0, 0.0, 1.0)).rest_on_ground()
