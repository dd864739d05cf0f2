"""Roots and bulbs: bulbs stand with their neck up, roots lie with the end of their leaves towards +X."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import chords, cylinder, ellipsoid, union
from manitwin.geometry.solids.sweep import tube
from manitwin.models.generators.templates.catalog.organic import lay_along_x, scale_radially, smooth_revolution, stalk
from manitwin.models.generators.templates.template import Model, template


@template("garlic")
def garlic(*, width_m: float, tall: float, cloves: float, neck: float) -> Model:
    """Build a bulb of garlic standing on its roots.

    ``cloves`` is the depth of the grooves between cloves, ``neck`` the neck's height relative to the width.
    """
    r, h = 0.5 * width_m, tall * width_m
    profile = [(0, 0.0), (0.22, 0.0), (0.5, 0.025), (0.86, 0.16), (1, 0.36), (0.9, 0.58), (0.62, 0.76), (0.34, 0.9)]
    body = smooth_revolution([*profile, (0.2, 1.0), (0, 1.0)], width_m, h, sides=120)
    parted = scale_radially(body, lambda angle: 1 - cloves * (1 - np.abs(np.sin(4.5 * angle)) ** 0.7))
    model = Model().add("body", parted)
    long = neck * width_m
    stem = stalk([(0, 0, 0.92 * h), (0, 0, h + 0.4 * long), (0.12 * long, 0, h + long)], 0.21 * r, 0.13 * r, sides=16)
    model.add("stem", stem, "stem")
    root = cylinder(0.0006, 0.006, sides=6).translate((0, 0, -0.004)).rotate((0, 16, 0))
    plate = cylinder(0.1 * r, 0.004).translate((0, 0, -0.0015))
    model.add(
        "roots", plate + union([root.translate((0.06 * r, 0, 0.003)).rotate((0, 0, 45 * k)) for k in range(8)]), "roots"
    )
    model.point("stem end", "tip", "stem", (0.12 * long, 0.0, h + long), (0.2, 0.0, 0.98))
    turn = np.pi / 9  # the crest of a clove: the number of cloves is odd
    side = (r * float(np.cos(turn)), r * float(np.sin(turn)), 0.36 * h)
    return model.point(
        "side", "surface", "body", side, (float(np.cos(turn)), float(np.sin(turn)), 0.0)
    ).rest_on_ground()


@template("radish")
def radish(*, length_m: float, width: float, root: float, tops_m: float) -> Model:
    """Build a lying radish with cut stalks towards +X; ``length_m`` excludes them, ``root`` is the thin end's share."""
    wide, body_long = width * length_m, (1 - root) * length_m
    profile = [(0, 0.0), (0.3, 0.03), (0.7, 0.16), (0.97, 0.4), (1, 0.55), (0.88, 0.78), (0.55, 0.95), (0, 1.0)]
    body = lay_along_x(smooth_revolution(profile, wide, body_long)).translate((0.5 * length_m - body_long, 0, 0))
    model = Model().add("body", body)
    low = 0.5 * length_m - body_long
    tail = stalk(
        [(low + 0.08 * body_long, 0, 0), (low - 0.3 * root * length_m, 0.03 * length_m, 0), (-0.5 * length_m, 0, 0)],
        0.16 * wide,
        0.018 * wide,
    )
    model.add("tip", tail, "tip")
    end = 0.5 * length_m
    for number in range(5):
        a = 2 * np.pi * number / 5
        y, z = 0.09 * wide * float(np.cos(a)), 0.09 * wide * float(np.sin(a))
        away = (end + tops_m * (0.8 + 0.05 * number), 2.4 * y, 2.4 * z)
        model.add(
            "stem", stalk([(end - 0.003, y, z), (end + 0.4 * tops_m, 1.4 * y, 1.4 * z), away], 0.0016, 0.0012), "stem"
        )
    model.point("stem", "surface", "stem", (end + 0.5 * tops_m, 0.15 * wide, 0.0), (0.0, 1.0, 0.0))
    middle = low + 0.5 * body_long
    model.point("body", "surface", "body", (middle, 0.0, 0.5 * wide), (0.0, 0.0, 1.0))
    return model.point("tip", "tip", "tip", (-0.5 * length_m, 0.0, 0.0), (-1.0, 0.0, 0.0)).rest_on_ground()


