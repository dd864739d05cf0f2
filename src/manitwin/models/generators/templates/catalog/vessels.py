"""Open vessels to eat and drink from: mugs, glasses, bowls, plates, jugs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manitwin.geometry.solids.shapes import box, cylinder, lathe, polygon, prism, rounded
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.cup_shapes import EAR_SHARE, HIGHEST_JOIN, CupSide, cup_ear
from manitwin.models.generators.templates.catalog.vessel import (
    RIM_SHARE,
    assemble_from_profile,
    ear,
    shell,
    smooth_profile,
)
from manitwin.models.generators.templates.template import Model, template


@template("mug")
def mug(*, height_m: float, width: float, wall_m: float, taper: float, handle: float) -> Model:
    """Build a mug; ``width`` and ``handle`` are relative to the height, ``taper`` is the foot's radius relative to the rim's."""
    model, radius = Model(), 0.5 * width * height_m
    profile = rounded([(0.8 * taper * radius, 0), (taper * radius, 0.03 * height_m), (radius, height_m)], 0.008)
    return assemble_from_profile(
        model,
        profile,
        wall_m,
        1.4 * wall_m,
        ear(model, 0.985 * radius, 0.8 * height_m, 0.25 * height_m, handle * height_m, 0.011),
    )


@template("cup")
def cup(*, height_m: float, width: float, wall_m: float, taper: float) -> Model:
    """Build a cup without a handle."""
    radius = 0.5 * width * height_m
    profile = rounded([(0.92 * taper * radius, 0), (taper * radius, 0.03 * height_m), (radius, height_m)], 0.004)
    return assemble_from_profile(Model(), profile, wall_m, 1.5 * wall_m)


@template("glass")
def glass(*, height_m: float, width: float, wall_m: float, taper: float) -> Model:
    """Build a tumbler with a thick floor."""
    radius = 0.5 * width * height_m
    profile = rounded([(0.9 * taper * radius, 0), (taper * radius, 0.03 * height_m), (radius, height_m)], 0.004)
    return assemble_from_profile(Model(), profile, wall_m, 4 * wall_m)


@template("wine glass")
def wine_glass(*, height_m: float, width: float, stem: float, wall_m: float, foot: float) -> Model:
    """Build a wine glass; ``stem`` is the share of its height below the bowl, ``foot`` the foot's width over the bowl's."""
    model, h, r = Model(), height_m, 0.5 * width * height_m
    low = stem * h
    bowl = smooth_profile(
        [(0.004, low), (0.6 * r, low + 0.06 * h), (r, low + 0.22 * h), (0.95 * r, low + 0.38 * h), (0.76 * r, h)]
    )
    outer, inner = shell(bowl, wall_m, 0.012)
    base = lathe(
        rounded([(foot * r, 0), (foot * r, 0.002), (0.35 * r, 0.008), (0.0042, 0.03), (0.0042, low + 0.002)], 0.01)
    )
    model.add("stem", base).add("bowl", outer).cut("inside", inner)
    model.region("foot", "stem", lambda centers: centers[:, 2] < 0.02)
    for part in ("bowl", "inside"):
        model.region("rim", part, lambda centers: centers[:, 2] > 0.97 * h)
    model.point("opening", "opening", "rim", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    model.point("stem", "surface", "stem", (0.0, -0.0042, 0.6 * low), (0.0, -1.0, 0.0))
    return model.point("foot", "face", "foot", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("bowl")
@template("mixing bowl")
def bowl(*, width_m: float, height: float, wall_m: float, foot: float) -> Model:
    """Build a bowl on a foot; ``height`` and ``foot`` are relative to the width."""
    radius, high = 0.5 * width_m, height * width_m
    turn = np.linspace(0.0, np.pi / 2, 12)
    side = zip(radius * (foot + (1 - foot) * np.sin(turn)), high * (0.06 + 0.94 * (1 - np.cos(turn))), strict=True)
    profile = [(foot * radius, 0.0), *((float(r), float(z)) for r, z in side)]
    return assemble_from_profile(Model(), profile, wall_m, 0.06 * high + wall_m)


@template("pet bowl")
def pet_bowl(*, width_m: float, height: float, wall_m: float, flare: float) -> Model:
    """Build a bowl that is wider at its foot than at its rim, by ``flare``."""
    radius, high = 0.5 * width_m, height * width_m
    model = Model()
    outer = lathe(rounded([(radius, 0.0), (radius, 0.004), (radius / flare, high)], 0.006))
    inside = rounded([(0, 2 * wall_m), (0.72 * radius / flare, 2 * wall_m), (radius / flare - wall_m, high)], 0.012)
    top = radius / flare
    between = (0.5 * (0.93 * top + 0.25 * radius + 0.75 * top), 0.75 * high)  # midway between the walls
    hollow = lathe([(0.72 * top + 3 * wall_m, -1e-3), (radius - 2 * wall_m, -1e-3), between])
    hollow = hollow - lathe(
        [(0, -2e-3), (0.72 * top + 2 * wall_m, -2e-3), (between[0] - 1e-3, between[1]), (0, between[1])]
    )
    model.add("body", outer).cut("inside", lathe([*inside, (inside[-1][0], high + 0.01)])).cut("underside", hollow)
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: centers[:, 2] > 0.95 * high)
    return model.point("opening", "opening", "rim", (0.0, 0.0, high), (0.0, 0.0, 1.0))


@template("plate")
@template("saucer")
def plate(*, width_m: float, height: float, wall_m: float, well: float) -> Model:
    """Build a plate or a saucer; ``well`` is the flat share of its radius."""
    radius, high = 0.5 * width_m, height * width_m
    profile = rounded([(well * radius, 0.0), ((well + 0.11) * radius, 0.25 * high), (radius, high)], 0.012)
    return assemble_from_profile(Model(), profile, wall_m, wall_m)


@template("cup and saucer")
def cup_and_saucer(
    *,
    width_m: float,
    saucer: float,
    cup: float,
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
    """Build a cup with a handle that stands on its saucer.

    ``saucer`` is the saucer's height relative to its width, ``cup`` the cup's rim relative to the saucer's width. The others are
    those of a ``tea cup``.
    """
    model, dish, radius = Model(), 0.5 * width_m, 0.5 * cup * width_m
    foot, height, up = taper * radius, rim * cup * width_m, saucer * width_m
    floor = wall_m + 0.0005
    well = 1.15 * foot
    dish_side = smooth_profile(
        [(well, 0.0), (0.6 * well + 0.4 * dish, 0.28 * up), (0.25 * well + 0.75 * dish, 0.64 * up), (dish, up)]
    )
    under, hollow = shell(dish_side, wall_m, floor + 0.0005)
    side = CupSide(radius, height, belly * radius, bottom * height, foot, flare * radius, wall_m)
    outer, inner = side.solids()
    reach, thick = handle * height, EAR_SHARE * cup * width_m
    # The handle must clear a high saucer; the lower half of a question-mark handle is far from it.
    outward = radius + (0.9 - 0.4 * float(np.clip(hook, 0.0, 1.0))) * reach
    below_ear = float(np.interp(outward, *np.array(dish_side).T)) - floor
    joined = max(join, min((below_ear + thick) / height, HIGHEST_JOIN))
    name, grip = cup_ear(model, side, reach_m=reach, join=joined, hook=hook, thick_m=thick)
    raised = [(x, y, z + floor) for x, y, z in (point.position_m for point in model.points)]
    model.points = [replace(point, position_m=at) for point, at in zip(model.points, raised, strict=True)]
    model.add("saucer", under).cut("saucer inside", hollow)
    model.add("body", outer.translate((0, 0, floor))).add(name, grip.translate((0, 0, floor)), "handle")
    model.cut("inside", inner.translate((0, 0, floor)))
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: centers[:, 2] > floor + (1 - RIM_SHARE) * height)
    model.region("base", "saucer", lambda centers: centers[:, 2] < 0.02 * up)
    model.point("opening", "opening", "rim", (0.0, 0.0, floor + height), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.5 * foot, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("pitcher")
def pitcher(*, height_m: float, width: float, wall_m: float, neck: float, spout: float) -> Model:
    """Build a jug with a handle towards +X and a spout towards -X."""
    model, h, r = Model(), height_m, 0.5 * width * height_m
    profile = smooth_profile(
        [(0.8 * r, 0), (0.98 * r, 0.18 * h), (r, 0.38 * h), (neck * r, 0.8 * h), (0.95 * neck * r, h)]
    )
    profile = [(0.7 * r, 0.0), *profile[1:]]
    lip_x = 0.95 * neck * r + spout * h
    outline = [(-0.3 * r, -0.42 * r), (-lip_x, -0.05 * r), (-lip_x, 0.05 * r), (-0.3 * r, 0.42 * r)]
    beak = prism(polygon(outline, radius_m=0.003), 0.16 * h).translate((0, 0, 0.84 * h))
    slope = polygon(
        [(-0.8 * neck * r, 0.8 * h), (-lip_x - 0.01, 0.975 * h), (-lip_x - 0.01, 0.7 * h), (-0.8 * neck * r, 0.7 * h)]
    )
    beak = beak - prism(slope, 2 * r).rotate((90, 0, 0)).translate((0, r, 0))
    channel = [(0.0, -0.33 * r), (-lip_x - 0.002, -0.02 * r), (-lip_x - 0.002, 0.02 * r), (0.0, 0.33 * r)]
    groove = prism(polygon(channel), 0.2 * h).translate((0, 0, 0.9 * h))
    outer, inner = shell(profile, wall_m, 1.5 * wall_m)
    model.add("body", outer).add("spout", beak)
    name, handle = ear(model, 0.9 * r, 0.86 * h, 0.3 * h, 0.42 * r, 0.014)
    model.add(name, handle, "handle").cut("inside", inner).cut("inside", groove)
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: (centers[:, 2] > 0.97 * h) & (centers[:, 0] > -0.9 * neck * r))
    model.point("opening", "opening", "rim", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("spout", "tip", "spout", (-lip_x, 0.0, 0.97 * h), (-1.0, 0.0, 0.0))


@template("teapot")
def teapot(*, height_m: float, width: float, spout: float, wall_m: float) -> Model:
    """Build a round teapot with its lid on; the spout towards -X protrudes by ``spout`` of the height."""
    model, h, r = Model(), 0.82 * height_m, 0.5 * width * height_m * 0.8
    profile = smooth_profile([(0.6 * r, 0), (0.95 * r, 0.25 * h), (r, 0.5 * h), (0.8 * r, 0.82 * h), (0.45 * r, h)])
    reach = r + spout * height_m
    path = arc([(-0.7 * r, 0, 0.3 * h), (-1.15 * r, 0, 0.42 * h), (-0.85 * reach, 0, 0.8 * h), (-reach, 0, 1.02 * h)])
    thick = np.linspace(0.24 * r, 0.115 * r, len(path))
    outer, inner = shell(profile, wall_m, 1.5 * wall_m)
    model.add("body", outer).add("spout", tube(path, thick, flatten=0.9))
    name, handle = ear(model, 0.92 * r, 0.8 * h, 0.3 * h, 0.55 * r, 0.012)
    model.add(name, handle, "handle").cut("inside", inner)
    model.cut("inside", tube(path, np.maximum(thick - wall_m, 0.002), flatten=0.9))
    lid = lathe(
        rounded(
            [
                (0.5 * r, 0.985 * h),
                (0.5 * r, 1.01 * h),
                (0.2 * r, 1.08 * h),
                (0.08 * r, 1.11 * h),
                (0.15 * r, height_m),
                (0, height_m * 1.04),
            ],
            0.008,
        )
    )
    model.add("lid", lid, "lid")
    model.point("spout", "tip", "spout", (-reach, 0.0, 1.02 * h), (-0.8, 0.0, 0.6))
    return model.point("lid", "surface", "lid", (0.0, 0.0, 1.04 * height_m), (0.0, 0.0, 1.0))


@template("serving tray")
def tray(*, length_m: float, width: float, height_m: float, wall_m: float) -> Model:
    """Build an open rectangular tray."""
    model, across = Model(), width * length_m
    inner = box(length_m - 2 * wall_m, across - 2 * wall_m, 2 * height_m, radius_m=0.003)
    model.add("body", box(length_m, across, height_m, radius_m=0.004)).cut("inside", inner.translate((0, 0, wall_m)))
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: centers[:, 2] > 0.9 * height_m)
    model.point("opening", "opening", "rim", (0.0, 0.0, height_m), (0.0, 0.0, 1.0))
    return model.point("surface", "face", "inside", (0.0, 0.0, wall_m), (0.0, 0.0, 1.0))


@template("measuring cup")
def measuring_cup(*, height_m: float, width: float, wall_m: float, handle: float) -> Model:
    """Build a straight measuring cup with a handle and a small spout towards -X."""
    model, radius = Model(), 0.5 * width * height_m
    profile = rounded([(0.82 * radius, 0), (0.86 * radius, 0.03 * height_m), (radius, height_m)], 0.006)
    lip = cylinder(0.25 * radius, 0.1 * height_m, top_radius_m=0.32 * radius).translate(
        (-0.85 * radius, 0, 0.9 * height_m)
    )
    grip = ear(model, 0.98 * radius, 0.88 * height_m, 0.25 * height_m, handle * height_m, 0.011)
    model.point("spout", "tip", "spout", (-1.17 * radius, 0.0, height_m), (-1.0, 0.0, 0.0))
    model = assemble_from_profile(model, profile, wall_m, 1.5 * wall_m, grip, ("spout", lip))
    groove = cylinder(0.25 * radius - wall_m, 0.2 * height_m, top_radius_m=0.39 * radius - wall_m)
    return model.cut("inside", groove.translate((-0.85 * radius, 0, 0.91 * height_m)))
