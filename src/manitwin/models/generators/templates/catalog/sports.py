"""Sports equipment: further balls, built about the origin and then placed on the ground; rackets lie with the head to +X."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import box, chords, cylinder, ellipsoid, lathe, rounded, torus, union
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.catalog.balls import finish_ball, sphere
from manitwin.models.generators.templates.catalog.organic import lay_along_x
from manitwin.models.generators.templates.template import Model, template

STRINGS, STRING_M = (18, 16), 0.0014
"""Number of strings across and along a racket's head, and their thickness in metres."""


def _seam(points: np.ndarray, radius_m: float, half_width_m: float) -> Manifold:
    """Return a thin tube through points ``(N, 3)`` projected onto a sphere."""
    line = points * radius_m / np.linalg.norm(points, axis=1)[:, None]
    return tube(line, half_width_m, sides=6, across=tuple(line[0] / radius_m))


def _ring(radius_m: float, half_width_m: float) -> Manifold:
    return torus(radius_m, half_width_m, sides=chords(80))


@template("basketball")
def basketball(*, width_m: float, seam: float, bow: float) -> Model:
    """Build a basketball with its eight seams; ``bow`` is the reach of the curved ones relative to the radius."""
    r, half = 0.5 * width_m, 0.5 * seam * width_m
    model = Model().add("body", sphere(width_m, 64))
    t = np.linspace(-0.5 * np.pi, 1.5 * np.pi, 80, endpoint=False)
    bent = np.column_stack([bow + 0.22 * np.cos(2 * t), np.cos(t), np.sin(t)])
    lines = [_ring(r, half), _ring(r, half).rotate((90, 0, 0))]
    for side in (1.0, -1.0):
        closed = np.vstack([bent, bent[:2]]) * [side, 1, 1]
        lines += [_seam(closed[:42], r, half), _seam(closed[40:], r, half)]
    model.cut("seams", union(lines), "seams")
    return finish_ball(model, width_m)


@template("volleyball")
def volleyball(*, width_m: float, seam: float) -> Model:
    """Build a volleyball with three strips on each of six sides, perpendicular to those of the adjacent sides."""
    r, half = 0.5 * width_m, 0.5 * seam * width_m
    along = np.linspace(-1.0, 1.0, 26)
    lines = [np.column_stack([np.ones(26), along, np.full(26, at)]) for at in (-1.0, -0.33, 0.33, 1.0)]
    turns = (np.eye(3), np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1.0, 0], [0, 0, 1], [1, 0, 0]]))
    seams = [_seam(side * line @ turn.T, r, half) for turn in turns for side in (1.0, -1.0) for line in lines]
    model = Model().add("body", sphere(width_m, 64))
    model.cut("seams", union(seams), "seams")

    def striped(centers: np.ndarray) -> np.ndarray:
        size = np.abs(centers)
        axis = size.argmax(axis=1)
        across = np.take_along_axis(centers, ((axis + 2) % 3)[:, None], axis=1)[:, 0]
        return np.asarray(np.abs(across / size.max(axis=1)) < 0.33)

    model.region("strips", "body", striped, "strips")
    return finish_ball(model, width_m, top="strips", side="strips")


def _curved_seam(width_m: float, half_width_m: float) -> Manifold:
    t, flat = np.linspace(0, 2 * np.pi, 120, endpoint=False), 0.26
    plane = [(1 - flat) * np.cos(t) + flat * np.cos(3 * t), (1 - flat) * np.sin(t) - flat * np.sin(3 * t)]
    line = np.column_stack([*plane, 2 * np.sqrt(flat * (1 - flat)) * np.sin(2 * t)])
    r = 0.5 * width_m
    return _seam(np.vstack([line[:62]]), r, half_width_m) + _seam(np.vstack([line[60:], line[:2]]), r, half_width_m)


@template("softball")
def softball(*, width_m: float, seam_m: float) -> Model:
    """Build a softball with its seam."""
    model = Model().add("body", sphere(width_m, 64)).add("seam", _curved_seam(width_m, seam_m), "seam")
    return finish_ball(model, width_m)


@template("cricket ball")
def cricket_ball(*, width_m: float, seam_m: float) -> Model:
    """Build a cricket ball with its seam of six rows around its horizontal great circle."""
    r = 0.5 * width_m
    model = Model().add("body", sphere(width_m, 64))
    rows = [
        torus(float(np.sqrt(r**2 - z**2)), seam_m, sides=chords(72)).translate((0, 0, z))
        for z in (-0.11 * r, -0.07 * r, -0.025 * r, 0.025 * r, 0.07 * r, 0.11 * r)
    ]
    model.add("seam", union(rows), "seam")
    model.point("top", "surface", "body", (0.0, 0.0, r), (0.0, 0.0, 1.0))
    return model.point("side", "surface", "seam", (0.0, -r, 0.025 * r), (0.0, -1.0, 0.0)).rest_on_ground()


