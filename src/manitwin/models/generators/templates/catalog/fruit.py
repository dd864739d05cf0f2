"""Further fruit: round ones stand with their stem up, long ones lie with it towards +X."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import chords, cylinder, ellipsoid, union
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.food import citrus
from manitwin.models.generators.templates.catalog.organic import (
    furrow,
    lay_along_x,
    scale_radially,
    smooth_revolution,
    stalk,
)
from manitwin.models.generators.templates.template import Model, template


@template("lime")
def lime(*, length_m: float, width: float, nipple: float) -> Model:
    """Build a lying lime with its nipple towards +X; ``nipple`` is its share of the length."""
    wide, waist = width * length_m, 1 - nipple
    profile = [(0, 0.0), (0.16, 0.005), (0.34, 0.035), (0.66, 0.14), (0.93, 0.31), (1, 0.48), (0.93, 0.68)]
    profile += [(0.64, waist - 0.04), (0.3, 1 - 0.5 * nipple), (0.14, 1 - 0.06 * nipple), (0, 1)]
    model = Model().add(
        "body", lay_along_x(smooth_revolution(profile, wide, length_m).translate((0, 0, -0.5 * length_m)))
    )
    scar = lay_along_x(cylinder(0.075 * wide, 0.02 * length_m, sides=chords(16)))
    model.add("stem", scar.translate((-0.51 * length_m, 0, 0)), "stem")
    model.point("side", "surface", "body", (0.0, -0.5 * wide, 0.0), (0.0, -1.0, 0.0))
    return model.point("upper side", "surface", "body", (0.0, 0.0, 0.5 * wide), (0.0, 0.0, 1.0)).rest_on_ground()


@template("grapefruit")
def grapefruit(*, width_m: float, tall: float, mark: float) -> Model:
    """Build a grapefruit with the mark of its stem on top."""
    return citrus(width_m, tall, mark)


@template("kiwi")
def kiwi(*, length_m: float, width: float, flat: float) -> Model:
    """Build a lying kiwi with its stem end towards +X; ``flat`` is its height relative to its width."""
    wide = width * length_m
    profile = [(0, 0.0), (0.3, 0.012), (0.66, 0.1), (0.92, 0.28), (1, 0.5), (0.93, 0.72), (0.7, 0.9), (0.38, 0.985)]
    body = lay_along_x(
        smooth_revolution([*profile, (0.12, 1.0), (0, 1.0)], wide, length_m).translate((0, 0, -0.5 * length_m))
    )
    model = Model().add("body", body.scale((1, 1, flat)))
    nub = lay_along_x(cylinder(0.1 * wide, 0.04 * length_m, top_radius_m=0.06 * wide, sides=chords(14)))
    model.add("stem", nub.translate((0.49 * length_m, 0, 0)), "stem")
    end = lay_along_x(cylinder(0.07 * wide, 0.025 * length_m, sides=chords(12))).translate((-0.51 * length_m, 0, 0))
    model.add("blossom end", end, "stem")
    model.point("side", "surface", "body", (0.0, -0.5 * wide, 0.0), (0.0, -1.0, 0.0))
    return model.point("upper side", "surface", "body", (0.0, 0.0, 0.5 * flat * wide), (0.0, 0.0, 1.0)).rest_on_ground()


@template("mango")
def mango(*, length_m: float, width: float, flat: float, beak: float) -> Model:
    """Build a mango lying on its flat side with its stem towards +X.

    ``beak`` is the displacement of its bent tip relative to the width.
    """
    wide = width * length_m
    profile = [(0, 0.0), (0.3, 0.02), (0.62, 0.12), (0.88, 0.3), (1, 0.55), (0.95, 0.76), (0.72, 0.92), (0.38, 0.985)]
    body = lay_along_x(
        smooth_revolution([*profile, (0.12, 0.99), (0, 0.985)], wide, length_m, sides=64).translate(
            (0, 0, -0.5 * length_m)
        )
    )

    def bent(vertices: np.ndarray) -> np.ndarray:
        share = np.clip(-2 * vertices[:, 0] / length_m, 0.0, 1.0)
        return np.column_stack([vertices[:, 0], vertices[:, 1] - beak * wide * share**2, flat * vertices[:, 2]])

    model = Model().add("body", body.warp_batch(bent))
    end = (0.53 * length_m, 0.0, 0.0)
    model.add("stem", stalk([(0.46 * length_m, 0, 0), (0.5 * length_m, 0, 0), end], 0.004, 0.0034), "stem")
    at = 0.07 * length_m
    model.point("side", "surface", "body", (at, -0.5 * wide, 0.0), (0.0, -1.0, 0.0))
    return model.point("upper side", "surface", "body", (at, 0.0, 0.5 * flat * wide), (0.0, 0.0, 1.0)).rest_on_ground()


@template("apricot")
def apricot(*, width_m: float, tall: float, cleft: float) -> Model:
    """Build an apricot with the stem cavity on top and a cleft in front."""
    r, h = 0.5 * width_m, tall * width_m
    profile = [(0, 0.0), (0.3, 0.014), (0.66, 0.12), (0.92, 0.32), (1, 0.52), (0.92, 0.76), (0.7, 0.93), (0.42, 0.995)]
    body = smooth_revolution([*profile, (0.2, 0.97), (0.06, 0.92), (0, 0.91)], width_m, h, sides=80)
    model = Model().add("body", scale_radially(body, furrow(cleft, 0.11, -0.5 * np.pi)))
    model.add("stem", cylinder(0.07 * r, 0.08 * h, sides=chords(12)).translate((0, 0, 0.88 * h)), "stem")
    model.point("upper side", "surface", "stem", (0.0, 0.0, 0.96 * h), (0.0, 0.0, 1.0))
    return model.point("side", "surface", "body", (r, 0.0, 0.52 * h), (1.0, 0.0, 0.0)).rest_on_ground()


@template("pomegranate")
def pomegranate(*, width_m: float, tall: float, ribs: float, crown: float) -> Model:
    """Build a pomegranate with its crown on top; ``ribs`` is the depth of its faces, ``crown`` its height over the width."""
    r, h = 0.5 * width_m, tall * width_m
    profile = [(0, 0.02), (0.25, 0.0), (0.64, 0.08), (0.93, 0.3), (1, 0.52), (0.93, 0.74), (0.68, 0.9), (0.36, 0.98)]
    body = scale_radially(
        smooth_revolution([*profile, (0.2, 1.02), (0, 1.02)], width_m, h, sides=72), lambda a: 1 + ribs * np.cos(6 * a)
    )
    model = Model().add("body", body)
    top, wide = h + crown * width_m, 0.24 * r
    cup = cylinder(0.8 * wide, top - 0.96 * h, top_radius_m=1.25 * wide, sides=chords(30)).translate((0, 0, 0.96 * h))
    hollow = cylinder(0.5 * wide, top - h, top_radius_m=wide, sides=chords(30)).translate((0, 0, 1.005 * h))
    notch = (
        cylinder(0.34 * wide, 2 * wide, sides=chords(12)).rotate((0, 90, 0)).scale((1, 1, 2.0)).translate((0, 0, top))
    )
    notches = union([notch.rotate((0, 0, 60.0 * number)) for number in range(6)])
    model.add("crown", cup - hollow - notches, "crown")
    model.point("stem end", "surface", "crown", (0.0, -0.95 * wide, 0.5 * (h + top)), (0.0, -1.0, 0.0))
    return model.point("side", "surface", "body", (r * (1 + ribs), 0.0, 0.52 * h), (1.0, 0.0, 0.0)).rest_on_ground()


@template("fig")
def fig(*, height_m: float, width: float, ribs: float) -> Model:
    """Build a fig that stands on its broad end with its neck up; ``ribs`` is the depth of its ribs."""
    wide, h = width * height_m, height_m
    profile = [(0, 0.03), (0.12, 0.0), (0.42, 0.0), (0.78, 0.08), (0.98, 0.26), (1, 0.38), (0.86, 0.55), (0.52, 0.72)]
    body = smooth_revolution([*profile, (0.26, 0.86), (0.17, 0.95), (0, 0.95)], wide, h, sides=96)
    model = Model().add("body", scale_radially(body, lambda angle: 1 + ribs * np.cos(12 * angle)))
    model.add(
        "stem", stalk([(0, 0, 0.88 * h), (0, 0, 0.94 * h), (0.03 * h, 0, 1.02 * h)], 0.07 * wide, 0.05 * wide), "stem"
    )
    model.point("upper side", "tip", "stem", (0.03 * h, 0.0, 1.02 * h), (0.3, 0.0, 0.954))
    return model.point(
        "side", "surface", "body", (0.5 * wide * (1 + ribs), 0.0, 0.36 * h), (1.0, 0.0, 0.0)
    ).rest_on_ground()


@template("cherry")
def cherry(*, width_m: float, tall: float, stem: float) -> Model:
    """Build a cherry with its stalk; ``stem`` is the stalk's length relative to the cherry's width."""
    r, h = 0.5 * width_m, tall * width_m
    profile = [(0, 0.02), (0.2, 0.0), (0.62, 0.1), (0.92, 0.34), (1, 0.58), (0.9, 0.82), (0.62, 0.97), (0.38, 1.0)]
    model = Model().add("body", smooth_revolution([*profile, (0.15, 0.95), (0, 0.92)], width_m, h))
    long = stem * width_m
    end = (0.34 * long, 0.0, 0.92 * h + 0.9 * long)
    path = arc(
        [(0, 0, 0.88 * h), (0.01 * long, 0, 0.92 * h + 0.25 * long), (0.12 * long, 0, 0.92 * h + 0.6 * long), end]
    )
    half = np.interp(np.linspace(0, 1, len(path)), [0, 0.1, 0.9, 1], [0.0012, 0.0008, 0.0008, 0.0016])
    model.add("stem", tube(path, half, sides=10), "stem")
    model.point("stem end", "tip", "stem", end, (0.5, 0.0, 0.866))
    return model.point("side", "surface", "body", (0.0, -r, 0.58 * h), (0.0, -1.0, 0.0)).rest_on_ground()


@template("papaya")
def papaya(*, length_m: float, width: float, neck: float) -> Model:
    """Build a lying papaya with its stem towards +X; ``neck`` is the thickness near the stem relative to the belly's."""
    wide = width * length_m
    profile = [(0, 0.0), (0.14, 0.01), (0.5, 0.07), (0.88, 0.22), (1, 0.38), (0.93, 0.58), (0.5 * (neck + 0.92), 0.74)]
    body = smooth_revolution([*profile, (neck, 0.88), (0.62 * neck, 0.965), (0, 0.985)], wide, length_m, sides=80)
    faced = scale_radially(body, lambda angle: 1 + 0.018 * np.cos(5 * angle))
    model = Model().add("body", lay_along_x(faced.translate((0, 0, -0.5 * length_m))))
    nub = lay_along_x(cylinder(0.13 * neck * wide, 0.05 * length_m, sides=chords(14))).translate(
        (0.465 * length_m, 0, 0)
    )
    model.add("stem", nub, "stem")
    model.add(
        "blossom end", ellipsoid(0.03 * length_m, 0.08 * wide, 0.08 * wide).translate((-0.5 * length_m, 0, 0)), "stem"
    )
    at = -0.12 * length_m
    model.point("side", "surface", "body", (at, -0.5 * wide, 0.0), (0.0, -1.0, 0.0))
    return model.point("upper side", "surface", "body", (at, 0.0, 0.49 * wide), (0.0, 0.0, 1.0)).rest_on_ground()
