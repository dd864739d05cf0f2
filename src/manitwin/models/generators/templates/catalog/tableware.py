"""Tableware besides dishes: for sugar, milk, sauce, butter, napkins and toothpicks. Spouts point to -X."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import box, chords, cylinder, lathe, polygon, prism, rectangle, rounded, union
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.vessel import assemble_from_profile, shell, smooth_profile
from manitwin.models.generators.templates.template import Model, template


@template("sugar bowl")
def sugar_bowl(*, height_m: float, width: float, foot: float, mouth: float, wall_m: float) -> Model:
    """Build a bowl without its lid, with two handles along X; ``foot`` and ``mouth`` are widths relative to its belly's."""
    h, r, model = height_m, 0.5 * width * height_m, Model()
    side = [(0.92 * r, 0.22 * h), (r, 0.5 * h), (0.5 * (1.02 + mouth) * r, 0.82 * h), (mouth * r, h)]
    thick, ears = 0.06 * r + 0.0016, []
    path = arc([(0.8 * r, 0, 0.8 * h), (1.3 * r, 0, 0.8 * h), (1.36 * r, 0, 0.56 * h), (0.95 * r, 0, 0.4 * h)])
    far = path[int(path[:, 0].argmax())]
    for sign, turn in ((1.0, 0.0), (-1.0, 180.0)):
        ears.append(("handle", tube(path, thick, flatten=0.75).rotate((0, 0, turn))))
        model.point(
            "handle", "surface", "handle", (sign * float(far[0] + 0.75 * thick), 0.0, float(far[2])), (sign, 0.0, 0.0)
        )
    return assemble_from_profile(model, smooth_profile([(foot * r, 0.0), *side]), wall_m, 1.5 * wall_m, *ears)


def _oval_jug(
    outer_profile: list[tuple[float, float]], wall_m: float, floor_m: float, *, long: float, lip: float, handle: float
) -> Model:
    """Build an oval jug: a body of the given profile, ``long`` times as long as wide, with a lip and a handle opposite."""
    model, h = Model(), outer_profile[-1][1]
    r = max(radius for radius, _ in outer_profile)
    outer, inner = shell(outer_profile, wall_m, floor_m)

    def pulled(vertices: np.ndarray) -> np.ndarray:
        x, y, z = vertices.T
        high = np.clip(z / h - 0.45, 0.0, None) / 0.55
        ahead = np.clip(-x / r, 0.0, None)
        narrow = 1 - 0.45 * np.minimum(high, 1.0) * ahead**2
        return np.column_stack(
            [
                long * x - lip * r * np.minimum(high, 1.2) ** 1.5 * ahead**3,
                y * narrow,
                z + 0.3 * lip * r * high**2 * ahead**3,
            ]
        )

    model.add("body", outer.refine(2).warp_batch(pulled))
    wall = max(radius for radius, z in outer_profile if z > 0.85 * h)
    z_high, z_low, thick = 0.9 * h, 0.34 * h, max(0.0035, 0.055 * r)
    at_high, at_low = (long * float(np.interp(z, *np.array(outer_profile).T[::-1])) for z in (z_high, z_low))
    out = long * r + handle * r
    bend = [
        (at_high - 0.6 * thick, 0, z_high),
        (at_high + 0.55 * (out - at_high), 0, 1.04 * h),
        (out, 0, 0.86 * h),
        (out, 0, 0.62 * h),
    ]
    path = arc([*bend, (0.5 * (out + at_low), 0, 0.36 * h), (at_low - 0.6 * thick, 0, z_low)], samples=32)
    model.add("handle", tube(path, thick, flatten=0.75), "handle").cut("inside", inner.refine(2).warp_batch(pulled))
    far = int(path[:, 0].argmax())
    model.point(
        "handle", "surface", "handle", (float(path[far, 0]) + 0.75 * thick, 0.0, float(path[far, 2])), (1.0, 0.0, 0.0)
    )
    for part in ("body", "inside"):
        model.region("rim", part, lambda c: (c[:, 2] > 0.95 * h) & (c[:, 0] > -0.92 * long * wall))
        model.region("spout", part, lambda c: (c[:, 2] > 0.62 * h) & (c[:, 0] < -0.92 * long * wall))
    model.region("base", "body", lambda c: c[:, 2] < 0.02 * h)
    tip = pulled(np.array([[-outer_profile[-1][0], 0.0, h]]))[0]
    model.point("spout", "tip", "spout", (float(tip[0]), 0.0, float(tip[2])), (-0.8, 0.0, 0.6))
    model.point("opening", "opening", "rim", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)).rest_on_ground()


@template("milk pourer")
def milk_pourer(*, height_m: float, width: float, lip: float, handle: float, wall_m: float) -> Model:
    """Build a small milk jug; ``lip`` and ``handle`` are how far they protrude relative to half its width."""
    h, r = height_m, 0.5 * width * height_m
    profile = smooth_profile([(0.7 * r, 0.0), (0.97 * r, 0.16 * h), (r, 0.36 * h), (0.78 * r, 0.72 * h), (0.8 * r, h)])
    return _oval_jug(profile, wall_m, 1.5 * wall_m, long=1.0, lip=lip, handle=handle)


