"""Small items for the body, a desk and a workshop. Long ones lie along X with the working end towards +X."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import box, chords, cylinder, lathe, polygon, prism, rectangle, rounded
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.organic import lay_along_x
from manitwin.models.generators.templates.template import Model, template


@template("mascara")
@template("eyeliner")
def cosmetic_tube(*, length_m: float, width: float, cap: float, waist: float) -> Model:
    """Build a closed round tube with its cap towards +X.

    ``cap`` is the cap's share of the length, ``waist`` its width relative to the barrel's.
    """
    n, r = length_m, 0.5 * width * length_m
    joint = (0.5 - cap) * n
    barrel = rounded([(0, -0.5 * n), (0.9 * r, -0.5 * n), (r, -0.48 * n), (r, joint), (0, joint)], 0.2 * r)
    cover = rounded(
        [(0, joint), (waist * r, joint), (0.94 * waist * r, 0.49 * n), (0.8 * waist * r, 0.5 * n), (0, 0.5 * n)],
        0.2 * r,
    )
    ring = [(0, joint - 0.02 * n), (1.02 * r, joint - 0.02 * n), (1.02 * r, joint), (0, joint)]
    model = Model().add("body", lay_along_x(lathe(barrel)))
    model.add("ring", lay_along_x(lathe(ring)), "ring").add("cap", lay_along_x(lathe(cover)), "cap")
    model.point("cap end", "face", "cap", (0.5 * n, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("barrel", "surface", "body", (-0.25 * n, 0.0, r), (0.0, 0.0, 1.0)).rest_on_ground()


@template("makeup brush")
def makeup_brush(*, length_m: float, head: float, width: float, ferrule: float, handle: float) -> Model:
    """Build a brush with a round head.

    ``head`` and ``ferrule`` are shares of the length, ``handle`` is the handle's width relative to the head's.
    """
    n, r = length_m, 0.5 * width * length_m
    tip, neck, end = 0.5 * n, (0.5 - head) * n, (0.5 - head - ferrule) * n
    thin = handle * r
    stick = [
        (0, -0.5 * n),
        (0.5 * thin, -0.49 * n),
        (thin, -0.1 * n),
        (0.72 * r, end),
        (0.72 * r, end + 0.002),
        (0, end + 0.002),
    ]
    metal = [(0, end), (0.74 * r, end), (0.62 * r, end + 0.3 * ferrule * n), (0.7 * r, neck), (0, neck)]
    curve = arc(
        [
            (0.66 * r, 0, neck - 0.001),
            (0.94 * r, 0, neck + 0.4 * head * n),
            (0.84 * r, 0, tip - 0.2 * head * n),
            (0.4 * r, 0, tip - 0.03 * head * n),
            (0, 0, tip),
        ]
    )
    model = Model().add("handle", lay_along_x(lathe(rounded(stick, 0.3 * thin))), "")
    model.add("ferrule", lay_along_x(lathe(metal)), "ferrule").add(
        "bristles", lay_along_x(lathe(curve[:, [0, 2]])), "bristles"
    )
    model.point("bristles", "tip", "bristles", (tip, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "handle",
        "surface",
        "handle",
        (-0.2 * n, 0.0, float(np.interp(-0.2, [-0.49, -0.1], [0.5, 1.0])) * thin),
        (0.0, 0.0, 1.0),
    ).rest_on_ground()


@template("bandage roll")
@template("medical tape")
def rolled_strip(*, width_m: float, tall: float, core: float, loose: float) -> Model:
    """Build a standing rolled-up strip.

    ``core`` is its hole relative to its width, ``loose`` how far the free end protrudes relative to the radius.
    """
    r, h = 0.5 * width_m, tall * width_m
    model = Model().add("body", cylinder(r, h))
    step = max(0.0008, loose * r)
    end = prism(polygon([(0.0, 0.6 * r), (0.0, r + step), (0.5 * r, 0.93 * r + step), (0.85 * r, 0.45 * r)]), h)
    model.add("end", end)
    model.cut("core", cylinder(core * r, 3 * h).translate((0, 0, -h)), "core")
    model.region("top", "body", lambda centers: centers[:, 2] > h - 1e-5)
    model.point("core", "hole", "core", (0.0, 0.0, 0.5 * h), (0.0, 0.0, 1.0))
    return model.point("outside", "surface", "body", (0.0, -r, 0.5 * h), (0.0, -1.0, 0.0))


@template("cigar")
def cigar(*, length_m: float, width: float, band: float) -> Model:
    """Build a lying cigar with its closed end and a paper band towards -X."""
    n, r = length_m, 0.5 * width * length_m
    curve = arc(
        [
            (0.0, 0, -0.5 * n),
            (0.55 * r, 0, -0.485 * n),
            (0.92 * r, 0, -0.42 * n),
            (r, 0, -0.1 * n),
            (0.98 * r, 0, 0.44 * n),
            (0.9 * r, 0, 0.495 * n),
            (0.84 * r, 0, 0.5 * n),
        ]
    )
    model = Model().add("body", lay_along_x(lathe([*curve[:, [0, 2]].tolist(), (0.0, 0.5 * n)])))
    ring = cylinder(1.03 * r, band * n).translate((0, 0, -0.33 * n))
    model.add("band", lay_along_x(ring), "band")
    model.point("tip", "face", "body", (0.5 * n, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("body", "surface", "body", (0.1 * n, 0.0, r), (0.0, 0.0, 1.0)).rest_on_ground()


@template("pocket knife")
def pocket_knife(*, length_m: float, width: float, thick: float, bolster: float) -> Model:
    """Build a closed folding knife lying on its side, with the blade's back along -Y and its pivot towards +X."""
    n, y, t = length_m, width * length_m, thick * length_m
    outline = rectangle(n, y, radius_m=0.48 * y)
    model = Model().add("body", prism(outline, t, radius_m=0.22 * t))
    liner = prism(outline.offset(0.0003), 0.3 * t).translate((0, 0, 0.35 * t))
    model.add("liner", liner, "liner")
    blade = [
        (-0.4 * n, -0.4 * y),
        (0.36 * n, -0.4 * y),
        (0.36 * n, -0.58 * y),
        (-0.3 * n, -0.56 * y),
        (-0.4 * n, -0.5 * y),
    ]
    model.add("blade", prism(polygon(blade), 0.12 * t).translate((0, 0, 0.44 * t)), "blade")
    model.region("bolster", "body", lambda centers: centers[:, 0] > (0.5 - bolster) * n, "blade")
    for side in (0.0, 1.0):
        pin = cylinder(0.09 * y, 0.0006, sides=chords(20)).translate(
            (0.36 * n, 0, side * t - (0.0002 if side else 0.0004))
        )
        model.add("pin", pin, "pin")
    model.point("blade", "edge", "blade", (0.0, -0.57 * y, 0.5 * t), (0.0, -1.0, 0.0))
    return model.point("handle", "face", "body", (-0.1 * n, 0.0, t), (0.0, 0.0, 1.0)).rest_on_ground()


