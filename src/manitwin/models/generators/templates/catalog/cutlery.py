"""Cutlery and cooking tools, lying with the working end towards +X."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import box, cylinder, ellipsoid, lathe, polygon, prism, rounded, union
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.resting import pitch_to_rest
from manitwin.models.generators.templates.template import Model, template

SPOON_NECK_HALF_M, FORK_NECK_HALF_M = 0.0042, 0.0045
"""Half the width of a handle where it meets the bowl or the tines, metres."""


def slim_handle(
    start_m: float,
    end_m: float,
    half_m: float,
    *,
    flatten: float,
    wide_end: float = 1.6,
    lift_m: float = 0.0,
    arch_m: float = 0.0,
) -> Manifold:
    """Return a handle along X from ``start_m`` down to ``end_m``, widened by ``wide_end`` and raised by ``lift_m`` at its end.

    Its middle is raised by a further ``arch_m``.
    """
    along = np.linspace(0.0, 1.0, 24)
    tip = np.minimum(1.0, np.sqrt(np.clip((1 - along) / 0.06, 0.03, 1.0)))
    height = lift_m * np.sin(0.5 * np.pi * along) + arch_m * np.sin(np.pi * along)
    path = np.stack([start_m + along * (end_m - start_m), 0 * along, height], axis=1)
    return tube(path, half_m * tip * (1 + (wide_end - 1) * along**2), flatten=flatten)


def arch_height(arch: float, length_m: float) -> float:
    """Return the height of a handle's middle above its ends: -0.03 to 0.07 of the length, and 0 for ``arch`` = 0.3."""
    return 0.1 * (arch - 0.3) * length_m


def scoop(long_m: float, wide_m: float, deep_m: float, wall_m: float) -> tuple[Manifold, Manifold]:
    """Return the lower half of an ellipsoid about the origin, and the solid that hollows it."""
    lower = box(2 * long_m, 2 * wide_m, 2 * deep_m).translate((0, 0, -2 * deep_m))
    inner = ellipsoid(long_m - 2 * wall_m, wide_m - 2 * wall_m, 2 * deep_m - 2 * wall_m)
    return ellipsoid(long_m, wide_m, 2 * deep_m) ^ lower, inner


def _spoon(
    length_m: float,
    bowl: float,
    width_m: float,
    deep: float,
    half_m: float,
    wall_m: float,
    lift: float,
    flatten: float = 0.35,
    wide_end: float = 1.6,
    arch_m: float = 0.0,
) -> Model:
    long = bowl * length_m
    at, low = 0.5 * (length_m - long), deep * width_m
    outer, inner = scoop(long, width_m, low, wall_m)
    model = Model().add("bowl", outer.translate((at, 0, 0))).cut("inside", inner.translate((at, 0, 0)))
    start, end = at - 0.47 * long, -0.5 * length_m
    model.add(
        "handle",
        slim_handle(start, end, half_m, flatten=flatten, wide_end=wide_end, lift_m=lift * low, arch_m=arch_m).translate(
            (0, 0, -flatten * half_m)
        ),
        "handle",
    )
    model.point("bowl", "opening", "inside", (at, 0.0, 0.0), (0.0, 0.0, 1.0))
    high = 0.85 * lift * low + arch_m * float(np.sin(0.65 * np.pi))
    model.point("handle", "surface", "handle", (0.35 * start + 0.65 * end, 0.0, high), (0.0, 0.0, 1.0))
    return model.rest_on_ground()


@template("spoon")
def spoon(*, length_m: float, bowl: float, width_m: float, grip: float, arch: float, end: float) -> Model:
    """Build a spoon lying on its bowl.

    ``grip`` is the width of the handle's end relative to the length. ``arch`` bends the handle: its middle is below the line
    through its ends at 0 and above it at 1 (``arch_height``). ``end`` is the height of the handle's end above the edge of the
    bowl, relative to the bowl's depth.
    """
    wide_end = 0.5 * grip * length_m / SPOON_NECK_HALF_M
    arch_m = arch_height(arch, length_m)
    return pitch_to_rest(
        _spoon(length_m, bowl, width_m, 0.22, SPOON_NECK_HALF_M, 0.0012, end, wide_end=wide_end, arch_m=arch_m)
    )


