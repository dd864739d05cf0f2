"""Retail packs: cardboard boxes, cans and tins, jars, bottles. All are full solids except an open flask."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.solids.shapes import box, cylinder, lathe, polygon, prism, rectangle, rounded
from manitwin.models.generators.templates.catalog.bottles import capped
from manitwin.models.generators.templates.catalog.vessel import assemble_from_profile
from manitwin.models.generators.templates.template import Model, template

BEAD_M = 0.0018
"""How far the rolled seam of a tin protrudes from its wall, metres."""


@template("cereal box")
@template("cracker box")
@template("cookie box")
@template("pasta box")
@template("rice box")
@template("tea box")
@template("sugar box")
@template("salt box")
@template("gelatin box")
@template("pudding box")
@template("baking soda box")
@template("medicine box")
@template("toothpaste box")
@template("cosmetic box")
def printed_box(*, height_m: float, width: float, depth: float) -> Model:
    """Build a standing closed box of printed cardboard, with its front towards -Y and flaps glued at both ends."""
    x, y = width * height_m, depth * height_m
    model = Model().add("body", box(x, y, height_m, radius_m=0.0006))
    model.region("front", "body", lambda centers: centers[:, 1] < -0.499 * y, "front")
    model.region("back", "body", lambda centers: centers[:, 1] > 0.499 * y, "front")
    model.region("top", "body", lambda centers: centers[:, 2] > 0.999 * height_m)
    model.region("base", "body", lambda centers: centers[:, 2] < 0.001 * height_m)
    if x > height_m:  # it opens at an end
        model.region("flap", "body", lambda centers: abs(centers[:, 0]) > 0.499 * x)
    model.point("front", "face", "front", (0.0, -0.5 * y, 0.5 * height_m), (0.0, -1.0, 0.0))
    model.point("top", "face", "top", (0.0, 0.0, height_m), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("cigarette pack")
def flip_top_pack(*, height_m: float, width: float, depth: float, lid: float) -> Model:
    """Build a pack with a hinged lid, which takes ``lid`` of its height in front and slants down to its hinge at the back."""
    x, y, h = width * height_m, depth * height_m, height_m
    model = Model().add("body", box(x, y, h, radius_m=0.0008))
    low, back = (1 - lid) * h, (1 - 0.55 * lid) * h
    line = polygon([(-y, low - 0.0004), (y, back - 0.0004), (y, back + 0.0004), (-y, low + 0.0004)])
    slit = prism(line, 2 * x).rotate((90, 0, 90)).translate((-x, 0, 0))
    core = box(x - 0.0012, y - 0.0012, 2 * h).translate((0, 0, -0.5 * h))
    model.cut("seam", slit - core, "seam")
    rise = (back - low) / (2 * y)  # the slit is cut from twice the depth
    model.region("lid", "body", lambda centers: centers[:, 2] > low + rise * (centers[:, 1] + y), "lid")
    model.region("base", "body", lambda centers: centers[:, 2] < 0.001 * h)
    model.point("lid", "face", "lid", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("tuna can")
@template("pet food can")
def low_can(*, height_m: float, width: float) -> Model:
    """Build a low can with seams at both ends, a paper label around it and a ring on its lid."""
    h, r = height_m, 0.5 * width * height_m
    wall = r - BEAD_M
    side = [(0, 0.002), (wall - 0.001, 0.002), (wall, 0.0), (r, 0.0), (r, 0.003), (wall, 0.0045)]
    model = Model().add("body", lathe(side + [(q, h - z) for q, z in reversed(side)]))
    ring = cylinder(0.24 * r, 0.0012) - cylinder(0.14 * r, 0.01).translate((0, 0, -0.001))
    tongue = box(0.1 * r + 0.006, 0.008, 0.001).translate((0.28 * r, 0, 0))
    model.add("ring", (ring + tongue).translate((0.42 * r, 0, h - 0.0024)), "ring")
    middle = 0.5 * h - 0.005
    model.region("label", "body", lambda centers: abs(centers[:, 2] - 0.5 * h) < middle, "label")
    model.region("top", "body", lambda centers: centers[:, 2] > h - 0.0025)
    model.region("base", "body", lambda centers: centers[:, 2] < 0.0025)
    model.point("top", "face", "top", (-0.4 * r, 0.0, h - 0.002), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.002), (0.0, 0.0, -1.0))


@template("coffee can")
@template("tea tin")
def lidded_tin(*, height_m: float, width: float, lid: float) -> Model:
    """Build a tall tin with a press-on lid, which takes ``lid`` of its height."""
    h, r = height_m, 0.5 * width * height_m
    low = (1 - lid) * h
    body = [(0, 0.002), (r - 0.004, 0.002), (r - BEAD_M, 0.0), (r, 0.0), (r, 0.003), (r - 0.0008, 0.0045)]
    model = Model().add("body", lathe([*body, (r - 0.0008, low + 0.002), (0, low + 0.002)]))
    cover = rounded([(0, low), (1.015 * r, low), (1.015 * r, h), (0.92 * r, h), (0.9 * r, h - 0.0015)], 0.001)
    model.add("lid", lathe([*cover, (0, h - 0.0015)]), "lid")
    model.region("base", "body", lambda centers: centers[:, 2] < 0.0025)
    model.point("lid", "face", "lid", (0.0, 0.0, h - 0.0015), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.002), (0.0, 0.0, -1.0))


@template("sardine can")
@template("canned meat")
def oblong_tin(*, length_m: float, width: float, height: float, corner: float) -> Model:
    """Build an oblong tin with rounded corners, seams at both ends and a ring on its lid; ``corner`` is relative to its width."""
    x, y, h = length_m, width * length_m, height * length_m
    radius, wall = corner * y, 2 * BEAD_M
    model = Model().add(
        "body", prism(rectangle(x - wall, y - wall, radius_m=radius), h - 0.004).translate((0, 0, 0.002))
    )
    seam = prism(rectangle(x, y, radius_m=radius + BEAD_M), 0.0035)
    seam -= prism(rectangle(x - 2 * wall, y - 2 * wall, radius_m=radius - BEAD_M), 0.01).translate((0, 0, -0.002))
    model.add("seams", seam + seam.translate((0, 0, h - 0.0035)), "seams")
    ring = cylinder(0.17 * y, 0.0012) - cylinder(0.1 * y, 0.01).translate((0, 0, -0.001))
    tongue = box(0.1 * y + 0.005, 0.007, 0.001).translate((0.22 * y, 0, 0))
    model.add("ring", (ring + tongue).translate((0.5 * x - 0.42 * y - wall, 0, h - 0.0024)), "seams")
    model.region("top", "body", lambda centers: centers[:, 2] > h - 0.0022, "seams")
    model.region("base", "body", lambda centers: centers[:, 2] < 0.0022, "seams")
    model.region("top", "seams", lambda centers: centers[:, 2] > h - 2e-4)
    model.region("base", "seams", lambda centers: centers[:, 2] < 2e-4)
    model.point("top", "face", "top", (-0.2 * x, 0.0, h - 0.002), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.002), (0.0, 0.0, -1.0))


def _labelled(model: Model, low_m: float, high_m: float) -> Model:
    """Give the body's wall between two heights, at which its profile has points, the look of a label."""
    return model.region("label", "body", lambda centers: (centers[:, 2] > low_m) & (centers[:, 2] < high_m), "label")