@template("bocce ball")
def bocce_ball(*, width_m: float, rings: float, groove_m: float) -> Model:
    """Build a ball with ``rings`` circular grooves."""
    r, count = 0.5 * width_m, round(rings)
    model = Model().add("body", sphere(width_m, 72))
    heights = (np.arange(count) - 0.5 * (count - 1)) * 0.16 * r
    cuts = [torus(float(np.sqrt(r**2 - z**2)), groove_m, sides=chords(72)).translate((0, 0, float(z))) for z in heights]
    model.cut("grooves", union(cuts).rotate((35, 0, 0)))
    return finish_ball(model, width_m)


@template("steel ball")
def steel_ball(*, width_m: float) -> Model:
    """Build a bearing ball."""
    return finish_ball(Model().add("body", sphere(width_m, 48)), width_m)


@template("kettlebell")
def kettlebell(*, height_m: float, body: float, grip_m: float, foot: float) -> Model:
    """Build a ball with a flat foot and a handle above it along X; ``body`` is the ball's share of the height."""
    ball = body * height_m
    r, t = 0.53 * ball, 0.5 * grip_m
    solid = ellipsoid(2 * r, 2 * r, 2 * r).translate((0, 0, ball - r)) ^ box(4 * r, 4 * r, 2 * ball)
    model = Model().add("body", solid + cylinder(foot * r, 0.5 * ball, top_radius_m=0.9 * r))
    high = height_m - t
    path = arc(
        [
            (-0.5 * r, 0, 0.86 * ball),
            (-0.86 * r, 0, ball + 0.36 * (high - ball)),
            (-0.68 * r, 0, 0.97 * high),
            (0, 0, high),
            (0.68 * r, 0, 0.97 * high),
            (0.86 * r, 0, ball + 0.36 * (high - ball)),
            (0.5 * r, 0, 0.86 * ball),
        ],
        samples=52,
    )
    model.add("handle", tube(path, t, sides=chords(24)), "handle")
    model.region("base", "body", lambda c: c[:, 2] < 0.01 * ball)
    model.point("handle", "surface", "handle", (0.0, 0.0, float(path[:, 2].max()) + t), (0.0, 0.0, 1.0))
    model.point("body", "surface", "body", (0.0, -r, ball - r), (0.0, -1.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)).rest_on_ground()


def _racket(
    length_m: float, head: float, oval: float, frame_m: float, shaft_m: float, grip_m: float, grip: float, throat: bool
) -> Model:
    """Build a racket lying on its face with its head towards +X.

    ``head`` is the head's share of the length, ``oval`` the head's width relative to its length, ``grip`` the handle's share.
    With ``throat`` the shaft is open between two arms.
    """
    long, half_y = head * length_m, 0.5 * oval * head * length_m
    half_x, cx = 0.5 * long, 0.5 * length_m - 0.5 * long
    t = np.linspace(0, 2 * np.pi, 73)
    loop = np.column_stack([cx + (half_x - frame_m) * np.cos(t), (half_y - frame_m) * np.sin(t), 0 * t])
    frame = tube(loop[:38], frame_m, sides=14, across=(0, 0, 1)) + tube(
        np.vstack([loop[36:], loop[1:3]]), frame_m, sides=14, across=(0, 0, 1)
    )
    model = Model().add("head", frame)
    inner_x, inner_y = half_x - frame_m, half_y - frame_m
    bed = cylinder(1.0, STRING_M, sides=chords(64)).scale((inner_x, inner_y, 1)).translate((cx, 0, -0.5 * STRING_M))
    model.add("strings", bed, "strings")
    model.perforate(
        "strings between",
        lambda: _between_strings(inner_x - frame_m, inner_y - frame_m).translate((cx, 0, 0)),
        "strings",
    )
    low, handle = cx - half_x, -0.5 * length_m + grip * length_m
    if throat:
        for side in (1.0, -1.0):
            joint = (cx - 0.86 * half_x, side * 0.46 * half_y, 0)
            arm = arc(
                [
                    joint,
                    (0.45 * low + 0.55 * handle, side * 0.16 * half_y, 0),
                    (handle - 0.02, side * 0.2 * shaft_m, 0),
                ],
                samples=16,
            )
            model.add("shaft", tube(arm, 0.9 * frame_m, sides=14, across=(0, 0, 1)))
    else:
        model.add(
            "shaft", lay_along_x(cylinder(shaft_m, low + 2 * frame_m - handle + 0.02)).translate((handle - 0.02, 0, 0))
        )
    eight = cylinder(grip_m, grip * length_m, sides=8).rotate((0, 0, 22.5))
    butt = cylinder(1.12 * grip_m, 0.012, sides=8).rotate((0, 0, 22.5))
    model.add("handle", lay_along_x(eight + butt).translate((-0.5 * length_m, 0, 0)), "handle")
    model.point("head", "axis", "strings", (cx, 0.0, 0.0), (0.0, 0.0, 1.0))
    model.point("front edge", "tip", "head", (0.5 * length_m, 0.0, 0.0), (1.0, 0.0, 0.0))
    middle = -0.5 * length_m + 0.5 * grip * length_m
    return model.point("handle", "surface", "handle", (middle, 0.0, 0.92 * grip_m), (0.0, 0.0, 1.0)).rest_on_ground()