@template("ladle")
def ladle(*, length_m: float, bowl: float, width_m: float) -> Model:
    """Build a ladle lying on its bowl, its handle rising."""
    return _spoon(length_m, bowl, width_m, 0.4, 0.007, 0.0018, 1.1)


@template("cooking spoon")
def cooking_spoon(*, length_m: float, bowl: float, width_m: float) -> Model:
    """Build a wooden spoon with a shallow bowl, a thick wall and a nearly round handle."""
    return _spoon(length_m, bowl, width_m, 0.2, 0.0055, 0.004, 0.5, flatten=0.8)


@template("fork")
def fork(*, length_m: float, head: float, width_m: float, grip: float, arch: float) -> Model:
    """Build a fork with four tines and raised points; ``grip`` and ``arch`` are those of a ``spoon``."""
    long = head * length_m
    start, thick, gap = 0.5 * length_m - long, 0.002, 0.13 * width_m
    outline = [(start, -0.11 * width_m), (start + 0.3 * long, -0.5 * width_m), (0.5 * length_m, -0.46 * width_m)]
    outline += [(x, -y) for x, y in reversed(outline)]
    plate = prism(polygon(outline, radius_m=0.001), 0.03)
    tine = 0.56 * long
    for place in (-0.25, 0.0, 0.25):
        cut = box(tine, gap, 0.05).translate((0.5 * length_m - 0.5 * tine + 0.001, place * width_m, -0.01))
        plate = plate - cut
    x = np.linspace(start - 0.01, 0.5 * length_m + 0.001, 28)
    share = (x - start) / long
    curve = 0.16 * long * (0.25 - (share - 0.45) ** 2 * 1.1)
    band = np.concatenate([np.stack([x, -curve], 1), np.stack([x, -curve + thick], 1)[::-1]])
    lifted = prism(polygon(band), 2 * width_m).rotate((90, 0, 0)).translate((0, width_m, 0))
    head_solid = plate.translate((0, 0, -0.015)) ^ lifted
    back = float(np.interp(start + 0.02 * length_m, x, -curve)) + 0.5 * thick
    model = Model().add("tines", head_solid)
    model.add(
        "handle",
        slim_handle(
            start + 0.02 * length_m,
            -0.5 * length_m,
            FORK_NECK_HALF_M,
            flatten=0.32,
            wide_end=0.5 * grip * length_m / FORK_NECK_HALF_M,
            lift_m=0.004,
            arch_m=arch_height(arch, length_m),
        ).translate((0, 0, back)),
        "handle",
    )
    model.region("neck", "tines", lambda centers: centers[:, 0] < 0.5 * length_m - tine)
    tip = float(-curve[-2]) + 0.5 * thick
    model.point("tines", "tip", "tines", (0.5 * length_m, 0.06 * width_m, tip), (1.0, 0.0, 0.0))
    along = (start + 0.27 * length_m) / (start + 0.52 * length_m)
    high = 0.004 * float(np.sin(0.5 * np.pi * along)) + arch_height(arch, length_m) * float(np.sin(np.pi * along))
    model.point("handle", "surface", "handle", (-0.25 * length_m, 0.0, back + high + 0.0015), (0.0, 0.0, 1.0))
    return pitch_to_rest(model)


