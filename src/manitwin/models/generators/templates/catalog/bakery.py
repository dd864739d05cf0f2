"""Goods of a bakery and a snack bar, lying or standing as they are served."""

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
    rounded,
    torus,
    union,
)
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.organic import scale_radially, smooth_revolution
from manitwin.models.generators.templates.catalog.rings import ring_radii
from manitwin.models.generators.templates.template import Model, template


def _both_faces(model: Model, height_m: float, off_m: float = 0.0) -> Model:
    """Add points on the upper and the lower side, ``off_m`` beside the centre, and place the model on the ground."""
    model.point("top", "surface", "body", (off_m, 0.0, height_m), (0.0, 0.0, 1.0))
    return model.point("base", "surface", "body", (off_m, 0.0, 0.0), (0.0, 0.0, -1.0)).rest_on_ground()


@template("bagel")
def bagel(*, width_m: float, thick: float, hole: float) -> Model:
    """Build a bagel lying, with seeds on it; ``hole`` is the hole's width over the bagel's."""
    h = thick * width_m
    ring, half = ring_radii(width_m, hole)
    body = torus(ring, half, sides=chords(60)).scale((1, 1, 0.5 * h / half)).translate((0, 0, 0.5 * h))
    model = Model().add("body", body)
    seeds = []
    for number in range(48):
        off = ((0.5698 * number) % 1 - 0.5) * 1.4 * half
        z = 0.5 * h + 0.5 * h * float(np.sqrt(1 - (off / half) ** 2))
        seed = ellipsoid(0.0036, 0.0021, 0.0016, sides=8).rotate((0, 0, 83.0 * number))
        tilt = float(np.degrees(np.arctan(0.9 * off / half)))
        seeds.append(seed.rotate((0, tilt, 0)).translate((ring + off, 0, z)).rotate((0, 0, 137.5 * number)))
    model.add("seeds", union(seeds), "seeds")
    model.region("hole", "body", lambda c: np.hypot(c[:, 0], c[:, 1]) < ring - 0.5 * half)
    return _both_faces(model, h, ring)


@template("bun")
def bun(*, width_m: float, tall: float, flat: float) -> Model:
    """Build a round bun; ``flat`` is the height of its widest cross-section relative to the total height."""
    r, h = 0.5 * width_m, tall * width_m
    profile = [
        (0, 0.0),
        (0.78, 0.0),
        (0.93, 0.08),
        (1, flat),
        (0.94, 0.5 * (1 + flat)),
        (0.74, 0.84),
        (0.4, 0.97),
        (0, 1.0),
    ]
    body = smooth_revolution(profile, width_m, h, sides=64)
    model = Model().add("body", body)
    model.region("crust", "body", lambda c: c[:, 2] > 0.8 * flat * h, "crust")
    model.region("base", "body", lambda c: c[:, 2] < 0.02 * h)
    model.point("top", "surface", "crust", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.3 * r, 0.0, 0.0), (0.0, 0.0, -1.0)).rest_on_ground()


@template("croissant")
def croissant(*, length_m: float, width: float, bend: float) -> Model:
    """Build a lying croissant, with the tips towards -Y; ``bend`` is the angle in rad from tip to tip."""
    about, angle = length_m / (2 * np.sin(0.5 * min(bend, np.pi))), np.linspace(-0.5 * bend, 0.5 * bend, 64)
    path = np.column_stack([about * np.sin(angle), about * np.cos(angle) - about, 0 * angle])
    share = np.linspace(0, 1, 64)
    thick = 0.5 * width * length_m * np.interp(np.abs(2 * share - 1), [0, 0.35, 0.75, 1], [1.0, 0.86, 0.5, 0.24])
    steps = 0.93 + 0.1 * ((5.0 * np.abs(2 * share - 1)) % 1.0)  # edges of the rolled layers, each above the next
    body = tube(path, thick * steps, flatten=0.84, across=(0, 1, 0), sides=chords(28))
    model = Model().add("body", body)
    model.region("tips", "body", lambda c: np.abs(c[:, 0]) > 0.42 * length_m)
    top = float(np.array(body.bounding_box())[5])
    model.point("top", "surface", "body", (0.0, 0.0, top), (0.0, 0.0, 1.0))
    return model.point("base", "surface", "body", (0.0, 0.0, -top), (0.0, 0.0, -1.0)).rest_on_ground()


