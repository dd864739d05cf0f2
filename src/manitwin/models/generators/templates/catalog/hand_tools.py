"""Hand tools with a handle, lying with the working end towards +X."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import box, cylinder, lathe, polygon, prism, rectangle, rounded
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.template import Model, template


def grip(start_m: float, end_m: float, radius_m: float, *, flatten: float = 0.8, swell: float = 0.12) -> Manifold:
    """Return a handle along X, thickened by ``swell`` in its middle and rounded at its ends, with its axis on z = 0."""
    along = np.linspace(0.0, 1.0, 24)
    ends = np.minimum(1.0, np.sqrt(np.clip(np.minimum(along, 1 - along) / 0.05, 0.05, 1.0)))
    path = np.stack([start_m + along * (end_m - start_m), 0 * along, 0 * along], axis=1)
    return tube(path, radius_m * ends * (1 + swell * np.sin(np.pi * along)), flatten=flatten)


def upright(outline: list[tuple[float, float]], width_m: float) -> Manifold:
    """Return an outline in x and z extruded along Y, centred on y = 0."""
    return prism(polygon(outline), width_m).rotate((90, 0, 0)).translate((0, 0.5 * width_m, 0))


@template("hammer")
def hammer(*, length_m: float, head: float, face_m: float) -> Model:
    """Build a claw hammer with its face to -Y and its claw to +Y; ``head`` is the head's length relative to the tool's."""
    across, at = head * length_m, 0.46 * length_m
    eye = box(1.05 * face_m, 0.34 * across, face_m, radius_m=0.003).translate((at, 0, -0.5 * face_m))
    neck = cylinder(0.36 * face_m, 0.25 * across).rotate((90, 0, 0)).translate((at, -0.1 * across, 0))
    face = cylinder(0.5 * face_m, 0.16 * across).rotate((90, 0, 0)).translate((at, -0.28 * across, 0))
    side = [(0.1, -0.5), (0.34, -0.42), (0.56, -0.05), (0.52, 0.02), (0.3, -0.1), (0.1, 0.5)]
    claw = prism(polygon([(face_m * x, across * y) for y, x in side]), 0.8 * face_m)
    claw = claw.rotate((0, 90, 0)).translate((at - 0.4 * face_m, 0, 0))
    slot = polygon(
        [
            (-0.08 * face_m, 0.27 * across),
            (0.08 * face_m, 0.27 * across),
            (0.2 * face_m, 0.6 * across),
            (-0.2 * face_m, 0.6 * across),
        ]
    )
    model = Model().add("head", eye, "head").add("head", neck, "head").add("face", face, "head")
    model.add("claw", claw, "head")
    model.cut("claw", prism(slot, 3 * face_m).translate((at, 0, -1.5 * face_m)), "head")
    model.add("handle", grip(-0.5 * length_m, at + 0.2 * face_m, 0.016), "handle")
    model.point("striking face", "face", "face", (at, -0.44 * across, 0.0), (0.0, -1.0, 0.0))
    model.point("claw", "tip", "claw", (at + 0.25 * face_m, 0.54 * across, 0.0), (0.0, 1.0, 0.0))
    return model.point("handle", "surface", "handle", (-0.2 * length_m, 0.0, 0.014), (0.0, 0.0, 1.0)).rest_on_ground()


@template("screwdriver")
def screwdriver(*, length_m: float, handle: float, grip_m: float, shaft_m: float) -> Model:
    """Build a slotted screwdriver; ``handle`` is the grip's share of the length."""
    end, middle = -0.5 * length_m, (handle - 0.5) * length_m
    shaft = cylinder(0.5 * shaft_m, (1 - handle) * length_m - 0.01).rotate((0, 90, 0)).translate((middle - 0.005, 0, 0))
    wide = prism(polygon([(0, -0.5), (1, -0.6), (1, 0.6), (0, 0.5)]).scale((0.016, shaft_m)), shaft_m).translate(
        (0, 0, -0.5 * shaft_m)
    )
    thin = upright(
        [(0, -0.5 * shaft_m), (0.016, -0.09 * shaft_m), (0.016, 0.09 * shaft_m), (0, 0.5 * shaft_m)], 2 * shaft_m
    )
    model = (
        Model()
        .add("shaft", shaft, "shaft")
        .add("tip", (wide ^ thin).translate((0.5 * length_m - 0.016, 0, 0)), "shaft")
    )
    model.add("handle", grip(end, middle, 0.5 * grip_m, flatten=1.0, swell=0.05), "handle")
    model.point("tip", "tip", "tip", (0.5 * length_m, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * (end + middle), 0.0, 0.515 * grip_m), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("wrench")
def wrench(*, length_m: float, head: float, jaw: float, thick_m: float) -> Model:
    """Build a combination wrench: an open jaw towards +X, a ring towards -X."""
    wide = head * length_m
    at, ring = 0.5 * (length_m - wide), -0.5 * length_m + 0.38 * wide
    bar = prism(rectangle(length_m - wide, 0.36 * wide, radius_m=0.002), 0.7 * thick_m).translate(
        (0, 0, -0.35 * thick_m)
    )
    open_head = cylinder(0.5 * wide, thick_m).translate((at, 0, -0.5 * thick_m))
    gap = box(wide, jaw * wide, 3 * thick_m).translate((at + 0.42 * wide, 0, -1.5 * thick_m))
    hexagon = cylinder(0.24 * wide, 3 * thick_m, sides=12).translate((ring, 0, -1.5 * thick_m))
    model = (
        Model()
        .add("handle", bar)
        .add("jaw", open_head)
        .add("ring", cylinder(0.38 * wide, 1.1 * thick_m).translate((ring, 0, -0.55 * thick_m)))
    )
    model.cut("jaw", gap).cut("hole", hexagon)
    model.point("jaw", "hole", "jaw", (at + 0.1 * wide, 0.0, 0.0), (0.0, 0.0, 1.0))
    model.point("ring", "hole", "hole", (ring, 0.0, 0.0), (0.0, 0.0, 1.0))
    return model.point("handle", "surface", "handle", (0.0, 0.0, 0.35 * thick_m), (0.0, 0.0, 1.0)).rest_on_ground()


@template("allen key")
def allen_key(*, length_m: float, arm: float, thick: float) -> Model:
    """Build a hexagonal bar bent at a right angle, lying flat."""
    half, turn = 0.5 * thick * length_m, 0.16 * length_m
    bend = [
        (0.5 * length_m - turn + turn * np.sin(a), turn - turn * np.cos(a), 0) for a in np.linspace(0, np.pi / 2, 8)
    ]
    path = np.array([(-0.5 * length_m, 0, 0), *bend, (0.5 * length_m, arm * length_m, 0)])
    model = Model().add("body", tube(path, half, sides=6, across=(0, 0, 1)))
    model.region("tip", "body", lambda centers: centers[:, 0] < -0.499 * length_m)
    model.point("tip", "tip", "tip", (-0.5 * length_m, 0.0, 0.0), (-1.0, 0.0, 0.0))
    return model.point("handle", "surface", "body", (0.0, 0.0, half), (0.0, 0.0, 1.0)).rest_on_ground()


@template("pliers")
def pliers(*, length_m: float, spread: float, thick_m: float) -> Model:
    """Build closed pliers with jaws towards +X and two grips towards -X that are ``spread`` of the length apart."""
    joint, half = 0.2 * length_m, 0.5 * spread * length_m
    model = Model().add("joint", cylinder(0.075 * length_m, thick_m).translate((joint, 0, -0.5 * thick_m)), "head")
    jaws = polygon(
        [
            (joint, -0.07 * length_m),
            (joint + 0.12 * length_m, -0.06 * length_m),
            (0.5 * length_m, -0.025 * length_m),
            (0.5 * length_m, 0.025 * length_m),
            (joint + 0.12 * length_m, 0.06 * length_m),
            (joint, 0.07 * length_m),
        ]
    )
    model.add("jaws", prism(jaws, 0.85 * thick_m).translate((0, 0, -0.425 * thick_m)), "head")
    model.cut(
        "mouth",
        box(0.3 * length_m, 0.0012, 3 * thick_m).translate((0.5 * length_m - 0.09 * length_m, 0, -1.5 * thick_m)),
        "head",
    )
    for side in (1.0, -1.0):
        path = arc(
            [
                (joint, -side * 0.02 * length_m, 0),
                (0.08 * length_m, side * 0.35 * half, 0),
                (-0.2 * length_m, side * half, 0),
                (-0.5 * length_m, side * 0.8 * half, 0),
            ]
        )
        model.add("handle", tube(path, 0.6 * thick_m, flatten=0.75, across=(0, 1, 0)), "handle")
    model.point("jaws", "tip", "jaws", (0.5 * length_m, 0.012 * length_m, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "handle", "surface", "handle", (-0.2 * length_m, half + 0.6 * thick_m, 0.0), (0.0, 1.0, 0.0)
    ).rest_on_ground()


@template("chisel")
def chisel(*, length_m: float, handle: float, width_m: float) -> Model:
    """Build a chisel with a bevelled end."""
    middle, thick = (handle - 0.5) * length_m, 0.0045
    blade = box((1 - handle) * length_m + 0.01, width_m, thick).translate(
        (0.5 * (middle - 0.01 + 0.5 * length_m), 0, -0.5 * thick)
    )
    bevel = upright(
        [
            (0.5 * length_m - 2.2 * thick, 0.5 * thick + 1e-4),
            (0.5 * length_m + 1e-4, -0.5 * thick + 2e-4),
            (0.5 * length_m + 0.01, 0.5 * thick + 0.01),
        ],
        3 * width_m,
    )
    model = Model().add("blade", blade, "blade").cut("edge", bevel, "blade")
    model.add("handle", grip(-0.5 * length_m, middle, 0.0145, flatten=0.9), "handle")
    model.point("edge", "edge", "edge", (0.5 * length_m, 0.0, -0.5 * thick), (1.0, 0.0, 0.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * (middle - 0.5 * length_m), 0.0, 0.0145), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("trowel")
def trowel(*, length_m: float, blade: float, width_m: float) -> Model:
    """Build a garden trowel with a hollow, pointed blade."""
    long, start = blade * length_m, (0.5 - blade) * length_m
    outline = [(0, -0.3), (0.15, -0.5), (0.6, -0.46), (1, -0.03), (1, 0.03), (0.6, 0.46), (0.15, 0.5), (0, 0.3)]
    flat = prism(polygon([(start + long * x, width_m * y) for x, y in outline], radius_m=0.003), 0.06).translate(
        (0, 0, -0.03)
    )
    radius = 0.9 * width_m
    ring = cylinder(radius, 2 * long).translate((0, 0, -long)) - cylinder(radius - 0.0022, 3 * long).translate(
        (0, 0, -1.5 * long)
    )
    trough = ring.rotate((0, 90, 0)).translate((start + 0.5 * long, 0, radius))
    model = Model().add("blade", flat ^ trough, "blade")
    neck = arc([(start + 0.2 * long, 0, 0.0015), (start, 0, 0.003), (start - 0.05, 0, 0.018)])
    model.add("neck", tube(neck, 0.0055), "blade")
    model.add("handle", grip(-0.5 * length_m, start - 0.04, 0.0145).translate((0, 0, 0.018)), "handle")
    model.point("tip", "tip", "blade", (0.5 * length_m, 0.0, 0.001), (1.0, 0.0, 0.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * (start - 0.04 - 0.5 * length_m), 0.0, 0.031), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("putty knife")
def putty_knife(*, length_m: float, blade: float, width_m: float) -> Model:
    """Build a filling knife with a thin flat blade."""
    start = (0.5 - blade) * length_m
    outline = [
        (start - 0.008, -0.009),
        (start + 0.02, -0.011),
        (0.5 * length_m, -0.5 * width_m),
        (0.5 * length_m, 0.5 * width_m),
        (start + 0.02, 0.011),
        (start - 0.008, 0.009),
    ]
    model = Model().add("blade", prism(polygon(outline), 0.0012).translate((0, 0, -0.0006)), "blade")
    model.region("edge", "blade", lambda centers: centers[:, 0] > 0.499 * length_m)
    model.add("handle", grip(-0.5 * length_m, start, 0.013, flatten=0.65), "handle")
    model.point("edge", "edge", "blade", (0.5 * length_m, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * (start - 0.5 * length_m), 0.0, 0.0092), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("paint brush")
def paint_brush(*, length_m: float, width_m: float, bristles: float) -> Model:
    """Build a flat brush: bristles towards +X in a metal ferrule."""
    hair, thick = bristles * length_m, 0.016
    start = 0.5 * length_m - hair
    model = Model().add(
        "bristles",
        box(hair + 0.01, 0.94 * width_m, 0.85 * thick, radius_m=0.004).translate(
            (start + 0.5 * hair - 0.005, 0, -0.425 * thick)
        ),
        "bristles",
    )
    model.add(
        "ferrule", box(0.034, width_m, thick, radius_m=0.002).translate((start - 0.015, 0, -0.5 * thick)), "ferrule"
    )
    handle_end = -0.5 * length_m
    x = np.linspace(start - 0.028, handle_end, 24)
    share = np.linspace(0, 1, 24)
    half = np.interp(share, [0, 0.2, 0.5, 0.85, 0.97, 1], [0.48 * width_m, 0.3 * width_m, 0.011, 0.015, 0.012, 0.006])
    model.add("handle", tube(np.stack([x, 0 * x, 0 * x], 1), half, flatten=0.36), "handle")
    model.point("bristles", "tip", "bristles", (0.5 * length_m, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("handle", "surface", "handle", (float(x[17]), 0.0, 0.0045), (0.0, 0.0, 1.0)).rest_on_ground()


@template("flashlight")
def flashlight(*, length_m: float, head: float, width_m: float) -> Model:
    """Build a flashlight lying along X, with its light towards +X and its switch up."""
    r, start = 0.5 * width_m, (0.5 - head) * length_m
    profile = rounded(
        [(0.66 * r, -0.5 * length_m), (0.68 * r, start - 0.02), (r, start + 0.012), (r, 0.5 * length_m)], 0.004
    )
    model = Model().add("body", lathe(profile).rotate((0, 90, 0)))
    model.add("lens", cylinder(0.86 * r, 0.001).rotate((0, 90, 0)).translate((0.5 * length_m - 0.0002, 0, 0)), "lens")
    model.add("switch", cylinder(0.0055, 0.004).translate((start - 0.035, 0, 0.6 * r)))
    model.point("lens", "face", "lens", (0.5 * length_m, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "switch", "button", "switch", (start - 0.035, 0.0, 0.6 * r + 0.004), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("axe")
def axe(*, length_m: float, head: float, thick_m: float) -> Model:
    """Build a hatchet lying on its side, with its edge towards -Y."""
    across, at = head * length_m, 0.42 * length_m
    outline = [(-0.14, 0.25), (0.14, 0.25), (0.13, -0.2), (0.32, -0.75), (0.0, -0.78), (-0.36, -0.72), (-0.14, -0.2)]
    flat = prism(polygon([(at + across * x, across * y) for x, y in outline]), thick_m).translate(
        (0, 0, -0.5 * thick_m)
    )
    wedge = polygon(
        [
            (-0.8 * across, -0.0006),
            (0.05 * across, -0.5 * thick_m),
            (0.4 * across, -0.5 * thick_m),
            (0.4 * across, 0.5 * thick_m),
            (0.05 * across, 0.5 * thick_m),
            (-0.8 * across, 0.0006),
        ]
    )
    ground = prism(wedge, 2 * across).rotate((90, 0, 90)).translate((at - across, 0, 0))
    model = (
        Model()
        .add("head", flat ^ ground, "head")
        .add("handle", grip(-0.5 * length_m, at + 0.16 * across, 0.0165, flatten=0.65), "handle")
    )
    model.region("edge", "head", lambda centers: centers[:, 1] < -0.6 * across)
    model.point("edge", "edge", "edge", (at, -0.778 * across, 0.0), (0.0, -1.0, 0.0))
    return model.point("handle", "surface", "handle", (-0.25 * length_m, 0.0, 0.0115), (0.0, 0.0, 1.0)).rest_on_ground()