def _knife(length_m: float, blade: float, width_m: float, back_m: float, handle_half_m: float, belly: float) -> Model:
    """Build a knife lying on its side, with the edge towards -Y."""
    long, start = blade * length_m, (0.5 - blade) * length_m
    x = np.linspace(0.0, 1.0, 20)
    edge = -0.5 * width_m * (1 - belly * x**3)
    spine = 0.5 * width_m * (1 - (1 - belly) * 1.6 * np.clip(x - 0.55, 0, 1))
    spine = np.maximum(spine, edge + 0.002 * (1 - 0.5 * x))
    outline = np.concatenate([np.stack([start + long * x, edge], 1), np.stack([start + long * x, spine], 1)[::-1]])
    flat = prism(polygon(outline), 2 * back_m).translate((0, 0, -back_m))
    wedge = polygon(
        [
            (-0.55 * width_m, -0.0002),
            (0.2 * width_m, -0.5 * back_m),
            (0.6 * width_m, -0.5 * back_m),
            (0.6 * width_m, 0.5 * back_m),
            (0.2 * width_m, 0.5 * back_m),
            (-0.55 * width_m, 0.0002),
        ]
    )
    ground = prism(wedge, 2 * long).rotate((90, 0, 90)).translate((start - 0.5 * long, 0, 0))
    model = Model().add("blade", flat ^ ground)
    model.region("edge", "blade", lambda centers: centers[:, 1] < -0.25 * width_m)
    grip = box(length_m - long + 0.012, 2 * handle_half_m, 1.3 * handle_half_m, radius_m=0.45 * handle_half_m)
    model.add(
        "handle",
        grip.translate((start - 0.5 * (length_m - long) + 0.006, 0.2 * width_m, -0.65 * handle_half_m)),
        "handle",
    )
    model.point("edge", "edge", "edge", (start + 0.5 * long, float(np.interp(0.5, x, edge)), 0.0), (0.0, -1.0, 0.0))
    model.point("tip", "tip", "blade", (0.5 * length_m, float(edge[-1]), 0.0), (1.0, 0.0, 0.0))
    model.point(
        "handle",
        "surface",
        "handle",
        (start - 0.5 * (length_m - long), 0.2 * width_m, 0.65 * handle_half_m),
        (0.0, 0.0, 1.0),
    )
    return model.rest_on_ground()


@template("chef's knife")
def chefs_knife(*, length_m: float, blade: float, width_m: float, back_m: float) -> Model:
    """Build a chef's knife: ``blade`` is the blade's share of the length, ``back_m`` the thickness of its spine."""
    return _knife(length_m, blade, width_m, back_m, 0.0115, 0.75)


@template("paring knife")
def paring_knife(*, length_m: float, blade: float, width_m: float, back_m: float) -> Model:
    """Build a small pointed knife."""
    return _knife(length_m, blade, width_m, back_m, 0.009, 0.6)


@template("knife")
def table_knife(*, length_m: float, blade: float, width_m: float, back_m: float) -> Model:
    """Build a table knife with a rounded point."""
    return _knife(length_m, blade, width_m, back_m, 0.0065, 0.25)


@template("spatula")
def spatula(*, length_m: float, head: float, width_m: float, rise: float, crank: float, grip: float) -> Model:
    """Build a slotted turner whose handle rises from its blade.

    ``rise`` is the height of the handle's end relative to the length, ``crank`` the share of it by which the neck rises near the
    blade, and ``grip`` the width of the handle's end relative to the length.
    """
    long = head * length_m
    at = 0.5 * (length_m - long)
    outline = [
        (at - 0.5 * long, -0.35 * width_m),
        (at + 0.5 * long, -0.5 * width_m),
        (at + 0.5 * long, 0.5 * width_m),
        (at - 0.5 * long, 0.35 * width_m),
    ]
    blade = prism(polygon(outline, radius_m=0.006), 0.0022)
    for place in (-0.22, 0.0, 0.22):
        blade = blade - box(0.55 * long, 0.007, 0.02, radius_m=0.003).translate((at, place * width_m, -0.01))
    end, neck = rise * length_m, crank * rise * length_m
    path = arc(
        [
            (at - 0.42 * long, 0, 0.0015),
            (at - 0.6 * long, 0, neck),
            (0, 0, 0.4 * neck + 0.6 * end),
            (-0.5 * length_m, 0, end),
        ],
        samples=32,
    )
    broad = 0.5 * grip * length_m
    half = np.interp(np.linspace(0, 1, len(path)), [0, 0.2, 0.35, 1], [0.006, 0.005, 0.8 * broad, broad])
    model = Model().add("blade", blade, "head").add("handle", tube(path, half, flatten=0.5), "handle")
    model.region("edge", "blade", lambda centers: centers[:, 0] > at + 0.42 * long)
    model.point("edge", "edge", "edge", (at + 0.5 * long, 0.0, 0.001), (1.0, 0.0, 0.0))
    middle = path[22]
    model.point("handle", "surface", "handle", (float(middle[0]), 0.0, float(middle[2]) + 0.005), (0.0, 0.0, 1.0))
    return pitch_to_rest(model)


