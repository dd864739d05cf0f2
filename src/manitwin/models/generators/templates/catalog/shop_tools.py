"""Further hand tools, lying along X with the working end towards +X, and items that stand in a yard or a kitchen."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import box, chords, cylinder, lathe, polygon, prism, rectangle, rounded, union
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.hand_tools import grip
from manitwin.models.generators.templates.catalog.organic import lay_along_x
from manitwin.models.generators.templates.catalog.vessel import assemble_from_profile
from manitwin.models.generators.templates.template import Model, template


@template("gavel")
def gavel(*, length_m: float, head: float, thick: float, grip_m: float) -> Model:
    """Build a gavel with its head across the end of its handle; ``head`` is its share, ``thick`` its width relative to that."""
    long, end = head * length_m, 0.5 * length_m
    r, at = 0.5 * thick * long, 0.5 * length_m - 0.5 * thick * long
    half = [
        (0, 0.0),
        (0.8 * r, 0.0),
        (0.72 * r, 0.16 * long),
        (0.8 * r, 0.2 * long),
        (0.8 * r, 0.24 * long),
        (0.95 * r, 0.28 * long),
    ]
    half += [(r, 0.36 * long), (0.98 * r, 0.47 * long), (0.86 * r, 0.5 * long), (0, 0.5 * long)]
    cap = lathe(rounded(half, 0.03 * r), sides=chords(48))
    solid = (cap + cap.mirror((0, 0, 1))).rotate((90, 0, 0)).translate((at, 0, 0))
    model = Model().add("head", solid)
    t = 0.5 * grip_m
    stick = [
        (0, -end),
        (0.8 * t, -end),
        (1.2 * t, -end + 0.012),
        (0.9 * t, -end + 0.035),
        (1.15 * t, -end + 0.1 * length_m),
    ]
    stick += [(0.75 * t, 0.05 * length_m), (0.6 * t, at - 0.5 * r), (0.6 * t, at), (0, at)]
    model.add("handle", lay_along_x(lathe(rounded(stick, 0.004))), "handle")
    model.region("face", "head", lambda c: np.abs(c[:, 1]) > 0.48 * long)
    model.point("striking face", "face", "face", (at, -0.5 * long, 0.0), (0.0, -1.0, 0.0))
    model.point("head", "surface", "head", (at, 0.32 * long, r), (0.0, 0.0, 1.0))
    return model.point("handle", "surface", "handle", (-0.28 * length_m, 0.0, t), (0.0, 0.0, 1.0)).rest_on_ground()


@template("file")
def file(*, length_m: float, blade: float, width_m: float, thick: float, grip_m: float) -> Model:
    """Build a flat file with its handle; ``blade`` is the blade's share of the length, ``thick`` its thickness over its width."""
    end, start = 0.5 * length_m, 0.5 * length_m - blade * length_m
    h = thick * width_m
    outline = [
        (start - 0.03, -0.16 * width_m),
        (start, -0.5 * width_m),
        (end - 0.3 * blade * length_m, -0.5 * width_m),
        (end, -0.36 * width_m),
    ]
    steel = prism(polygon([*outline, *[(x, -y) for x, y in outline[::-1]]]), h).translate((0, 0, -0.5 * h))
    groove = box(0.0006, 1.6 * width_m, 0.0012).rotate((0, 0, 32))
    rows = [
        groove.translate((start + 0.012 + 0.0035 * k, 0, side * 0.5 * h - 0.0006))
        for k in range(int((blade * length_m - 0.02) / 0.0035))
        for side in (-1, 1)
    ]
    model = Model().add("shaft", steel, "blade")
    model.perforate("teeth", lambda: union(rows), "blade")
    model.add("handle", grip(-end, start + 0.004, 0.5 * grip_m, flatten=0.94, swell=0.3), "handle")
    model.region("tip", "shaft", lambda c: c[:, 0] > end - 0.004)
    model.point("tip", "tip", "tip", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    model.point("shaft", "edge", "shaft", (start + 0.35 * blade * length_m, -0.5 * width_m, 0.0), (0.0, -1.0, 0.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * (start - end), 0.0, 0.6 * grip_m), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("awl")
def awl(*, length_m: float, blade: float, spike_m: float, grip_m: float) -> Model:
    """Build an awl, a spike in a bulbous handle; ``blade`` is the spike's share of the length."""
    end, start = 0.5 * length_m, 0.5 * length_m - blade * length_m
    r, t = 0.5 * grip_m, 0.5 * spike_m
    bulb = [(0, -end), (0.6 * r, -end), (r, -end + 0.18 * (start + end)), (0.9 * r, -end + 0.45 * (start + end))]
    bulb += [(0.52 * r, -end + 0.78 * (start + end)), (0.46 * r, start), (0, start)]
    smooth = arc([(x, 0, z) for x, z in bulb[1:-1]], samples=28)[:, [0, 2]]
    model = Model().add("handle", lay_along_x(lathe([(0, -end), *map(tuple, smooth), (0, start)])), "handle")
    model.add("collar", lay_along_x(cylinder(0.4 * r, 0.012)).translate((start - 0.006, 0, 0)), "blade")
    model.add(
        "shaft",
        lay_along_x(
            lathe(
                [(0, start), (t, start), (t, end - 0.35 * blade * length_m), (0.0003, end), (0, end)], sides=chords(20)
            )
        ),
        "blade",
    )
    model.region("tip", "shaft", lambda c: c[:, 0] > end - 0.35 * blade * length_m)
    model.point("tip", "tip", "tip", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    model.point("shaft", "surface", "shaft", (start + 0.3 * blade * length_m, 0.0, t), (0.0, 0.0, 1.0))
    return model.point(
        "handle", "surface", "handle", (-end + 0.3 * (start + end), 0.0, 0.97 * r), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("hacksaw")
def hacksaw(*, length_m: float, height: float, handle: float, bar_m: float) -> Model:
    """Build a hacksaw lying on its side with its teeth towards -Y; ``height`` and ``handle`` are relative to the length."""
    end, high, t = 0.5 * length_m, height * length_m, bar_m
    start = -end + handle * length_m
    low = -0.5 * high
    frame = [
        (start, low + 0.01),
        (start + 0.02, low + 0.8 * high),
        (start + 0.06, 0.5 * high),
        (end - 0.03, 0.5 * high),
        (end - 0.006, low + 0.75 * high),
        (end - 0.004, low - 0.004),
    ]
    bow = union(
        [prism(polygon(_bar(frame[k], frame[k + 1], t)), 0.62 * t).translate((0, 0, -0.31 * t)) for k in range(5)]
    )
    joints = union(
        [cylinder(0.5 * t, 0.62 * t, sides=chords(16)).translate((*place, -0.31 * t)) for place in frame[1:5]]
    )
    model = Model().add("frame", bow + joints)
    long = end - start
    blade = box(long + 0.006, 0.0125, 0.0009).translate((0.5 * (start + end), low, -0.00045))
    notch = prism(polygon([(-0.0011, -0.001), (0.0011, -0.001), (0.0, 0.0014)]), 0.004).translate(
        (0, low - 0.00625, -0.002)
    )
    model.add("blade", blade, "blade")
    model.perforate(
        "teeth",
        lambda: union(
            [notch.translate((start + 0.012 + 0.0022 * k, 0, 0)) for k in range(int((long - 0.024) / 0.0022))]
        ),
        "blade",
    )
    hand = [
        (start + 0.012, low - 0.018),
        (start + 0.012, low + 0.02),
        (start - 0.01, 0.22 * high),
        (start - 0.24 * handle * length_m, 0.42 * high),
    ]
    hand += [
        (-end + 0.1 * handle * length_m, 0.3 * high),
        (-end, -0.1 * high),
        (-end + 0.12 * handle * length_m, low - 0.012),
    ]
    outline = polygon(hand, radius_m=0.008)
    model.add("handle", prism(outline, 0.024, radius_m=0.005).translate((0, 0, -0.012)), "handle")
    opening = polygon(
        [
            (start - 0.02, low + 0.014),
            (start - 0.024, 0.12 * high),
            (start - 0.55 * handle * length_m, 0.2 * high),
            (-end + 0.028, -0.1 * high),
            (start - 0.62 * handle * length_m, low + 0.014),
        ],
        radius_m=0.007,
    )
    model.cut("grip", prism(opening, 0.1).translate((0, 0, -0.05)), "handle")
    model.region("blade tip", "blade", lambda c: c[:, 0] > end - 0.02)
    model.point("teeth", "edge", "blade", (0.5 * (start + end), low - 0.00625, 0.0), (0.0, -1.0, 0.0))
    model.point("blade tip", "tip", "blade tip", (end, low, 0.0), (1.0, 0.0, 0.0))
    return model.point("handle", "surface", "handle", (-end, -0.1 * high, 0.0), (-1.0, 0.0, 0.0)).rest_on_ground()


def _bar(a: tuple[float, float], b: tuple[float, float], width_m: float) -> list[tuple[float, float]]:
    """Return the corners of a bar of a given width between two points."""
    along = np.subtract(b, a)
    off = 0.5 * width_m * np.array([-along[1], along[0]]) / np.linalg.norm(along)
    return [tuple(map(float, place)) for place in (a - off, b - off, b + off, a + off)]  # type: ignore[misc]


@template("socket wrench")
def socket_wrench(*, length_m: float, head: float, thick: float, socket: float, grip: float) -> Model:
    """Build a lying ratchet with its drive up; ``grip`` is the handle's share, and all ratios are relative to the length."""
    r, h, end = 0.5 * head * length_m, thick * length_m, 0.5 * length_m
    at = end - r
    body = rounded([(0, 0), (0.9 * r, 0), (r, 0.12 * h), (r, 0.88 * h), (0.9 * r, h), (0, h)], 0.08 * h)
    model = Model().add("head", lathe(body).translate((at, 0, -0.5 * h)))
    drive = 0.5 * socket * length_m
    model.add("tip", box(2 * drive, 2 * drive, 1.1 * h, radius_m=0.0008).translate((at, 0, 0.3 * h)), "tip")
    start = -end + grip * length_m
    neck = [(start - 0.01, 0, 0), (0.5 * (start + at), 0, 0), (at - 0.7 * r, 0, 0)]
    model.add("shaft", tube(arc(neck, samples=12), np.linspace(0.3 * h, 0.44 * h, 12), flatten=0.9))
    model.add("handle", _knurled(-end, start, 0.5 * h), "handle")
    model.point("jaw", "tip", "tip", (at, 0.0, 1.4 * h), (0.0, 0.0, 1.0))
    model.point("head", "surface", "head", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * (start - end), 0.0, 0.5 * h), (0.0, 0.0, 1.0)
    ).rest_on_ground()


def _knurled(start_m: float, end_m: float, radius_m: float) -> Manifold:
    """Return a round handle along X with shallow rings."""
    share = np.linspace(0.0, 1.0, 33)
    radii = (
        radius_m
        * (1 - 0.05 * (np.arange(33) % 3 == 1))
        * np.minimum(1.0, np.sqrt(np.minimum(share, 1 - share) / 0.04 + 0.3))
    )
    return lay_along_x(lathe(np.column_stack([radii, start_m + share * (end_m - start_m)])))


_BANDS = ((0.4, 0.55), (0.68, 0.8))


@template("traffic cone")
def traffic_cone(*, height_m: float, foot: float, cone: float, top: float) -> Model:
    """Build a hollow cone with two bands on a square foot.

    ``foot`` and ``cone`` are relative to the height, ``top`` to the cone.
    """
    h, w, r = height_m, foot * height_m, 0.5 * cone * height_m
    wall = 0.01 * height_m + 0.0012
    plate = 0.05 * h
    base = prism(rectangle(w, w, radius_m=0.12 * w), plate, radius_m=0.2 * plate)
    levels = np.array([1.6 * plate, *(share * h for pair in _BANDS for share in pair), h])
    slope = zip(np.interp(levels, levels[[0, -1]], [0.94 * r, top * r]), levels, strict=True)
    side = [(r, 0.0), (r, 0.5 * plate), *((float(wide), float(z)) for wide, z in slope), (0, h)]
    model = Model().add("base", base, "base").add("body", lathe([(0, 0), *side], sides=chords(56)))
    inner = lathe(
        [
            (0, -0.01),
            (r - wall, -0.01),
            (0.94 * r - wall, 1.6 * plate),
            (max(top * r - wall, 0.001), h - wall),
            (0, h - wall),
        ],
        sides=chords(56),
    )
    model.cut("inside", inner)
    edges = np.array(_BANDS).ravel() * h
    model.region("bands", "body", lambda c: np.searchsorted(edges, c[:, 2]) % 2 == 1, "bands")
    model.point("top", "surface", "body", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    at = 0.3
    wide = float(np.interp(at * h, [1.6 * plate, h], [0.94 * r, top * r]))
    model.point("body", "surface", "body", (0.0, -wide, at * h), (0.0, -1.0, 0.0))
    return model.point("base", "surface", "base", (0.44 * w, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("toy bucket")
def toy_bucket(*, height_m: float, width: float, taper: float, wall_m: float) -> Model:
    """Build a plastic sand bucket with its flat bail folded down to its rim; ``taper`` is its foot's width over its mouth's."""
    h, r = height_m, 0.5 * width * height_m
    profile = rounded(
        [(taper * r, 0.0), (taper * r, 0.002), (0.97 * r, 0.92 * h), (1.04 * r, 0.93 * h), (1.04 * r, h)], 0.002
    )
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 28)
    bow = np.column_stack(
        [(1.04 * r + 0.006) * np.sin(turn), (1.04 * r + 0.009) * np.cos(turn), np.full(28, 0.965 * h)]
    )
    bow[0], bow[-1] = (-1.0 * r, 0.0, 0.965 * h), (1.0 * r, 0.0, 0.965 * h)
    handle = tube(bow, 0.0045, flatten=0.55, across=(0, 0, 1))
    return assemble_from_profile(Model(), profile, wall_m, 1.4 * wall_m, ("handle", handle))


@template("fly swatter")
def fly_swatter(*, length_m: float, head: float, wide: float, thick_m: float) -> Model:
    """Build a lying fly swatter; ``head`` is its flap's share of the length, ``wide`` its width relative to that."""
    end, long = 0.5 * length_m, head * length_m
    w = wide * long
    flap = prism(rectangle(long, w, radius_m=0.16 * w), thick_m).translate((end - 0.5 * long, 0, -0.5 * thick_m))
    model = Model().add("head", flap)
    pitch = 0.0085
    nx, ny = int(0.82 * long / pitch), int(0.84 * w / pitch)
    hole = box(0.56 * pitch, 0.56 * pitch, 0.02).translate((0, 0, -0.01))
    at = [
        (end - 0.5 * long + (u - 0.5 * (nx - 1)) * pitch, (v - 0.5 * (ny - 1)) * pitch)
        for u in range(nx)
        for v in range(ny)
    ]
    model.perforate("holes", lambda: union([hole.translate((*place, 0)) for place in at]))
    start = -end + 0.24 * length_m
    rod = lay_along_x(cylinder(0.0024, end - long - start + 0.03)).translate((start - 0.01, 0, 0))
    model.add("shaft", rod, "handle").add("handle", grip(-end, start, 0.0075, flatten=0.6, swell=0.1), "handle")
    model.point("head", "surface", "head", (end - 0.04 * long, 0.0, 0.5 * thick_m), (0.0, 0.0, 1.0))
    model.point("front edge", "edge", "head", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * (start - end), 0.0, 0.0048), (0.0, 0.0, 1.0)
    ).rest_on_ground()