@template("memory card")
def memory_card(*, length_m: float, width: float, thick: float, corner: float) -> Model:
    """Build a card with a cut corner, its label up and its contacts below, near the edge towards +X."""
    n, y, t = length_m, width * length_m, thick * length_m
    cut = corner * y
    outline = [
        (-0.5 * n, -0.5 * y),
        (0.5 * n, -0.5 * y),
        (0.5 * n, 0.5 * y - cut),
        (0.5 * n - cut, 0.5 * y),
        (-0.5 * n, 0.5 * y),
    ]
    model = Model().add("body", prism(polygon(outline, radius_m=0.0005), t))
    label = prism(rectangle(0.58 * n, 0.78 * y, radius_m=0.001), 0.0001).translate((-0.1 * n, 0, t - 0.00004))
    model.add("label", label, "label")
    for number in range(7):
        at = (number - 3) * 0.11 * y - 0.05 * y
        model.add("contacts", box(0.16 * n, 0.07 * y, 0.00012).translate((0.38 * n, at, -0.00006)), "contacts")
    model.point("front", "face", "label", (-0.1 * n, 0.0, t), (0.0, 0.0, 1.0))
    return model.point("edge", "edge", "body", (0.5 * n, -0.1 * y, 0.5 * t), (1.0, 0.0, 0.0)).rest_on_ground()


