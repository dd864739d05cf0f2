"""Groceries: eggs, baked goods, cheese, chocolate, potatoes and mushrooms."""

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
    rounded,
    torus,
    union,
)
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.organic import lay_along_x, scale_radially
from manitwin.models.generators.templates.catalog.rings import finish_ring, ring_radii
from manitwin.models.generators.templates.template import Model, template


@template("egg")
def egg(*, length_m: float, width: float, blunt: float) -> Model:
    """Build a lying egg with its pointed end towards +X; ``blunt`` is how much wider the other half is."""
    angle = np.linspace(0, np.pi, 32)
    wide = 0.5 * width * length_m * np.sin(angle) * (1 + 0.5 * blunt * np.cos(angle)) / (1 + 0.06 * blunt**2)
    solid = lathe(np.column_stack([wide, -0.5 * length_m * np.cos(angle)]), sides=chords(48))
    model = Model().add("body", lay_along_x(solid))
    model.region("tip", "body", lambda c: c[:, 0] > 0.42 * length_m)
    at = -0.12 * length_m
    r = 0.5 * width * length_m
    model.point("side", "surface", "body", (at, -r, 0.0), (0.0, -1.0, 0.0))
    return model.point("upper side", "surface", "body", (at, 0.0, r), (0.0, 0.0, 1.0)).rest_on_ground()


@template("potato")
def potato(*, length_m: float, width: float, thick: float, lumps: float) -> Model:
    """Build a lying potato with eyes; ``lumps`` is the deviation from an ellipsoid."""
    x, y, z = length_m, width * length_m, thick * length_m

    def lumped(vertices: np.ndarray) -> np.ndarray:
        u, v, w = (2 * vertices / (x, y, z)).T
        waves = (
            0.4 * np.sin(1.2 * u + 1.3 * v + 0.4)
            + 0.35 * np.cos(4.4 * u + 0.9)
            + 0.5 * np.cos(2.6 * v - 1.7 * w + 1.2 * u)
        )
        swell = 1 + lumps * waves
        return np.asarray(vertices * swell[:, None] + np.column_stack([0 * u, 0.35 * lumps * y * (1 - u**2), 0 * u]))

    solid = ellipsoid(x, y, z, sides=chords(64)).warp_batch(lumped)
    model = Model().add("body", solid)
    low, high = np.array(solid.bounding_box()).reshape(2, 3)
    surface = np.asarray(solid.to_mesh().vert_properties)[:, :3]
    directions = [
        (0.5, -0.5, 0.6),
        (-0.6, -0.4, 0.6),
        (0.1, -0.9, -0.1),
        (-0.15, 0.3, 0.9),
        (0.75, 0.5, 0.4),
        (-0.5, 0.7, 0.3),
    ]
    directions += [(-0.2, -0.7, 0.5), (0.3, 0.1, 0.9), (0.8, -0.3, 0.3), (-0.85, 0.1, 0.2)]
    size = 0.05 * length_m
    for direction in directions:
        at = surface[int((surface @ (np.array(direction) / (x, y, z))).argmax())]
        eye = ellipsoid(size, 0.6 * size, 0.5 * size, sides=chords(12)).translate(1.02 * at)
        model.cut("eyes", eye, "eyes")
    model.region("base", "body", lambda c: c[:, 2] < low[2] + 0.02 * length_m)
    top = surface[int(surface[:, 2].argmax())]
    model.point("top", "surface", "body", (float(top[0]), float(top[1]), float(high[2])), (0.0, 0.0, 1.0))
    return model.rest_on_ground()