def _round_root(width_m: float, tall: float, root: float, tops_m: float, parts: str) -> Model:
    """Build a round root lying on its side: the thin end, ``root`` of its height, to -X, and cut stalks to +X."""
    h = tall * width_m
    profile = [
        (0, 0.0),
        (0.16, 0.01),
        (0.56, 0.12),
        (0.92, 0.36),
        (1, 0.55),
        (0.9, 0.78),
        (0.6, 0.95),
        (0.3, 1.0),
        (0, 1.0),
    ]

    def laid(solid: Manifold) -> Manifold:
        return lay_along_x(solid.translate((0, 0, -0.5 * h)))

    model = Model().add("body", laid(smooth_revolution(profile, width_m, h)))
    model.region("crown", "body", lambda c: c[:, 0] > 0.3 * h, parts)
    long = root * h
    tail = stalk(
        [(-0.44 * h, 0, 0), (-0.5 * h - 0.5 * long, 0.05 * long, 0), (-0.5 * h - long, 0, 0)], 0.1 * width_m, 0.001
    )
    model.add("tip", tail)
    for number in range(6):
        a = 2 * np.pi * number / 6
        y, z = 0.1 * width_m * float(np.cos(a)), 0.1 * width_m * float(np.sin(a))
        away = (0.5 * h + tops_m * (0.8 + 0.04 * number), 1.8 * y, 1.8 * z)
        model.add(
            "stalks",
            stalk([(0.46 * h, y, z), (0.5 * h + 0.4 * tops_m, 1.2 * y, 1.2 * z), away], 0.003, 0.0024),
            "stalks",
        )
    model.point("top", "surface", "body", (0.05 * h, 0.0, 0.5 * width_m), (0.0, 0.0, 1.0))
    return model.point("base", "surface", "body", (0.05 * h, 0.0, -0.5 * width_m), (0.0, 0.0, -1.0)).rest_on_ground()


@template("beetroot")
def beetroot(*, width_m: float, tall: float, root: float, tops_m: float) -> Model:
    """Build a beetroot lying on its side, with its thin end towards -X and its cut stalks towards +X."""
    return _round_root(width_m, tall, root, tops_m, "body")


@template("turnip")
def turnip(*, width_m: float, tall: float, root: float, tops_m: float) -> Model:
    """Build a turnip lying on its side, with its crown of another colour towards +X."""
    return _round_root(width_m, tall, root, tops_m, "crown")


@template("sweet potato")
def sweet_potato(*, length_m: float, width: float, bend: float, lumps: float) -> Model:
    """Build a lying sweet potato, thin at both ends.

    ``bend`` is the distance of its middle from the line through its ends, relative to the length.
    """
    r, along = 0.5 * width * length_m, np.linspace(0, 1, 44)
    share, wide = (
        [0, 0.02, 0.08, 0.22, 0.42, 0.6, 0.8, 0.93, 0.985, 1],
        [0.04, 0.11, 0.26, 0.6, 0.9, 1, 0.9, 0.6, 0.3, 0.12],
    )
    half = np.interp(along, share, wide)
    half = np.convolve(np.pad(half, 2, mode="edge"), np.full(5, 0.2), mode="valid")
    half *= 1 + lumps * np.sin(9 * along + 0.7) * np.sin(np.pi * along)
    path = np.column_stack([(along - 0.5) * length_m, bend * length_m * (4 * (along - 0.5) ** 2), 0 * along])
    model = Model().add("body", tube(path, r * half, sides=chords(32)))
    eyes = []
    for number in range(9):
        at, turn = 0.15 + 0.08 * number, 120.3 * number
        place = (float(np.interp(at, along, path[:, 0])), float(np.interp(at, along, path[:, 1])), 0.0)
        out = r * float(np.interp(at, along, half))
        eye = ellipsoid(0.02 * length_m, 0.006 * length_m, 0.004 * length_m, sides=chords(10))
        eyes.append(eye.translate((0, 0, out)).rotate((turn, 0, 0)).translate(place))
    model.cut("eyes", union(eyes), "eyes")
    model.region("end", "body", lambda c: np.abs(c[:, 0]) > 0.45 * length_m)
    top, middle = r * float(half[18:24].max()), 20
    x, y = float(path[middle, 0]), float(path[middle, 1])
    model.point("top", "surface", "body", (x, y, top), (0.0, 0.0, 1.0))
    return model.point("base", "surface", "body", (x, y, -top), (0.0, 0.0, -1.0)).rest_on_ground()
