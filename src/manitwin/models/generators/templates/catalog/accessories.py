"""Accessories: glasses, watches, a wallet and a lighter."""

from __future__ import annotations

import numpy as np
from manifold3d import CrossSection, Manifold

from manitwin.geometry.solids.shapes import (
    Point,
    box,
    cylinder,
    lathe,
    polygon,
    prism,
    rectangle,
    rounded,
    union,
)
from manitwin.geometry.solids.sweep import arc, sweep, tube
from manitwin.models.generators.templates.template import Model, template


def _lens(x_m: float, z_m: float) -> CrossSection:
    """Return the outline of a lens: a rounded shape that is a little wider above."""
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    x, z = np.cos(turn), np.sin(turn)
    x, z = np.sign(x) * np.abs(x) ** 0.72, np.sign(z) * np.abs(z) ** 0.8
    return polygon(np.stack([0.5 * x_m * x * (1 + 0.06 * z), 0.5 * z_m * z], 1))


@template("glasses")
def glasses(*, width_m: float, lens: float, height: float, temple_m: float, frame_m: float) -> Model:
    """Build glasses that stand on their rims and the ends of their temples, with the lenses towards -Y."""
    wide = lens * width_m
    high = height * wide
    at, middle = 0.5 * width_m - 0.5 * wide - frame_m, 0.5 * high + frame_m
    front, thick = -0.5 * temple_m, 0.0038
    outline = _lens(wide, high)
    ring = outline.offset(frame_m) - outline
    model, bridge = Model(), at - 0.5 * wide
    for side in (-1.0, 1.0):
        rim = prism(ring, thick).rotate((90, 0, 0)).translate((side * at, front + 0.5 * thick, middle))
        model.add("frame", rim)
        glass = prism(outline.offset(0.0004), 0.0018).rotate((90, 0, 0))
        model.add("lenses", glass.translate((side * at, front + 0.0009, middle)), "lenses")
    over = middle + 0.2 * high
    span = arc(
        [(-bridge - 0.001, front, over), (0, front, over + 0.1 * high), (bridge + 0.001, front, over)], samples=12
    )
    model.add("bridge", tube(span, 0.75 * frame_m + 0.0005, across=(0, 0, 1)))
    side_z, out = middle + 0.3 * high, at + 0.5 * wide + 0.6 * frame_m
    for side in (-1.0, 1.0):
        hinge = box(0.5 * frame_m + 0.004, 0.006, 0.3 * frame_m + 0.004).translate(
            (side * out, front + 0.0015, side_z - 0.0025)
        )
        model.add("frame", hinge)
        x = side * (out + 0.0005)
        path = arc(
            [(x, front, side_z), (0.99 * x, 0.2 * temple_m, side_z - 0.002), (0.97 * x, 0.36 * temple_m, 0.7 * side_z),
             (0.95 * x, 0.5 * temple_m, 0.002)],
            samples=30,
        )  # fmt: skip
        model.add(
            "temples", tube(path, 0.0011 + 0.0004 * np.linspace(0, 2, 30), flatten=1.5, across=(1, 0, 0)), "temples"
        )
    model.point("lenses", "face", "lenses", (at, front - 0.0009, middle), (0.0, -1.0, 0.0))
    model.point("bridge", "surface", "bridge", (0.0, front, over + 0.1 * high + 0.75 * frame_m), (0.0, 0.0, 1.0))
    return model.point(
        "temple", "surface", "temples", (out + 0.002, 0.0, side_z - 0.001), (1.0, 0.0, 0.0)
    ).rest_on_ground()


def _add_strap(model: Model, loop_m: float, strap_m: float, thick_m: float, least_m: float) -> tuple[float, float]:
    """Add a closed strap about Z with its buckle at +Y.

    Returns the Y coordinate of its front, and the tilt (degrees) at which a case on it rests. ``least_m`` is half the height of
    the case, which protrudes below the strap.
    """
    turn = np.linspace(-0.38 * np.pi, 1.38 * np.pi, 48)
    half_x, half_y = 0.5 * loop_m, 0.43 * loop_m
    path = np.stack([half_x * np.cos(turn), half_y * np.sin(turn), 0 * turn], 1)
    section = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]) * (0.5 * strap_m, 0.5 * thick_m)
    tilt = -float(np.degrees(np.arctan2(least_m - 0.5 * strap_m, 2 * half_y)))
    model.add("strap", sweep(path, section, 1.0, across=(0, 0, 1)).rotate((tilt, 0, 0)), "strap")
    ring = box(0.6 * strap_m, 0.0046, 1.08 * strap_m, radius_m=0.001).translate((0, half_y, -0.54 * strap_m))
    model.add("buckle", ring.rotate((tilt, 0, 0)), "buckle")
    return -half_y * float(np.sin(0.38 * np.pi)), tilt


