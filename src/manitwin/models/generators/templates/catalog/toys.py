"""Blocks, game pieces, discs and toys; standing ones face -Y."""

from __future__ import annotations

from itertools import product

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
    union,
)
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.hand_tools import grip
from manitwin.models.generators.templates.catalog.rings import finish_ring, ring_radii
from manitwin.models.generators.templates.catalog.vessel import smooth_profile
from manitwin.models.generators.templates.template import Model, template


@template("hockey puck")
def hockey_puck(*, width_m: float, thick: float) -> Model:
    """Build a lying puck with a ribbed edge."""
    r, h = 0.5 * width_m, thick * width_m
    model = Model().add("body", lathe(rounded([(0, 0), (r, 0), (r, h), (0, h)], 0.002), sides=chords(72)))
    grooves = [torus(r + 0.0004, 0.0008).translate((0, 0, share * h)) for share in (0.3, 0.5, 0.7)]
    model.cut("edge", union(grooves)).region("edge", "body", lambda c: np.hypot(c[:, 0], c[:, 1]) > 0.98 * r)
    model.region("top", "body", lambda c: c[:, 2] > 0.99 * h)
    model.point("top", "face", "top", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("edge", "surface", "edge", (0.0, -r, 0.4 * h), (0.0, -1.0, 0.0))


@template("frisbee")
def frisbee(*, width_m: float, high: float, wall_m: float) -> Model:
    """Build a flying disc lying on its rim, with its hollow side down."""
    r, h, edge = 0.5 * width_m, high * width_m, 0.012 * width_m
    outer = [(0, h), (0.72 * r, h), (0.9 * r, 0.92 * h), (r, 0.4 * h), (0.985 * r, 0), (0.985 * r - edge, 0)]
    under = [
        (0.945 * r - wall_m, 0.45 * h),
        (0.88 * r, 0.92 * h - 1.2 * wall_m),
        (0.72 * r, h - wall_m),
        (0, h - wall_m),
    ]
    model = Model().add("body", lathe(rounded([*outer, *under], 0.006), sides=chords(72)))
    rings = [torus(share * r, 0.0007, sides=chords(72)).translate((0, 0, h)) for share in (0.5, 0.56, 0.62, 0.68)]
    model.add("rings", union(rings))
    model.region("rim", "body", lambda c: np.hypot(c[:, 0], c[:, 1]) > 0.93 * r)
    model.region("inside", "body", lambda c: (c[:, 2] < h - 0.6 * wall_m) & (np.hypot(c[:, 0], c[:, 1]) < 0.93 * r))
    model.region("top", "body", lambda c: np.hypot(c[:, 0], c[:, 1]) < 0.74 * r)
    model.point("rim", "surface", "rim", (0.0, -r, 0.4 * h), (0.0, -1.0, 0.0))
    model.point("inside", "surface", "inside", (0.0, 0.0, h - wall_m), (0.0, 0.0, -1.0))
    return model.point("top", "face", "top", (0.0, 0.0, h), (0.0, 0.0, 1.0))


@template("stacking ring")
def stacking_ring(*, width_m: float, hole: float) -> Model:
    """Build a lying ring; ``hole`` is the hole's width relative to the ring's."""
    ring, half = ring_radii(width_m, hole)
    model = Model().add("body", torus(ring, half, sides=chords(64)))
    return finish_ring(model, width_m, hole, hole_share=0.7)


@template("yo yo")
def yo_yo(*, width_m: float, thick: float, gap: float) -> Model:
    """Build a yo-yo lying on one half with its string wound up; ``gap`` is the slot's height relative to the whole."""
    r, h = 0.5 * width_m, thick * width_m
    low, slot = 0.5 * (1 - gap) * h, gap * h
    half = [(0, 0.04 * h), (0.5 * r, 0.03 * h), (0.72 * r, 0.0), (r, 0.55 * low), (0.9 * r, low), (0, low)]
    half_solid = lathe(rounded(half, 0.1 * r), sides=chords(64))
    model = Model().add("body", half_solid).add("body", half_solid.mirror((0, 0, 1)).translate((0, 0, h)))
    model.add("axle", cylinder(0.2 * r, slot + 0.002).translate((0, 0, low - 0.001)), "axle")
    model.add("string", cylinder(0.45 * r, 0.9 * slot).translate((0, 0, low + 0.05 * slot)), "string")
    model.region("end", "body", lambda c: np.hypot(c[:, 0], c[:, 1]) > 0.85 * r)
    cap = cylinder(0.32 * r, 0.06 * h).translate((0, 0, 0.95 * h))
    model.add("cap", cap, "axle")
    model.point("top", "face", "cap", (0.0, 0.0, 1.01 * h), (0.0, 0.0, 1.0))
    return model.point("end", "surface", "end", (0.0, -0.98 * r, 0.5 * low), (0.0, -1.0, 0.0)).rest_on_ground()


@template("rubik's cube")
def rubiks_cube(*, width_m: float, sticker: float, gap_m: float) -> Model:
    """Build a solved cube, green in front and white on top; ``sticker`` is a sticker's width relative to its piece's."""
    half, piece = 0.5 * width_m, width_m / 3
    raised = 0.0004
    model = Model().add("body", box(width_m, width_m, width_m, radius_m=0.0015).translate((0, 0, -half)))
    slit = box(gap_m, 2 * width_m, 2 * width_m).translate((0, 0, -width_m)) - box(
        2 * gap_m, width_m - 0.003, width_m - 0.003
    ).translate((0, 0, -half + 0.0015))
    for turn in ((0, 0, 0), (0, 0, 90), (0, 90, 0)):
        for side in (-1, 1):
            model.cut("body", slit.translate((side * piece / 2, 0, 0)).rotate(turn))
    plate = prism(rectangle(sticker * piece, sticker * piece, radius_m=0.08 * piece), 0.002)
    face = union(
        [plate.translate((i * piece, j * piece, half + raised - 0.002)) for i, j in product((-1, 0, 1), repeat=2)]
    )
    turns = {
        "up": (0, 0, 0), "down": (180, 0, 0), "front": (90, 0, 0), "back": (-90, 0, 0), "left": (0, -90, 0), "right": (0, 90, 0),
    }  # fmt: skip
    for side_name, turn in turns.items():
        model.add(side_name, face.rotate(turn), side_name)
    model.point("top", "face", "up", (0.0, 0.0, half + raised), (0.0, 0.0, 1.0))
    model.point("side", "face", "front", (0.0, -half - raised, 0.0), (0.0, -1.0, 0.0))
    return model.rest_on_ground()


@template("domino")
def domino(*, length_m: float, width: float, thick: float, spot: float) -> Model:
    """Build a lying domino with six and four facing up; ``spot`` is a spot's width relative to the domino's."""
    y, h = width * length_m, thick * length_m
    model = Model().add("body", box(length_m, y, h, radius_m=0.0015))
    r = 0.5 * spot * y
    pip = ellipsoid(2 * r, 2 * r, 1.2 * r, sides=chords(20))
    six = [(x, side) for x in (-1, 0, 1) for side in (-1, 1)]
    four = [(x, side) for x in (-1, 1) for side in (-1, 1)]
    places = [(-0.25 * length_m, each) for each in six] + [(0.25 * length_m, each) for each in four]
    pips = union([pip.translate((at + 0.13 * length_m * a, 0.27 * y * b, h)) for at, (a, b) in places])
    model.cut("spots", pips, "spots")
    model.cut("line", box(0.0012, 0.8 * y, 0.002).translate((0, 0, h - 0.0006)), "spots")
    model.region("front", "body", lambda c: c[:, 2] > 0.999 * h)
    model.point("front", "face", "front", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("edge", "surface", "body", (0.0, -0.5 * y, 0.5 * h), (0.0, -1.0, 0.0))


@template("chess piece")
def chess_piece(*, height_m: float, width: float, head: float, waist: float) -> Model:
    """Build a pawn; ``head`` and ``waist`` are relative to its foot's width."""
    h, r = height_m, 0.5 * width * height_m
    ball, thin = head * r, waist * r
    foot = [(0, 0), (r, 0), (r, 0.09 * h), (0.86 * r, 0.14 * h), (0.9 * r, 0.18 * h), (0.62 * r, 0.25 * h)]
    stem = [(thin, 0.5 * h), (0.9 * thin, h - 2.0 * ball), (0, h - 2.0 * ball)]
    model = Model().add("body", lathe(rounded([*foot, *stem], 0.1 * r)))
    at = h - 2.0 * ball
    collar = [(0, at - 0.03 * h), (0.95 * thin, at - 0.03 * h), (1.25 * ball, at), (1.25 * ball, at + 0.02 * h)]
    model.add("collar", lathe(rounded([*collar, (0.6 * ball, at + 0.05 * h), (0, at + 0.05 * h)], 0.002)))
    model.add("top", ellipsoid(2 * ball, 2 * ball, 2 * ball).translate((0, 0, h - ball)))
    model.add("felt", cylinder(0.96 * r, 0.002).translate((0, 0, -0.001)), "felt")
    model.point("top", "surface", "top", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point(
        "body",
        "surface",
        "body",
        (0.0, -float(np.interp(0.4, [0.25, 0.5], [0.62 * r, thin])), 0.4 * h),
        (0.0, -1.0, 0.0),
    ).rest_on_ground()


@template("toy car")
def toy_car(*, length_m: float, width: float, height: float, cabin: float, wheel: float) -> Model:
    """Build a car with its front to -Y; the cabin's length and the wheel's diameter are relative to the car's length."""
    n, x, h = length_m, 0.5 * width * length_m, height * length_m
    r = 0.5 * wheel * n
    low, belt = 0.55 * r, 0.56 * h
    side = [(-0.5, low / n), (0.5, low / n), (0.5, 0.8 * belt / n), (0.44, belt / n), (-0.2, belt / n)]
    side += [(-0.44, 0.9 * belt / n), (-0.5, 0.72 * belt / n)]
    hull = prism(polygon([(n * a, n * b) for a, b in side], radius_m=0.02 * n), 2 * x, radius_m=0.012 * n)
    front, back = 0.02 - 0.5 * cabin, 0.02 + 0.5 * cabin
    upper = [
        (front - 0.06, 0.9 * belt / n),
        (back + 0.04, 0.9 * belt / n),
        (back, belt / n + 0.02),
        (back - 0.06, h / n),
    ]
    upper += [(front + 0.1, h / n)]
    house = prism(polygon([(n * a, n * b) for a, b in upper], radius_m=0.012 * n), 1.76 * x, radius_m=0.012 * n)

    def along(solid: Manifold, wide: float) -> Manifold:
        return solid.translate((0, 0, -0.5 * wide)).rotate((90, 0, 90))

    model = Model().add("body", along(hull, 2 * x)).add("cabin", along(house, 1.76 * x))
    glass = [(front - 0.01, belt / n + 0.012), (back - 0.03, belt / n + 0.012), (back - 0.075, h / n - 0.03)]
    glass += [(front + 0.1, h / n - 0.03)]
    pane = prism(polygon([(n * a, n * b) for a, b in glass], radius_m=0.008 * n), 1.8 * x)
    model.add("windows", along(pane, 1.8 * x), "windows")
    a, b = np.array([front - 0.06, 0.9 * belt / n]), np.array([front + 0.1, h / n])
    for low_end, high_end, out in (
        (a, b, -1),
        (np.array([back + 0.04, 0.9 * belt / n]), np.array([back - 0.04, h / n]), 1),
    ):
        p, q = low_end + 0.36 * (high_end - low_end), low_end + 0.82 * (high_end - low_end)
        shift = np.array([0.006 * out, 0.002])
        ring = [tuple(n * each) for each in (p - 8 * shift, p + shift, q + shift, q - 8 * shift)]
        model.add("windows", along(Manifold.hull(prism(polygon(ring), 1.36 * x)), 1.36 * x), "windows")
    for at, sign in product((-0.3, 0.31), (-1, 1)):
        arch = cylinder(1.16 * r, 0.5 * x).rotate((0, 90 * sign, 0)).translate((0.62 * x * sign, at * n, r))
        model.cut("arches", arch, "windows")
    for at, sign in product((-0.3, 0.31), (-1, 1)):
        turned = cylinder(r, 0.34 * x, sides=chords(40)) + cylinder(0.2 * r, 0.34 * x).translate((0, 0, -0.12 * x))
        model.add("wheels", turned.rotate((0, 90 * sign, 0)).translate((0.68 * x * sign, at * n, r)), "wheels")
        cap = cylinder(0.52 * r, 0.012 * n, sides=chords(24)).rotate((0, 90 * sign, 0))
        model.add("hubs", cap.translate((1.0 * x * sign, at * n, r)), "hubs")
    lamp = ellipsoid(0.075 * n, 0.03 * n, 0.05 * n, sides=chords(20))
    for sign in (-1, 1):
        model.add("lamps", lamp.translate((0.66 * x * sign, -0.492 * n, 0.62 * belt)), "lamps")
        model.add("rear lamps", lamp.translate((0.7 * x * sign, 0.492 * n, 0.68 * belt)), "rear lamps")
    for sign in (-1, 1):
        bar = box(1.7 * x, 0.03 * n, 0.045 * n, radius_m=0.01 * n).translate((0, 0.5 * n * sign, low + 0.01 * n))
        model.add("bumper", bar, "hubs")
    model.point("front", "surface", "bumper", (0.0, -0.515 * n, low + 0.0325 * n), (0.0, -1.0, 0.0))
    return model.point("roof", "surface", "cabin", (0.0, 0.02 * n, h), (0.0, 0.0, 1.0)).rest_on_ground()


@template("bowling pin")
def bowling_pin(*, height_m: float, width: float, neck: float, head: float) -> Model:
    """Build a pin with a belly, a ``neck`` and a round ``head``, both relative to the belly's width."""
    h, r = height_m, 0.5 * width * height_m
    side = [(0.47 * r, 0.0), (0.86 * r, 0.15 * h), (r, 0.3 * h), (0.76 * r, 0.5 * h), (neck * r, 0.68 * h)]
    crown = np.linspace(0.0, 0.5 * np.pi, 6)
    ball = 1.0 - head * r / h  # where the head is widest, with a round upper half
    profile = smooth_profile([*side, (head * r, ball * h)], rows=12)
    profile += [(head * r * float(np.cos(a)), (ball + (1 - ball) * float(np.sin(a))) * h) for a in crown[1:]]
    model = Model().add("body", lathe(profile))
    levels = np.linspace(0.64, 0.73, 7) * h
    band = np.interp(levels, [z for _, z in profile], [radius for radius, _ in profile]) + 0.0004
    model.add("neck", lathe(np.stack([band, levels], axis=1)), "stripes")
    model.region("base", "body", lambda centers: centers[:, 2] < 0.001 * h)
    model.point("neck", "surface", "neck", (0.0, -neck * r - 0.0004, 0.68 * h), (0.0, -1.0, 0.0))
    model.point("head", "surface", "body", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("table tennis paddle")
def table_tennis_paddle(*, length_m: float, blade: float, width: float, thick_m: float) -> Model:
    """Build a lying paddle with its handle to -X and rubber on both sides; ``blade`` and ``width`` are over the length."""
    long, across = blade * length_m, width * length_m
    at = 0.5 * (length_m - long)
    wood = cylinder(0.5, thick_m).scale((long, across, 1)).translate((at, 0, -0.5 * thick_m))
    model = Model().add("blade", wood)
    edge = at - 0.36 * long
    trimmed = box(length_m, across, 0.1).translate((edge + 0.5 * length_m, 0, -0.05))
    for side in (-1.0, 1.0):
        sheet = cylinder(0.5, 0.002).scale((0.985 * long, 0.985 * across, 1))
        sheet = sheet.translate((at, 0, side * (0.5 * thick_m + 0.0008) - 0.001))
        name = "forehand" if side > 0 else "backhand"
        model.add(name, sheet ^ trimmed, name)
    start, end = -0.5 * length_m, edge + 0.004
    model.add("handle", grip(start, end, 0.0145, flatten=0.78, swell=0.06), "handle")
    top = 0.5 * thick_m + 0.0018
    model.point("forehand", "face", "forehand", (at, 0.0, top), (0.0, 0.0, 1.0))
    model.point("handle", "surface", "handle", (0.5 * (start + end), 0.0, 0.0119), (0.0, 0.0, 1.0))
    return model.rest_on_ground()


@template("rubber duck")
def rubber_duck(*, length_m: float, width: float, height: float, head: float) -> Model:
    """Build a bath duck that faces -Y, flat below; ``head`` is its head's width relative to the length."""
    n, wide, tall = length_m, width * length_m, height * length_m
    ball = 0.5 * head * n
    low = 0.62 * tall
    ahead = -0.16 * n
    trunk = ellipsoid(wide, 0.86 * n, 1.16 * low, sides=chords(72)).translate((0, 0, 0.47 * low))
    tail = arc(
        [(0, 0.1 * n, 0.45 * low), (0, 0.34 * n, 0.58 * low), (0, 0.45 * n, 0.76 * low), (0, 0.5 * n, 0.95 * low)]
    )
    along = np.linspace(0, 1, len(tail))
    plume = tube(
        tail, wide * np.interp(along, [0, 0.4, 0.75, 1], [0.4, 0.27, 0.13, 0.03]), flatten=0.8, across=(1, 0, 0)
    )
    ground = box(2 * n, 2 * n, 2 * n)
    model = Model().add("body", (trunk + plume) ^ ground)
    neck = cylinder(1.02 * ball, 0.5 * low, top_radius_m=0.7 * ball, sides=chords(56))
    model.add("body", neck.translate((0, ahead, 0.62 * low)))
    at = tall - ball
    model.add("head", ellipsoid(2 * ball, 2 * ball, 2 * ball, sides=chords(64)).translate((0, ahead, at)))
    for side in (-1.0, 1.0):
        wing = ellipsoid(0.18 * wide, 0.48 * n, 0.34 * low, sides=chords(48)).rotate((20, 0, 0))
        model.add("wings", wing.rotate((0, 0, 9 * side)).translate((side * 0.45 * wide, 0.08 * n, 0.6 * low)))
        eye = ellipsoid(0.3 * ball, 0.16 * ball, 0.38 * ball, sides=chords(24)).rotate((-16, 0, 24 * side))
        model.add("eyes", eye.translate((side * 0.4 * ball, ahead - 0.82 * ball, at + 0.36 * ball)), "eyes")
    for lean, thick, high in ((12.0, 0.34, 0.0), (-12.0, 0.26, -0.14)):
        half = ellipsoid(1.0 * ball, 1.3 * ball, thick * ball, sides=chords(36)).rotate((lean, 0, 0))
        model.add("beak", half.translate((0, ahead - 1.0 * ball, at - (0.1 - high) * ball)), "beak")
    model.region("base", "body", lambda centers: centers[:, 2] < 1e-5)
    model.point("head", "surface", "head", (0.0, ahead, tall), (0.0, 0.0, 1.0))
    tip = (0.0, ahead - 1.64 * ball, at - 0.22 * ball)
    model.point("beak", "tip", "beak", tip, (0.0, -1.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
