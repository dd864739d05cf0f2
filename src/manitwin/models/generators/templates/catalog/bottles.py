"""Standing closed containers: bottles, jars, cans, shakers, sprays. They are full solids; the contents are not modelled."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import box, cylinder, lathe, rounded
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.template import Model, template


def capped(
    model: Model, profile: list[tuple[float, float]], cap: list[tuple[float, float]], corner_m: float = 0.006
) -> Model:
    """Add a ``body`` and a ``cap`` of revolution, and points on the top of the cap and the base of the body."""
    model.add("body", lathe(rounded([(0.0, 0.0), *profile], corner_m)))
    model.add("cap", lathe(rounded(cap, 0.0015)), "cap")
    top = max(z for _, z in cap)
    model.region("base", "body", lambda centers: centers[:, 2] < 0.01 * top)
    model.point("cap", "surface", "cap", (0.0, 0.0, top), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


def _bottle(height_m: float, width: float, shoulder: float, neck: float, cap: float) -> Model:
    h, r = height_m, 0.5 * width * height_m
    n = max(neck * r, 0.008)
    top = (1 - cap) * h
    profile = [(r, 0.0), (r, shoulder * h), (n, 0.5 * (shoulder + 1 - cap) * h), (n, top)]
    lid = [(1.12 * n, top - 0.004), (1.12 * n, h), (0.0, h)]
    return capped(Model(), profile, lid, 0.12 * h)


@template("bottle")
def bottle(*, height_m: float, width: float, shoulder: float, neck: float, cap: float) -> Model:
    """Build a bottle with a cap; ``shoulder`` is the relative height where the body ends, ``neck`` is relative to its width."""
    return _bottle(height_m, width, shoulder, neck, cap)


@template("glass bottle")
def glass_bottle(*, height_m: float, width: float, shoulder: float, neck: float, cap: float) -> Model:
    """Build a bottle with a long neck."""
    return _bottle(height_m, width, shoulder, neck, cap)


@template("water bottle")
def water_bottle(*, height_m: float, width: float, shoulder: float, neck: float, cap: float) -> Model:
    """Build a bottle with a short, wide neck."""
    return _bottle(height_m, width, shoulder, neck, cap)


@template("thermos")
def thermos(*, height_m: float, width: float, cap: float) -> Model:
    """Build a straight flask whose cap is a cup."""
    h, r = height_m, 0.5 * width * height_m
    top = (1 - cap) * h
    profile = [(r, 0.0), (r, 0.94 * top), (0.86 * r, top)]
    return capped(Model(), profile, [(0.88 * r, top - 0.002), (0.84 * r, h), (0.0, h)], 0.01)


@template("jar")
def jar(*, height_m: float, width: float, neck: float, cap: float) -> Model:
    """Build a jar with a screwed lid."""
    h, r = height_m, 0.5 * width * height_m
    top = (1 - cap) * h
    profile = [(r, 0.0), (r, 0.92 * top), (neck * r, top), (neck * r, top + 0.003)]
    return capped(Model(), profile, [(1.03 * neck * r, top), (1.03 * neck * r, h), (0.0, h)], 0.008)


@template("can")
def can(*, height_m: float, width: float, rim_m: float) -> Model:
    """Build a food can with beaded rims and slightly recessed ends."""
    h, r = height_m, 0.5 * width * height_m
    body = [(0, 0.003), (r - 2 * rim_m, 0.003), (r - 2 * rim_m, 0.0), (r, 0.0), (r, 0.004), (r - rim_m, 0.006)]
    body += [(q, h - z) for q, z in reversed(body)]
    model = Model().add("body", lathe(body))
    model.region("top", "body", lambda centers: centers[:, 2] > h - 0.0035)
    model.region("base", "body", lambda centers: centers[:, 2] < 0.0035)
    model.point("top", "face", "top", (0.0, 0.0, h - 0.003), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("drink can")
def drink_can(*, height_m: float, width: float, neck: float) -> Model:
    """Build a drink can with a narrowed neck, a recessed lid and its ring."""
    h, r = height_m, 0.5 * width * height_m
    profile = rounded(
        [
            (0.0, 0.004),
            (0.6 * r, 0.004),
            (0.72 * r, 0.0),
            (0.78 * r, 0.0),
            (r, 0.012),
            (r, 0.9 * h),
            (neck * r, 0.975 * h),
            (neck * r, h),
            (0.94 * neck * r, h),
            (0.9 * neck * r, h - 0.004),
            (0.0, h - 0.004),
        ],
        0.004,
    )
    model = Model().add("body", lathe(profile))
    ring = lathe([(0.004, 0), (0.009, 0), (0.009, 0.0012), (0.004, 0.0012), (0.004, 0)][:4]).translate(
        (0, 0.0, h - 0.0042)
    )
    model.add("tab", ring).region("top", "body", lambda centers: centers[:, 2] > 0.965 * h)
    model.region("base", "body", lambda centers: centers[:, 2] < 0.005)
    return model.point("opening", "opening", "top", (0.0, -0.5 * neck * r, h - 0.004), (0.0, 0.0, 1.0))


@template("shampoo bottle")
def shampoo_bottle(*, height_m: float, width: float, flat: float, cap: float) -> Model:
    """Build an oval bottle; ``flat`` is its depth relative to its width."""
    h, r = height_m, 0.5 * width * height_m
    top = (1 - cap) * h
    body = lathe(
        rounded([(0, 0), (0.92 * r, 0), (r, 0.1 * top), (r, 0.72 * top), (0.62 * r, top), (0, top)], 0.02)
    ).scale((1, flat, 1))
    lid = lathe(rounded([(0, top - 0.003), (0.62 * r, top - 0.003), (0.6 * r, h), (0, h)], 0.003)).scale(
        (1, min(1.0, flat + 0.15), 1)
    )
    model = Model().add("body", body).add("cap", lid, "cap")
    return model.point("cap", "surface", "cap", (0.0, 0.0, h), (0.0, 0.0, 1.0))


@template("pump bottle")
def pump_bottle(*, height_m: float, width: float, body: float, spout_m: float) -> Model:
    """Build a bottle with a pump that is pressed from above and whose spout points to -Y."""
    h, r, top = height_m, 0.5 * width * height_m, body * height_m
    model = Model().add("body", lathe(rounded([(0, 0), (r, 0), (r, 0.86 * top), (0.42 * r, top), (0, top)], 0.012)))
    model.add("collar", cylinder(0.46 * r, 0.1 * h).translate((0, 0, top - 0.003)), "pump")
    model.add("stem", cylinder(0.0045, h - top).translate((0, 0, top - 0.002)), "pump")
    head = h - 0.016
    model.add("head", lathe(rounded([(0, head), (0.011, head), (0.012, h), (0, h)], 0.003)), "pump")
    path = arc([(0, -0.004, h - 0.008), (0, -0.6 * spout_m, h - 0.007), (0, -spout_m, h - 0.016)])
    model.add("spout", tube(path, 0.0045, across=(1, 0, 0)), "pump")
    model.point("pump head", "button", "head", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("spout", "tip", "spout", (0.0, -spout_m, h - 0.016), (0.0, -0.53, -0.848))


@template("spray bottle")
def spray_bottle(*, height_m: float, width: float, flat: float) -> Model:
    """Build a bottle with a trigger head that sprays towards -Y."""
    h, r, top = height_m, 0.5 * width * height_m, 0.7 * height_m
    body = lathe(
        rounded([(0, 0), (r, 0), (r, 0.5 * top), (0.34 * r, 0.82 * top), (0.34 * r, top), (0, top)], 0.03)
    ).scale((flat, 1, 1))
    model = (
        Model().add("body", body).add("collar", cylinder(0.4 * r, 0.09 * h).translate((0, 0, top - 0.004)), "trigger")
    )
    model.add("head", box(0.028, 0.085, 0.21 * h, radius_m=0.008).translate((0, -0.014, 0.77 * h)), "trigger")
    model.add("nozzle", cylinder(0.008, 0.016).rotate((90, 0, 0)).translate((0, -0.055, 0.945 * h)), "trigger")
    path = arc([(0, -0.035, 0.84 * h), (0, -0.052, 0.77 * h), (0, -0.048, 0.66 * h)])
    model.add("trigger", tube(path, 0.006, flatten=0.6, across=(1, 0, 0)), "trigger")
    model.point("nozzle", "tip", "nozzle", (0.0, -0.071, 0.945 * h), (0.0, -1.0, 0.0))
    return model.point("trigger", "button", "trigger", (0.0, -0.054, 0.76 * h), (0.0, -1.0, 0.0))


@template("aerosol can")
def aerosol_can(*, height_m: float, width: float, cap: float) -> Model:
    """Build a spray can with its cap on."""
    h, r = height_m, 0.5 * width * height_m
    top = (1 - cap) * h
    return capped(
        Model(), [(r, 0.0), (r, 0.93 * top), (0.8 * r, top)], [(0.86 * r, top - 0.003), (0.82 * r, h), (0.0, h)], 0.006
    )


@template("pill bottle")
def pill_bottle(*, height_m: float, width: float, cap: float) -> Model:
    """Build a pill bottle with a wide cap."""
    h, r = height_m, 0.5 * width * height_m
    top = (1 - cap) * h
    return capped(
        Model(), [(r, 0.0), (r, 0.9 * top), (0.85 * r, top)], [(1.02 * r, top - 0.002), (1.0 * r, h), (0.0, h)], 0.005
    )


@template("salt shaker")
def salt_shaker(*, height_m: float, width: float, cap: float) -> Model:
    """Build a shaker with a domed, pierced top."""
    h, r = height_m, 0.5 * width * height_m
    top = (1 - cap) * h
    turn = np.linspace(0, np.pi / 2, 8)
    dome = [
        (0.82 * r, top - 0.002),
        *((float(0.82 * r * np.cos(a)), float(top + 0.3 * (h - top) + 0.7 * (h - top) * np.sin(a))) for a in turn),
    ]
    model = (
        Model()
        .add("body", lathe(rounded([(0, 0), (r, 0), (0.8 * r, top), (0, top)], 0.004)))
        .add("cap", lathe(dome), "cap")
    )
    for angle in np.linspace(0, 2 * np.pi, 6, endpoint=False):
        model.cut(
            "holes",
            cylinder(0.0012, 0.01, sides=8).translate((0.4 * r * np.cos(angle), 0.4 * r * np.sin(angle), h - 0.006)),
            "cap",
        )
    return model.point("holes", "hole", "cap", (0.0, 0.0, h), (0.0, 0.0, 1.0))


@template("pepper mill")
def pepper_mill(*, height_m: float, width: float, waist: float, cap: float) -> Model:
    """Build a turned mill whose cap is rotated to grind."""
    h, r = height_m, 0.5 * width * height_m
    top = (1 - cap) * h
    profile = [(r, 0.0), (r, 0.18 * h), (waist * r, 0.45 * h), (0.85 * r, top)]
    knob = rounded(
        [
            (0, top),
            (0.78 * r, top),
            (0.9 * r, top + 0.35 * cap * h),
            (0.5 * r, top + 0.75 * cap * h),
            (0.22 * r, top + 0.82 * cap * h),
            (0.25 * r, h),
            (0, h),
        ],
        0.012,
    )
    return capped(Model(), profile, knob, 0.02)


@template("deodorant")
def deodorant(*, height_m: float, width: float, flat: float, cap: float) -> Model:
    """Build an oval deodorant stick with a domed cap."""
    h, r = height_m, 0.5 * width * height_m
    top = (1 - cap) * h
    body = lathe(rounded([(0, 0), (r, 0), (r, top), (0, top)], 0.004)).scale((1, flat, 1))
    lid = lathe(
        rounded([(0, top - 0.001), (0.97 * r, top - 0.001), (0.95 * r, 0.86 * h), (0.6 * r, h), (0, h)], 0.015)
    ).scale((1, flat, 1))
    model = Model().add("body", body).add("cap", lid, "cap")
    return model.point("cap", "surface", "cap", (0.0, 0.0, h), (0.0, 0.0, 1.0))