@template("muffin")
def muffin(*, width_m: float, tall: float, foot: float, dome: float) -> Model:
    """Build a muffin in its paper cup.

    ``foot`` is the cup's lower width relative to the muffin's, ``dome`` the share of the top in the height.
    """
    r, h = 0.5 * width_m, tall * width_m
    low = (1 - dome) * h
    cup = lathe([(foot * r, 0.0), (0.86 * r, low)], sides=chords(96))
    paper = scale_radially(cup, lambda angle: 1 + 0.025 * np.cos(24 * angle))
    crown = [(0, low - 0.04 * h), (0.8 * r, low - 0.04 * h), (0.97 * r, low), (r, low + 0.14 * dome * h)]
    crown += [(0.93 * r, low + 0.46 * dome * h), (0.66 * r, low + 0.83 * dome * h), (0.3 * r, 0.99 * h), (0, h)]
    top = lathe(arc([(x, 0, z) for x, z in crown], samples=40)[:, [0, 2]])
    model = Model().add("body", scale_radially(top, lambda a: 1 + 0.012 * np.sin(5 * a) + 0.01 * np.sin(3 * a + 1)))
    model.add("cup", paper, "cup")
    chips = []
    for number in range(12):
        off, a = 0.72 * r * float(np.sqrt((number + 0.5) / 12)), 2.39996 * number
        z = float(
            np.interp(
                off, [0, 0.3 * r, 0.66 * r, 0.93 * r], [h, 0.99 * h, low + 0.83 * dome * h, low + 0.46 * dome * h]
            )
        )
        chip = ellipsoid(0.009, 0.007, 0.006, sides=10).rotate((0, 0, 71.0 * number))
        chips.append(chip.translate((off * float(np.cos(a)), off * float(np.sin(a)), z - 0.0015)))
    model.add("chips", union(chips), "chips")
    model.point("top", "surface", "body", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("base", "face", "cup", (0.3 * foot * r, 0.0, 0.0), (0.0, 0.0, -1.0)).rest_on_ground()


@template("bread slice")
def bread_slice(*, width_m: float, tall: float, thick_m: float, dome: float) -> Model:
    """Build a slice of bread lying on its cut face, with the domed side towards +Y; ``dome`` is the share of that side."""
    w, d = width_m, tall * width_m
    low = (1 - dome) * d
    turn = np.linspace(0.0, np.pi, 15)
    bow = [(0.52 * w * float(np.cos(a)), low + dome * d * float(np.sin(a))) for a in turn]
    outline = polygon(
        [(-0.46 * w, 0.0), (0.46 * w, 0.0), (0.46 * w, 0.88 * low), *bow, (-0.46 * w, 0.88 * low)], radius_m=0.05 * w
    )
    crumb = outline.offset(-0.002).translate((0.0, -0.5 * d))
    model = Model().add("body", prism(crumb, thick_m))
    rim = outline.translate((0.0, -0.5 * d))
    model.add(
        "crust",
        prism(rim, 0.96 * thick_m).translate((0, 0, 0.02 * thick_m))
        - prism(crumb, 2 * thick_m).translate((0, 0, -0.5 * thick_m)),
        "crust",
    )
    model.point("front", "face", "body", (0.0, 0.0, thick_m), (0.0, 0.0, 1.0))
    model.point("edge", "surface", "crust", (0.0, -0.5 * d, 0.5 * thick_m), (0.0, -1.0, 0.0))
    return model.point("back", "face", "body", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)).rest_on_ground()


@template("hamburger")
def hamburger(*, width_m: float, crown: float, patty: float, heel: float) -> Model:
    """Build a standing hamburger: ``heel``, ``patty`` and ``crown`` are the heights of its layers relative to its width."""
    r, low, meat, high = 0.5 * width_m, heel * width_m, patty * width_m, crown * width_m
    model = Model().add(
        "heel", lathe(rounded([(0, 0), (0.9 * r, 0), (0.96 * r, 0.5 * low), (0.94 * r, low), (0, low)], 0.3 * low))
    )
    at = low
    rough = scale_radially(
        lathe(
            rounded(
                [(0, at - 0.001), (0.97 * r, at - 0.001), (r, at + 0.5 * meat), (0.97 * r, at + meat), (0, at + meat)],
                0.3 * meat,
            ),
            sides=chords(72),
        ),
        lambda a: 1 + 0.012 * np.sin(9 * a) + 0.01 * np.sin(14 * a + 1),
    )
    model.add("patty", rough, "patty")
    at += meat
    slab = box(1.66 * r, 1.66 * r, 0.0028).rotate((0, 0, 45)) ^ cylinder(1.12 * r, 0.02).translate((0, 0, -0.002))
    model.add("cheese", slab.translate((0, 0, at - 0.0006)), "cheese")
    at += 0.0022
    frill = cylinder(1.03 * r, 0.004, sides=chords(96)).translate((0, 0, at - 0.0006))
    model.add("salad", scale_radially(frill, lambda a: 1 + 0.04 * np.sin(11 * a) + 0.02 * np.sin(17 * a)), "salad")
    at += 0.0032
    dome = [(0, at - 0.0006), (0.9 * r, at - 0.0006), (0.98 * r, at + 0.2 * high), (0.93 * r, at + 0.5 * high)]
    dome += [(0.7 * r, at + 0.83 * high), (0.36 * r, at + 0.97 * high), (0, at + high)]
    model.add("body", lathe(arc([(x, 0, z) for x, z in dome], samples=36)[:, [0, 2]]))
    seeds = []
    for number in range(30):
        off, a = 0.72 * r * float(np.sqrt((number + 0.5) / 30)), 137.5 * number
        z = at + high * float(np.interp(off / r, [0, 0.36, 0.7, 0.93], [1.0, 0.97, 0.83, 0.5]))
        seed = ellipsoid(0.0034, 0.002, 0.0015, sides=8).rotate((0, 35.0 * off / r, 0))
        seeds.append(seed.translate((off, 0, z)).rotate((0, 0, a)))
    model.add("seeds", union(seeds), "seeds")
    model.point("top", "surface", "body", (0.0, 0.0, at + high), (0.0, 0.0, 1.0))
    return model.point("base", "face", "heel", (0.3 * r, 0.0, 0.0), (0.0, 0.0, -1.0))


