"""Further toys: stacking cups, tiles, wands, and toys to spin or to blow."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import (
    box,
    chords,
    cylinder,
    ellipsoid,
    lathe,
    polygon,
    prism,
    rectangle,
    rounded,
    torus,
)
from manitwin.models.generators.templates.catalog.organic import lay_along_x
from manitwin.models.generators.templates.catalog.toy_vehicles import slab_across
from manitwin.models.generators.templates.catalog.vessel import assemble_from_profile
from manitwin.models.generators.templates.template import Model, template


@template("stacking cup")
def stacking_cup(*, height_m: float, width: float, taper: float, wall_m: float, lip: float) -> Model:
    """Build an open cup with a thick lip of ``lip`` of its height; ``taper`` is its foot's width relative to its mouth's."""
    r, h = 0.5 * width * height_m, height_m
    edge = (1 - lip) * h
    profile = rounded(
        [(0.94 * taper * r, 0.0), (taper * r, 0.04 * h), (0.92 * r, edge), (r, edge + 0.001), (r, h)], 0.003
    )
    return assemble_from_profile(Model(), profile, max(wall_m, 0.0015), wall_m)


@template("mahjong tile")
def mahjong_tile(*, length_m: float, width: float, thick: float, back: float) -> Model:
    """Build a lying tile with its face up, engraved with three circles; its coloured back takes ``back`` of its thickness."""
    n, y, t = length_m, width * length_m, thick * length_m
    whole = prism(rectangle(n, y, radius_m=0.1 * y), t, radius_m=0.08 * y)
    model = Model().add("body", whole)
    model.region("back", "body", lambda centers: centers[:, 2] < back * t, "back")
    for number in (-1, 0, 1):
        ring = cylinder(0.15 * y, 0.001, sides=chords(28)) - cylinder(0.08 * y, 0.01, sides=chords(20)).translate(
            (0, 0, -0.005)
        )
        model.cut("mark", ring.translate((0.26 * n * number, 0, t - 0.0005)), "mark")
    model.point("front", "face", "body", (0.38 * n, 0.3 * y, t), (0.0, 0.0, 1.0))
    return model.point("edge", "surface", "body", (0.5 * n, 0.0, 0.6 * t), (1.0, 0.0, 0.0))


@template("fidget spinner")
def fidget_spinner(*, width_m: float, thick: float, lobe: float, hub: float) -> Model:
    """Build a lying spinner with three weighted lobes about a bearing; ``lobe`` and ``hub`` are widths over the whole."""
    reach, t = 0.5 * width_m * (1 - lobe) / 0.933, thick * width_m
    r, core = 0.5 * lobe * width_m, 0.5 * hub * width_m
    angles = np.radians([90.0, 210.0, 330.0])
    disk = cylinder(r, t, sides=chords(40))
    center = cylinder(core, t, sides=chords(40))
    arms = [
        Manifold.batch_hull(
            [
                cylinder(0.6 * r, t).translate((0.9 * reach * np.cos(a), 0.9 * reach * np.sin(a), 0)),
                cylinder(0.62 * core, t),
            ]
        )
        for a in angles
    ]
    model = Model()
    body = center
    for a, arm in zip(angles, arms, strict=True):
        body = body + disk.translate((reach * np.cos(a), reach * np.sin(a), 0)) + arm
    model.add("body", body)
    for a in angles:
        weight = cylinder(0.62 * r, 1.03 * t, sides=chords(36)) - cylinder(0.3 * r, 2 * t, sides=chords(24)).translate(
            (0, 0, -0.5 * t)
        )
        model.cut(
            "bores",
            cylinder(0.3 * r, 2 * t, sides=chords(24)).translate((reach * np.cos(a), reach * np.sin(a), -0.5 * t)),
            "weights",
        )
        model.add("weights", weight.translate((reach * np.cos(a), reach * np.sin(a), -0.015 * t)), "weights")
    button = lathe(
        rounded(
            [
                (0, -0.16 * t),
                (0.62 * core, -0.16 * t),
                (0.72 * core, 0.0),
                (0.72 * core, t),
                (0.62 * core, 1.16 * t),
                (0, 1.16 * t),
            ],
            0.1 * t,
        )
    )
    model.add("button", button, "button")
    model.point("button", "button", "button", (0.0, 0.0, 1.16 * t), (0.0, 0.0, 1.0))
    end = (
        float(reach * np.cos(angles[1]) + r * np.cos(angles[1])),
        float(reach * np.sin(angles[1]) + r * np.sin(angles[1])),
    )
    return model.point(
        "lobe", "surface", "body", (end[0], end[1], 0.5 * t), (float(np.cos(angles[1])), float(np.sin(angles[1])), 0.0)
    ).rest_on_ground()


@template("whistle")
def whistle(*, length_m: float, drum: float, width: float, bore: float) -> Model:
    """Build a whistle lying on its drum with its mouthpiece towards +X.

    ``drum`` and ``width`` of the drum are relative to the length.
    """
    n, r, y = length_m, 0.5 * drum * length_m, width * length_m
    round_part = (
        cylinder(r, y, sides=chords(48)).translate((0, 0, -0.5 * y)).rotate((90, 0, 0)).translate((r - 0.5 * n, 0, 0))
    )
    top = r
    neck = [(r - 0.5 * n, 0.35 * r), (0.5 * n, 0.55 * r), (0.5 * n, top), (r - 0.5 * n, top)]
    pipe = prism(polygon(neck), y).translate((0, 0, -0.5 * y)).rotate((90, 0, 0))
    model = Model().add("body", round_part + pipe)
    model.cut("mouth", box(0.7 * n, bore * y, 0.2 * r).translate((0.35 * n, 0, 0.68 * r)), "")
    slot = [(0.06 * n, top + 0.01), (0.06 * n, 0.72 * r), (0.2 * n, top + 0.01)]
    model.cut("window", prism(polygon(slot), bore * y).translate((0, 0, -0.5 * bore * y)).rotate((90, 0, 0)), "")
    ring = torus(0.3 * r, 0.0011, sides=chords(32)).rotate((90, 0, 0)).translate((-0.5 * n - 0.24 * r, 0, 0))
    model.add("ring", ring, "ring")
    model.point("mouthpiece", "hole", "mouth", (0.5 * n, 0.0, 0.78 * r), (1.0, 0.0, 0.0))
    return model.point("body", "surface", "body", (r - 0.5 * n, -0.5 * y, 0.0), (0.0, -1.0, 0.0)).rest_on_ground()


@template("baton")
@template("magic wand")
def wand(*, length_m: float, width: float, tip: float, grip: float) -> Model:
    """Build a lying stick with ends of another colour; ``tip`` and ``grip`` are their shares of the length."""
    n, r = length_m, 0.5 * width * length_m
    model = Model().add(
        "body", lay_along_x(cylinder(0.92 * r, n - 0.002, sides=chords(32)).translate((0, 0, -0.5 * n + 0.001)))
    )
    model.add(
        "tip",
        lay_along_x(lathe(rounded([(0, (0.5 - tip) * n), (r, (0.5 - tip) * n), (r, 0.5 * n), (0, 0.5 * n)], 0.4 * r))),
        "ends",
    )
    model.add(
        "grip",
        lay_along_x(
            lathe(rounded([(0, -0.5 * n), (r, -0.5 * n), (r, (grip - 0.5) * n), (0, (grip - 0.5) * n)], 0.4 * r))
        ),
        "ends",
    )
    model.point("tip", "tip", "tip", (0.5 * n, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("grip", "surface", "grip", ((0.5 * grip - 0.5) * n, 0.0, r), (0.0, 0.0, 1.0)).rest_on_ground()


@template("squash ball")
def squash_ball(*, width_m: float, dot: float) -> Model:
    """Build a small rubber ball with a coloured dot on top; ``dot`` is the dot's relative width."""
    r = 0.5 * width_m
    model = Model().add("body", ellipsoid(width_m, width_m, width_m).translate((0, 0, r)))
    model.region(
        "dot", "body", lambda centers: (np.hypot(centers[:, 0], centers[:, 1]) < dot * r) & (centers[:, 2] > r), "dot"
    )
    model.point("top", "surface", "dot", (0.0, 0.0, width_m), (0.0, 0.0, 1.0))
    return model.point("side", "surface", "body", (0.0, -r, r), (0.0, -1.0, 0.0))