@template("mushroom")
def mushroom(*, width_m: float, tall: float, dome: float, stem: float) -> Model:
    """Build a mushroom that stands on its cut stem; ``dome`` is the cap's share of the height."""
    r, h = 0.5 * width_m, tall * width_m
    low, thick = (1 - dome) * h, 0.5 * stem * width_m
    cap = [(0, low + 0.1 * h), (0.75 * r, low + 0.06 * h), (0.9 * r, low), (r, low + 0.1 * dome * h)]
    cap += [(0.96 * r, low + 0.42 * dome * h), (0.75 * r, low + 0.77 * dome * h), (0.4 * r, h * 0.985), (0, h)]
    outline = arc([(x, 0, z) for x, z in cap], samples=36)[:, [0, 2]]
    model = Model().add("body", lathe(outline))
    foot = [
        (0, 0.01 * h),
        (0.9 * thick, 0.0),
        (1.08 * thick, 0.05 * h),
        (0.98 * thick, 0.5 * low),
        (thick, low + 0.2 * h),
    ]
    model.add("stem", lathe(rounded([*foot, (0, low + 0.2 * h)], 0.003)), "stem")
    model.region(
        "gills", "body", lambda c: (c[:, 2] < low + 0.09 * h) & (np.hypot(c[:, 0], c[:, 1]) < 0.86 * r), "gills"
    )
    model.point("top", "surface", "body", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("stem", "surface", "stem", (0.0, -0.98 * thick, 0.5 * low), (0.0, -1.0, 0.0)).rest_on_ground()


@template("donut")
def donut(*, width_m: float, thick: float, hole: float, glaze: float) -> Model:
    """Build a lying donut with glaze and sprinkles; ``glaze`` is how far the glaze reaches down its side."""
    r, h = 0.5 * width_m, thick * width_m
    ring, half = ring_radii(width_m, hole)
    flat = h / (2 * half)
    body = torus(ring, half, sides=chords(60)).scale((1, 1, flat))
    cover = torus(ring, half + 0.0011, sides=chords(60)).scale((1, 1, (0.5 * h + 0.0011) / (half + 0.0011)))
    floor = scale_radially(
        cylinder(0.9 * r, h, sides=chords(72)), lambda angle: 1 + 0.05 * np.sin(7 * angle) + 0.03 * np.sin(4 * angle)
    )
    edge = floor.translate((0, 0, 0.5 * h * (1 - glaze)))
    model = Model().add("body", body).add("glaze", cover ^ edge, "glaze")
    crumbs: list[list[Manifold]] = [[], []]
    for number in range(44):
        a, off = 2 * np.pi * 0.7549 * number, ((0.5698 * number) % 1 - 0.5) * 1.3 * half
        z = 0.5 * h * float(np.sqrt(1 - (off / half) ** 2)) + 0.0006
        tilt = float(np.degrees(np.arctan(0.7 * off / half)))
        crumb = box(0.0046, 0.0014, 0.0014, radius_m=0.0004).rotate((0, 0, 97.0 * number)).rotate((0, tilt, 0))
        crumbs[int(1.618 * number) % 2].append(crumb.translate((ring + off, 0, z)).rotate((0, 0, float(np.degrees(a)))))
    model.add("sprinkles", union(crumbs[0]), "sprinkles").add("more sprinkles", union(crumbs[1]), "more sprinkles")
    return finish_ring(model, width_m, hole, hole_share=0.4)


@template("cookie")
def cookie(*, width_m: float, thick: float, chips: float) -> Model:
    """Build a lying round cookie with chocolate chips; ``chips`` is their width relative to the cookie's."""
    r, h = 0.5 * width_m, thick * width_m
    profile = [(0, 0), (0.93 * r, 0), (r, 0.35 * h), (0.92 * r, 0.7 * h), (0.6 * r, 0.94 * h), (0, h)]
    body = scale_radially(
        lathe(rounded(profile, 0.3 * h)), lambda angle: 1 + 0.012 * np.sin(5 * angle) + 0.01 * np.sin(8 * angle + 1)
    )
    model = Model().add("body", body)
    for number in range(14):
        off, a = 0.88 * r * np.sqrt((number + 0.5) / 14), 2.39996 * number
        z = float(np.interp(off, [0, 0.6 * r, 0.92 * r], [h, 0.94 * h, 0.7 * h]))
        size = chips * width_m * (0.8 + 0.13 * (number % 4))
        chip = ellipsoid(size, 0.85 * size, 0.6 * size, sides=chords(12)).rotate((0, 0, 61.0 * number))
        model.add("chips", chip.translate((off * np.cos(a), off * np.sin(a), z - 0.08 * size)), "chips")
    model.point("front", "surface", "body", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("edge", "surface", "body", (0.0, -r, 0.35 * h), (0.0, -1.0, 0.0))


@template("bread")
def bread(*, length_m: float, width: float, height: float, dome: float) -> Model:
    """Build a tin loaf lying along X with cuts across its crust; ``dome`` is how far the crust bulges over the sides."""
    y, h = 0.5 * width * length_m, height * length_m
    side, out = (1 - 0.5 * dome) * h, (1 + 0.1 * dome) * y
    model = Model().add("body", box(0.96 * length_m, 2 * y, side, radius_m=0.012))
    end = ellipsoid(1.5 * out, 2 * out, 1.0 * dome * h, sides=chords(40))
    reach = 0.5 * length_m - 0.75 * out
    model.add(
        "crust", (end.translate((-reach, 0, 0)) + end.translate((reach, 0, 0))).hull().translate((0, 0, side)), "crust"
    )
    for number in range(4):
        x = (number - 1.5) * 0.2 * length_m
        path = arc(
            [
                (x - 0.05 * length_m, -0.62 * out, h - 0.11 * dome * h),
                (x, 0, h),
                (x + 0.05 * length_m, 0.62 * out, h - 0.11 * dome * h),
            ]
        )
        half = 0.028 * length_m * np.sin(np.linspace(0.12, np.pi - 0.12, len(path)))
        model.cut("cuts", tube(path, half, flatten=0.45, across=(1, 0, 0), sides=8), "cuts")
    model.point("top", "surface", "crust", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("base", "face", "body", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("chocolate bar")
def chocolate_bar(*, length_m: float, width: float, thick_m: float, wrapped: float) -> Model:
    """Build a lying bar of squares with the share ``wrapped`` towards -X in its paper."""
    y = width * length_m
    model = Model().add("body", box(length_m, y, 0.6 * thick_m, radius_m=0.001))
    columns, rows = max(4, round(length_m / 0.026)), max(2, round(y / 0.021))
    a, b = length_m / columns, y / rows
    half_a, half_b = 0.46 * a, 0.46 * b
    corners = [(-half_a, -half_b), (half_a, -half_b), (half_a, half_b), (-half_a, half_b)]
    square = prism(polygon(corners), 0.5 * thick_m, top=0.8)
    places = [((i - 0.5 * (columns - 1)) * a, (j - 0.5 * (rows - 1)) * b) for i in range(columns) for j in range(rows)]
    model.add("body", union([square.translate((px, py, 0.5 * thick_m)) for px, py in places]))
    paper, reach = 0.0006, wrapped * length_m
    sleeve = box(reach + 2 * paper, y + 2 * paper, thick_m + 2 * paper, radius_m=0.0008)
    model.add("wrapper", sleeve.translate((0.5 * (reach - length_m), 0, -paper)), "wrapper")
    foil = box(0.012, y + paper, thick_m + paper, radius_m=0.0005)
    model.add("foil", foil.translate((reach - 0.5 * length_m + 0.004, 0, -0.5 * paper)), "foil")
    at = 0.5 * (reach - length_m)
    model.point("front", "face", "wrapper", (at, 0.0, thick_m + paper), (0.0, 0.0, 1.0))
    return model.point(
        "edge", "surface", "wrapper", (at, -0.5 * y - paper, 0.5 * thick_m), (0.0, -1.0, 0.0)
    ).rest_on_ground()


@template("cheese")
def cheese(*, length_m: float, angle: float, height: float, holes: float) -> Model:
    """Build a lying wedge of a round cheese with its tip towards +X.

    ``angle`` is in rad; ``holes`` is the width of the largest hole relative to the height.
    """
    h, half = height * length_m, 0.5 * angle
    around = np.pi + np.linspace(-half, half, 24)
    rim = [(length_m * np.cos(a), length_m * np.sin(a)) for a in around]
    model = Model().add("body", prism(polygon([(0, 0), *rim]), h))
    outer = [(1.012 * x, 1.012 * y) for x, y in rim]
    model.add("rind", prism(polygon([*outer, *[(0.99 * x, 0.99 * y) for x, y in rim[::-1]]]), h), "rind")
    spots = [
        (0.35, 0.4, 0.8),
        (0.62, 0.68, 1.0),
        (0.8, 0.25, 0.75),
        (0.52, 0.12, 0.55),
        (0.86, 0.82, 0.6),
        (0.24, 0.84, 0.5),
    ]
    for side in (-1, 1):
        for along, up, size in spots:
            r = 0.5 * holes * h * size
            reach = along if side < 0 else 1.05 - 0.9 * along
            x, y = -reach * length_m * np.cos(half), side * reach * length_m * np.sin(half)
            model.cut("holes", ellipsoid(2 * r, 2 * r, 2 * r, sides=chords(24)).translate((x, y, up * h)))
    for x, y, size in ((-0.55, 0.06, 0.9), (-0.8, -0.14, 1.0), (-0.75, 0.2, 0.6)):
        r = 0.5 * holes * h * size
        model.cut(
            "holes", ellipsoid(2 * r, 2 * r, 1.2 * r, sides=chords(24)).translate((x * length_m, y * length_m, h))
        )
    model.region("top", "body", lambda c: c[:, 2] > 0.999 * h)
    model.point("top", "face", "top", (-0.4 * length_m, 0.0, h), (0.0, 0.0, 1.0))
    return model.point("tip", "edge", "body", (0.0, 0.0, 0.5 * h), (1.0, 0.0, 0.0))
