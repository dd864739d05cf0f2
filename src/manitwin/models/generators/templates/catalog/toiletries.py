"""Personal care items and accessories."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import box, cylinder, ellipsoid, lathe, polygon, prism, rectangle, rounded, torus
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.template import Model, template


@template("toothbrush")
def toothbrush(*, length_m: float, head: float, thick_m: float) -> Model:
    """Build a lying toothbrush with its bristles up and its head towards +X."""
    end, long = 0.5 * length_m, head * length_m
    x = np.linspace(-end, end, 40)
    half = np.interp(
        x,
        [-end, -0.4 * length_m, -0.1 * length_m, end - 1.5 * long, end - 1.1 * long, end - 0.9 * long, end - 0.01, end],
        np.array([0.3, 0.55, 0.6, 0.32, 0.3, 0.52, 0.5, 0.2]) * thick_m,
    )
    model = Model().add("handle", tube(np.stack([x, 0 * x, 0 * x], 1), half, flatten=0.55))
    tuft = box(0.9 * long, 0.8 * thick_m, 0.0125, radius_m=0.001).translate((end - 0.5 * long - 0.002, 0, 0))
    model.add("bristles", tuft, "bristles").region("head", "handle", lambda centers: centers[:, 0] > end - 1.05 * long)
    model.point("bristles", "face", "bristles", (end - 0.5 * long - 0.002, 0.0, 0.0125), (0.0, 0.0, 1.0))
    return model.point(
        "handle", "surface", "handle", (-0.25 * length_m, 0.0, 0.31 * thick_m), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("soap")
def soap(*, length_m: float, width: float, thick: float) -> Model:
    """Build a bar of soap."""
    high = thick * length_m
    model = Model().add("body", box(length_m, width * length_m, high, radius_m=0.45 * high))
    return model.point("top", "face", "body", (0.0, 0.0, high), (0.0, 0.0, 1.0))


@template("comb")
def comb(*, length_m: float, width_m: float, thick_m: float, spine: float) -> Model:
    """Build a comb whose teeth point to -Y."""
    body = prism(rectangle(length_m, width_m, radius_m=0.006), thick_m)
    count = int(0.9 * length_m / 0.004)
    for number in range(count):
        x = (number - 0.5 * (count - 1)) * 0.004
        body = body - box(0.0019, (1 - spine) * width_m + 0.002, 0.02).translate(
            (x, -0.5 * width_m + 0.5 * (1 - spine) * width_m - 0.001, -0.005)
        )
    model = (
        Model()
        .add("spine", body)
        .region("teeth", "spine", lambda centers: centers[:, 1] < (0.5 - spine) * width_m - 0.0003)
    )
    model.point(
        "teeth", "edge", "teeth", (0.5 * 0.004 * (count % 2 == 1), -0.5 * width_m, 0.5 * thick_m), (0.0, -1.0, 0.0)
    )
    return model.point("spine", "surface", "spine", (0.0, 0.5 * width_m, 0.5 * thick_m), (0.0, 1.0, 0.0))


@template("hairbrush")
def hairbrush(*, length_m: float, head: float, width_m: float) -> Model:
    """Build a lying paddle brush with its bristles up."""
    long, end = head * length_m, 0.5 * length_m
    at = end - 0.5 * long
    paddle = cylinder(0.5, 0.014).scale((long, width_m, 1)).translate((at, 0, 0))
    x = np.linspace(-end, end - long + 0.02, 24)
    half = np.interp(np.linspace(0, 1, 24), [0, 0.04, 0.3, 0.8, 1], [0.006, 0.01, 0.0135, 0.01, 0.012])
    model = Model().add("back", paddle).add("handle", tube(np.stack([x, 0 * x, 0 * x + 0.007], 1), half, flatten=0.62))
    model.add("pad", ellipsoid(0.84 * long, 0.8 * width_m, 0.012).translate((at, 0, 0.0135)), "pad")
    for row in np.linspace(-0.7, 0.7, 7):
        for column in np.linspace(-0.7, 0.7, 5):
            if row**2 + column**2 < 0.65:
                pin = cylinder(0.0014, 0.018, sides=6).translate(
                    (at + 0.4 * long * row, 0.38 * width_m * column, 0.012)
                )
                model.add("bristles", pin, "bristles")
    model.point("bristles", "face", "bristles", (at, 0.0, 0.03), (0.0, 0.0, 1.0))
    return model.point("handle", "surface", "handle", (-0.3 * length_m, 0.0, 0.0155), (0.0, 0.0, 1.0)).rest_on_ground()


@template("razor")
def razor(*, length_m: float, head_m: float, thick_m: float) -> Model:
    """Build a lying razor with its blades up and its head towards +X."""
    end = 0.5 * length_m
    path = arc([(-end, 0, 0), (0, 0, 0.003), (end - 0.03, 0, 0.0), (end - 0.008, 0, -0.002)])
    half = np.interp(
        np.linspace(0, 1, len(path)), [0, 0.05, 0.4, 0.8, 1], np.array([0.35, 0.5, 0.55, 0.38, 0.45]) * thick_m
    )
    model = Model().add("handle", tube(path, half, flatten=0.7))
    model.add("head", box(0.022, head_m, 0.009, radius_m=0.002).translate((end - 0.011, 0, -0.004)), "head")
    for number in range(3):
        model.add(
            "blades", box(0.0012, 0.88 * head_m, 0.002).translate((end - 0.017 + 0.004 * number, 0, 0.0042)), "blades"
        )
    model.point("blades", "edge", "blades", (end - 0.013, 0.0, 0.0062), (0.0, 0.0, 1.0))
    return model.point("handle", "surface", "handle", (-0.2 * length_m, 0.0, 0.006), (0.0, 0.0, 1.0)).rest_on_ground()


@template("tissue box")
def tissue_box(*, length_m: float, width: float, height_m: float) -> Model:
    """Build a box with a slot from which a tissue protrudes."""
    across = width * length_m
    model = Model().add("body", box(length_m, across, height_m, radius_m=0.001))
    sheet = polygon(
        [
            (-0.3 * length_m, -0.01),
            (0.3 * length_m, -0.01),
            (0.2 * length_m, 0.05),
            (0.02 * length_m, 0.032),
            (-0.16 * length_m, 0.056),
        ]
    )
    model.add("tissue", prism(sheet, 0.006).rotate((90, 0, 0)).translate((0, 0.003, height_m)), "tissue")
    return model.point("tissue", "tip", "tissue", (-0.16 * length_m, 0.0, height_m + 0.056), (0.0, 0.0, 1.0))


@template("hand mirror")
def hand_mirror(*, length_m: float, glass: float, thick_m: float) -> Model:
    """Build a lying mirror with its glass up and its handle towards -X."""
    radius = 0.5 * glass * length_m
    at = 0.5 * length_m - radius
    x = np.linspace(at - 0.9 * radius, -0.5 * length_m, 20)
    half = np.interp(np.linspace(0, 1, 20), [0, 0.3, 0.8, 0.96, 1], [0.016, 0.009, 0.013, 0.011, 0.005])
    model = Model().add("frame", cylinder(radius, thick_m).translate((at, 0, 0)))
    model.add("handle", tube(np.stack([x, 0 * x, 0 * x + 0.5 * thick_m], 1), half, flatten=0.48))
    model.cut("rim", cylinder(0.88 * radius, thick_m).translate((at, 0, thick_m - 0.0025)))
    model.add("glass", cylinder(0.89 * radius, 0.002).translate((at, 0, thick_m - 0.004)), "glass")
    model.point("glass", "face", "glass", (at, 0.0, thick_m - 0.002), (0.0, 0.0, 1.0))
    return model.point(
        "handle", "surface", "handle", (-0.35 * length_m, 0.0, 0.9 * thick_m), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("toothpaste")
def toothpaste(*, length_m: float, width_m: float, cap_m: float) -> Model:
    """Build a tube with its flat end towards -X and its cap towards +X."""
    x = np.linspace(-0.5 * length_m, 0.5 * length_m - cap_m, 24)
    share = np.linspace(0, 1, 24)
    round_m = 0.36 * width_m
    half_z = np.interp(share, [0, 0.04, 0.8, 1], [0.0012, 0.002, round_m, round_m])
    half_y = np.interp(share, [0, 0.8, 1], [0.5 * width_m, 0.42 * width_m, round_m])
    slices = [
        cylinder(1.0, 1e-4, sides=24).scale((half_z[i], half_y[i], 1)).rotate((0, 90, 0)).translate((x[i], 0, 0))
        for i in (0, 1, 10, 19)
    ]
    slices += [
        cylinder(1.0, 1e-4, sides=24).scale((half_z[-1], half_y[-1], 1)).rotate((0, 90, 0)).translate((x[-1], 0, 0))
    ]
    model = Model().add("tube", Manifold.batch_hull(slices))
    model.add(
        "cap",
        cylinder(0.8 * round_m, cap_m + 0.004, sides=20).rotate((0, 90, 0)).translate((x[-1] - 0.004, 0, 0)),
        "cap",
    )
    model.point("cap", "surface", "cap", (0.5 * length_m, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "tube", "surface", "tube", (0.0, 0.0, float(np.interp(0.55, share, half_z))), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("ring")
def ring(*, width_m: float, thick_m: float, stone_m: float) -> Model:
    """Build a lying ring with a stone towards +X."""
    model = Model().add("band", torus(0.5 * (width_m - thick_m), 0.5 * thick_m))
    gem = cylinder(0.5 * stone_m, 0.4 * stone_m, top_radius_m=0.35 * stone_m, sides=8).rotate((0, 90, 0))
    model.add("stone", gem.translate((0.5 * width_m - 0.3 * thick_m, 0, 0)), "stone")
    model.point("hole", "hole", "band", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    return model.point(
        "stone", "surface", "stone", (0.5 * width_m - 0.3 * thick_m + 0.4 * stone_m, 0.0, 0.0), (1.0, 0.0, 0.0)
    ).rest_on_ground()


@template("bracelet")
def bracelet(*, width_m: float, thick_m: float, broad: float) -> Model:
    """Build a lying closed bangle; ``broad`` is its breadth relative to its thickness."""
    band = torus(0.5 * (width_m - thick_m), 0.5 * thick_m).scale((1, 1, broad))
    model = Model().add("band", band)
    return model.point("hole", "hole", "band", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)).rest_on_ground()


@template("dental floss")
def dental_floss(*, length_m: float, width: float, thick: float) -> Model:
    """Build a box of floss lying on its side with its lid towards +X."""
    across, high = width * length_m, thick * length_m
    body = prism(rectangle(length_m, across, radius_m=0.3 * across), high, radius_m=0.003)
    model = Model().add("body", body).region("lid", "body", lambda centers: centers[:, 0] > 0.25 * length_m, "lid")
    return model.point("lid", "surface", "body", (0.0, 0.0, high), (0.0, 0.0, 1.0))


@template("umbrella")
def umbrella(*, length_m: float, width_m: float, grip: float) -> Model:
    """Build a folded pocket umbrella lying along X with its grip towards -X."""
    end, r = 0.5 * length_m, 0.5 * width_m
    start = -end + grip * length_m
    cover = lathe(
        rounded(
            [
                (0, start - 0.002),
                (0.8 * r, start - 0.002),
                (r, start + 0.05),
                (0.9 * r, end - 0.02),
                (0.4 * r, end - 0.006),
                (0, end - 0.006),
            ],
            0.01,
        )
    )
    model = Model().add("cover", cover.rotate((0, 90, 0)))
    model.add(
        "handle",
        lathe(
            rounded([(0, -end), (0.62 * r, -end), (0.7 * r, start - 0.01), (0.5 * r, start), (0, start)], 0.006)
        ).rotate((0, 90, 0)),
        "handle",
    )
    model.add("tip", cylinder(0.004, 0.01).rotate((0, 90, 0)).translate((end - 0.01, 0, 0)), "handle")
    model.point("tip", "tip", "tip", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    return model.point(
        "handle", "surface", "handle", (0.5 * (start - end), 0.0, 0.67 * r), (0.0, 0.0, 1.0)
    ).rest_on_ground()


@template("nail clipper")
def nail_clipper(*, length_m: float, width: float, thick_m: float, lever: float) -> Model:
    """Build a closed nail clipper lying on its lower bar, with its jaws to +X and the folded lever to -X.

    ``lever`` is the lever's length relative to the whole.
    """
    n, end, y = length_m, 0.5 * length_m, width * length_m
    gap = 0.0031
    plan = [
        (-end, -0.36 * y),
        (-0.3 * end, -0.42 * y),
        (0.55 * end, -0.5 * y),
        (0.86 * end, -0.5 * y),
        (end, -0.46 * y),
    ]
    plan += [(x, -wide) for x, wide in reversed(plan)]
    within = prism(polygon(plan, radius_m=0.0016), 0.1).translate((0, 0, -0.05))
    low = [
        (-0.96 * end, 0, 0.0003),
        (-0.5 * end, 0, 0.6 * gap),
        (0.2 * end, 0, gap),
        (0.76 * end, 0, 0.95 * gap),
        (0.985 * end, 0, 0.0012),
    ]
    inner = [*((float(x), float(z)) for x, _, z in arc(low, samples=22)), (end, 0.0)]
    rise = [
        (-end, 0, thick_m),
        (-0.5 * end, 0, 0.6 * gap + thick_m),
        (0.2 * end, 0, gap + thick_m),
        (0.76 * end, 0, 0.95 * gap + thick_m),
    ]
    outer = [*((float(x), float(z)) for x, _, z in arc([*rise, (end, 0, 0.0016)], samples=22)[::-1]), (-end, 0.0)]
    arm = prism(polygon([*inner, *outer]), 2 * y).rotate((90, 0, 0)).translate((0, y, 0)) ^ within
    model = Model().add("body", arm).add("body", arm.mirror((0, 0, 1)))
    model.region("jaws", "body", lambda centers: centers[:, 0] > 0.8 * end)
    top = gap + thick_m
    pin = 0.56 * end
    model.add("pin", cylinder(0.0021, 2 * top + 0.0052, sides=24).translate((pin, 0, -top - 0.0012)), "pin")
    model.add(
        "pin",
        lathe([(0, 0), (0.0034, 0), (0.0034, 0.0008), (0.0022, 0.0016), (0, 0.0016)], sides=24).translate(
            (pin, 0, -top - 0.0012)
        ),
        "pin",
    )
    start = pin + 0.07 * n
    back = start - lever * n
    bend = [
        (start, 0, top + 0.0018),
        (pin, 0, top + 0.0024),
        (pin - 0.16 * n, 0, top + 0.0012),
        (0.45 * back + 0.55 * pin, 0, top + 0.0006),
    ]
    curve = arc(
        [*bend, (back + 0.14 * n, 0, 0.62 * gap + thick_m + 0.0016), (back, 0, 0.5 * gap + thick_m + 0.004)], samples=26
    )
    bar = [(float(x), float(z) + 0.0009) for x, _, z in curve] + [
        (float(x), float(z) - 0.0009) for x, _, z in curve[::-1]
    ]
    tongue = [
        (back, -0.3 * y),
        (back + 0.1 * n, -0.4 * y),
        (pin - 0.1 * n, -0.36 * y),
        (pin, -0.26 * y),
        (start, -0.24 * y),
    ]
    tongue += [(x, -wide) for x, wide in reversed(tongue)]
    flat = prism(polygon(bar), 2 * y).rotate((90, 0, 0)).translate((0, y, 0))
    model.add("lever", flat ^ prism(polygon(tongue, radius_m=0.0012), 0.1).translate((0, 0, -0.05)), "lever")
    model.cut("hole", cylinder(0.0016, 0.1, sides=24).translate((-end + 0.0045, 0, -0.05)))
    model.point("jaws", "edge", "jaws", (end, 0.0, 0.0006), (1.0, 0.0, 0.0))
    at = curve[19]
    return model.point(
        "lever", "surface", "lever", (float(at[0]), 0.0, float(at[2]) + 0.0009), (0.0, 0.0, 1.0)
    ).rest_on_ground()
