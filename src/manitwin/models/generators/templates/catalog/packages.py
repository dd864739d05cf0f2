"""Closed packages of food, drink and small goods with their contents: cartons, cups, tubes, tins and flasks."""

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
    union,
)
from manitwin.models.generators.templates.template import Model, template


@template("milk carton")
def milk_carton(*, height_m: float, width: float, depth: float, gable: float) -> Model:
    """Build a carton with a gabled top and a screw cap on the slope towards -Y."""
    x, y = width * height_m, width * depth * height_m
    fin = 0.42 * gable * height_m
    shoulder, ridge = (1 - gable) * height_m, height_m - fin
    model = Model().add("body", box(x, y, shoulder, radius_m=0.0015))
    low = box(x - 0.0006, y - 0.0006, 0.001).translate((0, 0, shoulder - 0.002))
    model.add("gable", (low + box(x - 0.0006, 0.0026, 0.001).translate((0, 0, ridge))).hull(), "gable")
    for side in (-1.0, 1.0):  # the ends are folded in below the slopes
        rise, end = ridge - shoulder, 0.5 * side * x
        corners = [
            (end * 1.01, 0.44 * y, shoulder),
            (end * 1.01, -0.44 * y, shoulder),
            (end * 1.01, 0, ridge - 0.16 * rise),
        ]
        model.cut("folds", Manifold.hull_points([*corners, (0.55 * end, 0, ridge - 0.2 * rise)]), "gable")
    model.add("fin", box(x - 0.0006, 0.003, fin + 0.001).translate((0, 0, ridge - 0.0005)), "gable")
    slope = np.array([ridge - shoulder, -0.5 * y])
    slope = slope / np.linalg.norm(slope)  # (out towards -Y, up) is (slope[0], -slope[1])
    r = min(0.016, 0.4 * float(np.hypot(ridge - shoulder, 0.5 * y)))
    tilt = float(np.degrees(np.arctan2(slope[0], -slope[1])))
    middle = (-0.27 * y, shoulder + 0.46 * (ridge - shoulder))
    cap = cylinder(r, 0.016, top_radius_m=0.95 * r) + cylinder(1.2 * r, 0.004)
    model.add(
        "cap",
        cap.rotate((tilt, 0, 0)).translate((0, middle[0] + 0.0015 * slope[0], middle[1] + 0.0015 * slope[1])),
        "cap",
    )
    out, up = float(slope[0]), -float(slope[1])
    model.region("base", "body", lambda centers: centers[:, 2] < 1e-5)
    model.point("cap", "surface", "cap", (0.0, middle[0] - 0.0145 * out, middle[1] + 0.0145 * up), (0.0, -out, up))
    model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    return model.point("body", "surface", "body", (-0.5 * x, 0.0, 0.5 * shoulder), (-1.0, 0.0, 0.0))