@template("gravy boat")
def gravy_boat(*, height_m: float, width: float, long: float, lip: float, handle: float, wall_m: float) -> Model:
    """Build a sauce boat; ``long`` is its length relative to its width.

    ``lip`` and ``handle`` are how far they protrude relative to half the width.
    """
    h, r = height_m, 0.5 * width * height_m
    profile = smooth_profile([(0.5 * r, 0.0), (0.46 * r, 0.1 * h), (0.84 * r, 0.36 * h), (0.97 * r, 0.68 * h), (r, h)])
    return _oval_jug(profile, wall_m, 0.14 * h, long=long, lip=lip, handle=handle)  # solid up to its waist


@template("butter dish")
def butter_dish(*, length_m: float, width: float, height: float, wall_m: float) -> Model:
    """Build a filled oblong dish with its cover and a knob; ``width`` and ``height`` are shares of the length."""
    w, h = width * length_m, height * length_m
    plate = prism(rectangle(length_m, w, radius_m=0.16 * w), 0.2 * h, radius_m=0.045 * h)
    well = prism(rectangle(length_m - 6 * wall_m, w - 6 * wall_m, radius_m=0.1 * w), h).translate((0, 0, 0.11 * h))
    model = Model().add("base", plate - well)
    x, y, low = length_m - 8.5 * wall_m, w - 8.5 * wall_m, 0.1 * h
    top = 0.84 * h
    cover = prism(rectangle(x, y, radius_m=0.2 * y), top - low, radius_m=0.06 * h)
    model.add("body", cover.translate((0, 0, low)), "cover")
    knob = [
        (0, top - 0.002),
        (0.05 * w, top - 0.002),
        (0.045 * w, top + 0.05 * h),
        (0.09 * w, top + 0.1 * h),
        (0.07 * w, h),
        (0, h),
    ]
    model.add("lid", lathe(rounded(knob, 0.003)), "cover")
    model.point("lid", "surface", "lid", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    model.point("body", "surface", "body", (0.0, -0.5 * y, 0.45 * h), (0.0, -1.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("napkin holder")
def napkin_holder(*, length_m: float, height: float, gap: float, wall_m: float) -> Model:
    """Build two upright walls with rounded upper corners on a floor; ``height`` and ``gap`` are relative to the length."""
    h, deep = height * length_m, gap * length_m
    model = Model().add("base", box(length_m, deep + 2 * wall_m, wall_m, radius_m=0.3 * wall_m))
    turn = np.linspace(0.0, np.pi, 25)
    bow = [(0.5 * length_m * float(np.cos(a)), 0.45 * h + 0.55 * h * float(np.sin(a))) for a in turn]
    wall = prism(polygon([(-0.5 * length_m, 0.0), (0.5 * length_m, 0.0), *bow]), wall_m).rotate((90, 0, 0))
    for side in (1.0, -1.0):
        model.add("body", wall.translate((0, side * 0.5 * (deep + wall_m) + 0.5 * wall_m, 0)))
    inner = 0.5 * deep + 1e-5
    model.region("inside", "body", lambda c: np.abs(c[:, 1]) < inner)
    model.region("inside", "base", lambda c: (c[:, 2] > 0.9 * wall_m) & (np.abs(c[:, 1]) < inner))
    model.point("opening", "opening", "inside", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    model.point("inside", "surface", "inside", (0.0, 0.0, wall_m), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("utensil holder")
def utensil_holder(*, height_m: float, width: float, taper: float, wall_m: float) -> Model:
    """Build a crock for kitchen tools with two bands; ``taper`` is its foot's width relative to its mouth's."""
    h, r = height_m, 0.5 * width * height_m
    profile = rounded([(0.96 * taper * r, 0.0), (taper * r, 0.006), (r, h)], 0.005)
    model = Model()
    model = assemble_from_profile(model, profile, wall_m, 1.4 * wall_m)
    for share in (0.16, 0.86):
        wide = r * (taper + (1 - taper) * share)
        ring = lathe(
            [
                (wide - 0.5 * wall_m, share * h),
                (wide + 0.0015, share * h + 0.0015),
                (wide + 0.0015, share * h + 0.0075),
                (wide - 0.5 * wall_m, share * h + 0.009),
            ]
        )
        model.add("bands", ring - cylinder(wide - 0.5 * wall_m, 2 * h), "bands")
    return model


@template("toothpick holder")
def toothpick_holder(*, height_m: float, width: float, cap: float, holes: float) -> Model:
    """Build a small barrel with holes in its cap; ``cap`` is the cap's share of the height."""
    h, r, low = height_m, 0.5 * width * height_m, (1 - cap) * height_m
    body = rounded([(0, 0), (0.94 * r, 0), (r, 0.03 * h), (0.96 * r, low), (0, low)], 0.003)
    model = Model().add("body", lathe(body))
    dome = rounded(
        [(0, low - 0.001), (1.02 * r, low - 0.001), (1.02 * r, low + 0.45 * cap * h), (0.7 * r, h), (0, h)], 0.25 * r
    )
    model.add("cap", lathe(dome), "cap")
    pin = cylinder(0.0016, 0.02, sides=chords(12)).translate((0, 0, h - 0.006))
    count = round(holes)
    model.perforate(
        "holes",
        lambda: union([pin.translate((0.34 * r, 0, 0)).rotate((0, 0, 360 * k / count)) for k in range(count)]),
        "cap",
    )
    model.region("base", "body", lambda c: c[:, 2] < 0.02 * h)
    model.point("cap", "surface", "cap", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    model.point("body", "surface", "body", (0.0, -0.98 * r, 0.5 * low), (0.0, -1.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