def _tilted(place: Point, tilt: float) -> Point:
    """Return (y, z) rotated about X by an angle in degrees."""
    sin, cos = float(np.sin(np.radians(tilt))), float(np.cos(np.radians(tilt)))
    return place[0] * cos - place[1] * sin, place[0] * sin + place[1] * cos


@template("watch")
def watch(*, case_m: float, thick: float, strap: float, loop_m: float) -> Model:
    """Build a watch that rests on the edges of its closed strap and its case, with the dial towards -Y."""
    r, deep = 0.5 * case_m, thick * case_m
    model = Model()
    front, tilt = _add_strap(model, loop_m, strap * case_m, 0.0026, r)
    case = lathe(
        rounded(
            [
                (0, 0),
                (0.9 * r, 0),
                (r, 0.3 * deep),
                (r, 0.7 * deep),
                (0.9 * r, deep),
                (0.8 * r, deep),
                (0.76 * r, 0.86 * deep),
                (0, 0.86 * deep),
            ],
            0.0012,
        )
    )
    face = front - deep + 0.001

    def on_case(solid: Manifold, z_m: float) -> Manifold:
        return solid.translate((0, 0, z_m)).rotate((90, 0, 0)).translate((0, face + deep, 0)).rotate((tilt, 0, 0))

    model.add("case", on_case(case, 0))
    lugs = [
        box(0.5 * strap * case_m, 0.5 * deep, 1.04 * strap * case_m).translate(
            (x * 0.86 * r, front - 0.2 * deep, -0.52 * strap * case_m)
        )
        for x in (-1, 1)
    ]
    model.add("lugs", union(lugs).rotate((tilt, 0, 0)))
    model.add("dial", on_case(cylinder(0.775 * r, 0.0012), 0.86 * deep - 0.0006), "dial")
    hands = [
        box(0.04 * r, 0.62 * r, 0.0006).translate((0, 0.27 * r, 0)),
        box(0.44 * r, 0.06 * r, 0.0006).translate((0.18 * r, 0, 0)),
    ]
    marks = [
        box(0.03 * r, 0.11 * r, 0.0006).translate((0, 0.64 * r, 0)).rotate((0, 0, 30 * hour)) for hour in range(12)
    ]
    model.add("hands", on_case(union([*hands, *marks]), 0.86 * deep + 0.0004), "hands")
    crown = cylinder(0.13 * r, 0.004).rotate((0, 90, 0)).translate((r - 0.0008, front - 0.45 * deep, 0))
    model.add("crown", crown.rotate((tilt, 0, 0)))
    y, z = _tilted((face + 0.14 * deep - 0.001, 0.2 * r), tilt)
    out = _tilted((-1.0, 0.0), tilt)
    model.point("dial", "face", "dial", (0.0, y, z), (0.0, *out))
    y, z = _tilted((front - 0.45 * deep, 0.0), tilt)
    model.point("crown", "button", "crown", (r + 0.0032, y, z), (1.0, 0.0, 0.0))
    return model.point("strap", "hole", "strap", (0.0, 0.0, 0.0), (0.0, *_tilted((0.0, 1.0), tilt))).rest_on_ground()


@template("smart watch")
def smart_watch(*, case_m: float, width: float, thick: float, strap: float, loop_m: float) -> Model:
    """Build a watch with a rounded rectangular screen that rests on its closed strap, with the screen towards -Y."""
    across, deep = width * case_m, thick * case_m
    model = Model()
    front, tilt = _add_strap(model, loop_m, strap * across, 0.0028, 0.5 * across)
    # The strap follows the longer side of the case, which is along X here.
    face = front - deep + 0.002

    def on_case(solid: Manifold, z_m: float) -> Manifold:
        return solid.translate((0, 0, z_m)).rotate((90, 0, 0)).translate((0, face + deep, 0)).rotate((tilt, 0, 0))

    model.add("case", on_case(prism(rectangle(case_m, across, radius_m=0.26 * across), deep, radius_m=0.002), 0))
    model.add(
        "screen",
        on_case(prism(rectangle(0.88 * case_m, 0.86 * across, radius_m=0.2 * across), 0.001), deep - 0.0005),
        "screen",
    )
    crown = cylinder(0.1 * across, 0.003).translate((0.2 * case_m, face + 0.5 * deep, 0.5 * across - 0.0006))
    model.add("button", crown.rotate((tilt, 0, 0)))
    y, z = _tilted((face - 0.0005, 0.0), tilt)
    model.point("screen", "face", "screen", (0.0, y, z), (0.0, *_tilted((-1.0, 0.0), tilt)))
    y, z = _tilted((face + 0.5 * deep, 0.5 * across + 0.0024), tilt)
    model.point("button", "button", "button", (0.2 * case_m, y, z), (0.0, *_tilted((0.0, 1.0), tilt)))
    return model.point("strap", "hole", "strap", (0.0, 0.0, 0.0), (0.0, *_tilted((0.0, 1.0), tilt))).rest_on_ground()


