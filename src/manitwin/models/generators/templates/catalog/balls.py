"""Balls, built about the origin and then placed on the ground, with a distinctive mark up or to the front."""

from __future__ import annotations

import numpy as np
from manifold3d import CrossSection, Manifold

from manitwin.geometry.solids.shapes import chords, cylinder, ellipsoid, lathe, union
from manitwin.geometry.solids.sweep import tube
from manitwin.models.generators.templates.template import Model, template


def sphere(width_m: float, sides: int = 56) -> Manifold:
    return ellipsoid(width_m, width_m, width_m, sides=chords(sides))


def finish_ball(model: Model, width_m: float, top: str = "body", side: str = "body") -> Model:
    """Add points on the top and the side of a ball about the origin, and place it on the ground."""
    r = 0.5 * width_m
    model.point("top", "surface", top, (0.0, 0.0, r), (0.0, 0.0, 1.0))
    return model.point("side", "surface", side, (0.0, -r, 0.0), (0.0, -1.0, 0.0)).rest_on_ground()


@template("ball")
def ball(*, width_m: float, stripe: float) -> Model:
    """Build a ball with a stripe around it; ``stripe`` is the stripe's height relative to the ball's."""
    r, edge = 0.5 * width_m, np.arcsin(stripe)
    below, above = np.linspace(-0.5 * np.pi, -edge, 12), np.linspace(edge, 0.5 * np.pi, 12)
    angles = np.concatenate([below, np.linspace(-edge, edge, 7)[1:-1], above])
    model = Model().add("body", lathe(np.column_stack([r * np.cos(angles), r * np.sin(angles)])))
    model.region("stripe", "body", lambda c: np.abs(c[:, 2]) < stripe * r, "stripe")
    return finish_ball(model, width_m, side="stripe")


@template("baseball")
def baseball(*, width_m: float, seam_m: float) -> Model:
    """Build a baseball with its seam and stitches."""
    r, t = 0.5 * width_m, np.linspace(0, 2 * np.pi, 160, endpoint=False)
    flat = 0.26
    curve = [(1 - flat) * np.cos(t) + flat * np.cos(3 * t), (1 - flat) * np.sin(t) - flat * np.sin(3 * t)]
    line = np.column_stack([*curve, 2 * np.sqrt(flat * (1 - flat)) * np.sin(2 * t)])
    line *= (r - 0.3 * seam_m) / np.linalg.norm(line, axis=1)[:, None]
    halves = [line[:82], np.concatenate([line[80:], line[:2]])]  # a self-intersecting tube is no solid
    seam = union([tube(half, seam_m, sides=8, across=(0, 0, 1)) for half in halves])
    model = Model().add("body", sphere(width_m, 64)).add("seam", seam, "seam")
    stitches = []
    for at in range(1, 160, 4):
        here, on = line[at], line[(at + 1) % 160] - line[at - 1]
        out, on = here / np.linalg.norm(here), on / np.linalg.norm(on)
        for side in (-1, 1):
            end = here + 0.065 * r * side * np.cross(out, on) + 0.05 * r * on
            path = here + np.linspace(0.0, 1.0, 4)[:, None] * (end - here)
            path *= (r - 0.25 * seam_m) / np.linalg.norm(path, axis=1)[:, None]
            stitches.append(tube(path, 0.65 * seam_m, sides=6, across=tuple(out)))
    model.add("seam", union(stitches), "seam")
    return finish_ball(model, width_m)


def _icosahedron_corners() -> np.ndarray:
    """Return the corners ``(12, 3)`` of an icosahedron on the unit sphere, one of them at the top."""
    around = np.arange(5) * 2 * np.pi / 5
    z, ring = 1 / np.sqrt(5), 2 / np.sqrt(5)
    upper = np.column_stack([ring * np.cos(around), ring * np.sin(around), np.full(5, z)])
    return np.concatenate([[(0, 0, 1)], upper, -upper, [(0, 0, -1)]])


@template("soccer ball")
def soccer_ball(*, width_m: float, patch: float) -> Model:
    """Build a soccer ball with twelve pentagons and seams; ``patch`` is a pentagon's radius relative to a regular one."""
    r, corners = 0.5 * width_m, _icosahedron_corners()
    pentagons, seams = [], []
    for a, corner in enumerate(corners):
        near = [b for b in range(12) if 0.3 < corners[b] @ corner < 0.9]
        toward = [corner + patch / 3 * (corners[b] - corner) for b in near]
        cone = Manifold.hull_points(np.array([np.zeros(3), *[1.4 * r * each for each in toward]]))
        pentagons.append(cone)
        for b in near:
            if b > a:
                ends = corner + np.linspace(patch / 3, 1 - patch / 3, 8)[:, None] * (corners[b] - corner)
                path = r * ends / np.linalg.norm(ends, axis=1)[:, None]
                seams.append(tube(path, 0.006 * width_m, sides=6))
    model = Model().add("body", sphere(width_m, 72))
    model.add("pentagons", sphere(1.003 * width_m, 72) ^ union(pentagons), "pentagons")
    model.cut("seams", union(seams), "pentagons")
    return finish_ball(model, 1.003 * width_m, top="pentagons")


