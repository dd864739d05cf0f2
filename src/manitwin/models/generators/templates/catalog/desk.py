"""Desk items to write, measure, fix and bind with."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import Point, box, cylinder, lathe, polygon, prism, rectangle, rounded, union
from manitwin.geometry.solids.sweep import tube
from manitwin.models.generators.templates.template import Model, template


def _lathe_along_x(profile: list[Point], sides: int = 32) -> Manifold:
    """Return a solid of revolution whose axis lies along X."""
    return lathe(profile, sides=sides).rotate((0, 90, 0))


@template("pen")
def pen(*, length_m: float, thick_m: float, tip: float) -> Model:
    """Build a pen with a push button and a clip, and with its tip towards +X."""
    end, r = 0.5 * length_m, 0.5 * thick_m
    start = end - tip * length_m
    model = Model().add(
        "barrel",
        _lathe_along_x(
            rounded([(0, -end + 0.008), (r, -end + 0.008), (r, start), (0.0016, end - 0.003), (0, end - 0.003)], 0.002)
        ),
    )
    model.add("tip", _lathe_along_x([(0, start), (0.0017, end - 0.006), (0.0004, end), (0, end)]))
    model.add("button", _lathe_along_x([(0, -end), (0.55 * r, -end), (0.55 * r, -end + 0.01), (0, -end + 0.01)]), "cap")
    clip = box(0.04, 0.003, 0.0014).translate((-end + 0.032, 0, r + 0.001))
    model.add("clip", clip, "cap").add("clip", box(0.004, 0.003, 0.004).translate((-end + 0.014, 0, r - 0.0018)), "cap")
    model.point("tip", "tip", "tip", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("button", "button", "button", (-end, 0.0, 0.0), (-1.0, 0.0, 0.0)).rest_on_ground()


@template("pencil")
def pencil(*, length_m: float, thick_m: float) -> Model:
    """Build a hexagonal pencil with an eraser, and with its point towards +X."""
    end, r = 0.5 * length_m, 0.5 * thick_m
    start = end - 0.022
    model = Model().add(
        "barrel", cylinder(r, start + end - 0.012, sides=6).rotate((0, 90, 0)).translate((-end + 0.012, 0, 0))
    )
    model.add(
        "wood",
        cylinder(0.99 * r, 0.0225, top_radius_m=0.0009).rotate((0, 90, 0)).translate((start - 0.0005, 0, 0)),
        "wood",
    )
    model.region("lead", "wood", lambda centers: centers[:, 0] > end - 0.006, "lead")
    # Wider than the corners of the barrel, which would otherwise pierce it.
    model.add("ferrule", cylinder(1.005 * r, 0.012).rotate((0, 90, 0)).translate((-end + 0.004, 0, 0)), "lead")
    model.add("eraser", cylinder(0.9 * r, 0.006).rotate((0, 90, 0)).translate((-end, 0, 0)), "eraser")
    model.point("point", "tip", "lead", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("eraser", "tip", "eraser", (-end, 0.0, 0.0), (-1.0, 0.0, 0.0)).rest_on_ground()


@template("marker")
def marker(*, length_m: float, thick_m: float, cap: float) -> Model:
    """Build a marker with its cap on, the cap towards +X."""
    end, r = 0.5 * length_m, 0.5 * thick_m
    start = end - cap * length_m
    model = Model().add(
        "barrel",
        _lathe_along_x(rounded([(0, -end), (0.86 * r, -end), (0.86 * r, start + 0.01), (0, start + 0.01)], 0.002)),
    )
    model.add("cap", _lathe_along_x(rounded([(0, start), (r, start), (0.94 * r, end), (0, end)], 0.0025)), "cap")
    model.add(
        "clip", box(0.6 * cap * length_m, 0.004, 0.002).translate((start + 0.4 * cap * length_m, 0, r - 0.0006)), "cap"
    )
    model.point("cap", "surface", "cap", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point("barrel", "surface", "barrel", (-0.4 * end, 0.0, 0.86 * r), (0.0, 0.0, 1.0)).rest_on_ground()


@template("eraser")
def eraser(*, length_m: float, width: float, thick_m: float, sleeve: float) -> Model:
    """Build an eraser in a cardboard sleeve; the free end towards +X."""
    across = width * length_m
    model = Model().add("body", box(length_m, across, thick_m, radius_m=0.0025).translate((0, 0, 0.0003)))
    model.add(
        "sleeve",
        box(sleeve * length_m, across + 0.0006, thick_m + 0.0006).translate(
            (-0.5 * (1 - sleeve) * length_m + 0.002, 0, 0)
        ),
        "sleeve",
    )
    return model.point("corner", "tip", "body", (0.5 * length_m, 0.0, 0.5 * thick_m), (1.0, 0.0, 0.0))


@template("ruler")
def ruler(*, length_m: float, width_m: float, thick_m: float) -> Model:
    """Build a ruler with a bevelled edge towards -Y."""
    section = polygon(
        [
            (-0.5 * width_m, 0),
            (0.5 * width_m, 0),
            (0.5 * width_m, thick_m),
            (-0.2 * width_m, thick_m),
            (-0.5 * width_m, 0.3 * thick_m),
        ]
    )
    solid = prism(section, length_m).rotate((90, 0, 90)).translate((-0.5 * length_m, 0, 0))
    model = (
        Model()
        .add("body", solid)
        .cut("hole", cylinder(0.003, 0.02).translate((0.475 * length_m, 0.2 * width_m, -0.01)))
    )
    model.region("edge", "body", lambda centers: (centers[:, 1] < -0.2 * width_m) & (centers[:, 2] > 1e-5))
    return model.point("edge", "edge", "body", (0.0, -0.5 * width_m, 0.0), (0.0, -1.0, 0.0))


@template("book")
def book(*, length_m: float, width: float, thick_m: float) -> Model:
    """Build a closed book lying on its back cover, the spine towards -X."""
    across = width * length_m
    board = 0.0025
    pages = box(across - 0.006, length_m - 0.008, thick_m - 1.6 * board).translate((-0.0015, 0, 0.8 * board))
    model = Model().add("pages", pages, "pages")
    for low in (0.0, thick_m - board):
        model.add("cover", box(across, length_m, board).translate((0, 0, low)), "cover")
    model.add("spine", box(board, length_m, thick_m).translate((-0.5 * across + 0.5 * board, 0, 0)), "cover")
    model.point("cover", "face", "cover", (0.0, 0.0, thick_m), (0.0, 0.0, 1.0))
    return model.point("spine", "face", "spine", (-0.5 * across, 0.0, 0.5 * thick_m), (-1.0, 0.0, 0.0))


@template("notebook")
def notebook(*, length_m: float, width: float, thick_m: float) -> Model:
    """Build a notebook lying on its back, its spiral towards -X."""
    across = width * length_m
    model = Model().add("pages", box(across, length_m, thick_m - 0.001).translate((0, 0, 0.0005)), "pages")
    for low in (0.0, thick_m - 0.0007):
        model.add("cover", box(across + 0.002, length_m + 0.002, 0.0007).translate((0, 0, low)), "cover")
    count = int(length_m / 0.012)
    radius = 0.5 * thick_m + 0.0035
    rings = []
    for number in range(count):
        angles = np.linspace(0, 2 * np.pi, 20)
        y = (number - 0.5 * (count - 1)) * 0.012
        place = np.stack(
            [
                -0.5 * across - 0.25 * radius + radius * np.cos(angles),
                y + 0.0 * angles,
                0.5 * thick_m + radius * np.sin(angles),
            ],
            1,
        )
        rings.append(tube(place[:-1], 0.0007, across=(0, 1, 0), sides=6))
    model.add("spiral", union(rings), "spiral")
    return model.point("cover", "face", "cover", (0.0, 0.0, thick_m), (0.0, 0.0, 1.0)).rest_on_ground()


@template("stapler")
def stapler(*, length_m: float, height: float, width_m: float) -> Model:
    """Build a stapler that stands, its mouth towards +X."""
    h, x = height * length_m, 0.5 * length_m
    side = polygon(
        [
            (-x, 0.3 * h),
            (-0.9 * x, 0.7 * h),
            (-0.3 * x, h),
            (0.75 * x, 0.95 * h),
            (0.97 * x, 0.6 * h),
            (0.97 * x, 0.42 * h),
            (-0.6 * x, 0.3 * h),
        ],
        radius_m=0.003,
    )
    arm = prism(side, width_m, radius_m=0.003).rotate((90, 0, 0)).translate((0, 0.5 * width_m, 0))
    model = Model().add("arm", arm, "arm").add("base", box(length_m, 1.1 * width_m, 0.18 * h, radius_m=0.003), "base")
    model.add("hinge", box(0.22 * length_m, 0.9 * width_m, 0.5 * h).translate((-0.36 * length_m, 0, 0.1 * h)), "base")
    model.add("anvil", box(0.02, 0.5 * width_m, 0.004).translate((0.86 * x, 0, 0.18 * h - 0.001)), "base")
    model.point("arm", "button", "arm", (0.6 * x, 0.0, 0.955 * h), (0.0, 0.0, 1.0))
    return model.point("anvil", "face", "anvil", (0.86 * x, 0.0, 0.18 * h + 0.003), (0.0, 0.0, 1.0))


@template("tape dispenser")
def tape_dispenser(*, length_m: float, height: float, width_m: float) -> Model:
    """Build a desk dispenser with its roll, and with the cutter towards +X."""
    h, x = height * length_m, 0.5 * length_m
    side = polygon(
        [
            (-x, 0),
            (x, 0),
            (x, 0.62 * h),
            (0.78 * x, 0.66 * h),
            (0.35 * x, 0.3 * h),
            (-0.85 * x, 0.32 * h),
            (-x, 0.6 * h),
        ],
        radius_m=0.004,
    )
    body = prism(side, width_m, radius_m=0.003).rotate((90, 0, 0)).translate((0, 0.5 * width_m, 0))
    center, radius = (-0.28 * x, 0.0, 0.58 * h), 0.42 * h
    slot = cylinder(1.08 * radius, 0.6 * width_m).translate((0, 0, -0.3 * width_m)).rotate((90, 0, 0)).translate(center)
    roll = cylinder(radius, 0.36 * width_m).translate((0, 0, -0.18 * width_m)).rotate((90, 0, 0)).translate(center)
    axle = cylinder(0.3 * radius, 1.0 * width_m).translate((0, 0, -0.5 * width_m)).rotate((90, 0, 0)).translate(center)
    walls = prism(rectangle(1.1 * radius, 1.3 * radius), 0.2 * width_m).rotate((90, 0, 0))
    model = Model().add("body", body)
    for y in (0.5 * width_m, -0.3 * width_m):
        model.add("body", walls.translate((center[0], y, 0.42 * h)))
    model.cut("slot", slot).add("tape", roll, "tape").add("axle", axle)
    model.add("cutter", box(0.004, 0.5 * width_m, 0.012).translate((0.985 * x, 0, 0.6 * h)))
    model.point("cutter", "edge", "cutter", (0.985 * x, 0.0, 0.6 * h + 0.012), (0.0, 0.0, 1.0))
    return model.point("tape", "surface", "tape", (center[0], 0.0, center[2] + radius), (0.0, 0.0, 1.0))


@template("glue stick")
def glue_stick(*, height_m: float, width: float, cap: float) -> Model:
    """Build a glue stick that stands with its cap on."""
    h, r = height_m, 0.5 * width * height_m
    top = (1 - cap) * h
    model = Model().add(
        "body", lathe(rounded([(0, 0.01), (0.92 * r, 0.01), (0.92 * r, top + 0.003), (0, top + 0.003)], 0.001))
    )
    model.add("wheel", cylinder(r, 0.012, sides=20)).add(
        "cap", lathe(rounded([(0, top), (r, top), (0.96 * r, h), (0, h)], 0.002)), "cap"
    )
    model.point("cap", "surface", "cap", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("wheel", "surface", "wheel", (0.0, -r, 0.006), (0.0, -1.0, 0.0))


@template("pencil sharpener")
def pencil_sharpener(*, length_m: float, width: float, thick: float) -> Model:
    """Build a wedge sharpener, its hole towards +X."""
    y, z = width * length_m, thick * length_m
    body = prism(
        polygon(
            [
                (-0.5 * length_m, -0.36 * y),
                (0.5 * length_m, -0.5 * y),
                (0.5 * length_m, 0.5 * y),
                (-0.5 * length_m, 0.36 * y),
            ]
        ),
        z,
        radius_m=0.0012,
    )
    cone = cylinder(0.0041, length_m, top_radius_m=0.001).rotate((0, -90, 0)).translate((0.501 * length_m, 0, 0.55 * z))
    model = Model().add("body", body).cut("hole", cone)
    model.add(
        "blade", box(0.8 * length_m, 0.3 * y, 0.0012).translate((-0.05 * length_m, -0.22 * y, z - 0.0006)), "blade"
    )
    return model.point("hole", "hole", "hole", (0.5 * length_m, 0.0, 0.55 * z), (1.0, 0.0, 0.0))


@template("picture frame")
def picture_frame(*, height_m: float, width: float, border: float) -> Model:
    """Build a frame on its stand, facing -Y and leaning back by 12 degrees."""
    x, b, thick = width * height_m, border * height_m, 0.014
    plate = box(x, thick, height_m, radius_m=0.002)
    window = box(x - 2 * b, 0.008, height_m - 2 * b).translate((0, -0.5 * thick, b))
    model = Model().add("frame", plate.rotate((-12, 0, 0)))
    model.cut("picture", window.rotate((-12, 0, 0)), "picture")
    lean = float(np.tan(np.radians(12)))
    leg = np.array([(0, 0.62 * height_m * lean, 0.62 * height_m), (0, 0.42 * height_m, 0.0035)])
    model.add("stand", tube(leg, 0.12 * x, flatten=0.04, across=(1, 0, 0)), "frame")
    y = 0.5 * height_m * lean - 0.5 * thick + 0.004
    return model.point("picture", "face", "picture", (0.0, y, 0.5 * height_m), (0.0, -0.978, 0.208)).rest_on_ground()
