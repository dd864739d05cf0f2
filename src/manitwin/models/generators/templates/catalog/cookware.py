"""Things that cook, drain, grate, bake, toast and weigh, standing with the front to -Y, spouts to -X and handles to +X."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import box, cylinder, ellipsoid, lathe, prism, rectangle, rounded, torus, union
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.vessel import ear, shell, smooth_profile
from manitwin.models.generators.templates.template import Model, template


@template("kettle")
def kettle(*, height_m: float, width: float, waist: float, spout: float, wall_m: float) -> Model:
    """Build a kettle with its lid on and a plastic foot.

    ``waist`` is its upper width relative to the lower, ``spout`` the length of the spout relative to the height.
    """
    model, h, r, foot = Model(), 0.86 * height_m, 0.5 * width * height_m, 0.09 * height_m
    side = smooth_profile([(r, 0.0), (0.99 * r, 0.3 * h), (0.5 * (1 + waist) * r, 0.65 * h), (waist * r, h)])
    profile = [(0.97 * r, 0.0), *side[1:]]
    reach = r + spout * height_m
    path = arc([(-0.45 * r, 0, 0.58 * h), (-0.5 * (r + reach), 0, 0.8 * h), (-reach, 0, 0.98 * h)])
    thick = np.linspace(0.42 * r, 0.19 * r, len(path))
    outer, inner = shell(profile, wall_m, 1.5 * wall_m)
    model.add("body", outer).add("spout", tube(path, thick, flatten=0.8))
    name, handle = ear(model, 0.5 * (1 + waist) * r, 0.95 * h, 0.2 * h, 0.62 * r, 0.024)
    model.add(name, handle, "handle").cut("inside", inner)
    beyond = np.vstack([path, 2 * path[-1] - path[-2]])
    model.cut("inside", tube(beyond, np.append(thick, thick[-1]) - wall_m, flatten=0.8))
    top = waist * r
    cover = [
        (0.0, 0.965 * h),
        (1.01 * top, 0.965 * h),
        (1.03 * top, h),
        (0.97 * top, 1.025 * h),
        (0.55 * top, 1.06 * h),
    ]
    cover += [(0.14 * top, 1.07 * h)]
    cover += [(0.14 * top, height_m - 0.012), (0.27 * top, height_m - 0.009), (0.24 * top, height_m), (0.0, height_m)]
    model.add("lid", lathe(rounded(cover, 0.004)), "lid")
    base = rounded(
        [(0.0, -foot), (1.03 * r, -foot), (1.05 * r, -0.3 * foot), (0.99 * r, 0.15 * foot), (0.0, 0.15 * foot)], 0.004
    )
    under = cylinder(0.9 * r, 0.6 * foot).translate((0, 0, -1.001 * foot))
    model.add("base", lathe(base) - (under - cylinder(0.3 * r, 2 * foot).translate((0, 0, -2 * foot))), "handle")
    ahead = (path[-1] - path[-2]) / np.linalg.norm(path[-1] - path[-2])
    lip = path[-1] + (0.8 * thick[-1] - 0.5 * wall_m) * np.array([-ahead[2], 0.0, ahead[0]])
    out = (float(ahead[0]), 0.0, float(ahead[2]))
    model.point("spout", "tip", "spout", (float(lip[0]), 0.0, float(lip[2])), out)
    model.point("lid", "surface", "lid", (0.0, 0.0, height_m), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.98 * r, -foot), (0.0, 0.0, -1.0)).rest_on_ground()


@template("colander")
def colander(*, width_m: float, height: float, wall_m: float, ears: float) -> Model:
    """Build a bowl with holes on a foot ring, with two handles along X that protrude by ``ears`` of its width."""
    r, high, model = 0.5 * width_m, height * width_m, Model()
    foot = 0.1 * high
    turn = np.linspace(0.0, np.pi / 2, 14)
    side = [(float(r * (0.42 + 0.58 * np.sin(a))), float(foot + (high - foot) * (1 - np.cos(a)))) for a in turn]
    outer, inner = shell([(0.4 * r, foot), *side[1:]], wall_m, wall_m)
    model.add("body", outer)
    for edge in (1.0, -1.0):
        across, out = 0.26 * width_m, r + ears * width_m
        wall = 0.975 * float(np.sqrt(r**2 - across**2))
        bend = [(wall, -across), (out, -0.75 * across), (out, 0.75 * across), (wall, across)]
        path = arc([(edge * x, y, 0.955 * high) for x, y in bend])
        model.add("handle", tube(path, 0.0042, across=(0, 0, 1)), "handle")
        model.point("handle", "surface", "handle", (edge * (out + 0.004), 0.0, 0.955 * high), (edge, 0.0, 0.0))
    model.cut("inside", inner)
    model.add("body", torus(r - 0.001, max(0.0022, wall_m)).translate((0, 0, high - 0.002)) - inner)
    wide = max(2 * wall_m, 0.0022)
    ring = lathe([(0.44 * r - wide, 0.0), (0.44 * r, 0.0), (0.46 * r, 1.25 * foot), (0.46 * r - wide, 1.25 * foot)])
    model.add("base", ring - cylinder(0.44 * r - wide, foot + 0.5 * wall_m))
    model.perforate("holes", lambda: _colander_holes(r, high, foot))
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: centers[:, 2] > 0.965 * high)
    return model.point("opening", "opening", "rim", (0.0, 0.0, high), (0.0, 0.0, 1.0)).rest_on_ground()


def _colander_holes(r: float, high: float, foot: float) -> Manifold:
    """Return five rings of pins through the side of a bowl of radius ``r``, and a grid of them through its base."""
    holes: list[Manifold] = []
    size, steps = 0.019 * r + 0.0012, 5
    for row in range(steps):
        a = 0.42 + 0.2 * row
        x, z = r * (0.42 + 0.58 * np.sin(a)), foot + (high - foot) * (1 - np.cos(a))
        lean = np.degrees(np.arctan2((high - foot) * np.sin(a), 0.58 * r * np.cos(a)))
        count = 4 * int(2 * np.pi * x / (4.6 * size) / 4)
        pin = (
            cylinder(size, 0.04, sides=10)
            .translate((0, 0, -0.02))
            .rotate((0, -float(lean), 0))
            .translate((float(x), 0, float(z)))
        )
        holes += [pin.rotate((0, 0, 360 * (number + 0.5 * (row % 2)) / count)) for number in range(count)]
    pitch = 4.0 * size
    for u in range(-6, 7):
        for v in range(-6, 7):
            if np.hypot(u, v) * pitch < 0.37 * r:
                holes.append(cylinder(size, 0.04, sides=10).translate((u * pitch, v * pitch, foot - 0.02)))
    return union(holes)


@template("grater")
def grater(*, height_m: float, width: float, depth: float, taper: float) -> Model:
    """Build a standing box grater with the coarse face towards -Y: four perforated walls of sheet and a handle on top.

    ``width`` and ``depth`` of its foot are relative to the height, ``taper`` is the width of its top relative to its foot.
    """
    high, wall, x, y = 0.86 * height_m, 0.0008, 0.5 * width * height_m, 0.5 * depth * height_m
    model = Model().add("body", prism(rectangle(2 * x, 2 * y, radius_m=0.006), high, top=taper), "body")
    hollow = prism(rectangle(2 * (x - wall), 2 * (y - wall), radius_m=0.0055), high, top=taper)
    model.cut("inside", hollow.translate((0, 0, -2 * wall)), "body")
    lean = float(np.degrees(np.arctan((1 - taper) * y / high)))
    model.perforate("holes", lambda: _rasps(x, y, high, taper, lean), "body")
    model.perforate("slots", lambda: _slots(x, y, high), "body")
    reach = 0.92 * taper * x
    path = arc(
        [
            (-reach, 0, high - 0.006),
            (-0.9 * reach, 0, 0.97 * height_m),
            (0.9 * reach, 0, 0.97 * height_m),
            (reach, 0, high - 0.006),
        ]
    )
    model.add("handle", tube(path, min(0.011, 0.7 * taper * y), flatten=0.55), "handle")
    lip = prism(rectangle(2 * taper * x, 2 * taper * y, radius_m=0.005), 0.006, radius_m=0.001)
    lip = lip - box(1.5 * taper * x, 1.3 * taper * y, 0.03).translate((0, 0, -0.01))
    model.add("top", lip.translate((0, 0, high - 0.004)), "handle")
    tilt = np.radians(lean)
    out = y * (1 - (1 - taper) * 0.45)
    model.point(
        "grating face", "face", "body", (0.0, -out, 0.45 * high), (0.0, -float(np.cos(tilt)), float(np.sin(tilt)))
    )
    return model.point("handle", "surface", "handle", (0.0, 0.0, float(path[:, 2].max()) + 0.006), (0.0, 0.0, 1.0))


def _rasps(x: float, y: float, high: float, taper: float, lean_deg: float) -> Manifold:
    """Return pins through the front and back of a grater, coarse and fine; ``x`` and ``y`` are half the sides of its foot."""
    rasps: list[Manifold] = []
    for face, radius, pitch in ((-1.0, 0.0042, 0.0135), (1.0, 0.0016, 0.0072)):
        columns = int(1.5 * x * (0.5 + 0.5 * taper) / pitch)
        for row in range(int(0.72 * high / pitch)):
            z = 0.1 * high + (row + 0.5) * pitch
            out = y * (1 - (1 - taper) * z / high)
            for column in range(columns - row % 2):
                at = ((column - 0.5 * (columns - 1 - row % 2)) * pitch, face * out, z)
                hole = cylinder(radius, 0.012, sides=12 if face < 0 else 6).translate((0, 0, -0.006))
                rasps.append(hole.rotate((90 - face * lean_deg, 0, 0)).translate(at))
    return union(rasps)


def _slots(x: float, y: float, high: float) -> Manifold:
    """Return three slots across one side of a grater."""
    slot = box(0.02, 0.95 * y, 0.0045, radius_m=0.0015)
    return union([slot.translate((x, 0, (0.28 + 0.2 * number) * high)) for number in range(3)])


@template("casserole dish")
def casserole_dish(*, length_m: float, width: float, height_m: float, wall_m: float) -> Model:
    """Build an oblong baking dish with a lug at each end; ``width`` is relative to its length without them."""
    across, slope = width * length_m, 1.12
    low = rectangle(length_m / slope, across / slope, radius_m=0.22 * across)
    model = Model().add("body", prism(low, height_m, top=slope), "body")
    for side in (1.0, -1.0):
        lug = prism(rectangle(0.075, 0.5 * across, radius_m=0.018), 0.011, radius_m=0.004)
        model.add("handle", lug.translate((side * (0.5 * length_m - 0.012), 0, height_m - 0.011)), "body")
        x = side * (0.5 * length_m + 0.0255)
        model.point("handle", "surface", "handle", (x, 0.0, height_m - 0.0055), (side, 0.0, 0.0))
    inner = rectangle(length_m / slope - 2 * wall_m, across / slope - 2 * wall_m, radius_m=0.2 * across)
    model.cut("inside", prism(inner, height_m + 0.001, top=slope * 1.002).translate((0, 0, wall_m)), "body")
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: centers[:, 2] > 0.94 * height_m)
    model.region("base", "body", lambda centers: centers[:, 2] < 0.01 * height_m)
    model.point("opening", "opening", "rim", (0.0, 0.0, height_m), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("toaster")
def toaster(*, length_m: float, width: float, height: float) -> Model:
    """Build a toaster with two slots along X, and with lever and dial on the end towards +X."""
    deep, high, end = width * length_m, height * length_m, 0.5 * length_m
    foot = 0.012
    model = Model().add("body", box(length_m, deep, high - foot, radius_m=0.16 * high).translate((0, 0, foot)), "body")
    base = prism(rectangle(0.96 * length_m, 0.92 * deep, radius_m=0.03), 0.24 * high, radius_m=0.006)
    model.add("base", base.translate((0, 0, foot - 0.001)), "base")
    for side in (-1.0, 1.0):
        slot = box(0.66 * length_m, 0.17 * deep, high, radius_m=0.004).translate(
            (-0.04 * length_m, side * 0.2 * deep, 0.3 * high)
        )
        model.cut("slots", slot, "inside")
        model.point("slot", "opening", "slots", (-0.04 * length_m, side * 0.2 * deep, high), (0.0, 0.0, 1.0))
        for x in (-0.38, 0.38):
            model.add("base", cylinder(0.011, foot + 0.02).translate((x * length_m, side * 0.32 * deep, 0)), "base")
    track = box(0.024, 0.011, 0.48 * high, radius_m=0.004).translate((end, 0, 0.32 * high))
    model.cut("track", track, "inside")
    stem = box(0.04, 0.007, 0.007).translate((end, 0, 0.72 * high))
    knob = box(0.016, 0.04, 0.015, radius_m=0.005).translate((end + 0.018, 0, 0.72 * high - 0.004))
    model.add("lever", stem + knob, "lever")
    dial = cylinder(0.013, 0.016).rotate((0, 90, 0)).translate((end - 0.006, -0.22 * deep, 0.3 * high))
    model.add("dial", dial, "lever")
    model.point("lever", "button", "lever", (end + 0.018, 0.0, 0.72 * high + 0.011), (0.0, 0.0, 1.0))
    return model.point("dial", "button", "dial", (end + 0.01, -0.22 * deep, 0.3 * high), (1.0, 0.0, 0.0))


@template("kitchen scale")
def kitchen_scale(*, length_m: float, width: float, thick_m: float, platform: float) -> Model:
    """Build a flat scale with a display and two buttons before the platform, which takes ``platform`` of the depth."""
    across = width * length_m
    foot, size = 0.003, platform * length_m
    body = prism(rectangle(across, length_m, radius_m=0.016), thick_m - foot, radius_m=0.0045)
    model = Model().add("body", body.translate((0, 0, foot)), "body")
    for x in (-0.36, 0.36):
        for y in (-0.4, 0.4):
            model.add("feet", cylinder(0.009, 0.5 * thick_m).translate((x * across, y * length_m, 0)), "body")
    at = 0.5 * length_m - 0.5 * size - 0.008
    neck = cylinder(0.3 * size, 0.005).translate((0, at, thick_m - 0.001))
    model.add("neck", neck, "body")
    plate = prism(rectangle(min(size, across - 0.008), size, radius_m=0.02), 0.005, radius_m=0.0012)
    model.add("platform", plate.translate((0, at, thick_m + 0.002)), "platform")
    front = at - 0.5 * size
    middle = 0.5 * (front - 0.5 * length_m)
    deep = front + 0.5 * length_m
    model.add(
        "screen",
        box(0.4 * across, 0.46 * deep, 0.002, radius_m=0.0006).translate((0, middle, thick_m - 0.001)),
        "screen",
    )
    for side in (-1.0, 1.0):
        knob = cylinder(min(0.15 * deep, 0.007), 0.004).translate((side * 0.34 * across, middle, thick_m - 0.002))
        model.add("buttons", knob, "buttons")
    model.point("platform", "face", "platform", (0.0, at, thick_m + 0.007), (0.0, 0.0, 1.0))
    model.point("screen", "face", "screen", (0.0, middle, thick_m + 0.001), (0.0, 0.0, 1.0))
    return model.point("button", "button", "buttons", (-0.34 * across, middle, thick_m + 0.002), (0.0, 0.0, 1.0))


@template("tea infuser")
def tea_infuser(*, length_m: float, ball_m: float) -> Model:
    """Build a perforated ball with a long handle, lying on the ball, which opens at the seam of its two halves."""
    r, end, wall = 0.5 * ball_m, 0.5 * length_m, 0.0009
    at = end - r
    ball = ellipsoid(2 * r, 2 * r, 2 * r)
    model = Model().add("ball", ball.translate((at, 0, 0)), "ball")
    seam = cylinder(r + 0.0014, 0.0026).rotate((0, 90, 0)).translate((at - 0.0013, 0, 0))
    model.add("seam", seam, "ball")
    path = arc([(at - r + 0.002, 0, 0.0), (at - r - 0.02, 0, 0.0025), (-0.3 * end, 0, 0.004), (-end, 0, 0.004)])
    half = 0.0042 * np.interp(np.linspace(0, 1, len(path)), [0, 0.1, 0.6, 0.96, 1], [0.8, 0.9, 1.1, 2.4, 1.8])
    model.add("handle", tube(path, half, flatten=0.28), "ball")
    model.cut("inside", ellipsoid(2 * (r - wall), 2 * (r - wall), 2 * (r - wall)).translate((at, 0, 0)), "ball")
    model.perforate("holes", lambda: _infuser_holes(r).rotate((0, 90, 0)).translate((at, 0, 0)), "ball")
    model.point("ball", "surface", "ball", (at, 0.0, r), (0.0, 0.0, 1.0))
    return model.point("handle", "surface", "handle", (-0.5 * end, 0.0, 0.0065), (0.0, 0.0, 1.0)).rest_on_ground()


def _infuser_holes(r: float) -> Manifold:
    """Return radial pins from the centre of a ball of radius ``r``, except at its seam and at the root of the handle."""
    count, holes = 90, []
    for number in range(count):
        z = 1 - 2 * (number + 0.5) / count
        turn = number * np.pi * (3 - np.sqrt(5))
        if abs(z) * r < 0.0036 or z < -0.88:
            continue
        level = np.degrees(np.arccos(z))
        pin = cylinder(0.0011, r, sides=8).translate((0, 0, 0.5 * r)).rotate((0, float(level), float(np.degrees(turn))))
        holes.append(pin)
    return union(holes)


@template("baking tray")
def baking_tray(*, length_m: float, width: float, height: float, lip: float) -> Model:
    """Build a sheet tray with flaring walls and a flat ``lip`` all around, relative to the length."""
    sheet, flare, across, high, edge = 0.0012, 0.9, width * length_m, height * length_m, lip * length_m
    long, wide = length_m - 2 * edge, across - 2 * edge
    corner, top = 0.06 * wide, high - 1.5 * sheet
    outer = prism(rectangle(flare * long, flare * wide, radius_m=corner), high, top=1 / flare)
    inner = prism(rectangle(flare * long - 2 * sheet, flare * wide - 2 * sheet, radius_m=corner), high, top=1 / flare)
    rim = prism(rectangle(length_m, across, radius_m=corner + edge), 1.5 * sheet).translate((0, 0, top))
    model = Model().add("body", outer).add("rim", rim).cut("inside", inner.translate((0, 0, sheet)))
    model.region("base", "body", lambda centers: centers[:, 2] < 0.1 * sheet)
    model.point("inside", "face", "inside", (0.0, 0.0, sheet), (0.0, 0.0, 1.0))
    for side in (-0.5, 0.5):
        model.point("rim", "edge", "rim", (side * length_m, 0.0, top + 0.75 * sheet), (2 * side, 0.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
