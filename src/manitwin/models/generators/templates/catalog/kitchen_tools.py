"""Kitchen tools held in one hand, lying with the working end towards +X."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import box, cylinder, ellipsoid, lathe, polygon, prism, rectangle, union
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.cutlery import scoop
from manitwin.models.generators.templates.catalog.hand_tools import grip
from manitwin.models.generators.templates.template import Model, template


@template("tongs")
def tongs(*, length_m: float, spread: float, width_m: float, head: float) -> Model:
    """Build tongs lying on their side with arms ``spread`` of the length apart; ``head`` is the jaws' share of the length."""
    tail, end, half = -0.5 * length_m, 0.5 * length_m, 0.5 * spread * length_m
    start = end - head * length_m
    model = Model().add("joint", cylinder(0.009, width_m).translate((tail + 0.012, 0, -0.5 * width_m)), "handle")
    for side in (1.0, -1.0):
        bend = [(tail + 0.012, 0.006), (tail + 0.06 * length_m, 0.4 * half), (0.25 * tail, 0.8 * half), (start, half)]
        path = arc([(x, side * y, 0.0) for x, y in bend], samples=28)
        wide = 0.5 * width_m * np.interp(np.linspace(0, 1, 28), [0, 0.3, 1], [0.95, 1.0, 0.72])
        model.add("handle", tube(path, wide, flatten=0.18, across=(0, 0, 1)), "handle")
        jaw = arc(
            [(start - 0.01, side * half, 0), (0.5 * (start + end), side * 0.93 * half, 0), (end, side * 0.6 * half, 0)]
        )
        shape = 0.5 * width_m * np.interp(np.linspace(0, 1, 24), [0, 0.25, 0.6, 0.9, 1], [0.72, 0.9, 1.25, 1.15, 0.7])
        bowl = tube(jaw, shape, flatten=0.2, across=(0, 0, 1))
        notches = [
            cylinder(0.08 * width_m, 4 * half).rotate((90, 0, 0)).translate((x, 2 * half, z * width_m))
            for x, z in ((end, 0.0), (end - 0.004, 0.28), (end - 0.004, -0.28))
        ]
        model.add("jaws", bowl - union(notches), "jaws")
    ring = tube(_loop(0.011, 0.008, tail + 0.006), 0.0016, sides=8)
    model.add("ring", ring, "handle")
    y = 0.6 * half
    model.point("jaws", "tip", "jaws", (end, y, 0.25 * width_m), (1.0, 0.0, 0.0))
    model.point("joint", "surface", "joint", (tail + 0.012, 0.0, 0.5 * width_m), (0.0, 0.0, 1.0))
    return model.point(
        "handles", "surface", "handle", (0.25 * tail, 0.8 * half, 0.45 * width_m), (0.0, 0.0, 1.0)
    ).rest_on_ground()


def _loop(x_m: float, y_m: float, at_m: float) -> np.ndarray:
    turn = np.linspace(0, 2.02 * np.pi, 28)
    return np.stack([at_m - x_m + x_m * np.cos(turn), y_m * np.sin(turn), 0 * turn], axis=1)


