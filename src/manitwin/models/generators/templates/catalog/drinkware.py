"""Bottles, mugs and jugs for travel, babies and the table, standing on their bases."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import box, cylinder, lathe, rounded
from manitwin.models.generators.templates.catalog.cup_shapes import EAR_SHARE, CupSide, cup_ear
from manitwin.models.generators.templates.catalog.vessel import assemble_from_profile, assemble_vessel, smooth_profile
from manitwin.models.generators.templates.template import Model, template


@template("baby bottle")
def baby_bottle(*, height_m: float, width: float, body: float, collar: float) -> Model:
    """Build a filled bottle with a screwed ``collar`` and a teat; all ratios are relative to the height."""
    h, r = height_m, 0.5 * width * height_m
    top, ring = body * h, (body + collar) * h
    model = Model().add("body", lathe(rounded([(0.0, 0.0), (r, 0.0), (r, 0.86 * top), (0.82 * r, top)], 0.12 * r)))
    model.add("cap", lathe(rounded([(0.0, top), (0.96 * r, top), (0.9 * r, ring), (0.0, ring)], 0.003)), "cap")
    shoulder = ring + 0.35 * (h - ring)
    teat = smooth_profile(
        [(0.66 * r, ring - 0.002), (0.5 * r, shoulder), (0.2 * r, ring + 0.62 * (h - ring)), (0.17 * r, h)]
    )
    model.add("teat", lathe(rounded([*teat, (0.0, h)], 0.12 * r)), "teat")
    model.region("base", "body", lambda centers: centers[:, 2] < 0.01 * h)
    model.point("teat", "tip", "teat", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    model.point("cap", "surface", "cap", (0.0, -0.93 * r, 0.5 * (top + ring)), (0.0, -1.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("travel mug")
def travel_mug(*, height_m: float, width: float, foot: float, lid: float) -> Model:
    """Build a closed mug that narrows towards its ``foot``, with a ``lid`` to drink through."""
    h, r = height_m, 0.5 * width * height_m
    top = (1 - lid) * h
    model = Model().add("body", lathe(rounded([(0.0, 0.0), (foot * r, 0.0), (0.985 * r, top), (0.0, top)], 0.005)))
    cover = [(0.0, top - 0.002), (r, top - 0.002), (r, top + 0.35 * lid * h), (0.93 * r, h), (0.86 * r, h)]
    cover += [(0.8 * r, h - 0.35 * lid * h), (0.0, h - 0.35 * lid * h)]
    model.add("lid", lathe(rounded(cover, 0.002)), "lid")
    floor = h - 0.35 * lid * h
    slot = box(0.4 * r, 0.16 * r, 0.01, radius_m=0.05 * r).translate((0, -0.6 * r, floor - 0.004))
    model.cut("drinking hole", slot, "lid")
    model.region("base", "body", lambda centers: centers[:, 2] < 0.01 * h)
    model.point("drinking hole", "hole", "drinking hole", (0.0, -0.6 * r, floor), (0.0, 0.0, 1.0))
    model.point("lid", "surface", "lid", (0.0, 0.3 * r, floor), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("carafe")
def carafe(*, height_m: float, width: float, neck: float, flare: float, wall_m: float) -> Model:
    """Build an open jug without a handle: broad below, narrowed to a ``neck``, and widened by ``flare`` at its rim."""
    h, r = height_m, 0.5 * width * height_m
    n = neck * r
    profile = smooth_profile([(0.8 * r, 0.0), (r, 0.2 * h), (0.86 * r, 0.45 * h), (n, 0.74 * h), (flare * n, h)])
    return assemble_from_profile(Model(), profile, wall_m, 2 * wall_m)


@template("tea cup")
def tea_cup(
    *,
    width_m: float,
    rim: float,
    belly: float,
    bottom: float,
    taper: float,
    flare: float,
    handle: float,
    join: float,
    hook: float,
    wall_m: float,
) -> Model:
    """Build a cup with a handle, a round bottom, and a lip that leans outward.

    ``rim`` is the height relative to the width. ``belly`` is the radius where the bottom ends relative to the rim's, and
    ``bottom`` the relative height of that. ``taper`` of the foot and ``flare`` of the lip are relative to the rim's radius.
    ``handle`` is how far the handle protrudes and ``join`` where it returns to the wall, relative to the height. ``hook`` is 0
    for an even arc and 1 for a question mark.
    """
    model, radius, height = Model(), 0.5 * width_m, rim * width_m
    side = CupSide(radius, height, belly * radius, bottom * height, taper * radius, flare * radius, wall_m)
    grip = cup_ear(model, side, reach_m=handle * height, join=join, hook=hook, thick_m=EAR_SHARE * width_m)
    return assemble_vessel(model, *side.solids(), height, side.foot_m, grip)


@template("ramekin")
def ramekin(*, width_m: float, height: float, taper: float, wall_m: float) -> Model:
    """Build a small baking dish with grooved, nearly straight walls; ``taper`` is the foot's width relative to the rim's."""
    r, high = 0.5 * width_m, height * width_m
    model = assemble_from_profile(Model(), [(taper * r, 0.0), (r, high)], wall_m, 1.4 * wall_m)
    pitch = 2 * np.pi * r / 40
    lean = float(np.degrees(np.arctan((1 - taper) * r / high)))
    for number in range(40):
        groove = cylinder(0.22 * pitch, 0.66 * high, sides=8).rotate((0, lean, 0))
        groove = groove.translate((taper * r + 0.16 * (1 - taper) * r + 0.03 * pitch, 0, 0.12 * high))
        model.cut("grooves", groove.rotate((0, 0, 9.0 * number)))
    return model