def _between_strings(half_x_m: float, half_y_m: float) -> Manifold:
    """Return pins through an ellipse of these half axes that leave strings along and across it."""
    x, y = half_x_m / STRINGS[0], half_y_m / STRINGS[1]
    pin = box(2 * x - STRING_M, 2 * y - STRING_M, 0.02).translate((0, 0, -0.01))
    places = [
        (x * (2 * u + 1 - STRINGS[0]), y * (2 * v + 1 - STRINGS[1]))
        for u in range(STRINGS[0])
        for v in range(STRINGS[1])
    ]
    oval = cylinder(1.0, 0.02, sides=chords(64)).scale((half_x_m, half_y_m, 1)).translate((0, 0, -0.01))
    return union([pin.translate((*place, 0)) for place in places]) ^ oval


@template("tennis racket")
def tennis_racket(*, length_m: float, head: float, oval: float, frame_m: float, grip: float) -> Model:
    """Build a tennis racket with an open throat."""
    return _racket(length_m, head, oval, frame_m, 0.03, 0.0165, grip, True)


@template("badminton racket")
def badminton_racket(*, length_m: float, head: float, oval: float, frame_m: float, grip: float) -> Model:
    """Build a badminton racket, its head on a thin shaft."""
    return _racket(length_m, head, oval, frame_m, 0.0037, 0.0125, grip, False)


@template("drum stick")
def drum_stick(*, length_m: float, width_m: float, taper: float, bead: float) -> Model:
    """Build a lying drum stick with its tip towards +X.

    ``taper`` is its neck's width relative to its own, ``bead`` that of the tip.
    """
    r, end = 0.5 * width_m, 0.5 * length_m
    profile = [
        (0.8 * r, -end),
        (r, -end + 0.004),
        (r, 0.2 * length_m),
        (taper * r, end - 0.018),
        (taper * r, end - 0.014),
    ]
    tip = [(0.9 * bead * r, end - 0.01), (bead * r, end - 0.006), (0.75 * bead * r, end - 0.001), (0.3 * bead * r, end)]
    model = Model().add("shaft", lay_along_x(lathe([(0, -end), *profile, (0, end - 0.014)])))
    model.add("tip", lay_along_x(lathe([(0, end - 0.0148), (taper * r, end - 0.0148), *tip, (0, end)])), "tip")
    model.point("tip", "tip", "tip", (end, 0.0, 0.0), (1.0, 0.0, 0.0))
    model.point("shaft", "surface", "shaft", (0.0, 0.0, r), (0.0, 0.0, 1.0))
    return model.point("shaft end", "face", "shaft", (-end, 0.0, 0.0), (-1.0, 0.0, 0.0)).rest_on_ground()


@template("maraca")
def maraca(*, length_m: float, head: float, width: float, grip_m: float) -> Model:
    """Build a lying maraca with its head to +X; ``head`` is the head's share of the length, ``width`` its width over that."""
    long = head * length_m
    r, t, ball = 0.5 * width * long, 0.5 * grip_m, length_m - 0.5 * head * length_m  # along it, from its end
    tilt = float(np.arcsin((r - 1.25 * t) / ball))

    def laid(solid: Manifold) -> Manifold:
        """Move a solid about Z, with the head's centre at the origin, to rest on its head and the end of its handle."""
        return lay_along_x(solid.translate((0, 0, -ball))).rotate((0, float(np.degrees(-tilt)), 0))

    stick = [(0, 0.0), (1.15 * t, 0.0), (1.25 * t, 0.008), (0.85 * t, 0.03), (t, 0.4 * (length_m - long))]
    stick += [(0.8 * t, length_m - long - 0.01), (1.3 * t, length_m - 0.94 * long), (0, length_m - 0.9 * long)]
    model = Model().add("handle", laid(lathe(rounded(stick, 0.004))), "handle")
    model.add("head", laid(ellipsoid(2 * r, 2 * r, long).translate((0, 0, ball))))
    model.add("stripe", laid(torus(r - 0.0016, 0.0022).scale((1, 1, 3.0)).translate((0, 0, ball))), "stripe")
    ahead = (float(np.cos(tilt)), 0.0, float(np.sin(tilt)))
    at = 0.4 * (length_m - long) - ball
    model.point("tip", "tip", "head", (0.5 * long * ahead[0], 0.0, 0.5 * long * ahead[2]), ahead)
    model.point("head", "surface", "stripe", (0.0, -r - 0.0006, 0.0), (0.0, -1.0, 0.0))
    handle = (at * ahead[0] - t * ahead[2], 0.0, at * ahead[2] + t * ahead[0])
    return model.point("handle", "surface", "handle", handle, (-ahead[2], 0.0, ahead[0])).rest_on_ground()
