"""Soft plastic bottles that are no bodies of revolution: squeeze bottles, and jugs with a handle. Full solids."""

from __future__ import annotations

from manitwin.geometry.solids.shapes import lathe, polygon, prism, rectangle, rounded
from manitwin.models.generators.templates.catalog.vessel import smooth_profile
from manitwin.models.generators.templates.template import Model, template

LEAST_NECK_M = 0.009


@template("ketchup bottle")
def ketchup_bottle(
    *, height_m: float, width: float, flat: float, waist: float, shoulder: float, neck: float, cap: float
) -> Model:
    """Build an oval squeeze bottle with a nozzle on its cap.

    ``flat`` is its depth relative to its width, ``waist`` the width at the grip relative to the largest, ``shoulder`` the
    relative height of the body above which it narrows, ``neck`` the width of the cap's foot relative to the bottle's.
    """
    h, r = height_m, 0.5 * width * height_m
    top, n = (1 - cap) * h, max(neck * r, LEAST_NECK_M)
    side = smooth_profile([(0.98 * r, 0.07 * top), (waist * r, 0.4 * top), (r, shoulder * top), (0.98 * n, top)])
    body = lathe([(0.0, 0.0), *rounded([(0.88 * r, 0.0), (0.95 * r, 0.02 * top), side[0]], 0.01), *side, (0.0, top)])
    high = h - top
    spout = [(0.52 * n, top + 0.5 * high), (max(0.36 * n, 0.004), h), (0.0, h)]
    skirt = [(0.0, top - 0.005), (1.1 * n, top - 0.005), (1.08 * n, top + 0.36 * high), *spout]
    model = Model().add("body", body.scale((1, flat, 1))).add("cap", lathe(rounded(skirt, 0.0015)), "cap")
    model.region("nozzle", "cap", lambda centers: centers[:, 2] > top + 0.6 * high)
    model.region("base", "body", lambda centers: centers[:, 2] < 0.01 * top)
    model.point("nozzle", "tip", "nozzle", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("detergent bottle")
def detergent_bottle(
    *, height_m: float, width: float, flat: float, shoulder: float, neck: float, grip: float, cap: float
) -> Model:
    """Build a flat-sided jug with its cap towards -X, and with a handle behind a hole towards +X.

    ``flat`` is its depth relative to its width, ``shoulder`` the relative height of the body where its far side begins to slope,
    ``neck`` the cap's width and ``grip`` the hole's width relative to the body's.
    """
    h, w = height_m, width * height_m
    top, end, n = (1 - cap) * h, 0.5 * width * height_m, max(0.5 * neck * width * height_m, LEAST_NECK_M)
    at = -0.5 * w + 1.15 * n + 0.06 * w
    side = [(-end, 0.0), (end, 0.0), (end, shoulder * top), (at + 1.1 * n, 0.985 * top), (at + n, top), (at - n, top)]
    front = polygon([*side, (at - 1.1 * n, 0.96 * top), (-end, 0.8 * top)], radius_m=0.05 * w)
    deep = flat * w
    slab = prism(front, 1.2 * deep).rotate((90, 0, 0)).translate((0, 0.6 * deep, 0))
    body = slab ^ prism(rectangle(w, deep, radius_m=0.42 * deep), h, radius_m=0.08 * deep)
    wide, long = grip * w, 0.34 * top
    center = (end - 0.14 * w - 0.5 * wide, shoulder * top - 0.16 * top)
    hole = prism(rectangle(wide, long, radius_m=0.45 * wide), 2 * deep).rotate((90, 0, 0))
    model = Model().add("body", body)
    model.cut("grip", hole.translate((center[0], deep, center[1])))
    model.add(
        "cap",
        lathe(rounded([(0.0, top - 0.006), (1.12 * n, top - 0.006), (1.05 * n, h), (0.0, h)], 0.004)).translate(
            (at, 0, 0)
        ),
        "cap",
    )
    outer = center[0] + 0.5 * wide
    model.region(
        "handle", "body", lambda centers: (centers[:, 0] > outer) & (abs(centers[:, 2] - center[1]) < 0.4 * long)
    )
    model.region("base", "body", lambda centers: centers[:, 2] < 0.005)
    model.point("cap", "surface", "cap", (at, 0.0, h), (0.0, 0.0, 1.0))
    model.point("handle", "surface", "handle", (end, 0.0, center[1]), (1.0, 0.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
