"""Fruit and vegetables: standing ones have their stem up, lying ones have it towards +X."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import chords, cylinder, ellipsoid, lathe, union
from manitwin.geometry.solids.sweep import arc, sweep, tube
from manitwin.models.generators.templates.catalog.organic import (
    lay_along_x,
    leaves,
    scale_radially,
    smooth_revolution,
    stalk,
)
from manitwin.models.generators.templates.template import Model, template


@template("apple")
def apple(*, width_m: float, tall: float, shoulder: float, stem_m: float) -> Model:
    """Build an apple; ``shoulder`` sets how wide it is near its top and how narrow near its base."""
    r, h = 0.5 * width_m, tall * width_m
    low, high = 0.9 - 0.5 * (shoulder - 1), 0.95 + 0.3 * (shoulder - 1)
    profile = [(0, 0.08), (0.16, 0.045), (0.34, 0.0), (0.66 * low / 0.9, 0.08), (low, 0.3), (1, 0.58)]
    profile += [(high, 0.78), (0.74, 0.95), (0.48, 1.0), (0.24, 0.95), (0.08, 0.84), (0, 0.82)]
    body = scale_radially(smooth_revolution(profile, width_m, h, sides=60), lambda angle: 1 + 0.012 * np.cos(5 * angle))
    top = 0.82 * h + stem_m
    model = Model().add("body", body)
    model.region("dimple", "body", lambda c: (np.hypot(c[:, 0], c[:, 1]) < 0.36 * r) & (c[:, 2] > 0.7 * h))
    model.add("stem", stalk([(0, 0, 0.78 * h), (0.04 * r, 0, 0.9 * h), (0.18 * r, 0, top)], 0.0013, 0.0019), "stem")
    model.point("stem end", "tip", "stem", (0.18 * r, 0.0, top), (0.25, 0.0, 0.968))
    return model.point("side", "surface", "body", (0.0, -r, 0.58 * h), (0.0, -1.0, 0.0)).rest_on_ground()


def citrus(width_m: float, tall: float, mark: float) -> Model:
    """Build a round citrus fruit with the mark of its stem on top; ``mark`` is its relative width."""
    r, h = 0.5 * width_m, tall * width_m
    profile = [(0, 0.02), (0.3, 0.015), (0.62, 0.11), (0.9, 0.3), (1, 0.5), (0.9, 0.7), (0.62, 0.89), (0.3, 0.985)]
    model = Model().add("body", smooth_revolution([*profile, (0.1, 0.985), (0, 0.975)], width_m, h))
    star = scale_radially(cylinder(mark * r, 0.02 * h, sides=chords(40)), lambda angle: 1 + 0.25 * np.cos(5 * angle))
    model.add("stem", star.translate((0, 0, 0.97 * h)), "stem")
    model.point("upper side", "surface", "stem", (0.0, 0.0, 0.99 * h), (0.0, 0.0, 1.0))
    return model.point("side", "surface", "body", (0.0, -r, 0.5 * h), (0.0, -1.0, 0.0)).rest_on_ground()


@template("orange")
def orange(*, width_m: float, tall: float, mark: float) -> Model:
    """Build an orange with the mark of its stem on top."""
    return citrus(width_m, tall, mark)


@template("lemon")
def lemon(*, length_m: float, width: float, nipple: float) -> Model:
    """Build a lying lemon with its nipple towards +X; ``nipple`` is its share of the length."""
    wide, waist = width * length_m, 1 - nipple
    profile = [
        (0, 0),
        (0.13, 0.005),
        (0.2, 0.05),
        (0.55, 0.14),
        (0.9, 0.32),
        (1, 0.5),
        (0.9, 0.67),
        (0.6, waist - 0.06),
    ]
    profile += [(0.34, waist), (0.22, 1 - 0.45 * nipple), (0.13, 1 - 0.1 * nipple), (0, 1)]
    model = Model().add(
        "body", lay_along_x(smooth_revolution(profile, wide, length_m).translate((0, 0, -0.5 * length_m)))
    )
    scar = lay_along_x(cylinder(0.07 * wide, 0.02 * length_m, sides=chords(16)))
    model.add("stem", scar.translate((-0.51 * length_m, 0, 0)), "stem")
    model.point("side", "surface", "body", (0.0, -0.5 * wide, 0.0), (0.0, -1.0, 0.0))
    return model.point("upper side", "surface", "body", (0.0, 0.0, 0.5 * wide), (0.0, 0.0, 1.0)).rest_on_ground()


@template("peach")
def peach(*, width_m: float, tall: float, cleft: float) -> Model:
    """Build a peach with the stem cavity on top and a cleft in front."""
    r, h = 0.5 * width_m, tall * width_m
    profile = [(0, 0.0), (0.25, 0.012), (0.6, 0.1), (0.9, 0.3), (1, 0.55), (0.9, 0.79), (0.66, 0.95), (0.42, 1.0)]
    body = smooth_revolution([*profile, (0.18, 0.95), (0.05, 0.89), (0, 0.88)], width_m, h, sides=96)

    def cleaved(angle: np.ndarray) -> np.ndarray:
        off = np.abs(np.angle(np.exp(1j * (angle + 0.5 * np.pi))))
        return np.asarray(
            1 - cleft * np.exp(-((off / 0.13) ** 2)) + 0.35 * cleft * np.exp(-(((off - 0.45) / 0.3) ** 2))
        )

    model = Model().add("body", scale_radially(body, cleaved))
    model.add("stem", cylinder(0.06 * r, 0.09 * h, sides=chords(12)).translate((0, 0, 0.85 * h)), "stem")
    model.point("upper side", "surface", "stem", (0.0, 0.0, 0.94 * h), (0.0, 0.0, 1.0))
    return model.point("side", "surface", "body", (r, 0.0, 0.55 * h), (1.0, 0.0, 0.0)).rest_on_ground()


@template("pear")
def pear(*, height_m: float, width: float, neck: float, stem_m: float) -> Model:
    """Build a pear that stands on its blossom end; ``neck`` is the neck's thickness relative to the belly's."""
    wide, h = width * height_m, height_m
    profile = [(0, 0.05), (0.15, 0.02), (0.3, 0.0), (0.7, 0.06), (0.96, 0.22), (1, 0.34), (0.88, 0.5)]
    profile += [
        (0.5 * (0.88 + neck), 0.62),
        (neck, 0.76),
        (0.86 * neck, 0.88),
        (0.5 * neck, 0.975),
        (0.2 * neck, 0.985),
    ]
    model = Model().add("body", smooth_revolution([*profile, (0, 0.96)], wide, h))
    end = (0.006, 0.0, h + stem_m)
    model.add("stem", stalk([(0, 0, 0.93 * h), (0.0005, 0, h), end], 0.0015, 0.002), "stem")
    model.point("stem end", "tip", "stem", end, (0.3, 0.0, 0.954))
    return model.point("side", "surface", "body", (0.0, -0.5 * wide, 0.34 * h), (0.0, -1.0, 0.0)).rest_on_ground()


@template("tomato")
def tomato(*, width_m: float, tall: float, ribs: float, leaf: float) -> Model:
    """Build a tomato with its sepals on top; ``ribs`` is the depth of its ribs."""
    r, h = 0.5 * width_m, tall * width_m
    profile = [(0, 0.0), (0.35, 0.01), (0.72, 0.13), (0.95, 0.35), (1, 0.52), (0.93, 0.75), (0.7, 0.94), (0.42, 1.0)]
    body = smooth_revolution([*profile, (0.18, 0.955), (0, 0.9)], width_m, h, sides=80)
    model = Model().add("body", scale_radially(body, lambda angle: 1 + ribs * np.cos(6 * angle)))
    outline = [(0.0, 0.95 * h), (0.4 * leaf * r, 0.995 * h), (0.72 * leaf * r, 1.01 * h), (leaf * r, 1.08 * h)]
    model.add("leaves", leaves(5, outline, 0.12 * r, 0.0018), "leaves")
    end = (0.1 * r, 0.0, h + 0.2 * r)
    model.add("stem", stalk([(0, 0, 0.88 * h), (0.01 * r, 0, h), end], 0.002, 0.0026), "leaves")
    model.point("stem end", "tip", "stem", end, (0.4, 0.0, 0.917))
    return model.point("side", "surface", "body", (0.0, -r, 0.5 * h), (0.0, -1.0, 0.0)).rest_on_ground()


@template("pumpkin")
def pumpkin(*, width_m: float, tall: float, ribs: float, stem: float) -> Model:
    """Build a pumpkin with ten ribs; ``stem`` is the stem's height relative to the width."""
    r, h = 0.5 * width_m, tall * width_m
    profile = [(0, 0.09), (0.18, 0.05), (0.42, 0.0), (0.76, 0.1), (0.96, 0.32), (1, 0.5), (0.95, 0.7), (0.74, 0.91)]
    body = smooth_revolution([*profile, (0.46, 1.0), (0.22, 0.95), (0, 0.89)], width_m, h, sides=120)
    model = Model().add("body", scale_radially(body, lambda angle: 1 - ribs * (1 - np.abs(np.sin(5 * angle)) ** 0.7)))
    top = (0.2 * r, 0.0, 0.9 * h + stem * width_m)
    path = arc(
        [(0, 0, 0.86 * h), (0.02 * r, 0, 0.97 * h), (0.09 * r, 0, 0.94 * h + 0.6 * stem * width_m), top], samples=14
    )
    half = 0.13 * r * np.interp(np.linspace(0, 1, 14), [0, 0.3, 1], [1.9, 0.95, 1.0])
    angles = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    section = (1 + 0.035 * np.cos(5 * angles))[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    model.add("stem", sweep(path, section, half), "stem")
    model.point("stem end", "tip", "stem", top, (0.5, 0.0, 0.866))
    return model.point("side", "surface", "body", (0.0, -r, 0.5 * h), (0.0, -1.0, 0.0)).rest_on_ground()


@template("onion")
def onion(*, width_m: float, tall: float, neck: float) -> Model:
    """Build an onion that stands on its roots; ``neck`` is the height of its dry neck relative to the width."""
    r, h = 0.5 * width_m, tall * width_m
    profile = [(0, 0.0), (0.22, 0.0), (0.6, 0.1), (0.92, 0.33), (1, 0.5), (0.9, 0.7), (0.62, 0.87), (0.3, 0.97)]
    model = Model().add("body", smooth_revolution([*profile, (0.14, 1.02), (0, 1.04)], width_m, h))
    dry = [(0, 0.9 * h), (0.3 * r, 0.955 * h), (0.15 * r, 1.03 * h), (0.11 * r, h + 0.6 * neck * width_m)]
    end = h + neck * width_m
    outline = np.array([*dry, (0.16 * r, end), (0, end - 0.004)])
    tuft = scale_radially(lathe(outline, sides=chords(40)), lambda angle: 1 + 0.12 * np.cos(7 * angle))
    model.add("stem", tuft, "stem")
    root = cylinder(0.0011, 0.009, top_radius_m=0.002, sides=8).translate((0, 0, -0.006)).rotate((0, 14, 0))
    model.add("roots", union([root.translate((-0.001, 0, 0.002)).rotate((0, 0, 60 * k)) for k in range(6)]), "roots")
    model.point("stem end", "tip", "stem", (0.0, 0.0, end - 0.004), (0.0, 0.0, 1.0))
    return model.point("side", "surface", "body", (0.0, -r, 0.5 * h), (0.0, -1.0, 0.0)).rest_on_ground()


@template("banana")
def banana(*, length_m: float, width: float, bend: float, stem: float) -> Model:
    """Build a banana lying on its side with its stem towards +X; ``bend`` is the angle in rad from end to end."""
    r, angle = 0.5 * width * length_m, bend * np.linspace(-0.5, 0.5, 40)
    about = length_m / (2 * np.sin(0.5 * bend))
    curve = np.column_stack([about * np.sin(angle), about * (np.cos(angle) - np.cos(0.25 * bend)), 0 * angle])
    along = np.linspace(0, 1, 40)
    neck = 1 - stem
    half = r * np.interp(along, [0, 0.03, 0.1, 0.22, 0.4, 0.6, neck - 0.16, neck - 0.06, neck, 1], _BANANA)
    around = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    section = (1 + 0.034 * np.cos(5 * around))[:, None] * np.column_stack([np.cos(around), np.sin(around)])
    cut = int(np.searchsorted(along, neck + 0.35 * stem))
    model = Model().add("body", sweep(curve[1 : cut + 1], section, half[1 : cut + 1], across=(0, 0, 1)))
    model.add("stem", sweep(curve[cut - 1 :], section, 1.05 * half[cut - 1 :], across=(0, 0, 1)), "stem")
    model.add("tip", tube(curve[:3], [0.14 * r, 0.24 * r, 0.3 * r], across=(0, 0, 1)), "tip")
    end, start, middle = curve[-1], curve[0], 20
    out = (float(np.cos(0.5 * bend)), -float(np.sin(0.5 * bend)), 0.0)
    model.point("stem", "tip", "stem", (float(end[0]), float(end[1]), 0.0), out)
    model.point("body", "surface", "body", (float(curve[middle, 0]), float(curve[middle, 1]), r), (0.0, 0.0, 1.0))
    return model.point(
        "tip", "tip", "tip", (float(start[0]), float(start[1]), 0.0), (-out[0], out[1], 0.0)
    ).rest_on_ground()


_BANANA = [0.2, 0.32, 0.62, 0.88, 1.0, 1.0, 0.85, 0.52, 0.3, 0.27]


@template("carrot")
def carrot(*, length_m: float, width: float, taper: float, tops_m: float) -> Model:
    """Build a lying carrot with green stalks towards +X, cut at ``tops_m``; ``taper`` is its relative width near the tip."""
    r, crown = 0.5 * width * length_m, 0.5 * length_m
    along = np.linspace(0, 1, 48)
    half = r * np.interp(along, [0, 0.02, 0.1, 0.5, 0.9, 0.97, 1], [0.06, 0.14, taper, 0.5 * (1 + taper), 1, 0.92, 0.5])
    half *= 1 + np.where(np.arange(48) % 5 == 2, -0.035, 0.0)
    path = np.column_stack([(along - 0.5) * length_m, 0.012 * length_m * np.sin(5 * along), 0 * along])
    model = Model().add("body", tube(path, half, sides=chords(24)))
    model.region("tip", "body", lambda c: c[:, 0] < -0.43 * length_m)
    for number in range(7):
        a, tilt = 2.4 * number, 0.06 + 0.05 * (number % 4)
        y, z = np.cos(a), np.sin(a)
        at = 0.012 * length_m * np.sin(5)
        ends = [(crown - 0.008, at + 0.2 * r * y, 0.2 * r * z), (crown + 0.4 * tops_m, at + 0.35 * r * y, 0.35 * r * z)]
        reach = tops_m * (0.72 + 0.07 * (number % 5))
        bent = [*ends, (crown + reach, at + (0.4 * r + tilt * tops_m) * y, (0.4 * r + tilt * tops_m) * z)]
        model.add("stem", stalk(bent, 0.1 * r + 0.001, 0.08 * r + 0.0006, sides=8), "stem")
    model.point("stem", "surface", "stem", (crown + 0.002, 0.0, 0.25 * r), (0.0, 0.0, 1.0))
    model.point("body", "surface", "body", (0.0, 0.0, float(np.interp(0.5, along, half))), (0.0, 0.0, 1.0))
    return model.point("tip", "tip", "tip", (-0.5 * length_m, 0.0, 0.0), (-1.0, 0.0, 0.0)).rest_on_ground()


@template("eggplant")
def eggplant(*, length_m: float, width: float, neck: float, bend: float, stem_m: float) -> Model:
    """Build a lying eggplant with its stem towards +X; ``neck`` is its relative thickness at the green cap.

    ``bend`` is half the curvature of its centre line times its length.
    """
    r = 0.5 * width * length_m
    share = [0, 0.02, 0.07, 0.16, 0.3, 0.5, 0.75, 0.93, 1]
    wide = [0.15, 0.4, 0.68, 0.9, 1, 0.88, 0.5 * (neck + 0.75), neck, 0.75 * neck]
    along = np.linspace(0, 1, 48)
    half = r * np.interp(along, share, wide)
    half = np.convolve(np.pad(half, 2, mode="edge"), np.full(5, 0.2), mode="valid")
    path = np.column_stack([(along - 0.5) * length_m, bend * length_m * (0.5 - along) ** 2, 0 * along])
    model = Model().add("body", tube(path, half, sides=chords(32)))
    model.region("tip", "body", lambda c: c[:, 0] < -0.46 * length_m)
    x, y = 0.5 * length_m, float(path[-1, 1])
    n = 1.06 * neck * r
    outline = [(0.0, 0.01), (0.6 * n, 0.006), (n, -0.012), (1.06 * n, -0.05 * length_m), (1.12 * n, -0.11 * length_m)]
    cap = leaves(6, outline, 0.5 * n, 0.003)
    model.add("leaves", lay_along_x(cap).translate((x, y, 0)), "leaves")
    top = (x + stem_m, y - 0.2 * stem_m, 0.0)
    model.add("stem", stalk([(x - 0.004, y, 0), (x + 0.5 * stem_m, y, 0), top], 0.0055, 0.0045), "leaves")
    model.point("stem", "tip", "stem", top, (0.96, -0.28, 0.0))
    at = 14
    model.point("body", "surface", "body", (float(path[at, 0]), float(path[at, 1]), float(half[at])), (0.0, 0.0, 1.0))
    return model.point(
        "tip", "tip", "tip", (-0.5 * length_m, float(path[0, 1]), 0.0), (-1.0, 0.0, 0.0)
    ).rest_on_ground()


@template("strawberry")
def strawberry(*, length_m: float, width: float, taper: float, leaf: float) -> Model:
    """Build a strawberry lying on its side with its tip towards +X; ``taper`` is its relative width below its middle."""
    wide = width * length_m
    profile = [(0, 0.02), (0.45, 0.0), (0.82, 0.07), (1, 0.24), (0.94, 0.45), (taper, 0.7), (0.36, 0.92), (0.16, 0.985)]
    body = smooth_revolution([*profile, (0, 1.0)], wide, length_m)
    outline = [(0, -0.01 * length_m), (0.3 * wide, -0.03 * length_m), (0.45 * leaf * wide, 0.0)]
    green = leaves(9, [*outline, (0.56 * leaf * wide, -0.06 * length_m)], 0.085 * wide, 0.0012)
    edge = arc([(r, 0, z) for r, z in [*profile, (0, 1.0)]], samples=60)[20:, [0, 2]]
    seeds = []
    for number in range(54):
        z, a = 0.1 + 0.85 * (number + 0.5) / 54, 2.39996 * number
        r = 0.5 * wide * float(np.interp(z, edge[:, 1], edge[:, 0]))
        seed = ellipsoid(0.0007, 0.0011, 0.0018, sides=8)
        seeds.append(seed.translate((r, 0, z * length_m)).rotate((0, 0, float(np.degrees(a)))))
    # The side of the cone from its widest ring to where it narrows rests on the ground: its tangent is horizontal.
    tilt = float(np.degrees(np.arctan2(0.5 * wide * (1 - taper), 0.46 * length_m)))

    def laid(solid: Manifold) -> Manifold:
        return lay_along_x(solid.translate((0, 0, -0.45 * length_m))).rotate((0, 0.9 * tilt, 0))

    model = (
        Model().add("body", laid(body)).add("seeds", laid(union(seeds)), "seeds").add("leaves", laid(green), "leaves")
    )
    stem = stalk([(0, 0, 0.03 * length_m), (0, 0, -0.1 * length_m), (0.03 * wide, 0, -0.2 * length_m)], 0.0012, 0.001)
    model.add("stem", laid(stem), "leaves")
    a = np.radians(0.9 * tilt)
    x, z = -0.65 * length_m, -0.03 * wide
    end = (x * np.cos(a) + z * np.sin(a), 0.0, -x * np.sin(a) + z * np.cos(a))
    model.point(
        "stem end", "tip", "stem", (float(end[0]), 0.0, float(end[2])), (-float(np.cos(a)), 0.0, float(np.sin(a)))
    )
    return model.point(
        "side", "surface", "body", (-0.2 * length_m, -0.5 * wide, 0.0), (0.0, -1.0, 0.0)
    ).rest_on_ground()
