"""Computers and accessories: slabs that open, boxes with sockets and lenses, and game controllers."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import box, cylinder, ellipsoid, lathe, prism, rectangle, rounded, union
from manitwin.geometry.solids.sweep import tube
from manitwin.models.generators.templates.template import Model, template


@template("laptop")
def laptop(*, length_m: float, width: float, thick_m: float, lean: float) -> Model:
    """Build an open laptop with the trackpad towards -Y; the screen leans back by ``lean`` of its height."""
    deep, lid = width * length_m, 0.4 * thick_m
    model = Model().add("base", prism(rectangle(length_m, deep, radius_m=0.01), thick_m, radius_m=0.0016))
    pad = box(0.32 * length_m, 0.27 * deep, 0.01).translate((0, -0.31 * deep, thick_m - 0.0007))
    model.cut("trackpad", pad, "trackpad")
    pitch_x, pitch_y, middle = 0.88 * length_m / 14, 0.44 * deep / 5, 0.11 * deep
    keys = [
        box(0.84 * pitch_x, 0.84 * pitch_y, 0.003).translate(
            ((column - 6.5) * pitch_x, middle + (row - 2) * pitch_y, thick_m - 0.0015)
        )
        for row in range(5)
        for column in range(14)
        if row > 0 or not 4 <= column <= 9
    ]
    bar = box(5.84 * pitch_x, 0.84 * pitch_y, 0.003).translate((0, middle - 2 * pitch_y, thick_m - 0.0015))
    model.add("keys", union([*keys, bar]), "keys")
    angle, hinge_y, hinge_z = np.arctan(lean), 0.5 * deep - 0.5 * thick_m, thick_m
    rod = cylinder(0.4 * thick_m, 0.7 * length_m).rotate((0, 90, 0)).translate((-0.35 * length_m, hinge_y, hinge_z))
    model.add("hinge", rod)

    def leaned(solid: Manifold, z_m: float) -> Manifold:
        upright = solid.rotate((90, 0, 0)).translate((0, 0.5 * lid, z_m))
        return upright.rotate((-float(np.degrees(angle)), 0, 0)).translate((0, hinge_y, hinge_z))

    model.add("lid", leaned(prism(rectangle(length_m, deep, radius_m=0.01), lid, radius_m=0.3 * lid), 0.5 * deep))
    glass = prism(rectangle(0.95 * length_m, 0.86 * deep, radius_m=0.003), lid + 0.0004)
    model.add("screen", leaned(glass, 0.53 * deep), "screen")
    out, up = -0.5 * lid - 0.0004, 0.53 * deep
    sin, cos = float(np.sin(angle)), float(np.cos(angle))
    face = (0.0, hinge_y + out * cos + up * sin, hinge_z - out * sin + up * cos)
    model.point("screen", "face", "screen", face, (0.0, -cos, sin))
    model.point("keyboard", "face", "keys", (0.0, middle, thick_m + 0.0015), (0.0, 0.0, 1.0))
    return model.point("trackpad", "face", "trackpad", (0.0, -0.31 * deep, thick_m - 0.0007), (0.0, 0.0, 1.0))


@template("game controller")
def game_controller(*, length_m: float, depth: float, height: float) -> Model:
    """Build a gamepad on its back: two grips towards -Y, sticks and buttons up, triggers towards +Y."""
    s, deep, high = length_m, depth * length_m, height * length_m
    front = 0.28 * deep
    sides = [ellipsoid(0.36 * s, 0.62 * deep, high).translate((x * s, front, 0)) for x in (-0.27, 0.27)]
    pieces = [(sides[0] + sides[1]).hull()]
    for side in (-1.0, 1.0):
        upper = ellipsoid(0.34 * s, 0.5 * deep, high).translate((side * 0.3 * s, 0.2 * deep, 0))
        grip = ellipsoid(0.2 * s, 0.3 * deep, 0.72 * high).translate((side * 0.4 * s, -0.37 * deep, -0.14 * high))
        pieces.append((upper + grip).hull())
    upper_half, grips = union(pieces).split_by_plane((0, 1, 0), -0.12 * deep)
    model = Model().add("body", upper_half).add("grips", grips, "grips")
    low = 0.2 * high
    for x, y in ((-0.28 * s, 0.33 * deep), (0.14 * s, 0.1 * deep)):
        stick = cylinder(0.035 * s, 0.34 * high + 0.004).translate((x, y, low))
        cap = lathe(rounded([(0, 0), (0.058 * s, 0), (0.058 * s, 0.004), (0, 0.003)], 0.001))
        model.add("sticks", stick + cap.translate((x, y, low + 0.34 * high + 0.003)), "sticks")
    arms = [box(0.11 * s, 0.035 * s, 0.33 * high), box(0.035 * s, 0.11 * s, 0.33 * high)]
    model.add("d-pad", union(arms).translate((-0.14 * s, 0.1 * deep, low)), "buttons")
    turns = [(0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0)]
    knobs = [
        cylinder(0.027 * s, 0.33 * high, sides=20).translate(
            (0.29 * s + 0.062 * s * x, 0.33 * deep + 0.062 * s * y, low)
        )
        for x, y in turns
    ]
    model.add("buttons", union(knobs), "buttons")
    for side in (-1.0, 1.0):
        trigger = box(0.2 * s, 0.12 * deep, 0.5 * high, radius_m=0.004)
        model.add("triggers", trigger.translate((side * 0.28 * s, 0.55 * deep, -0.3 * high)), "buttons")
    top = low + 0.33 * high
    model.point("buttons", "button", "buttons", (0.352 * s, 0.33 * deep, top), (0.0, 0.0, 1.0))
    model.point("stick", "button", "sticks", (-0.28 * s, 0.33 * deep, low + 0.34 * high + 0.006), (0.0, 0.0, 1.0))
    model.point("trigger", "button", "triggers", (0.28 * s, 0.61 * deep, -0.05 * high), (0.0, 1.0, 0.0))
    return model.point(
        "grip", "surface", "grips", (0.4 * s, -0.37 * deep, 0.22 * high), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("webcam")
def webcam(*, length_m: float, height: float, depth: float, lens: float) -> Model:
    """Build a camera bar on a folded clip, its lens towards -Y."""
    high, deep = height * length_m, depth * length_m
    r, middle = 0.5 * lens * high, 0.5 * high + 0.016
    ends = [
        ellipsoid(high, 1.15 * deep, high).translate((side * 0.5 * (length_m - high), 0, middle)) for side in (-1, 1)
    ]
    cut = box(2 * length_m, deep, 2 * high)
    model = Model().add("body", (ends[0] + ends[1]).hull() ^ cut)
    ring = cylinder(r, 0.5 * deep + 0.004).rotate((90, 0, 0)).translate((0, 0, middle))
    model.add("lens", ring, "lens")
    front = -0.5 * deep - 0.004
    dome = ellipsoid(1.5 * r, 1.5 * r, 0.4 * r).rotate((90, 0, 0)).translate((0, front, middle))
    model.add("glass", dome, "glass")
    led = cylinder(0.0016, 0.004, sides=12).rotate((90, 0, 0)).translate((0.32 * length_m, -0.5 * deep + 0.003, middle))
    model.add("light", led, "glass")
    model.add("clip", box(0.014, 0.012, 0.02).translate((0, 0, 0.002)), "clip")
    model.add("clip", box(0.5 * length_m, 1.3 * deep, 0.005, radius_m=0.002).translate((0, 0.1 * deep, 0.007)), "clip")
    model.add("clip", box(0.44 * length_m, 1.9 * deep, 0.005, radius_m=0.002).translate((0, 0.3 * deep, 0)), "clip")
    model.point("lens", "face", "glass", (0.0, front - 0.2 * r, middle), (0.0, -1.0, 0.0))
    return model.point("clip", "face", "clip", (0.0, 0.3 * deep, 0.0), (0.0, 0.0, -1.0))


@template("charger")
def charger(*, length_m: float, width: float, thick: float, pins_m: float) -> Model:
    """Build a plug-in charger lying on its side, with two pins towards +X and the socket towards -X."""
    long = length_m - pins_m
    across, high = width * long, thick * long
    end = 0.5 * length_m
    body = box(long, across, high, radius_m=0.12 * high)
    model = Model().add("body", body.translate((-0.5 * pins_m, 0, 0)))
    for side in (-1.0, 1.0):
        profile = rounded([(0, 0), (0.0022, 0), (0.0022, pins_m + 0.004), (0, pins_m + 0.004)], 0.0015)
        pin = lathe(profile, sides=20).rotate((0, 90, 0))
        model.add("pins", pin.translate((end - pins_m - 0.004, side * min(0.0095, 0.3 * across), 0.5 * high)), "pins")
    model.cut("socket", box(0.014, 0.0095, 0.0045, radius_m=0.002).translate((-end, 0, 0.5 * high - 0.0022)), "socket")
    model.point("pins", "tip", "pins", (end, min(0.0095, 0.3 * across), 0.5 * high), (1.0, 0.0, 0.0))
    return model.point("socket", "hole", "socket", (-end, 0.0, 0.5 * high), (-1.0, 0.0, 0.0))


@template("power strip")
def power_strip(*, length_m: float, width_m: float, thick_m: float, sockets: float) -> Model:
    """Build a power strip with a switch towards +X and the start of its cable towards -X."""
    count = round(sockets)
    model = Model().add("body", box(length_m, width_m, thick_m, radius_m=0.006))
    pitch = 0.8 * length_m / count
    r = min(0.0195, 0.44 * pitch, 0.4 * width_m)
    places = [(number - 0.5 * (count - 1)) * pitch - 0.05 * length_m for number in range(count)]
    model.cut("sockets", union([cylinder(r, thick_m).translate((x, 0, thick_m - 0.012)) for x in places]), "socket")
    holes = [
        cylinder(0.0026, thick_m, sides=16).translate((x + 0.34 * r * side, 0.34 * r * side, 0.3 * thick_m))
        for x in places
        for side in (-1.4, 1.4)
    ]
    model.cut("contacts", union(holes), "contacts")
    rocker = box(0.05 * length_m, 0.4 * width_m, 0.006, radius_m=0.001).rotate((0, 8, 0))
    model.add("switch", rocker.translate((0.42 * length_m, 0, thick_m - 0.003)), "switch")
    path = np.array([[-0.48, 0, 0.5], [-0.53, 0, 0.5], [-0.6, 0, 0.3]]) * (length_m, 1, thick_m)
    model.add("cable", tube(path, [0.006, 0.005, 0.004]), "cable")
    model.point("socket", "hole", "sockets", (places[-1], 0.0, thick_m), (0.0, 0.0, 1.0))
    return model.point("switch", "button", "switch", (0.42 * length_m, 0.0, thick_m + 0.003), (0.0, 0.0, 1.0))


@template("hard drive")
def hard_drive(*, length_m: float, width: float, thick_m: float) -> Model:
    """Build a portable drive that lies, its socket towards +X."""
    across = width * length_m
    body = prism(rectangle(length_m, across, radius_m=0.008), thick_m, radius_m=0.0012)
    model = Model().add("body", body)
    panel = prism(rectangle(0.86 * length_m, 0.8 * across, radius_m=0.004), 0.004)
    model.cut("panel", panel.translate((0, 0, thick_m - 0.0006)), "panel")
    model.cut("socket", box(0.018, 0.0125, 0.0035).translate((0.5 * length_m, 0, 0.5 * thick_m - 0.0018)), "socket")
    lamp = cylinder(0.0014, 0.0008, sides=12).translate((0.38 * length_m, 0.3 * across, thick_m - 0.0008))
    model.add("light", lamp, "light")
    model.point("socket", "hole", "socket", (0.5 * length_m, 0.0, 0.5 * thick_m), (1.0, 0.0, 0.0))
    return model.point("front", "face", "panel", (0.0, 0.0, thick_m - 0.0006), (0.0, 0.0, 1.0))
