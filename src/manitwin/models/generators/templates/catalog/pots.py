"""Vessels to cook, carry and store in: pots, pans, buckets, flower pots, holders."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import cylinder, lathe, rounded
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.vessel import assemble_from_profile, ear, shell, stick
from manitwin.models.generators.templates.template import Model, template


@template("frying pan")
def frying_pan(*, width_m: float, height: float, wall_m: float, handle: float) -> Model:
    """Build a pan whose handle extends to +X by ``handle`` of its width."""
    model, radius, high = Model(), 0.5 * width_m, height * width_m
    profile = rounded([(0.78 * radius, 0.0), (0.8 * radius, 0.002), (radius, high)], 0.01)
    grip = stick(model, radius, 0.8 * high, handle * width_m, 0.45 * high, 0.0125)
    return assemble_from_profile(model, profile, wall_m, 1.3 * wall_m, grip)


@template("saucepan")
def saucepan(*, width_m: float, height: float, wall_m: float, handle: float) -> Model:
    """Build a deep pan with one long handle."""
    model, radius, high = Model(), 0.5 * width_m, height * width_m
    profile = rounded([(0.94 * radius, 0.0), (0.97 * radius, 0.003), (radius, high)], 0.008)
    grip = stick(model, radius, 0.82 * high, handle * width_m, 0.1 * high, 0.0115)
    return assemble_from_profile(model, profile, wall_m, 2 * wall_m, grip)


@template("wok")
def wok(*, width_m: float, height: float, wall_m: float, handle: float) -> Model:
    """Build a wok with a flat foot."""
    model, radius, high = Model(), 0.5 * width_m, height * width_m
    turn = np.linspace(0.35, np.pi / 2, 12)
    side = zip(radius * np.sin(turn), high * (1 - np.cos(turn)) / 1.0, strict=True)
    side_list = [(float(r), float(z)) for r, z in side]
    foot = side_list[0][1]
    profile = [(side_list[0][0], 0.0), *((r, (z - foot) * high / (high - foot)) for r, z in side_list[1:])]
    return assemble_from_profile(
        model, profile, wall_m, 1.5 * wall_m, stick(model, radius, 0.85 * high, handle * width_m, 0.35 * high, 0.013)
    )


@template("pot")
def pot(*, width_m: float, height: float, wall_m: float, ears: float) -> Model:
    """Build a pot with two handles along X that protrude by ``ears`` of its width."""
    model, radius, high = Model(), 0.5 * width_m, height * width_m
    handles = []
    for side in (1.0, -1.0):
        across, out = 0.24 * width_m, radius + ears * width_m
        wall = 0.985 * float(np.sqrt(radius**2 - across**2))
        path = arc(
            [
                (side * wall, -across, 0.8 * high),
                (side * out, -0.8 * across, 0.83 * high),
                (side * out, 0.8 * across, 0.83 * high),
                (side * wall, across, 0.8 * high),
            ]
        )
        handles.append(("handle", tube(path, 0.006, across=(0, 0, 1))))
        model.point("handle", "surface", "handle", (side * out, 0.0, 0.83 * high), (side, 0.0, 0.0))
    profile = rounded([(0.95 * radius, 0.0), (radius, 0.006), (radius, high)], 0.008)
    return assemble_from_profile(model, profile, wall_m, 2 * wall_m, *handles)


@template("pot lid")
def pot_lid(*, width_m: float, dome: float, wall_m: float, knob_m: float) -> Model:
    """Build a domed lid with a knob, in the pose in which it covers a pot."""
    radius, high = 0.5 * width_m, dome * width_m
    turn = np.linspace(0, np.pi / 2, 14)
    cap = [(float(radius * np.cos(a)), float(0.006 + high * np.sin(a))) for a in turn]
    outer = lathe([(radius, 0.0), *cap])
    under = lathe([(0.98 * radius - wall_m, -0.001), *((max(r - wall_m, 0.0), z - wall_m) for r, z in cap)])
    top = high + 0.006
    knob = lathe(
        rounded(
            [
                (0, top - 0.004),
                (0.3 * knob_m, top - 0.004),
                (0.28 * knob_m, top + 0.012),
                (0.5 * knob_m, top + 0.018),
                (0.5 * knob_m, top + 0.024),
                (0, top + 0.028),
            ],
            0.004,
        )
    )
    model = Model().add("cover", outer).cut("inside", under).add("knob", knob, "knob")
    return model.point("knob", "surface", "knob", (0.0, 0.0, top + 0.028), (0.0, 0.0, 1.0))


@template("bucket")
def bucket(*, height_m: float, width: float, taper: float, wall_m: float) -> Model:
    """Build a bucket whose bail stands upright above it."""
    model, radius = Model(), 0.5 * width * height_m
    profile = rounded([(taper * radius, 0.0), (taper * radius, 0.002), (radius, height_m)], 0.004)
    lugs = [(side * 0.99 * radius, 0.0, 0.92 * height_m) for side in (-1.0, 1.0)]
    path = arc(
        [
            lugs[0],
            (-0.8 * radius, 0, 1.35 * height_m),
            (0, 0, 1.55 * height_m),
            (0.8 * radius, 0, 1.35 * height_m),
            lugs[1],
        ],
        samples=40,
    )
    model.point("handle", "surface", "handle", (0.0, 0.0, 1.55 * height_m + 0.004), (0.0, 0.0, 1.0))
    return assemble_from_profile(model, profile, wall_m, 1.5 * wall_m, ("handle", tube(path, 0.004)))


@template("flower pot")
def flower_pot(*, height_m: float, width: float, taper: float, wall_m: float) -> Model:
    """Build a pot with a band around its mouth and a hole in its floor."""
    h, r = height_m, 0.5 * width * height_m
    slope = (1 - taper) * r / h
    profile = [(taper * r, 0.0), (taper * r + 0.78 * h * slope - 0.0, 0.78 * h), (r, 0.8 * h), (r * 1.01, h)]
    model = assemble_from_profile(Model(), profile, wall_m, 1.4 * wall_m)
    return model.cut("hole", cylinder(0.12 * r, 4 * wall_m).translate((0, 0, -wall_m)))


@template("trash can")
def trash_can(*, height_m: float, width: float, taper: float, wall_m: float) -> Model:
    """Build an open waste bin."""
    radius = 0.5 * width * height_m
    profile = rounded([(0.95 * taper * radius, 0.0), (taper * radius, 0.01), (radius, height_m)], 0.006)
    return assemble_from_profile(Model(), profile, wall_m, 1.5 * wall_m)


@template("pen holder")
def pen_holder(*, height_m: float, width: float, wall_m: float, taper: float) -> Model:
    """Build a cup for pens."""
    radius = 0.5 * width * height_m
    profile = rounded([(0.97 * taper * radius, 0.0), (taper * radius, 0.002), (radius, height_m)], 0.003)
    return assemble_from_profile(Model(), profile, wall_m, 1.5 * wall_m)


@template("candle holder")
def candle_holder(*, height_m: float, foot: float, cup_m: float) -> Model:
    """Build a candlestick: a foot, a stem and a socket for a candle 22 mm in diameter."""
    h, r, low = height_m, max(0.5 * foot * height_m, 0.032), height_m - 0.03
    stem = [(0.006, 0.35 * low), (0.009, 0.65 * low), (0.007, 0.95 * low)]
    body = rounded([(r, 0.0), (r, 0.004), (0.4 * r, 0.01), *stem, (0.5 * cup_m, low + 0.006), (0.5 * cup_m, h)], 0.005)
    model = Model().add("stem", lathe(body)).cut("socket", cylinder(0.0112, 0.5 * h).translate((0, 0, h - 0.022)))
    model.region("foot", "stem", lambda centers: centers[:, 2] < 0.012)
    model.region("cup", "stem", lambda centers: centers[:, 2] > low)
    return model.point("socket", "hole", "socket", (0.0, 0.0, h), (0.0, 0.0, 1.0))


@template("mortar")
def mortar(*, width_m: float, height: float, wall_m: float, foot: float) -> Model:
    """Build a heavy mortar."""
    radius, high = 0.5 * width_m, height * width_m
    profile = rounded(
        [(foot * radius, 0.0), (foot * radius, 0.08 * high), (0.9 * radius, 0.45 * high), (radius, high)], 0.02
    )
    model = Model()
    outer, inner = shell(profile, wall_m, 0.3 * high)
    model.add("body", outer).cut("inside", inner)
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: centers[:, 2] > 0.97 * high)
    return model.point("opening", "opening", "rim", (0.0, 0.0, high), (0.0, 0.0, 1.0))


@template("vase")
def vase(*, height_m: float, width: float, neck: float, mouth: float, wall_m: float) -> Model:
    """Build a vase; the ``neck`` and the ``mouth`` are shares of its largest width."""
    h, r = height_m, 0.5 * width * height_m
    levels = np.linspace(0, 1, 26)
    radii = np.interp(levels, [0, 0.12, 0.38, 0.6, 0.8, 0.9, 1], [0.6, 0.78, 1.0, 0.8, neck, neck * 1.05, mouth])
    smooth = np.convolve(np.pad(radii, 2, mode="edge"), np.ones(5) / 5, mode="valid")
    profile = [(float(r * share), float(h * level)) for share, level in zip(smooth, levels, strict=True)]
    return assemble_from_profile(Model(), profile, wall_m, 1.6 * wall_m)


@template("watering can")
def watering_can(*, height_m: float, width: float, spout: float, wall_m: float) -> Model:
    """Build a can with a long spout towards -X and a handle towards +X."""
    model, h, r = Model(), height_m, 0.5 * width * height_m
    profile = rounded([(0.95 * r, 0.0), (r, 0.006), (0.9 * r, h)], 0.008)
    reach = r + spout * h
    path = arc([(-0.8 * r, 0, 0.22 * h), (-0.5 * (r + reach), 0, 0.5 * h), (-reach, 0, 1.1 * h)])
    thick = np.linspace(0.16 * r, 0.1 * r, len(path))
    outer, inner = shell(profile, wall_m, 1.5 * wall_m)
    model.add("body", outer).add("spout", tube(path, thick))
    name, handle = ear(model, 0.9 * r, 0.92 * h, 0.2 * h, 0.55 * r, 0.014)
    model.add(name, handle, "handle").cut("inside", inner).cut("inside", tube(path, np.maximum(thick - wall_m, 0.002)))
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: (centers[:, 2] > 0.97 * h) & (centers[:, 0] > -r))
    model.point("opening", "opening", "rim", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("spout", "tip", "spout", (-reach, 0.0, 1.1 * h), (-0.6, 0.0, 0.8))
