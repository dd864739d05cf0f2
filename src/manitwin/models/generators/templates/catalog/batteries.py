"""Batteries: a lying round cell, and a standing 9 V block with its terminals up."""

from __future__ import annotations

from manitwin.geometry.solids.shapes import box, chords, cylinder, lathe, rounded
from manitwin.models.generators.templates.template import Model, template


@template("battery")
def battery(*, length_m: float, width: float) -> Model:
    """Build a cell lying along X, with the positive terminal towards +X."""
    r = 0.5 * width * length_m
    body = lathe(
        rounded(
            [(0, -0.5 * length_m), (r, -0.5 * length_m), (r, 0.5 * length_m - 0.0012), (0, 0.5 * length_m - 0.0012)],
            0.0006,
        )
    )
    model = (
        Model()
        .add("body", body.rotate((0, 90, 0)))
        .add("pole", cylinder(0.36 * r, 0.0022).rotate((0, 90, 0)).translate((0.5 * length_m - 0.0022, 0, 0)), "pole")
    )
    return model.point("pole", "tip", "pole", (0.5 * length_m, 0.0, 0.0), (1.0, 0.0, 0.0)).rest_on_ground()


@template("9v battery")
def block_battery(*, height_m: float, width: float, depth: float, band: float) -> Model:
    """Build a standing 9 V block, with the front towards -Y; ``band`` is the share of its height in another colour.

    The side lengths of 6LR61, and the pitch and height of its snap terminals, follow IEC 60086-2.
    """
    stud = 0.0026
    x, y, h = width * height_m, depth * height_m, height_m - stud
    cut = (1 - band) * h
    model = Model().add("body", box(x, y, h, radius_m=0.0018))
    wrap = box(x + 0.0002, y + 0.0002, h, radius_m=0.0019) ^ box(2 * x, 2 * y, band * h - 0.0012).translate((0, 0, cut))
    model.add("band", wrap, "band")
    model.add("top", box(x - 0.0016, y - 0.0016, 0.0014, radius_m=0.0004).translate((0, 0, h - 0.0009)), "top")
    pitch = 0.0127
    snap = [(0, 0), (0.0026, 0), (0.0023, 0.001), (0.0029, 0.0021), (0.0026, stud + 0.0004), (0, stud + 0.0004)]
    model.add("positive terminal", lathe(snap, sides=chords(28)).translate((-0.5 * pitch, 0, h - 0.0004)), "terminals")
    socket = cylinder(0.0042, stud + 0.0002, sides=6) - cylinder(0.0029, stud, sides=chords(28)).translate(
        (0, 0, 0.0008)
    )
    model.add("negative terminal", socket.translate((0.5 * pitch, 0, h - 0.0004)), "terminals")
    model.region("base", "body", lambda centers: centers[:, 2] < 1e-5)
    model.point("positive terminal", "tip", "positive terminal", (-0.5 * pitch, 0.0, height_m), (0.0, 0.0, 1.0))
    ring = (0.5 * pitch, -0.0033, h + stud - 0.0002)
    model.point("negative terminal", "surface", "negative terminal", ring, (0.0, 0.0, 1.0))
    return model.point("body", "surface", "body", (0.0, -0.5 * y, 0.3 * h), (0.0, -1.0, 0.0))
