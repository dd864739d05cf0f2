"""Electronics: slabs and boxes with screens, buttons and lenses; faces point up if they lie and to -Y if they stand."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import box, cylinder, ellipsoid, lathe, prism, rectangle, rounded
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.template import Model, template


def slab(model: Model, x_m: float, y_m: float, z_m: float, *, corner_m: float = 0.008, edge_m: float = 0.002) -> Model:
    """Add a lying ``body`` with corners rounded by ``corner_m`` in plan view and edges rounded by ``edge_m``."""
    return model.add("body", prism(rectangle(x_m, y_m, radius_m=corner_m), z_m, radius_m=min(edge_m, 0.45 * z_m)))


@template("mobile phone")
@template("tablet")
def screened(*, length_m: float, width: float, thick_m: float, border: float) -> Model:
    """Build a phone or a tablet on its back, with the screen up."""
    across = width * length_m
    model = slab(Model(), length_m, across, thick_m)
    edge = 2 * border * across
    model.add(
        "screen",
        prism(rectangle(length_m - edge, across - edge, radius_m=0.003), 0.001).translate((0, 0, thick_m - 0.0006)),
        "screen",
    )
    side = 0.5 * across
    model.add("button", box(0.012, 0.002, 0.36 * thick_m).translate((0.2 * length_m, side, 0.32 * thick_m)))
    model.point("screen", "face", "screen", (0.0, 0.0, thick_m + 0.0004), (0.0, 0.0, 1.0))
    return model.point("button", "button", "button", (0.2 * length_m, side + 0.001, 0.5 * thick_m), (0.0, 1.0, 0.0))


@template("remote control")
def remote_control(*, length_m: float, width: float, thick_m: float, rows: float) -> Model:
    """Build a remote control with rows of buttons; the end towards +X points at the device."""
    across, count = width * length_m, round(rows)
    model = slab(Model(), length_m, across, thick_m, corner_m=0.01, edge_m=0.006)
    pitch = 0.66 * length_m / count
    for row in range(count):
        for column in (-1, 0, 1):
            knob = cylinder(0.3 * min(pitch, 0.24 * across / 0.6), 0.003, sides=16)
            model.add(
                "buttons",
                knob.translate(
                    ((row - 0.5 * count + 0.5) * pitch - 0.03 * length_m, 0.27 * across * column, thick_m - 0.001)
                ),
                "buttons",
            )
    model.add(
        "power button",
        cylinder(0.1 * across, 0.003, sides=20).translate((0.42 * length_m, -0.25 * across, thick_m - 0.001)),
        "buttons",
    )
    model.region("front", "body", lambda centers: centers[:, 0] > 0.499 * length_m)
    return model.point(
        "power button", "button", "power button", (0.42 * length_m, -0.25 * across, thick_m + 0.002), (0.0, 0.0, 1.0)
    )


@template("computer mouse")
def computer_mouse(*, length_m: float, width: float, height: float) -> Model:
    """Build a mouse with buttons and wheel towards +X."""
    across, high = width * length_m, height * length_m
    half = box(2 * length_m, 2 * length_m, 2 * length_m)
    body = ellipsoid(length_m, across, 2 * high) ^ half
    groove = box(0.5 * length_m, 0.0014, high).translate((0.3 * length_m, 0, 0.45 * high))
    model = Model().add("body", body).cut("groove", groove)
    model.region(
        "buttons", "body", lambda centers: (centers[:, 0] > 0.1 * length_m) & (centers[:, 2] > 0.3 * high), "buttons"
    )
    rise = high * float(np.sqrt(1 - 0.56**2))
    model.add(
        "wheel", cylinder(0.011, 0.006, sides=24).rotate((90, 0, 0)).translate((0.28 * length_m, 0.003, rise - 0.007))
    )
    model.point(
        "left button",
        "button",
        "buttons",
        (0.28 * length_m, 0.2 * across, high * float(np.sqrt(1 - 0.56**2 - 0.16))),
        (0.3, 0.2, 0.9),
    )
    return model.point("wheel", "button", "wheel", (0.28 * length_m, 0.0, rise + 0.004), (0.0, 0.0, 1.0))


@template("keyboard")
def keyboard(*, length_m: float, width: float, thick_m: float) -> Model:
    """Build a keyboard of five rows of keys and a space bar."""
    across = width * length_m
    model = slab(Model(), length_m, across, thick_m, corner_m=0.006)
    columns = 15
    pitch_x, pitch_y = 0.95 * length_m / columns, 0.86 * across / 5
    for row in range(5):
        for column in range(columns):
            if row == 0 and 4 <= column <= 9:
                continue
            place = ((column - (columns - 1) / 2) * pitch_x, (row - 2) * pitch_y, thick_m - 0.001)
            model.add("keys", box(0.84 * pitch_x, 0.84 * pitch_y, 0.005).translate(place), "keys")
    middle = (6.5 - (columns - 1) / 2) * pitch_x
    model.add(
        "space bar",
        box(5.84 * pitch_x, 0.84 * pitch_y, 0.005).translate((middle, -2 * pitch_y, thick_m - 0.001)),
        "keys",
    )
    return model.point("space bar", "button", "space bar", (middle, -2 * pitch_y, thick_m + 0.004), (0.0, 0.0, 1.0))


@template("calculator")
def calculator(*, length_m: float, width: float, thick_m: float) -> Model:
    """Build a calculator whose display is towards +X."""
    across = width * length_m
    model = slab(Model(), length_m, across, thick_m, corner_m=0.006)
    model.cut("frame", box(0.16 * length_m, 0.84 * across, 0.01).translate((0.36 * length_m, 0, thick_m - 0.002)))
    model.add(
        "screen", box(0.15 * length_m, 0.82 * across, 0.002).translate((0.36 * length_m, 0, thick_m - 0.0028)), "screen"
    )
    for row in range(5):
        for column in range(4):
            place = (-0.42 * length_m + 0.135 * length_m * row, (column - 1.5) * 0.21 * across, thick_m - 0.001)
            model.add("buttons", box(0.1 * length_m, 0.16 * across, 0.0035).translate(place), "buttons")
    model.point("screen", "face", "screen", (0.36 * length_m, 0.0, thick_m - 0.0008), (0.0, 0.0, 1.0))
    return model.point(
        "key", "button", "buttons", (-0.42 * length_m, 0.315 * across, thick_m + 0.0025), (0.0, 0.0, 1.0)
    )


@template("power bank")
def power_bank(*, length_m: float, width: float, thick_m: float) -> Model:
    """Build a power bank with a socket in its end towards +X."""
    across = width * length_m
    model = slab(Model(), length_m, across, thick_m, corner_m=0.01, edge_m=0.004)
    model.cut("socket", box(0.02, 0.0095, 0.0045).translate((0.5 * length_m, 0, 0.5 * thick_m - 0.0022)))
    model.add("button", box(0.008, 0.002, 0.2 * thick_m).translate((0.3 * length_m, 0.5 * across, 0.4 * thick_m)))
    model.point("socket", "hole", "socket", (0.5 * length_m, 0.0, 0.5 * thick_m), (1.0, 0.0, 0.0))
    return model.point(
        "button", "button", "button", (0.3 * length_m, 0.5 * across + 0.001, 0.5 * thick_m), (0.0, 1.0, 0.0)
    )


@template("usb stick")
def usb_stick(*, length_m: float, width: float, thick_m: float) -> Model:
    """Build a stick whose plug is towards +X."""
    across = max(width * length_m, 0.0145)
    body = box(length_m - 0.012, across, thick_m, radius_m=0.002).translate((-0.006, 0, 0))
    model = (
        Model()
        .add("body", body)
        .add("plug", box(0.014, 0.012, 0.0045).translate((0.5 * length_m - 0.007, 0, 0.5 * thick_m - 0.00225)), "plug")
    )
    return model.point("plug", "tip", "plug", (0.5 * length_m, 0.0, 0.5 * thick_m), (1.0, 0.0, 0.0))


@template("speaker")
def speaker(*, height_m: float, width: float, depth: float) -> Model:
    """Build a box with two cones in its front."""
    x, y = width * height_m, depth * height_m
    model = Model().add("body", box(x, y, height_m, radius_m=0.004))
    for part, radius, z in (("cone", 0.38 * x, 0.34 * height_m), ("tweeter", 0.18 * x, 0.76 * height_m)):
        dish = (
            cylinder(radius, 0.03 * height_m + 0.001, top_radius_m=0.55 * radius)
            .rotate((-90, 0, 0))
            .translate((0, -0.5 * y - 0.001, z))
        )
        model.cut(part, dish, "cone")
        model.point(part, "face", part, (0.0, -0.5 * y + 0.03 * height_m, z), (0.0, -1.0, 0.0))
    return model


@template("camera")
def camera(*, length_m: float, height: float, depth: float, lens: float) -> Model:
    """Build a camera that stands, its lens towards -Y and its release on top."""
    high, y = height * length_m, depth * length_m
    reach, radius = lens * length_m, 0.42 * high
    model = Model().add("body", box(length_m, y, high, radius_m=0.006))
    tube_solid = lathe(rounded([(radius, 0), (radius, 0.8 * reach), (0.92 * radius, reach), (0, reach)], 0.002))
    model.add("lens", tube_solid.rotate((90, 0, 0)).translate((0, -0.45 * y, 0.46 * high)), "lens")
    front = -0.45 * y - reach
    model.cut(
        "glass",
        ellipsoid(1.4 * radius, 1.4 * radius, 0.5 * radius).rotate((90, 0, 0)).translate((0, front, 0.46 * high)),
        "lens",
    )
    model.add("viewfinder", box(0.34 * length_m, 0.7 * y, 0.2 * high, radius_m=0.004).translate((0, 0, 0.95 * high)))
    model.add("button", cylinder(0.006, 0.006).translate((-0.36 * length_m, -0.1 * y, high - 0.003)))
    model.point("lens", "face", "lens", (0.0, front + 0.2 * radius, 0.46 * high + 0.9 * radius), (0.0, -1.0, 0.0))
    return model.point("release", "button", "button", (-0.36 * length_m, -0.1 * y, high + 0.003), (0.0, 0.0, 1.0))


@template("headphones")
def headphones(*, width_m: float, height: float, cup_m: float) -> Model:
    """Build headphones that stand on their cups, with the headband as an arch above X."""
    half, top = 0.5 * width_m, height * width_m
    path = arc(
        [
            (-half, 0, 0.6 * cup_m),
            (-0.98 * half, 0, 0.6 * top),
            (0, 0, top),
            (0.98 * half, 0, 0.6 * top),
            (half, 0, 0.6 * cup_m),
        ],
        samples=48,
    )
    model = Model().add("band", tube(path, 0.013, flatten=0.3), "band")
    for side in (-1.0, 1.0):
        cup = lathe(rounded([(0, 0), (0.42 * cup_m, 0), (0.5 * cup_m, 0.014), (0.47 * cup_m, 0.03), (0, 0.03)], 0.006))
        model.add("cups", cup.rotate((0, -90 * side, 0)).translate((side * (half + 0.006), 0, 0.5 * cup_m)), "cups")
    return model.point("band", "surface", "band", (0.0, 0.0, top + 0.0035), (0.0, 0.0, 1.0)).rest_on_ground()


@template("light bulb")
def light_bulb(*, length_m: float, width: float) -> Model:
    """Build a bulb that stands on its screw base."""
    h, r = length_m, 0.5 * width * length_m
    base = [
        (0, 0),
        (0.005, 0),
        (0.008, 0.004),
        *((0.0125 + 0.0007 * (i % 2), 0.006 + 0.003 * i) for i in range(8)),
        (0.0135, 0.03),
        (0, 0.03),
    ]
    turn = np.linspace(-0.95, np.pi / 2, 18)
    globe = [(0.0, 0.028), (0.0132, 0.028), *((float(r * np.cos(a)), float(h - r + r * np.sin(a))) for a in turn)]
    model = Model().add("bulb", lathe(globe), "bulb").add("base", lathe(base), "base")
    model.point("base", "tip", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return model.point("bulb", "surface", "bulb", (0.0, 0.0, h), (0.0, 0.0, 1.0))


@template("electric toothbrush")
def electric_toothbrush(*, height_m: float, width: float, head: float) -> Model:
    """Build a toothbrush that stands on its foot, the bristles towards -Y."""
    h, r, top = height_m, 0.5 * width * height_m, (1 - head) * height_m
    model = Model().add(
        "body",
        lathe(rounded([(0, 0), (1.05 * r, 0), (r, 0.04 * h), (0.85 * r, 0.8 * top), (0.5 * r, top), (0, top)], 0.02)),
    )
    model.add("neck", lathe([(0, top - 0.003), (0.42 * r, top - 0.003), (0.0042, h - 0.01), (0, h - 0.01)]), "head")
    model.add("head", cylinder(0.0068, 0.009).rotate((90, 0, 0)).translate((0, 0.005, h - 0.0068)), "head")
    model.add("bristles", cylinder(0.0055, 0.0085).rotate((90, 0, 0)).translate((0, -0.003, h - 0.0068)), "bristles")
    model.add("button", ellipsoid(0.009, 0.006, 0.02).translate((0, -0.93 * r, 0.62 * top)))
    model.point("bristles", "tip", "bristles", (0.0, -0.0115, h - 0.0068), (0.0, -1.0, 0.0))
    return model.point("button", "button", "button", (0.0, -0.93 * r - 0.003, 0.62 * top), (0.0, -1.0, 0.0))


@template("hair dryer")
def hair_dryer(*, length_m: float, barrel: float, grip: float) -> Model:
    """Build a dryer lying on its side, with the outlet towards +X and the grip towards -Y."""
    r, reach = 0.5 * barrel * length_m, grip * length_m
    profile = rounded(
        [
            (0, -0.5 * length_m),
            (0.85 * r, -0.5 * length_m),
            (r, -0.2 * length_m),
            (0.8 * r, 0.2 * length_m),
            (0.62 * r, 0.5 * length_m),
            (0, 0.5 * length_m),
        ],
        0.02,
    )
    model = Model().add("body", lathe(profile).rotate((0, 90, 0)))
    model.cut("outlet", cylinder(0.54 * r, 0.06).rotate((0, 90, 0)).translate((0.5 * length_m - 0.03, 0, 0)))
    path = arc(
        [(-0.18 * length_m, -0.5 * r, 0), (-0.17 * length_m, -r - 0.4 * reach, 0), (-0.12 * length_m, -r - reach, 0)]
    )
    model.add("handle", tube(path, 0.42 * r, flatten=0.75, across=(1, 0, 0)), "handle")
    model.add(
        "switch",
        box(0.014, 0.024, 0.006, radius_m=0.002).translate((-0.17 * length_m + 0.0, -r - 0.3 * reach, 0.29 * r)),
        "handle",
    )
    model.point("outlet", "opening", "outlet", (0.5 * length_m, 0.0, 0.0), (1.0, 0.0, 0.0))
    model.point("switch", "button", "switch", (-0.17 * length_m, -r - 0.3 * reach, 0.29 * r + 0.006), (0.0, 0.0, 1.0))
    return model.point(
        "handle", "surface", "handle", (-0.14 * length_m, -r - 0.75 * reach, 0.315 * r), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("router")
def router(*, length_m: float, width: float, thick_m: float, aerial: float) -> Model:
    """Build a router with two antennas at its back (+Y)."""
    across = width * length_m
    model = slab(Model(), length_m, across, thick_m, corner_m=0.012, edge_m=0.004)
    for side in (-1.0, 1.0):
        rod = box(0.014, 0.008, aerial * length_m, radius_m=0.003)
        model.add("aerials", rod.translate((side * 0.4 * length_m, 0.5 * across + 0.003, 0.3 * thick_m)))
    for port in range(4):
        model.cut("sockets", box(0.0125, 0.016, 0.011).translate(((port - 1.5) * 0.018, 0.5 * across, 0.35 * thick_m)))
    return model.point("socket", "hole", "sockets", (0.009, 0.5 * across, 0.5 * thick_m), (0.0, 1.0, 0.0))