@template("peeler")
def peeler(*, length_m: float, blade: float, width_m: float) -> Model:
    """Build a peeler with a long swivelling blade (a trough with a slit) in a wire bow."""
    long, end, r = blade * length_m, 0.5 * length_m, 0.5 * width_m
    start = end - long
    ring = cylinder(r, long) - cylinder(r - 0.0011, 3 * long).translate((0, 0, -long))
    upper = box(2 * long, 4 * r, 2 * r).translate((0.5 * long, 0, -0.25 * r))
    trough = ring.rotate((0, 90, 0)) ^ upper
    nose = polygon(
        [
            (0, -1.1 * r),
            (0.94 * long, -1.1 * r),
            (long, -0.2 * r),
            (long, 0.2 * r),
            (0.94 * long, 1.1 * r),
            (0, 1.1 * r),
        ]
    )
    trough = trough ^ prism(nose, 4 * r).translate((0, 0, -2 * r))
    slit = box(0.74 * long, 0.5 * r, 2 * r, radius_m=0.2 * r).translate((0.47 * long, 0, 0.2 * r))
    model = (
        Model()
        .add("blade", trough.translate((start, 0, 0)), "blade")
        .cut("edge", slit.translate((start, 0, 0)), "blade")
    )
    pin = cylinder(0.0022, 0.022).rotate((0, 90, 0)).translate((start - 0.018, 0, 0.3 * r))
    yoke = box(0.005, 1.7 * r, 1.0 * r, radius_m=0.001).translate((start + 0.001, 0, -0.2 * r))
    model.add("neck", union([pin, yoke]), "blade")
    model.add("handle", grip(-end, start - 0.008, 0.62 * width_m, flatten=0.8, swell=0.2), "handle")
    model.point("blade", "edge", "edge", (start + 0.47 * long, 0.25 * r, 0.96 * r), (0.0, 0.0, 1.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * (start - 0.008 - end), 0.0, 0.58 * width_m), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("bottle opener")
def bottle_opener(*, length_m: float, head: float, thick_m: float) -> Model:
    """Build a flat bar with an opening for bottle caps; ``head`` is its head's width relative to the length."""
    wide, end = head * length_m, 0.5 * length_m
    at = end - 0.52 * wide
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    outer = polygon([(at + 0.52 * wide * np.cos(a), 0.5 * wide * np.sin(a)) for a in turn])
    waist = [(at, -0.42 * wide), (at - 0.75 * wide, -0.2 * wide), (-0.7 * end, -0.27 * wide), (-end, -0.24 * wide)]
    bar = polygon([*waist, *((x, -y) for x, y in reversed(waist))], radius_m=0.003)
    flat = prism(outer + bar, thick_m, radius_m=min(0.0008, 0.3 * thick_m))
    model = Model().add("handle", flat, "body")
    model.region("head", "handle", lambda centers: centers[:, 0] > at - 0.55 * wide)
    mouth = polygon([(at + 0.36 * wide * np.cos(a), 0.35 * wide * np.sin(a)) for a in turn])
    lip = polygon(
        [
            (at - 0.5 * wide, -0.2 * wide),
            (at - 0.12 * wide, -0.13 * wide),
            (at - 0.12 * wide, 0.13 * wide),
            (at - 0.5 * wide, 0.2 * wide),
        ]
    )
    model.cut("mouth", prism(mouth - lip, 3 * thick_m).translate((0, 0, -thick_m)), "body")
    model.cut("hole", cylinder(0.0032, 3 * thick_m).translate((-end + 0.012, 0, -thick_m)), "body")
    model.point("mouth", "hole", "mouth", (at + 0.1 * wide, 0.0, 0.5 * thick_m), (0.0, 0.0, 1.0))
    return model.point("handle", "surface", "handle", (-0.45 * end, 0.0, thick_m), (0.0, 0.0, 1.0)).rest_on_ground()


@template("can opener")
def can_opener(*, length_m: float, spread: float, wheel_m: float) -> Model:
    """Build a lying can opener: two handles towards -X, at the head a cutting wheel, and above it the key that turns it."""
    end, half, thick = 0.5 * length_m, 0.5 * spread * length_m, 0.0035
    at = end - 0.12 * length_m
    plate = [
        (at - 0.15 * length_m, -0.016),
        (at, -0.02),
        (end, -0.011),
        (end, 0.011),
        (at, 0.02),
        (at - 0.15 * length_m, 0.016),
    ]
    model = Model().add(
        "head", prism(polygon(plate, radius_m=0.006), 2 * thick, radius_m=0.001).translate((0, 0, -thick)), "head"
    )
    for side in (1.0, -1.0):
        bend = [
            (at - 0.06 * length_m, side * 0.006),
            (0.3 * end, side * 0.45 * half),
            (-0.4 * end, side * half),
            (-end, side * 0.92 * half),
        ]
        path = arc([(x, y, 0.0) for x, y in bend], samples=30)
        width = np.interp(np.linspace(0, 1, 30), [0, 0.25, 0.5, 0.95, 1], [0.006, 0.0065, 0.0095, 0.0105, 0.006])
        model.add("handle", tube(path, width, flatten=0.75, across=(0, 1, 0)), "handle")
    wheel = lathe(
        [
            (0, -thick - 0.006),
            (0.3 * wheel_m, -thick - 0.006),
            (0.5 * wheel_m, -thick - 0.0035),
            (0.3 * wheel_m, -thick + 0.0002),
            (0, -thick + 0.0002),
        ]
    )
    model.add("wheel", wheel.translate((at + 0.045 * length_m, -0.004, 0)), "head")
    top = thick + 0.016
    model.add("key", cylinder(0.0045, 0.022).translate((at, 0, 0)), "head")
    wings = prism(
        polygon(
            [
                (-0.024, -0.011),
                (0, -0.006),
                (0.024, -0.011),
                (0.026, 0.0),
                (0.024, 0.011),
                (0, 0.006),
                (-0.024, 0.011),
                (-0.026, 0.0),
            ],
            radius_m=0.003,
        ),
        0.008,
        radius_m=0.0025,
    )
    model.add("key", wings.rotate((0, 0, 90)).translate((at, 0, top)), "key")
    model.point("cutting head", "surface", "wheel", (at + 0.045 * length_m, -0.004, -thick - 0.006), (0.0, 0.0, -1.0))
    model.point("key", "surface", "key", (at, 0.0, top + 0.008), (0.0, 0.0, 1.0))
    return model.point(
        "handles", "surface", "handle", (-0.5 * end, half + 0.0095, 0.0), (0.0, 1.0, 0.0)
    ).rest_on_ground()


@template("pizza cutter")
def pizza_cutter(*, length_m: float, wheel: float, grip_m: float) -> Model:
    """Build a lying wheel on a handle; ``wheel`` is its diameter relative to the length."""
    r, end = 0.5 * wheel * length_m, 0.5 * length_m
    at, start = end - r, end - 2 * r
    disc = lathe([(0, -0.0006), (0.9 * r, -0.0006), (r, -0.00015), (r, 0.00015), (0.9 * r, 0.0006), (0, 0.0006)])
    model = Model().add("blade", disc.translate((at, 0, 0)), "blade")
    model.region("edge", "blade", lambda centers: np.hypot(centers[:, 0] - at, centers[:, 1]) > 0.91 * r)
    fork = prism(
        polygon(
            [(start - 0.016, -0.008), (at, -0.006), (at + 0.006, 0.0), (at, 0.006), (start - 0.016, 0.008)],
            radius_m=0.002,
        ),
        0.007,
    )
    gap = box(2 * r, 4 * r, 0.002).translate((at, 0, -0.001))
    model.add("neck", fork.translate((0, 0, -0.0035)) - gap, "neck")
    model.add("neck", cylinder(0.007, 0.0094).translate((at, 0, -0.0047)), "neck")
    model.add("guard", ellipsoid(0.014, 2.3 * grip_m, 0.9 * grip_m).translate((start - 0.012, 0, 0)), "handle")
    model.add("handle", grip(-end, start - 0.008, 0.5 * grip_m, flatten=0.85, swell=0.15), "handle")
    model.point("front edge", "edge", "edge", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * (start - end), 0.0, 0.48 * grip_m), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("ice cream scoop")
def ice_cream_scoop(*, length_m: float, bowl_m: float, deep: float) -> Model:
    """Build a scoop with a deep round bowl, lying on it; ``deep`` is its depth relative to its width."""
    end, low = 0.5 * length_m, deep * bowl_m
    at = end - 0.5 * bowl_m
    outer, inner = scoop(bowl_m, 0.95 * bowl_m, low, 0.0017)
    model = Model().add("bowl", outer.translate((at, 0, 0))).cut("inside", inner.translate((at, 0, 0)))
    start = at - 0.46 * bowl_m
    neck = arc([(start, 0, -0.25 * low), (start - 0.012, 0, -0.12 * low), (start - 0.035, 0, -0.05 * low)])
    model.add("neck", tube(neck, 0.0058))
    model.add(
        "handle", grip(-end, start - 0.02, 0.0118, flatten=0.9, swell=0.22).translate((0, 0, -0.05 * low)), "handle"
    )
    model.point("bowl", "opening", "inside", (at, 0.0, 0.0), (0.0, 0.0, 1.0))
    model.point("bowl tip", "tip", "bowl", (end, 0.0, -0.0005), (1.0, 0.0, 0.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * (start - 0.02 - end), 0.0, 0.0128 - 0.05 * low), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("masher")
def masher(*, length_m: float, plate_m: float, head: float) -> Model:
    """Build a masher lying on the rim of its perforated plate and the end of its handle; ``head`` is the share of its fork."""
    end, r = 0.5 * length_m, 0.5 * plate_m
    start = end - head * length_m
    lean = np.degrees(np.arcsin((0.82 * r - 0.014) / (0.96 * length_m)))
    disc = prism(rectangle(1.64 * r, 2 * r, radius_m=0.8 * r), 0.0022, radius_m=0.0008)
    holes = [
        cylinder(0.0042, 0.02, sides=12).translate((u * 0.0135, v * 0.0135, -0.01))
        for u in range(-6, 7)
        for v in range(-6, 7)
        if np.hypot(u * 0.0135 / (0.82 * r), v * 0.0135 / r) < 0.84
        and np.hypot(u * 0.0135, abs(v) * 0.0135 - 0.6 * r) > 0.009  # where the fork is attached
    ]
    plate = (disc - union(holes)).rotate((0, 90, 0)).translate((end - 0.0022, 0, 0))
    model = Model().add("head", plate.rotate((0, -lean, 0)), "head")
    for side in (1.0, -1.0):
        path = arc(
            [
                (start - 0.02, side * 0.003, 0),
                (start + 0.01, side * 0.008, 0),
                (start + 0.45 * (end - start), side * 0.5 * r, 0),
                (end - 0.001, side * 0.6 * r, 0),
            ]
        )
        model.add("neck", tube(path, 0.0034, across=(0, 0, 1)).rotate((0, -lean, 0)), "head")
    model.add("handle", grip(-end, start, 0.0138, flatten=0.9, swell=0.12).rotate((0, -lean, 0)), "handle")
    angle, middle = np.radians(lean), 0.5 * (start - end)
    ahead = (float(np.cos(angle)), 0.0, float(np.sin(angle)))
    model.point("plate", "face", "head", (end * ahead[0], 0.0, end * ahead[2]), ahead)
    place = (middle * ahead[0] - 0.0135 * ahead[2], 0.0, middle * ahead[2] + 0.0135 * ahead[0])
    return model.point(
        "handle", "surface", "handle", (float(place[0]), 0.0, float(place[2])), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("pestle")
def pestle(*, length_m: float, head_m: float, waist: float) -> Model:
    """Build a club-shaped pestle lying along X, with its grinding end to +X; ``waist`` is its smallest width over its head's."""
    r, end = 0.5 * head_m, 0.5 * length_m
    side = [
        (0.0, -end),
        (0.55 * r, -end + 0.06 * r),
        (0.8 * r, -end + 0.6 * r),
        (waist * r, -0.15 * length_m),
        (0.72 * r, 0.2 * length_m),
    ]
    side += [(r, end - 0.7 * r), (0.8 * r, end - 0.16 * r), (0.4 * r, end - 0.02 * r), (0.0, end)]
    curve = arc([(radius, 0, z) for radius, z in side], samples=48)
    profile = [(max(float(radius), 0.0), float(z)) for radius, _, z in curve]
    model = Model().add("shaft", lathe(profile).rotate((0, 90, 0)))
    model.region("tip", "shaft", lambda centers: centers[:, 0] > end - 0.7 * r)
    model.point("grinding end", "tip", "tip", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "shaft", "surface", "shaft", (-0.15 * length_m, 0.0, waist * r), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("honey dipper")
def honey_dipper(*, length_m: float, head: float, width_m: float) -> Model:
    """Build a dipper lying along X, with a head of turned discs at +X that takes ``head`` of the length."""
    r, end, long = 0.5 * width_m, 0.5 * length_m, head * length_m
    start, rings = end - long, 7
    profile = [(0.0, -end), (0.0045, -end + 0.001), (0.0048, -end + 0.01), (0.0036, start - 0.01), (0.0045, start)]
    for number in range(rings):
        z = start + long * (number + 0.5) / rings
        out = r * float(np.sqrt(max(0.15, 1 - (1.7 * ((number + 0.5) / rings - 0.5)) ** 2)))
        step = 0.27 * long / rings
        profile += [(0.48 * r, z - step - 1e-4), (out, z - step), (out, z + step), (0.48 * r, z + step + 1e-4)]
    profile += [(0.4 * r, end - 0.002), (0.0, end)]
    model = Model().add("shaft", lathe(profile).rotate((0, 90, 0)))
    model.region("head", "shaft", lambda centers: centers[:, 0] > start)
    model.point("head", "surface", "head", (start + 0.5 * long, 0.0, r), (0.0, 0.0, 1.0))
    return model.point("shaft", "surface", "shaft", (-0.5 * end, 0.0, 0.004), (0.0, 0.0, 1.0)).rest_on_ground()
