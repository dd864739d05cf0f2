"""Flat objects that lie on a table: cards, chips, coasters, discs, and drawing instruments."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import (
    box,
    chords,
    cylinder,
    lathe,
    polygon,
    prism,
    rectangle,
    rounded,
    torus,
    union,
)
from manitwin.models.generators.templates.template import Model, template

PRINT_M = 0.00025
"""Height of print above its surface, metres, so that it is a separate part."""


def _faced(
    model: Model, part: str, half_depth_m: float, height_m: float, off_m: tuple[float, float] = (0.0, 0.0)
) -> Model:
    """Add points on both faces of a flat object, beside the centre, and on its edge towards -Y."""
    model.point("front", "face", part, (*off_m, height_m), (0.0, 0.0, 1.0))
    model.point("edge", "surface", part, (off_m[0], -half_depth_m, 0.5 * height_m), (0.0, -1.0, 0.0))
    return model.point("back", "face", part, (*off_m, 0.0), (0.0, 0.0, -1.0))


@template("credit card")
def credit_card(*, length_m: float, width: float, thick_m: float, chip: float) -> Model:
    """Build a lying bank card with a chip, a coloured stripe and rows of digits; ``chip`` is relative to the width."""
    w = width * length_m
    model = Model().add("body", prism(rectangle(length_m, w, radius_m=0.0032), thick_m))
    top = thick_m - 0.0001
    plate = prism(rectangle(1.25 * chip * w, chip * w, radius_m=0.0012), PRINT_M)
    model.add("chip", plate.translate((-0.32 * length_m, 0.08 * w, top)), "chip")
    digit = box(0.0028, 0.0044, PRINT_M)
    rows = [digit.translate((-0.38 * length_m + 0.0036 * k + 0.004 * (k // 4), -0.14 * w, top)) for k in range(16)]
    model.add("numbers", union(rows), "numbers")
    model.add(
        "name",
        union(
            [digit.scale((0.7, 0.6, 1)).translate((-0.39 * length_m + 0.0031 * k, -0.34 * w, top)) for k in range(11)]
        ),
        "numbers",
    )
    return _faced(model, "body", 0.5 * w, thick_m, (0.3 * length_m, 0.2 * w))


@template("business card")
def business_card(*, length_m: float, width: float, thick_m: float, lines: float) -> Model:
    """Build a lying card with a logo and ``lines`` lines of text."""
    w = width * length_m
    model = Model().add("body", box(length_m, w, thick_m))
    top = thick_m - 0.0001
    mark = cylinder(0.11 * w, 0.00018, sides=chords(32)).translate((-0.34 * length_m, 0.22 * w, top))
    model.add("mark", mark, "mark")
    rows = []
    for number in range(round(lines)):
        long = length_m * (0.44 - 0.06 * (number % 3))
        rows.append(
            box(long, 0.0016, 0.00018).translate((-0.42 * length_m + 0.5 * long, -0.08 * w - 0.0042 * number, top))
        )
    model.add("text", union(rows), "text")
    return _faced(model, "body", 0.5 * w, thick_m, (0.3 * length_m, 0.2 * w))


@template("poker chip")
def poker_chip(*, width_m: float, thick_m: float, spots: float) -> Model:
    """Build a lying chip with ``spots`` spots of another colour on its edge."""
    r, count = 0.5 * width_m, round(spots)
    edge = rounded([(0, 0), (r, 0), (r, thick_m), (0, thick_m)], 0.0004)
    model = Model().add("body", lathe(edge, sides=chords(96)))
    groove = torus(0.64 * r, 0.0003, sides=chords(64))
    model.cut("rings", groove + groove.translate((0, 0, thick_m)))

    def spotted(centers: np.ndarray) -> np.ndarray:
        turn = np.arctan2(centers[:, 1], centers[:, 0]) * count / (2 * np.pi) + 0.25
        return np.asarray((np.hypot(centers[:, 0], centers[:, 1]) > 0.66 * r) & (turn % 1.0 < 0.5))

    model.region("spots", "body", spotted, "spots")
    return (
        _faced(model, "body", r, thick_m)
        if count % 2
        else _faced(model, "body", r * float(np.cos(np.pi / count)), thick_m)
    )


@template("coaster")
def coaster(*, width_m: float, thick_m: float, rim: float) -> Model:
    """Build a lying round coaster with a raised rim; ``rim`` is the rim's width relative to the coaster's."""
    r = 0.5 * width_m
    body = lathe(rounded([(0, 0), (r, 0), (r, thick_m), (0, thick_m)], 0.18 * thick_m), sides=chords(72))
    model = Model().add("body", body)
    model.cut(
        "middle", cylinder((0.5 - rim) * width_m, thick_m, sides=chords(72)).translate((0, 0, 0.84 * thick_m)), "middle"
    )
    model.point("surface", "face", "middle", (0.0, 0.0, 0.84 * thick_m), (0.0, 0.0, 1.0))
    model.point("edge", "surface", "body", (0.0, -r, 0.5 * thick_m), (0.0, -1.0, 0.0))
    return model.point("back", "face", "body", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("trivet")
def trivet(*, width_m: float, thick_m: float, slots: float, foot: float) -> Model:
    """Build a square trivet of slats on low feet; ``slots`` is the number of slots, ``foot`` is relative to the thickness."""
    w, count, high = width_m, round(slots), foot * thick_m
    model = Model().add(
        "body", prism(rectangle(w, w, radius_m=0.1 * w), thick_m, radius_m=0.12 * thick_m).translate((0, 0, high))
    )
    pitch = 0.8 * w / count
    cut = prism(rectangle(0.42 * pitch, 0.72 * w, radius_m=0.2 * pitch), 4 * thick_m)
    at = [(number - 0.5 * (count - 1)) * pitch for number in range(count)]
    model.cut("slots", union([cut.translate((x, 0, -thick_m)) for x in at]))
    for u in (-1, 1):
        for v in (-1, 1):
            model.add("feet", cylinder(0.04 * w, high + 0.2 * thick_m).translate((0.4 * u * w, 0.4 * v * w, 0)), "feet")
    top, rib = high + thick_m, 0.5 * pitch if count % 2 else 0.0
    model.point("surface", "face", "body", (rib, 0.0, top), (0.0, 0.0, 1.0))
    model.point("edge", "surface", "body", (0.0, -0.5 * w, high + 0.5 * thick_m), (0.0, -1.0, 0.0))
    return model.point("back", "face", "body", (rib, 0.0, high), (0.0, 0.0, -1.0))


@template("compact disc")
def compact_disc(*, width_m: float, hole: float, label: float) -> Model:
    """Build a lying disc with its printed side up; ``hole`` and ``label`` are widths relative to its own."""
    r, h = 0.5 * width_m, 0.0012
    model = Model().add("body", cylinder(r, h, sides=chords(96)))
    ring = cylinder(label * r, 0.0002, sides=chords(72)) - cylinder(1.5 * hole * r, 0.001)
    model.add("label", ring.translate((0, 0, h - 0.00005)), "label")
    model.cut("hole", cylinder(hole * r, 4 * h, sides=chords(36)).translate((0, 0, -h)), "hub")
    model.region("hub", "body", lambda c: np.hypot(c[:, 0], c[:, 1]) < 2.4 * hole * r, "hub")
    model.point("face", "face", "label", (0.5 * (1.5 * hole + label) * r, 0.0, h + 0.00015), (0.0, 0.0, 1.0))
    return model.point("edge", "edge", "body", (0.0, -r, 0.5 * h), (0.0, -1.0, 0.0))


def _marks(at: list[tuple[float, float, float]], long_m: float, height_m: float) -> Manifold:
    """Return thin marks at (x, y, angle), where the angle in degrees is their direction."""
    mark = box(long_m, 0.0004, PRINT_M)
    return union([mark.rotate((0, 0, turn)).translate((x, y, height_m - 0.00005)) for x, y, turn in at])


@template("set square")
def set_square(*, length_m: float, angle: float, thick_m: float, frame: float) -> Model:
    """Build a lying set square, open in its middle; ``angle`` (rad) is that at the end of its long leg, ``frame`` its width."""
    x, y = length_m * float(np.cos(angle)), length_m * float(np.sin(angle))
    outer = np.array([(0.0, 0.0), (x, 0.0), (0.0, y)])
    middle, inset = np.array([(x + y - length_m) / 2] * 2), frame * length_m  # of the incircle
    inner = middle + (outer - middle) * (1 - inset / middle[0])
    ring = polygon(outer - middle) - polygon(inner - middle, radius_m=0.004)
    model = Model().add("body", prism(ring, thick_m))
    ticks = [(float(k) - middle[0], -middle[1] + 0.0036, 90.0) for k in np.arange(0.01, x - 0.03, 0.005)]
    model.add("scale", _marks(ticks, 0.005, thick_m), "scale")
    return _faced(
        model, "body", float(middle[1]), thick_m, (0.45 * x - float(middle[0]), 0.75 * inset - float(middle[1]))
    )


@template("protractor")
def protractor(*, width_m: float, thick_m: float, band: float) -> Model:
    """Build a lying half-round protractor, open in its middle; ``band`` is the scale's width relative to the radius."""
    r, base = 0.5 * width_m, 0.16 * width_m
    turn = np.linspace(0.0, np.pi, 49)
    half = [(r * float(np.cos(a)), base + (r - 0.5 * base) * float(np.sin(a))) for a in turn]
    inner = (1 - band) * r
    hole = [(inner * float(np.cos(a)), base + 0.1 * r + inner * 0.82 * float(np.sin(a))) for a in turn]
    ring = polygon([(-r, 0.0), (r, 0.0), *half], radius_m=0.002) - polygon(hole, radius_m=0.003)
    model = Model().add("body", prism(ring.translate((0.0, -0.5 * r)), thick_m))
    ticks = []
    for a in np.radians(np.arange(5, 180, 5)):
        out = 0.93
        place = (out * r * float(np.cos(a)), base + out * (r - 0.5 * base) * float(np.sin(a)) - 0.5 * r)
        ticks.append((*place, float(np.degrees(a))))
    model.add("scale", _marks(ticks, 0.07 * r, thick_m), "scale")
    return _faced(model, "body", 0.5 * r, thick_m, (0.0, 0.4 * base - 0.5 * r))
