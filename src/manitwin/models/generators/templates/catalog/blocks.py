"""Blocks to stack and build with: cubes, wooden blocks, toy bricks."""

from __future__ import annotations

from itertools import product

from manitwin.geometry.solids.shapes import box, chords, cylinder, lathe, rounded, union
from manitwin.models.generators.templates.standard_sizes import BRICK_GAP_M, STUD_PITCH_M
from manitwin.models.generators.templates.template import Model, template


@template("cube")
def cube(*, width_m: float, edge: float) -> Model:
    """Build a cube; ``edge`` is the radius of its edges relative to its width."""
    return _block(width_m, width_m, width_m, edge * width_m)


@template("wood block")
def wood_block(*, length_m: float, width: float, thick: float, edge: float) -> Model:
    """Build a block lying on its largest face, with its length along X; ``edge`` is the edge radius relative to the thickness."""
    return _block(length_m, width * length_m, thick * width * length_m, edge * thick * width * length_m)


def _block(x_m: float, y_m: float, z_m: float, radius_m: float) -> Model:
    model = Model().add("body", box(x_m, y_m, z_m, radius_m=radius_m))
    model.region("top", "body", lambda centers: centers[:, 2] > z_m - 1e-6)
    model.region("base", "body", lambda centers: centers[:, 2] < 1e-6)
    model.point("top", "face", "top", (0.0, 0.0, z_m), (0.0, 0.0, 1.0))
    model.point("side", "face", "body", (0.0, -0.5 * y_m, 0.5 * z_m), (0.0, -1.0, 0.0))
    return model.point("base", "face", "base", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


@template("building block")
def building_block(*, length_m: float, height: float, wall_m: float) -> Model:
    """Build a brick with two rows of four studs, hollow from below.

    Its sides are smaller than its grid places by 1/40 of the pitch.
    """
    pitch = length_m * STUD_PITCH_M / (4 * STUD_PITCH_M - BRICK_GAP_M)
    y, h = pitch * (2 - BRICK_GAP_M / STUD_PITCH_M), height * length_m
    stud, raised = 0.3 * pitch, 0.22 * pitch
    model = Model().add("body", box(length_m, y, h, radius_m=0.0003))
    model.cut("inside", box(length_m - 2 * wall_m, y - 2 * wall_m, h).translate((0, 0, -wall_m)))
    tubes = [cylinder(0.41 * pitch, h - 0.5 * wall_m).translate((i * pitch, 0, 0)) for i in (-1, 0, 1)]
    model.add("tubes", union(tubes))
    bores = [cylinder(0.3 * pitch, h - wall_m + 0.001).translate((i * pitch, 0, -0.001)) for i in (-1, 0, 1)]
    model.cut("tubes", union(bores))
    top = lathe(rounded([(0, 0), (stud, 0), (stud, raised + 0.001), (0, raised + 0.001)], 0.0003), sides=chords(32))
    places = product((-1.5, -0.5, 0.5, 1.5), (-0.5, 0.5))
    model.add("studs", union([top.translate((i * pitch, j * pitch, h - 0.001)) for i, j in places]))
    model.point("top", "surface", "studs", (0.5 * pitch, 0.5 * pitch, h + raised), (0.0, 0.0, 1.0))
    model.point("side", "face", "body", (0.0, -0.5 * y, 0.5 * h), (0.0, -1.0, 0.0))
    return model.point("base", "opening", "inside", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