def _sausage(length_m: float, width_m: float, bend: float) -> tuple[Manifold, np.ndarray]:
    """Return a sausage along X, curved in its plane by ``bend`` of its length, and its centre line ``(N, 3)``."""
    share = np.linspace(0, 1, 40)
    path = np.column_stack([(share - 0.5) * length_m, bend * length_m * (1 - 4 * (share - 0.5) ** 2), 0 * share])
    end = 0.5 * width_m / length_m
    away = np.clip(np.minimum(share, 1 - share) / end, 0.0, 1.0)
    return tube(path, 0.5 * width_m * np.sqrt(np.clip(1 - (1 - away) ** 2, 0.02, 1.0)), sides=chords(32)), path


@template("sausage")
def sausage(*, length_m: float, width: float, bend: float) -> Model:
    """Build a lying sausage with tied ends; ``bend`` is the distance of its middle from the line through its ends, over the
    length.
    """
    r = 0.5 * width * length_m
    body, path = _sausage(length_m, 2 * r, bend)
    model = Model().add("body", body)
    for end, side in ((path[0], -1.0), (path[-1], 1.0)):
        knot = ellipsoid(0.5 * r, 0.4 * r, 0.4 * r, sides=chords(12)).translate(
            (float(end[0]) + side * 0.08 * r, float(end[1]), 0)
        )
        model.add("end", knot, "end")
    tip = float(path[-1, 0]) + 0.33 * r
    model.point("end", "tip", "end", (tip, float(path[-1, 1]), 0.0), (1.0, 0.0, 0.0))
    middle = path[len(path) // 2]
    return model.point(
        "body", "surface", "body", (float(middle[0]), float(middle[1]), r), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("hot dog")
def hot_dog(*, length_m: float, width: float, sausage: float, sauce_m: float) -> Model:
    """Build a lying hot dog whose bun is open above; ``sausage`` is the sausage's thickness relative to the bun's width."""
    w, thick = width * length_m, sausage * width * length_m
    loaf, _ = _sausage(0.92 * length_m, w, 0.0)
    bread = loaf.scale((1, 1, 0.82))
    wedge = prism(polygon([(-0.36 * thick, 0.0), (0.36 * thick, 0.0), (0.75 * thick, w), (-0.75 * thick, w)]), length_m)
    slot = wedge.rotate((90, 0, 90)).translate((-0.5 * length_m, 0, 0.02 * w))
    model = Model().add("bun", bread - slot)
    meat, path = _sausage(length_m, thick, 0.0)
    lifted = 0.2 * w
    model.add("body", meat.translate((0, 0, lifted)), "sausage")
    top = lifted + 0.5 * thick
    share = np.linspace(-0.4, 0.4, 60)
    line = np.column_stack([share * length_m, 0.28 * thick * np.sin(34 * share), np.full(60, top - 0.05 * thick)])
    model.add("sauce", tube(line, sauce_m, sides=10, across=(0, 0, 1)), "sauce")
    end = float(path[-1, 0])
    model.point("end", "tip", "body", (end, 0.0, lifted), (1.0, 0.0, 0.0))
    return model.point("body", "surface", "bun", (0.0, -0.5 * w, 0.0), (0.0, -1.0, 0.0)).rest_on_ground()


@template("waffle")
def waffle(*, width_m: float, thick_m: float, cells: float, deep: float) -> Model:
    """Build a lying round waffle with ``cells`` hollows across; ``deep`` is their depth relative to the thickness."""
    r, count = 0.5 * width_m, round(cells)
    pitch, high = width_m / count, deep * thick_m
    pit = box(0.62 * pitch, 0.62 * pitch, 2 * high)
    pits: list[Manifold] = []
    for u in range(count):
        for v in range(count):
            x, y = (u - 0.5 * (count - 1)) * pitch, (v - 0.5 * (count - 1)) * pitch
            if np.hypot(x, y) < r - 0.55 * pitch:
                pits += [pit.translate((x, y, thick_m - high)), pit.translate((x, y, -high))]
    edge = rounded([(0, 0), (0.97 * r, 0), (r, 0.5 * thick_m), (0.97 * r, thick_m), (0, thick_m)], 0.3 * thick_m)
    model = Model().add("body", lathe(edge, sides=chords(72))).cut("hollows", union(pits))
    rib = 0.5 * pitch if count % 2 else 0.0
    model.point("face", "face", "body", (rib, rib, thick_m), (0.0, 0.0, 1.0))
    model.point("edge", "surface", "body", (0.0, -r, 0.5 * thick_m), (0.0, -1.0, 0.0))
    return model.point("other face", "face", "body", (rib, rib, 0.0), (0.0, 0.0, -1.0)).rest_on_ground()
