"""Household fittings and utensils. Long ones lie along X with the working end towards +X."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import chords, cylinder, lathe, polygon, prism, rectangle, rounded
from manitwin.geometry.solids.sweep import arc, loft, tube
from manitwin.models.generators.templates.catalog.organic import lay_along_x
from manitwin.models.generators.templates.template import Model, template


@template("light switch")
def light_switch(*, width_m: float, tall: float, deep: float, rocker: float) -> Model:
    """Build a switch plate lying on its back, with a rocker to press; ``rocker`` is its share of the plate."""
    x, y, t = tall * width_m, width_m, deep * width_m
    model = Model().add("body", prism(rectangle(x, y, radius_m=0.08 * y), t, radius_m=0.3 * t))
    a, b = rocker * x, rocker * y
    model.cut("frame", prism(rectangle(a + 0.0012, b + 0.0012, radius_m=0.002), t).translate((0, 0, 0.5 * t)))
    side = [(-0.5 * a, 0.3 * t), (0.5 * a, 0.3 * t), (0.5 * a, 0.8 * t), (0.0, 1.05 * t), (-0.5 * a, 1.5 * t)]
    lever = prism(polygon(side, radius_m=0.0006), b).translate((0, 0, -0.5 * b)).rotate((90, 0, 0))
    model.add("rocker", lever, "rocker")
    model.point("rocker", "button", "rocker", (-0.4 * a, 0.0, 1.4 * t), (0.4, 0.0, 0.917))
    return model.rest_on_ground()


@template("wall socket")
def wall_socket(*, width_m: float, deep: float, well: float) -> Model:
    """Build a socket plate lying on its back, with a round recess and two holes; ``well`` is its width over the plate's."""
    y, t, r = width_m, deep * width_m, 0.5 * well * width_m
    model = Model().add("body", prism(rectangle(y, y, radius_m=0.08 * y), t, radius_m=0.25 * t))
    model.cut("well", cylinder(r, t, top_radius_m=1.06 * r).translate((0, 0, 0.35 * t)), "")
    for side in (-1.0, 1.0):
        model.cut("contacts", cylinder(0.0025, t, sides=chords(20)).translate((0, side * 0.0095, 0.12 * t)), "contacts")
    model.point("contacts", "hole", "contacts", (0.0, 0.0, 0.35 * t), (0.0, 0.0, 1.0))
    return model.rest_on_ground()


@template("lint roller")
def lint_roller(*, length_m: float, roll: float, width: float, grip: float) -> Model:
    """Build a lint roller: ``roll`` is the roll's share of the length, ``grip`` the handle's width relative to the roll's."""
    n, r = length_m, 0.5 * width * length_m
    start, thin = (0.5 - roll) * n, grip * r
    model = Model().add("roller", lay_along_x(cylinder(r, roll * n).translate((0, 0, start))), "roller")
    stick = [
        (0, -0.5 * n),
        (0.9 * thin, -0.5 * n),
        (thin, -0.46 * n),
        (0.8 * thin, -0.2 * n),
        (thin, start - 0.06 * n),
        (0.8 * r, start - 0.01 * n),
        (0.8 * r, start + 0.001),
        (0, start + 0.001),
    ]
    model.add("handle", lay_along_x(lathe(rounded(stick, 0.4 * thin))), "")
    model.cut("end", lay_along_x(cylinder(0.55 * r, 0.01).translate((0, 0, 0.5 * n - 0.006))), "")
    model.point("roller", "surface", "roller", ((0.5 - 0.5 * roll) * n, 0.0, r), (0.0, 0.0, 1.0))
    return model.point("handle", "surface", "handle", (-0.22 * n, 0.0, 0.8 * thin), (0.0, 0.0, 1.0)).rest_on_ground()


@template("hand broom")
def hand_broom(*, length_m: float, head: float, width: float, bristles: float) -> Model:
    """Build a dust brush that stands on its bristles; ``head`` is its share of the length, ``bristles`` their relative height."""
    n, y, low = length_m, width * length_m, bristles * length_m
    start, thick = (0.5 - head) * n, 0.055 * n
    back = prism(rectangle(head * n, y, radius_m=0.3 * y), thick, radius_m=0.3 * thick).translate(
        (start + 0.5 * head * n, 0, low)
    )
    model = Model().add("head", back)
    tuft = prism(rectangle(0.94 * head * n, 0.84 * y, radius_m=0.25 * y), low + 0.002, top=1.0)
    model.add("bristles", tuft.translate((start + 0.5 * head * n, 0, 0)), "bristles")
    path = arc(
        [
            (start + 0.1 * n, 0, low + 0.5 * thick),
            (start - 0.08 * n, 0, low + 0.75 * thick),
            (-0.34 * n, 0, low + 1.3 * thick),
            (-0.5 * n, 0, low + 1.2 * thick),
        ]
    )
    half = np.interp(np.linspace(0, 1, len(path)), [0, 0.3, 0.7, 1.0], [0.6, 0.42, 0.5, 0.36]) * thick
    model.add("handle", tube(path, half, flatten=0.75), "")
    middle = path[len(path) // 2 + 3]
    model.point("bristles", "face", "bristles", (start + 0.5 * head * n, 0.0, 0.0), (0.0, 0.0, -1.0))
    return model.point(
        "handle", "surface", "handle", (float(middle[0]), 0.0, float(middle[2]) + 0.33 * thick), (0.0, 0.0, 1.0)
    )


@template("shoe horn")
def shoe_horn(*, length_m: float, width: float, grip: float, hollow: float) -> Model:
    """Build a lying shoe horn whose blade towards +X is curved across; ``grip`` is the handle's width over the blade's."""
    n, y = length_m, width * length_m
    t, along = 0.0022, np.linspace(0.0, 1.0, 30)
    half = 0.5 * y * np.interp(along, [0, 0.04, 0.35, 0.75, 0.95, 1.0], [0.7 * grip, grip, grip, 0.96, 0.98, 0.72])
    depth = hollow * y * np.interp(along, [0, 0.3, 0.7, 1.0], [0.1, 0.2, 1.0, 0.9])
    across = np.linspace(-1.0, 1.0, 15)
    x = (along - 0.5) * n
    lower = np.stack(
        [np.broadcast_to(x[:, None], (30, 15)), half[:, None] * across, depth[:, None] * across**2], axis=-1
    )
    upper = lower[:, ::-1] + np.array([0.0, 0.0, t])
    model = Model().add("body", loft(np.concatenate([lower, upper], axis=1)))
    model.region("blade", "body", lambda centers: centers[:, 0] > 0.12 * n)
    model.region("handle", "body", lambda centers: centers[:, 0] < -0.1 * n)
    model.point("blade", "edge", "blade", (0.5 * n, 0.0, 0.5 * t), (1.0, 0.0, 0.0))
    return model.point("handle", "face", "handle", (-0.3 * n, 0.0, t), (0.0, 0.0, 1.0)).rest_on_ground()