@template("jam jar")
@template("honey jar")
@template("pickle jar")
@template("peanut butter jar")
@template("chocolate spread jar")
@template("mason jar")
@template("ink bottle")
def labelled_jar(*, height_m: float, width: float, neck: float, cap: float, label: float) -> Model:
    """Build a jar with a screw lid and a label around it.

    ``label`` is the label's share of the body's height, ``neck`` the lid's width relative to the body's.
    """
    h, r = height_m, 0.5 * width * height_m
    top, n = (1 - cap) * h, neck * r
    low, high = (0.46 - 0.5 * label) * top, (0.46 + 0.5 * label) * top
    profile = [(r, 0.0), (r, low), (r, high), (r, 0.88 * top), (n, top), (n, top + 0.003)]
    cover = [(1.03 * n, top), (1.03 * n, h), (0.0, h)]
    return _labelled(capped(Model(), profile, cover, 0.1 * h), low, high)


@template("oil bottle")
@template("vinegar bottle")
def tall_bottle(*, height_m: float, width: float, shoulder: float, neck: float, cap: float, label: float) -> Model:
    """Build a slender bottle with a long neck and a label, which takes ``label`` of the height below its shoulder."""
    h, r = height_m, 0.5 * width * height_m
    n, top, side = max(neck * r, 0.009), (1 - cap) * h, shoulder * h
    low, high = (0.48 - 0.5 * label) * side, (0.48 + 0.5 * label) * side
    profile = [(r, 0.0), (r, low), (r, high), (r, side), (n, 0.5 * (side + top)), (n, top)]
    cover = [(1.12 * n, top - 0.004), (1.12 * n, h), (0.0, h)]
    return _labelled(capped(Model(), profile, cover, 0.08 * h), low, high)


@template("glue bottle")
def glue_bottle(*, height_m: float, width: float, flat: float, shoulder: float, neck: float, cap: float) -> Model:
    """Build an oval squeeze bottle with a pointed screw nozzle; ``flat`` is its depth relative to its width."""
    h, r = height_m, 0.5 * width * height_m
    top, n = (1 - cap) * h, max(neck * r, 0.007)
    low = shoulder * top
    outline = rounded([(0.94 * r, 0.0), (r, 0.04 * top), (r, low), (n, 0.97 * top), (n, top)], 0.12 * h)
    body = lathe([(0.0, 0.0), *outline, (0.0, top)])

    def flattened(vertices: np.ndarray) -> np.ndarray:
        """Flatten the sides, decreasingly towards the neck, which stays round."""
        neckward = np.clip((vertices[:, 2] - low) / (0.97 * top - low), 0.0, 1.0)
        return np.column_stack([vertices[:, 0], vertices[:, 1] * (flat + (1 - flat) * neckward), vertices[:, 2]])

    high = h - top
    tip = [
        (1.05 * n, top - 0.004),
        (1.05 * n, top + 0.3 * high),
        (0.62 * n, top + 0.42 * high),
        (0.2 * n + 0.001, h),
        (0.0, h),
    ]
    model = Model().add("body", body.warp_batch(flattened))
    model.add("cap", lathe(rounded([(0.0, top - 0.004), *tip], 0.001)), "cap")
    model.region("base", "body", lambda centers: centers[:, 2] < 0.005 * h)
    model.point("nozzle", "tip", "cap", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("laboratory flask")
def conical_flask(*, height_m: float, width: float, neck: float, slope: float, wall_m: float) -> Model:
    """Build an open conical flask; ``neck`` is its mouth relative to its foot, ``slope`` the cone's share of its height."""
    h, r = height_m, 0.5 * width * height_m
    n = max(neck * r, 0.009)
    profile = rounded([(0.93 * r, 0.0), (r, 0.05 * h), (n, slope * h), (n, 0.97 * h), (1.16 * n, h)], 0.02 * h)
    return assemble_from_profile(Model(), profile, wall_m, 1.2 * wall_m)