@template("yogurt cup")
def yogurt_cup(*, height_m: float, width: float, taper: float) -> Model:
    """Build a cup that widens upwards, with a foil lid whose tab points to -Y."""
    r, top = 0.5 * width * height_m, height_m - 0.0008
    foot = taper * r
    profile = [
        (0, 0.003),
        (0.85 * foot, 0.003),
        (0.92 * foot, 0),
        (foot, 0),
        (0.93 * r, top - 0.006),
        (0.93 * r, top - 0.003),
        (r, top - 0.0026),
        (r, top),
        (0, top),
    ]
    model = Model().add("body", lathe(profile))
    sheet = cylinder(1.01 * r, 0.0012) + prism(rectangle(0.5 * r, 0.5 * r, radius_m=0.2 * r), 0.0012).translate(
        (0, -1.05 * r, 0)
    )
    model.add("lid", sheet.translate((0, 0, height_m - 0.0012)), "lid")
    model.region("tab", "lid", lambda centers: centers[:, 1] < -1.04 * r)
    model.region(
        "base", "body", lambda centers: (centers[:, 2] < 0.0035) & (np.hypot(centers[:, 0], centers[:, 1]) < foot)
    )
    model.point("tab", "edge", "tab", (0.0, -1.3 * r, height_m - 0.0006), (0.0, -1.0, 0.0))
    model.point("lid", "face", "lid", (0.0, 0.0, height_m), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.95 * foot, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("chips can")
def chips_can(*, height_m: float, width: float, lid_m: float) -> Model:
    """Build a tall cardboard tube with a metal bottom and a plastic lid."""
    r, start = 0.5 * width * height_m, height_m - lid_m
    model = Model().add("body", cylinder(0.975 * r, start - 0.002).translate((0, 0, 0.0035)))
    model.add(
        "base",
        lathe(rounded([(0, 0.003), (0.88 * r, 0.003), (0.93 * r, 0), (r, 0), (r, 0.004), (0, 0.004)], 0.001)),
        "metal",
    )
    model.add("seam", lathe([(0, start - 0.004), (r, start - 0.004), (r, start), (0, start)]), "metal")
    lid = [
        (0, start),
        (1.02 * r, start),
        (1.02 * r, height_m),
        (0.9 * r, height_m),
        (0.87 * r, height_m - 0.0025),
        (0, height_m - 0.0025),
    ]
    model.add("lid", lathe(rounded(lid, 0.001)), "lid")
    model.point("lid", "surface", "lid", (0.0, 0.0, height_m - 0.0025), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.96 * r, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("canister tin")
def canister_tin(*, length_m: float, width: float, thick: float, corner: float) -> Model:
    """Build a flat tin with a hinged lid; the hinge is towards +Y."""
    across, high = width * length_m, thick * length_m
    radius = corner * across
    split = 0.56 * high
    model = Model().add("body", prism(rectangle(length_m, across, radius_m=radius), split + 0.002, radius_m=0.001))
    cover = prism(rectangle(length_m + 0.0014, across + 0.0014, radius_m=radius + 0.0007), high - split, radius_m=0.001)
    raised = prism(rectangle(0.9 * length_m, 0.84 * across, radius_m=0.8 * radius), 0.002)
    model.add("lid", cover.translate((0, 0, split)) + raised.translate((0, 0, high - 0.0012)), "lid")
    for side in (-1.0, 1.0):
        pin = cylinder(0.0016, 0.16 * length_m, sides=16).rotate((0, 90, 0))
        model.add("hinge", pin.translate((side * 0.24 * length_m - 0.08 * length_m, 0.5 * across + 0.0008, split)))
    model.point("lid", "face", "lid", (0.0, 0.0, high + 0.0008), (0.0, 0.0, 1.0))
    return model.point("front edge", "edge", "lid", (0.0, -0.5 * across - 0.0007, split + 0.001), (0.0, -1.0, 0.0))


@template("dropper bottle")
def dropper_bottle(*, height_m: float, width: float, bulb: float, neck: float) -> Model:
    """Build a small bottle with a pipette, which has a screw collar and a rubber bulb."""
    r, h = 0.5 * width * height_m, height_m
    rubber, collar = bulb * h, 0.13 * h
    shoulder, narrow = h - rubber - collar, neck * r
    profile = [
        (0, 0),
        (0.96 * r, 0),
        (r, 0.02 * h),
        (r, 0.78 * shoulder),
        (0.8 * r, 0.92 * shoulder),
        (narrow, shoulder),
        (narrow, shoulder + 0.02),
        (0, shoulder + 0.004),
    ]
    profile[-2] = (narrow, shoulder + 0.004)
    model = Model().add("body", lathe(rounded(profile, 0.25 * r)))
    ring = 1.22 * narrow
    ribs = [
        cylinder(0.0012, 0.8 * collar, sides=8).translate((ring * np.cos(a), ring * np.sin(a), shoulder + 0.1 * collar))
        for a in np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ]
    model.add(
        "collar",
        union(
            [
                lathe(
                    rounded([(0, shoulder), (ring, shoulder), (ring, shoulder + collar), (0, shoulder + collar)], 0.001)
                ),
                *ribs,
            ]
        ),
        "collar",
    )
    low = shoulder + collar
    teat = [
        (0, low - 0.001),
        (0.86 * narrow, low - 0.001),
        (0.9 * narrow, low + 0.55 * rubber),
        (0.62 * narrow, low + 0.66 * rubber),
        (0.6 * narrow, h - 0.2 * rubber),
        (0.3 * narrow, h),
        (0, h),
    ]
    model.add("bulb", lathe(rounded(teat, 0.004)), "bulb")
    model.region("base", "body", lambda centers: centers[:, 2] < 1e-5)
    model.point("bulb", "surface", "bulb", (0.0, -0.89 * narrow, low + 0.35 * rubber), (0.0, -1.0, 0.0))
    model.point("cap", "surface", "collar", (0.0, -ring, low - 0.5 * collar), (0.0, -1.0, 0.0))
    return model.point("base", "face", "base", (0.5 * r, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("playing cards")
def playing_cards(*, length_m: float, width: float, thick: float) -> Model:
    """Build a pack of cards in its box, lying on its back with the flap towards +X."""
    across, high = width * length_m, thick * length_m
    model = Model().add("body", box(length_m, across, high, radius_m=0.0008))
    model.region("flap", "body", lambda centers: centers[:, 0] > 0.499 * length_m, "flap")
    notch = cylinder(0.13 * across, 0.0006).scale((0.8, 1, 1)).translate((0.5 * length_m, 0, high - 0.0006))
    model.cut("notch", notch, "cards")
    for low in (0.0, 1.0):
        border = prism(rectangle(0.9 * length_m, 0.86 * across, radius_m=0.004), 0.0005)
        model.add(
            "back" if low else "face",
            border.translate((0, 0, low * (high + 0.0001) - (0.0003 if low else 0.0002))),
            "back",
        )
    x, y = 0.16 * length_m, 0.14 * across
    emblem = prism(polygon([(-x, 0), (0, -y), (x, 0), (0, y)]), 0.0004)
    model.add("emblem", emblem.translate((0, 0, high + 0.0002)), "emblem")
    model.point("flap", "surface", "flap", (0.5 * length_m, 0.0, 0.5 * high), (1.0, 0.0, 0.0))
    return model.point("front", "face", "back", (-0.3 * length_m, 0.0, high + 0.0003), (0.0, 0.0, 1.0)).rest_on_ground()


@template("glasses case")
def glasses_case(*, length_m: float, width: float, thick: float) -> Model:
    """Build a closed lying hard case with its lid up and the opening edge towards -Y."""
    across, high = width * length_m, thick * length_m
    reach = 0.5 * (length_m - across)
    ends = [ellipsoid(across, across, 1.16 * high).translate((side * reach, 0, 0.42 * high)) for side in (-1.0, 1.0)]
    shell = (ends[0] + ends[1]).hull() ^ box(2 * length_m, 2 * across, 2 * high)
    model = Model().add("body", shell)
    inner = prism(rectangle(length_m - 0.003, across - 0.003, radius_m=0.5 * across), 0.1).translate((0, 0, -0.05))
    groove = box(2 * length_m, 2 * across, 0.0012) - inner
    model.cut("seam", groove.translate((0, 0, 0.45 * high)), "seam")
    model.region("lid", "body", lambda centers: centers[:, 2] > 0.46 * high)
    clasp = ellipsoid(0.1 * length_m, 0.008, 0.16 * high).translate((0, -0.5 * across, 0.45 * high))
    model.add("clasp", clasp, "clasp")
    model.point("lid", "surface", "lid", (0.0, 0.0, high), (0.0, 0.0, 1.0))
    return model.point("clasp", "surface", "clasp", (0.0, -0.5 * across - 0.004, 0.45 * high), (0.0, -1.0, 0.0))


@template("matchbox")
def matchbox(*, length_m: float, width: float, thick: float, drawn: float) -> Model:
    """Build a lying matchbox with matches, its drawer pulled out towards +X by ``drawn`` of its length."""
    n, y, z = length_m, width * length_m, thick * length_m
    card, out = 0.0006, drawn * length_m
    model = Model().add("body", box(n, y, z, radius_m=0.0004))
    for side in (-1.0, 1.0):
        strip = box(n - 0.002, 0.0006, 0.8 * z).translate((0, side * (0.5 * y - 0.0002), 0.1 * z))
        model.add("striking side", strip, "striking side")
    inner_y, inner_z = y - 2 * card, z - 2 * card
    for side in (-1.0, 1.0):  # the drawer is recessed at -X and visible at +X
        model.cut("mouth", box(0.004, inner_y, inner_z).translate((side * 0.5 * n, 0, card)), "drawer")
    drawer = box(out + 0.006, inner_y - 0.0004, inner_z - 0.0004).translate((0.5 * n + 0.5 * out - 0.003, 0, card))
    model.add("drawer", drawer, "drawer")
    hollow = box(out - card + 0.001, inner_y - 0.0022, z).translate(
        (0.5 * n + 0.5 * out - 0.5 * card - 0.0005, 0, card + 0.55 * inner_z)
    )
    model.cut("inside", hollow, "drawer")
    stick, pitch = 0.0021, 0.0028
    count = int((inner_y - 0.004) / pitch)
    level, end = card + 0.55 * inner_z - 0.0002, 0.5 * n + out - card - 0.0016
    for number in range(count):
        across = (number - 0.5 * (count - 1)) * pitch
        back = end - 0.0012 * ((7 * number) % 3)
        rod = box(out + 0.0014, stick, stick).translate((back - 0.5 * out, across, level))
        model.add("matches", rod, "matches")
        ball = ellipsoid(0.0052, 0.0027, 0.0027, sides=chords(16))
        model.add("heads", ball.translate((back - 0.0022, across, level + 0.5 * stick)), "heads")
    model.region("base", "body", lambda centers: centers[:, 2] < 1e-5)
    model.region("top", "body", lambda centers: centers[:, 2] > z - 1e-5)
    model.point("drawer", "face", "drawer", (0.5 * n + out, 0.0, card + 0.25 * inner_z), (1.0, 0.0, 0.0))
    model.point("striking side", "face", "striking side", (0.0, -0.5 * y - 0.0001, 0.5 * z), (0.0, -1.0, 0.0))
    return model.point("top", "face", "top", (0.0, 0.0, z), (0.0, 0.0, 1.0))


@template("food container")
def food_container(*, length_m: float, width: float, height: float, taper: float, lid: float) -> Model:
    """Build a closed container whose lid is held by four clips.

    ``taper`` is the floor's width relative to the opening's, ``lid`` the lid's share of the height.
    """
    n, y, h = length_m, width * length_m, height * length_m
    brim = (1 - lid) * h
    radius = 0.16 * y

    def layer(x_m: float, y_m: float, low_m: float, high_m: float) -> Manifold:
        return prism(rectangle(x_m, y_m, radius_m=radius), high_m - low_m).translate((0, 0, low_m))

    rim, floor = (0.94 * n, y - 0.06 * n), (taper * 0.94 * n, taper * (y - 0.06 * n))
    tub = Manifold.batch_hull(
        [
            layer(*rim, brim - 0.001, brim),
            layer(*floor, 0.004, 0.005),
            layer(0.96 * floor[0], 0.95 * floor[1], 0, 0.001),
        ]
    )
    model = Model().add("body", tub)
    flange = (0.965 * n, y - 0.035 * n)
    model.add("body", layer(*flange, brim - 0.0035, brim))
    cover = prism(rectangle(*flange, radius_m=radius), lid * h, radius_m=0.25 * lid * h).translate(
        (0, 0, brim - 0.0002)
    )
    model.add("lid", cover, "lid")
    well = prism(rectangle(0.8 * n, y - 0.2 * n, radius_m=0.8 * radius), h, radius_m=0.001).translate(
        (0, 0, h - 0.3 * lid * h)
    )
    model.cut("panel", well, "lid")
    thick, long = 0.0175 * n + 0.0006, 0.42 * y
    down = brim - 0.012
    for turn, reach in ((0, 0.5 * flange[0]), (180, 0.5 * flange[0]), (90, 0.5 * flange[1]), (270, 0.5 * flange[1])):
        clip = box(thick, long, h - 0.25 * lid * h - down, radius_m=0.0012).translate(
            (reach + 0.5 * thick - 0.0008, 0, down)
        )
        model.add("clips", clip.rotate((0, 0, turn)), "lid")
    model.region("base", "body", lambda centers: centers[:, 2] < 1e-5)
    model.point("lid", "face", "panel", (0.0, 0.0, h - 0.3 * lid * h - 0.0002), (0.0, 0.0, 1.0))
    middle = 0.5 * (down + h - 0.25 * lid * h)
    model.point("clip", "face", "clips", (0.5 * flange[0] + thick - 0.0008, 0.0, middle), (1.0, 0.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