@template("harmonica")
def harmonica(*, length_m: float, deep: float, height: float, holes: float) -> Model:
    """Build a lying harmonica with a row of ``holes`` towards -Y between two covers."""
    n, y, h = length_m, deep * length_m, height * length_m
    model = Model().add("body", box(0.98 * n, 0.96 * y, 0.42 * h).translate((0, 0, 0.29 * h)))
    side = [(-0.4 * y, 0.0), (0.5 * y, 0.0), (0.5 * y, 0.3 * h), (0.2 * y, 0.33 * h), (-0.28 * y, 0.18 * h)]
    cover = slab_across(side, n, 0.04 * h)
    model.add("covers", cover.translate((0, 0, 0.67 * h)), "covers").add(
        "covers", cover.scale((1, 1, -1)).translate((0, 0, 0.33 * h)), "covers"
    )
    count = max(round(holes), 4)
    pitch = 0.9 * n / count
    for number in range(count):
        hole = box(0.62 * pitch, 0.4 * y, 0.24 * h).translate(
            ((number - 0.5 * (count - 1)) * pitch, -0.48 * y, 0.38 * h)
        )
        model.cut("holes", hole, "holes")
    model.point("holes", "face", "holes", (0.0, -0.48 * y, 0.5 * h), (0.0, -1.0, 0.0))
    return model.point("cover", "face", "covers", (0.0, 0.3 * y, h), (0.0, 0.0, 1.0)).rest_on_ground()