@template("id card")
def id_card(*, length_m: float, width: float, thick_m: float, photo: float) -> Model:
    """Build a plastic card with a portrait field, lying on its back; ``photo`` is the field's width relative to the card's."""
    n, y, t = length_m, width * length_m, thick_m
    model = Model().add("body", prism(rectangle(n, y, radius_m=0.003), t))
    field = prism(rectangle(photo * n, 1.25 * photo * n), 0.0001).translate((-0.32 * n, -0.02 * y, t - 0.00004))
    model.add("photo", field, "photo")
    stripe = prism(rectangle(0.98 * n, 0.14 * y), 0.0001).translate((0, 0.37 * y, t - 0.00004))
    model.add("stripe", stripe, "stripe")
    model.point("front", "face", "body", (0.2 * n, -0.1 * y, t), (0.0, 0.0, 1.0))
    return model.point("edge", "edge", "body", (0.5 * n, 0.0, 0.5 * t), (1.0, 0.0, 0.0)).rest_on_ground()


@template("binder clip")
def binder_clip(*, length_m: float, tall: float, deep: float, levers: float) -> Model:
    """Build a clip standing on its back, with its jaws up and its two wire levers folded against its sides.

    ``length_m`` is that of the jaws. ``tall`` and ``deep`` are its height and the width of its back relative to that, ``levers``
    the reach of the levers.
    """
    n, h, y = length_m, tall * length_m, deep * length_m
    sheet = 0.01 * n + 0.0001
    outer = [(-0.5 * y, 0.0), (0.5 * y, 0.0), (1.1 * sheet, h), (-1.1 * sheet, h)]
    inner = [(-0.5 * y + 1.8 * sheet, sheet), (0.5 * y - 1.8 * sheet, sheet), (0.0, 0.94 * h)]
    section = polygon(outer) - polygon(inner)
    body = prism(section, n).translate((0, 0, -0.5 * n)).rotate((90, 0, 90))
    model = Model().add("body", body)
    model.region("jaws", "body", lambda centers: centers[:, 2] > 0.86 * h)
    wire, reach = 0.017 * n, levers * h
    for side in (-1.0, 1.0):

        def at(up: float, x: float, side: float = side) -> tuple[float, float, float]:
            lean = 0.5 * y * (1 - up / h) if up < h else 0.0
            return (x, side * (lean + 0.9 * wire + 0.03 * y), up)

        path = arc(
            [
                at(0.96 * h, -0.34 * n),
                at(0.5 * h, -0.3 * n),
                at(h - reach, -0.2 * n),
                at(0.92 * (h - reach), 0.0),
                at(h - reach, 0.2 * n),
                at(0.5 * h, 0.3 * n),
                at(0.96 * h, 0.34 * n),
            ],
            samples=40,
        )
        model.add("levers", tube(path, wire, sides=chords(10)), "levers")
    model.point("jaws", "edge", "jaws", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("lever", "surface", "levers", (0.0, -0.5 * y, 0.25 * h), (0.0, -1.0, 0.0)).rest_on_ground()


@template("thumbtack")
def push_pin(*, length_m: float, head: float, width: float) -> Model:
    """Build a push pin lying on the rims of its head with its point towards +X; ``head`` is the grip's share of its length."""
    n, r = length_m, 0.5 * width * length_m
    end = (head - 0.5) * n
    grip = [
        (0, -0.5 * n),
        (0.92 * r, -0.5 * n),
        (r, -0.44 * n),
        (0.5 * r, -0.36 * n),
        (0.46 * r, end - 0.14 * n),
        (0.98 * r, end - 0.05 * n),
        (0.94 * r, end),
        (0, end),
    ]
    needle = [(0, end - 0.001), (0.0006, end - 0.001), (0.0005, 0.42 * n), (0, 0.5 * n)]
    model = Model().add("body", lay_along_x(lathe(rounded(grip, 0.05 * n), sides=chords(40))))
    model.add("needle", lay_along_x(lathe(needle, sides=chords(12))), "needle")
    model.point("needle", "tip", "needle", (0.5 * n, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("grip", "surface", "body", (-0.5 * n, 0.0, 0.0), (-1.0, 0.0, 0.0)).rest_on_ground()


@template("foam brick")
def foam_brick(*, length_m: float, width: float, height: float) -> Model:
    """Build a block of foam."""
    x, y, h = length_m, width * length_m, height * length_m
    model = Model().add("body", box(x, y, h, radius_m=0.0015))
    model.point("top", "face", "body", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("side", "face", "body", (0.0, -0.5 * y, 0.5 * h), (0.0, -1.0, 0.0))