@template("golf ball")
def golf_ball(*, width_m: float, dimple: float) -> Model:
    """Build a golf ball; ``dimple`` is a dimple's width relative to the ball's."""
    r, count = 0.5 * width_m, 150
    number = np.arange(count) + 0.5
    z, angle = 1 - 2 * number / count, 2.39996 * number
    places = np.column_stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z])
    half = 0.5 * dimple * width_m
    at_m = float(np.sqrt(r**2 - half**2) + 0.75 * half)
    dent = sphere(2 * 1.25 * half, 20)
    depth = r - (at_m - 1.25 * half)
    dents = union([dent.translate(at_m * place) for place in places])
    model = Model().add("body", sphere(width_m, 72)).cut("dimples", dents)
    top, side = int((places @ (0, 0, 1.0)).argmax()), int((places @ (0, -1.0, 0)).argmax())
    for label, at in (("top", top), ("side", side)):
        x, y, up = (float(v) for v in places[at])
        model.point(label, "surface", "dimples", ((r - depth) * x, (r - depth) * y, (r - depth) * up), (x, y, up))
    return model.rest_on_ground()


@template("table tennis ball")
def table_tennis_ball(*, width_m: float, seam: float) -> Model:
    """Build a table tennis ball with the seam of its halves around it."""
    r, half = 0.5 * width_m, 0.5 * seam * width_m
    model = Model().add("body", sphere(width_m))
    model.add(
        "seam", lathe([(0, -half), (r + 0.00008, -half), (r + 0.00008, half), (0, half)], sides=chords(56)), "seam"
    )
    return finish_ball(model, width_m)


@template("marble")
def marble(*, width_m: float, twist: float) -> Model:
    """Build a marble with coloured bands; ``twist`` is their rotation from the lower to the upper end, in turns."""
    r = 0.5 * width_m
    star = CrossSection([np.array([(0, 0), (1.2 * r, -0.16 * r), (1.2 * r, 0.16 * r)])])
    star = star + star.rotate(120) + star.rotate(240)
    bands = star.extrude(2.1 * r, 120, 360 * twist).translate((0, 0, -1.05 * r)) ^ sphere(1.006 * width_m, 64)
    model = Model().add("body", sphere(width_m, 64)).add("bands", bands, "bands")
    model.region("top", "body", lambda c: c[:, 2] > 0.9 * r)
    r *= 1.006
    model.point("top", "surface", "bands", (0.0, 0.0, r), (0.0, 0.0, 1.0))
    return model.point("side", "surface", "body", (0.0, -r, 0.0), (0.0, -1.0, 0.0)).rest_on_ground()


@template("billiard ball")
def billiard_ball(*, width_m: float, spot: float) -> Model:
    """Build a billiard ball with a white spot at front and back; ``spot`` is its width relative to the ball's."""
    drum = cylinder(0.5 * spot * width_m, 2 * width_m).translate((0, 0, -width_m)).rotate((90, 0, 0))
    model = Model().add("body", sphere(width_m, 64)).add("spot", sphere(1.002 * width_m, 64) ^ drum, "spot")
    return finish_ball(model, width_m, side="spot")


@template("bowling ball")
def bowling_ball(*, width_m: float, hole: float, span: float) -> Model:
    """Build a bowling ball with its holes near the top.

    ``hole`` is a hole's width and ``span`` the arc length from fingers to thumb, both relative to the ball's width.
    """
    r, radius_m = 0.5 * width_m, 0.5 * hole * width_m
    drill = cylinder(radius_m, r).translate((0, 0, 0.55 * r))
    apart, away = np.degrees(1.3 * hole), np.degrees(span)
    finger = drill.rotate((0, away, 0))
    holes = union([finger.rotate((0, 0, apart / np.sin(span))), finger.rotate((0, 0, -apart / np.sin(span)))])
    thumb = drill.rotate((0, -away, 0))
    model = Model().add("body", sphere(width_m, 72)).cut("holes", holes + thumb, "holes")
    return finish_ball(model, width_m)


@template("beach ball")
def beach_ball(*, width_m: float, cap: float) -> Model:
    """Build a beach ball of six strips, alternately coloured, that end at discs; ``cap`` is a disc's relative width."""
    r = 0.5 * width_m

    def is_coloured(centers: np.ndarray) -> np.ndarray:
        sector = np.floor(np.degrees(np.arctan2(centers[:, 1], centers[:, 0])) / 60)
        return np.asarray((sector % 2 == 1) & (np.hypot(centers[:, 0], centers[:, 1]) > cap * r))

    model = Model().add("body", sphere(width_m, 72))
    model.region("stripes", "body", is_coloured, "stripes")
    return finish_ball(model, width_m)