@template("rolling pin")
def rolling_pin(*, length_m: float, roller: float, width_m: float) -> Model:
    """Build a rolling pin lying along X."""
    long = roller * length_m
    body = cylinder(0.5 * width_m, long).translate((0, 0, -0.5 * long)).rotate((0, 90, 0))
    model = Model().add("roller", body)
    side = 0.5 * (length_m - long)
    knob = lathe(
        rounded(
            [(0.006, -0.01), (0.007, 0.0), (0.009, 0.1 * side), (0.014, 0.5 * side), (0.011, side), (0, side)], 0.01
        )
    )
    model.add("handle", knob.rotate((0, 90, 0)).translate((0.5 * long, 0, 0)), "handle")
    model.add("handle", knob.rotate((0, -90, 0)).translate((-0.5 * long, 0, 0)), "handle")
    model.point("roller", "surface", "roller", (0.0, 0.0, 0.5 * width_m), (0.0, 0.0, 1.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * long + 0.5 * side, 0.0, 0.0135), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("chopstick")
def chopstick(*, length_m: float, thick_m: float, tip: float) -> Model:
    """Build one chopstick, square at its thick end."""
    x = np.array([-0.5, 0.0, 0.5]) * length_m
    path = np.stack([x, 0 * x, 0 * x], axis=1)
    half = 0.5 * thick_m * np.array([1.0, 0.85, tip])
    model = Model().add("body", tube(path, half, sides=12))
    model.region("tip", "body", lambda centers: centers[:, 0] > 0.49 * length_m)
    model.point("tip", "tip", "tip", (0.5 * length_m, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "handle", "surface", "body", (-0.2 * length_m, 0.0, 0.45 * thick_m), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("whisk")
def whisk(*, length_m: float, head: float, width_m: float) -> Model:
    """Build a balloon whisk of five loops."""
    long, start = head * length_m, (0.5 - head) * length_m
    model = Model()
    loop = arc(
        [
            (start - 0.01, 0.004, 0),
            (start + 0.3 * long, 0.3 * width_m, 0),
            (start + 0.72 * long, 0.5 * width_m, 0),
            (start + long, 0.0, 0),
            (start + 0.72 * long, -0.5 * width_m, 0),
            (start + 0.3 * long, -0.3 * width_m, 0),
            (start - 0.01, -0.004, 0),
        ],
        samples=60,
    )
    wire = tube(loop, 0.0011, across=(0, 0, 1), sides=8)
    model.add("wires", union([wire.rotate((angle, 0, 0)) for angle in (0.0, 36.0, 72.0, 108.0, 144.0)]), "wires")
    model.add("handle", slim_handle(start + 0.01, -0.5 * length_m, 0.011, flatten=1.0, wide_end=1.15), "handle")
    model.point("wires", "tip", "wires", (start + long, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * (start - 0.5 * length_m), 0.0, 0.0115), (0.0, 0.0, 1.0)
    ).rest_on_ground()