@template("wallet")
def wallet(*, length_m: float, width: float, thick_m: float) -> Model:
    """Build a lying folded wallet, with the fold towards +Y and cards and notes between its halves."""
    across, leaf = width * length_m, 0.36 * thick_m
    half = prism(rectangle(length_m, across, radius_m=0.007), leaf, radius_m=0.4 * leaf)
    model = Model().add("cover", half).add("cover", half.translate((0, 0, thick_m - leaf)))
    back = 0.5 * across - 0.35 * thick_m
    fold = (
        cylinder(0.5 * thick_m, 0.97 * length_m).rotate((0, 90, 0)).translate((-0.485 * length_m, back, 0.5 * thick_m))
    )
    model.add("fold", fold)
    inside = box(0.93 * length_m, 0.93 * across, thick_m - 1.7 * leaf).translate((0, 0.01 * across, 0.85 * leaf))
    model.add("contents", inside, "contents")
    patch = prism(rectangle(0.22 * length_m, 0.2 * across, radius_m=0.002), 0.0008)
    model.add("badge", patch.translate((0.3 * length_m, -0.26 * across, thick_m - 0.0003)), "badge")
    model.point("front", "face", "cover", (0.0, 0.0, thick_m), (0.0, 0.0, 1.0))
    model.point("opening", "edge", "cover", (0.0, -0.5 * across, thick_m - 0.5 * leaf), (0.0, -1.0, 0.0))
    return model.point("fold", "surface", "fold", (0.0, back + 0.5 * thick_m, 0.5 * thick_m), (0.0, 1.0, 0.0))


@template("lighter")
def lighter(*, height_m: float, width: float, thick: float) -> Model:
    """Build a standing lighter, with the wheel towards -X and the lever towards +X."""
    x, h = width * height_m, height_m
    y = thick * x
    oval = rectangle(x, y, radius_m=0.48 * y)
    top = 0.8 * h
    model = Model().add("body", prism(oval, top, radius_m=0.0012))
    model.region("base", "body", lambda centers: centers[:, 2] < 0.0012)
    hood = prism(oval.offset(0.0003), 0.17 * h) - box(0.62 * x, 2 * y, h).translate((0.32 * x, 0, 0.07 * h))
    model.add("hood", hood.translate((0, 0, top)), "metal")
    model.add("neck", prism(rectangle(0.7 * x, 0.66 * y), 0.1 * h).translate((0, 0, top - 0.002)), "metal")
    wheel = union(
        [
            cylinder(0.16 * x, 0.5 * y, sides=20),
            cylinder(0.19 * x, 0.12 * y, sides=24),
            cylinder(0.19 * x, 0.12 * y, sides=24).translate((0, 0, 0.38 * y)),
        ]
    )
    model.add("wheel", wheel.rotate((90, 0, 0)).translate((0.06 * x, 0.25 * y, 0.9 * h)), "metal")
    lever = box(0.36 * x, 0.62 * y, 0.045 * h, radius_m=0.001).rotate((0, 8, 0))
    model.add("lever", lever.translate((0.32 * x, 0, 0.845 * h)), "lever")
    model.point("wheel", "button", "wheel", (0.06 * x, 0.2 * y, 0.9 * h + 0.19 * x), (0.0, 0.0, 1.0))
    model.point("lever", "button", "lever", (0.34 * x, 0.0, 0.89 * h), (0.0, 0.0, 1.0))
    model.point("flame", "tip", "hood", (-0.3 * x, 0.0, 0.97 * h), (0.0, 0.0, 1.0))
    return model.point("body", "surface", "body", (0.0, -0.5 * y, 0.4 * h), (0.0, -1.0, 0.0))