@template("flute")
def recorder(*, length_m: float, width: float, beak: float, foot: float) -> Model:
    """Build a lying recorder with its mouthpiece towards +X.

    ``beak`` is the mouthpiece's share of the length, ``foot`` the bell's width relative to the tube's.
    """
    n, r = length_m, 0.5 * width * length_m
    neck = (0.5 - beak) * n
    side = [
        (0, -0.5 * n),
        (foot * r, -0.5 * n),
        (0.86 * r, -0.4 * n),
        (0.78 * r, -0.3 * n),
        (0.92 * r, neck - 0.02 * n),
        (1.12 * r, neck),
        (r, neck + 0.03 * n),
        (0.94 * r, 0.5 * n),
        (0, 0.5 * n),
    ]
    model = Model().add("body", lay_along_x(lathe(rounded(side, 0.3 * r))))
    slope = prism(polygon([(0.34 * n, -1.2 * r), (0.56 * n, 0.2 * r), (0.56 * n, -2 * r), (0.34 * n, -2 * r)]), 4 * r)
    model.cut("beak", slope.translate((0, 0, -2 * r)).rotate((90, 0, 0)), "")
    window = box(0.05 * n, 0.8 * r, r).translate((neck + 0.09 * n, 0, 0.62 * r))
    model.cut("window", window, "")
    for number in range(7):
        model.cut(
            "holes",
            cylinder(0.24 * r, r, sides=chords(16)).translate((neck - (0.1 + 0.075 * number) * n, 0, 0.45 * r)),
            "",
        )
    model.cut("bore", lay_along_x(cylinder(0.5 * r, 0.1 * n, sides=chords(24)).translate((0, 0, -0.52 * n))), "")
    model.point("mouthpiece", "tip", "body", (0.5 * n, 0.0, 0.4 * r), (1.0, 0.0, 0.0))
    return model.point("shaft", "surface", "body", (-0.1 * n, -0.86 * r, 0.0), (0.0, -1.0, 0.0)).rest_on_ground()
