"""Tools to measure, hold, rake, paint and magnify: lying with the working end to +X, or standing with the front to -Y."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import box, cylinder, ellipsoid, lathe, polygon, prism, rounded
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.hand_tools import grip
from manitwin.models.generators.templates.template import Model, template


@template("tape measure")
def tape_measure(*, length_m: float, height: float, thick: float) -> Model:
    """Build a tape measure standing on its flat side, with the hook to +X; ``height`` and ``thick`` are over the length."""
    high, deep, end = height * length_m, thick * length_m, 0.44 * length_m
    outline = [(-end, 0.0), (end, 0.0), (end, 0.34 * high), (0.8 * end, 0.86 * high), (0.5 * end, high), (-end, high)]
    shape = polygon([(x, z) for x, z in outline]) ^ polygon(outline, radius_m=0.16 * high)
    shape = shape + polygon(
        [(-0.6 * end, 0.0), (end, 0.0), (end, 0.3 * high), (-0.6 * end, 0.3 * high)], radius_m=0.002
    )
    case = prism(shape, deep, radius_m=0.05 * length_m).rotate((90, 0, 0)).translate((0, 0.5 * deep, 0))
    model = Model().add("body", case, "body")
    disc = cylinder(0.3 * high, 1.03 * deep).rotate((90, 0, 0)).translate((-0.1 * length_m, 0.515 * deep, 0.5 * high))
    model.add("label", disc, "label")
    slot = box(0.05 * length_m, 0.56 * deep, 0.006).translate((end, 0, 0.045 * high))
    model.cut("mouth", slot, "body")
    tape = box(0.12 * length_m, 0.5 * deep, 0.0012).translate((0.44 * length_m, 0, 0.045 * high + 0.0015))
    model.add("tape", tape, "tape")
    hook = box(0.0016, 0.46 * deep, 0.012).translate((0.5 * length_m - 0.0008, 0, 0.045 * high + 0.003 - 0.006))
    model.add("hook", hook.translate((0, 0, max(0.0, 0.003 - 0.045 * high))), "hook")
    lock = box(0.2 * length_m, 0.45 * deep, 0.009, radius_m=0.003).rotate((0, 58, 0))
    model.add("lock", lock.translate((0.85 * end, 0, 0.64 * high)), "label")
    clip = box(0.3 * length_m, 0.0018, 0.6 * high, radius_m=0.0008).translate(
        (-0.1 * length_m, 0.5 * deep + 0.0035, 0.3 * high)
    )
    rivet = cylinder(0.004, 0.006).rotate((-90, 0, 0)).translate((-0.1 * length_m, 0.5 * deep - 0.001, 0.8 * high))
    model.add("clip", clip + rivet, "hook")
    model.point("hook", "tip", "hook", (0.5 * length_m, 0.0, 0.045 * high + 0.003), (1.0, 0.0, 0.0))
    ahead, up = float(np.sin(np.radians(58))), float(np.cos(np.radians(58)))
    place = (0.85 * end + 0.009 * ahead, 0.0, 0.64 * high + 0.009 * up)
    model.point("lock", "button", "lock", place, (ahead, 0.0, up))
    return model.point("body", "surface", "body", (-0.3 * length_m, 0.0, high), (0.0, 0.0, 1.0)).rest_on_ground()


@template("spirit level")
def spirit_level(*, length_m: float, height_m: float, thick: float) -> Model:
    """Build a level standing on its measuring face, with a vial in its upper edge and two in windows at its ends."""
    high, deep = height_m, thick * height_m
    model = Model().add("body", box(length_m, deep, high, radius_m=0.0012), "body")
    bore, half = 0.19 * high, max(0.024, 0.05 * length_m)
    model.cut("window", box(2 * half, 2 * deep, 0.5 * high, radius_m=0.003).translate((0, 0, 0.62 * high)), "body")
    vial = cylinder(bore, 2 * half + 0.004).rotate((0, 90, 0)).translate((-half - 0.002, 0, 0.78 * high))
    model.add("vial", vial, "vial")
    for at in (-0.36, 0.36):
        window = cylinder(0.34 * high, 2 * deep).rotate((90, 0, 0)).translate((at * length_m, deep, 0.5 * high))
        model.cut("window", window, "body")
        model.add("plumb vial", cylinder(bore, 0.7 * high).translate((at * length_m, 0, 0.15 * high)), "vial")
    for side in (-1.0, 1.0):
        cap = box(0.014, 1.08 * deep, 1.02 * high, radius_m=0.003).translate(
            (side * (0.5 * length_m - 0.007), 0, -0.01 * high)
        )
        model.add("caps", cap, "caps")
    for side in (-1.0, 1.0):
        groove = box(0.9 * length_m, 0.1 * deep, 0.12 * high).translate((0, side * 0.5 * deep, 0.1 * high))
        model.cut("groove", groove, "body")
    model.point("vial", "surface", "vial", (0.0, 0.0, 0.78 * high + bore), (0.0, 0.0, 1.0))
    model.point("measuring face", "face", "body", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return model.point(
        "plumb vial", "surface", "plumb vial", (0.36 * length_m, -bore, 0.5 * high), (0.0, -1.0, 0.0)
    ).rest_on_ground()


@template("magnet")
def magnet(*, length_m: float, width: float, thick: float) -> Model:
    """Build a lying horseshoe magnet with its poles towards +X."""
    r, deep, end = 0.5 * width * length_m, thick * length_m, 0.5 * length_m
    inner, bow, cap = 0.5 * r, r - end, 0.2 * length_m
    outer = polygon([(bow, -r), (end - cap, -r), (end - cap, r), (bow, r)]) + polygon(_round(r, bow))
    slot = polygon([(bow, -inner), (end, -inner), (end, inner), (bow, inner)]) + polygon(_round(inner, bow))
    model = Model().add("body", prism(outer - slot, deep, radius_m=0.06 * deep), "body")
    for side in (-1.0, 1.0):
        tip = box(cap + 0.001, r - inner, deep, radius_m=0.06 * deep)
        y = side * 0.5 * (r + inner)
        model.add("poles", tip.translate((end - 0.5 * cap - 0.0005, y, 0)), "poles")
        model.point("pole", "face", "poles", (end, y, 0.5 * deep), (1.0, 0.0, 0.0))
    return model.point("bow", "surface", "body", (-end, 0.0, 0.5 * deep), (-1.0, 0.0, 0.0)).rest_on_ground()


def _round(radius_m: float, x_m: float) -> np.ndarray:
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    return np.stack([x_m + radius_m * np.cos(turn), radius_m * np.sin(turn)], axis=1)


@template("hand rake")
def hand_rake(*, length_m: float, head: float, width_m: float) -> Model:
    """Build a hand cultivator lying on the tips of its three tines and the end of its handle."""
    start, end, drop = (0.5 - head) * length_m, 0.5 * length_m, 0.05
    lean = float(np.arcsin((drop - 0.014) / (0.95 * length_m)))
    model = Model()
    for side in (-1.0, 0.0, 1.0):
        spread, reach = side * 0.5 * width_m, head * length_m
        path = arc(
            [
                (start - 0.01, 0.003 * side, 0),
                (start + 0.3 * reach, 0.55 * spread, 0.01),
                (start + 0.72 * reach, spread, 0.006),
                (end - 0.02 * reach, spread, -0.4 * drop),
                (end - 0.08 * reach, spread, -drop),
            ],
            samples=30,
        )
        half = 0.0038 * np.interp(np.linspace(0, 1, 30), [0, 0.8, 1], [1, 1, 0.45])
        model.add("tines", tube(path, half, flatten=0.9).rotate((0, -np.degrees(lean), 0)), "tines")
        if side == 0.0:
            x, _, z = path[-1]
            tip = (x * np.cos(lean) - z * np.sin(lean), 0.0, x * np.sin(lean) + z * np.cos(lean))
    ferrule = cylinder(0.0085, 0.035, top_radius_m=0.0075).rotate((0, 90, 0)).translate((start - 0.035, 0, 0))
    model.add("neck", ferrule.rotate((0, -np.degrees(lean), 0)), "tines")
    handle = grip(-0.5 * length_m, start - 0.02, 0.0142, flatten=0.9)
    model.add("handle", handle.rotate((0, -np.degrees(lean), 0)), "handle")
    model.point("tines", "tip", "tines", (float(tip[0]), 0.0, float(tip[2])), (0.0, 0.0, -1.0))
    middle = 0.5 * (start - 0.5 * length_m)
    place = (middle * np.cos(lean) - 0.014 * np.sin(lean), 0.0, middle * np.sin(lean) + 0.014 * np.cos(lean))
    return model.point(
        "handle", "surface", "handle", (float(place[0]), 0.0, float(place[2])), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("paint roller")
def paint_roller(*, length_m: float, width_m: float, roll_m: float, handle: float) -> Model:
    """Build a roller on a bent wire, lying on its sleeve and its handle; ``roll_m`` is the sleeve's diameter."""
    r, end = 0.5 * roll_m, 0.5 * length_m
    at, tail = end - r, -0.5 * length_m
    stop, side, wire = tail + handle * length_m, 0.5 * width_m + 0.016, 0.0036
    low = 0.0155 - r
    path = arc(
        [
            (stop - 0.02, 0, low),
            (stop + 0.03, 0, 0.8 * low),
            (stop + 0.3 * (at - stop), -0.3 * side, 0.6 * low),
            (stop + 0.62 * (at - stop), -side, 0.3 * low),
            (at - 0.012, -side, 0.0),
            (at, -side + 0.012, 0.0),
            (at, -0.4 * width_m, 0.0),
        ],
        samples=60,
    )
    model = Model().add("wire", tube(path, wire, across=(0, 0, 1), sides=12), "wire")
    sleeve = (
        prism(polygon(_round(r, 0.0)), width_m, radius_m=0.006).rotate((90, 0, 0)).translate((at, 0.5 * width_m, 0))
    )
    model.add("roller", sleeve, "roller")
    model.cut("bore", cylinder(0.6 * r, 0.012).rotate((90, 0, 0)).translate((at, 0.5 * width_m + 0.004, 0)), "cap")
    model.add("handle", grip(tail, stop, 0.0145, flatten=0.9, swell=0.1).translate((0, 0, low)), "handle")
    model.point("roller", "surface", "roller", (at, 0.0, r), (0.0, 0.0, 1.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * (tail + stop), 0.0, low + 0.0143), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("squeegee")
def squeegee(*, length_m: float, width: float, handle_m: float) -> Model:
    """Build a lying window squeegee: a rubber blade in a channel across the end of its handle."""
    wide, end, r = width * length_m, 0.5 * length_m, 0.5 * handle_m
    channel = box(0.016, wide, 0.014, radius_m=0.0025).translate((end - 0.019, 0, -0.007))
    model = Model().add("channel", channel, "channel")
    rubber = polygon([(end - 0.02, -0.0022), (end, -0.0009), (end, 0.0009), (end - 0.02, 0.0022)])
    strip = prism(rubber, 1.02 * wide).rotate((90, 0, 0)).translate((0, 0.51 * wide, 0))
    model.add("rubber", strip, "rubber")
    model.region("edge", "rubber", lambda centers: centers[:, 0] > end - 0.0008)
    clamp = box(0.03, 0.3 * wide, 0.013, radius_m=0.005).translate((end - 0.032, 0, -0.0065))
    model.add("neck", clamp, "handle")
    along = np.linspace(0, 1, 30)
    half = r * np.interp(along, [0, 0.05, 0.15, 0.5, 0.8, 1], [0.6, 0.95, 1.05, 1.0, 0.75, 0.9])
    x = -end + along * (2 * end - 0.04)
    model.add("handle", tube(np.stack([x, 0 * x, 0 * x], 1), half, flatten=0.85), "handle")
    model.point("front edge", "edge", "edge", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("handle", "surface", "handle", (-0.5 * end, 0.0, 0.85 * r), (0.0, 0.0, 1.0)).rest_on_ground()


@template("magnifying glass")
def magnifying_glass(*, length_m: float, lens: float, thick_m: float) -> Model:
    """Build a lying lens in a ring on a handle; ``lens`` is the ring's diameter relative to the length."""
    r, end = 0.5 * lens * length_m, 0.5 * length_m
    at, band = end - r, max(0.0028, 0.075 * r)
    ring = rounded(
        [(r - band, -0.5 * thick_m), (r, -0.5 * thick_m), (r, 0.5 * thick_m), (r - band, 0.5 * thick_m)], 0.0012
    )
    hoop = lathe([(0, -0.5 * thick_m), *ring, (0, 0.5 * thick_m)]) - cylinder(r - band, 2 * thick_m).translate(
        (0, 0, -thick_m)
    )
    model = Model().add("frame", hoop.translate((at, 0, 0)), "frame")
    bulge = ellipsoid(2.1 * r, 2.1 * r, 0.92 * thick_m) ^ cylinder(r - 0.5 * band, thick_m).translate(
        (0, 0, -0.5 * thick_m)
    )
    model.add("lens", bulge.translate((at, 0, 0)), "lens")
    start = at - r
    model.add(
        "neck", cylinder(0.32 * thick_m + 0.001, 0.03).rotate((0, 90, 0)).translate((start - 0.024, 0, 0)), "frame"
    )
    model.add("handle", grip(-end, start - 0.012, max(0.0075, 0.62 * thick_m), flatten=0.9, swell=0.15), "handle")
    model.point("lens", "face", "lens", (at, 0.0, 0.46 * thick_m), (0.0, 0.0, 1.0))
    middle = 0.5 * (start - 0.012 - end)
    return model.point(
        "handle", "surface", "handle", (middle, 0.0, max(0.0075, 0.62 * thick_m)), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("mallet")
def mallet(*, length_m: float, head: float, face_m: float, handle_m: float) -> Model:
    """Build a lying mallet with its faces towards -Y and +Y; ``head`` is the head's length relative to the tool's."""
    across, at = head * length_m, 0.5 * length_m - 0.5 * face_m
    profile = rounded(
        [(0.0, 0.0), (0.46 * face_m, 0.0), (0.5 * face_m, 0.5 * across), (0.46 * face_m, across), (0.0, across)], 0.006
    )
    block = lathe(profile).rotate((90, 0, 0)).translate((at, 0.5 * across, 0))
    model = Model().add("head", block)
    model.region("face", "head", lambda centers: centers[:, 1] < -0.485 * across)
    model.region("other face", "head", lambda centers: centers[:, 1] > 0.485 * across)
    for side, name in ((-1.0, "face"), (1.0, "other face")):
        model.point("striking face", "face", name, (at, side * 0.5 * across, 0.0), (0.0, side, 0.0))
    model.add("handle", grip(-0.5 * length_m, at, 0.5 * handle_m, flatten=0.85, swell=0.05), "handle")
    middle = 0.5 * (-0.5 * length_m + at - 0.5 * face_m)
    return model.point("handle", "surface", "handle", (middle, 0.0, 0.445 * handle_m), (0.0, 0.0, 1.0)).rest_on_ground()
