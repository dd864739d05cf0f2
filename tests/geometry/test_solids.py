"""Constructed solids against their closed forms, and parts that keep their names through every step."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from manitwin.geometry.solids.parts import Assembly, PartedMesh
from manitwin.geometry.solids.shapes import (
    SIDES,
    SolidError,
    box,
    cylinder,
    ellipsoid,
    lathe,
    polygon,
    prism,
    rectangle,
    rounded,
    torus,
)
from manitwin.geometry.solids.sweep import arc, sweep, tube

CIRCLE = SIDES / (2 * np.pi) * np.sin(2 * np.pi / SIDES)
"""The area of the polygon that stands for a circle, over the circle's."""


def as_trimesh(mesh: PartedMesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def size_of(solid: Manifold) -> np.ndarray:
    low_x, low_y, low_z, high_x, high_y, high_z = solid.bounding_box()
    return np.array([high_x - low_x, high_y - low_y, high_z - low_z])


@pytest.mark.parametrize(
    ("solid", "volume_m3"),
    [
        (box(0.1, 0.2, 0.3), 0.006),
        (cylinder(0.05, 0.2), np.pi * 0.05**2 * 0.2 * CIRCLE),
        (cylinder(0.05, 0.2, top_radius_m=0.0), np.pi * 0.05**2 * 0.2 / 3 * CIRCLE),
        (lathe([(0.03, 0), (0.05, 0), (0.05, 0.1), (0.03, 0.1)]), np.pi * 0.05**2 * 0.1 * CIRCLE),
        (prism(rectangle(0.1, 0.05), 0.02), 1e-4),
        (torus(0.1, 0.02), 2 * np.pi**2 * 0.1 * 0.02**2 * CIRCLE * 8 / np.pi * np.sin(np.pi / 8)),
        (tube(np.array([(0, 0, 0), (0, 0, 0.3)]), 0.01, sides=64), np.pi * 0.01**2 * 0.3),
        (sweep(np.array([(0, 0, 0), (0.1, 0, 0)]), np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]), 0.01), 4e-5),
    ],
)
def test_volume_is_that_of_the_closed_form(solid: Manifold, volume_m3: float) -> None:
    assert solid.volume() == pytest.approx(volume_m3, rel=3e-3)


def test_rounded_box_has_its_extents_and_loses_its_edges() -> None:
    r = 0.01
    solid = box(0.1, 0.06, 0.04, radius_m=r)
    assert size_of(solid) == pytest.approx([0.1, 0.06, 0.04])
    x, y, z = 0.08, 0.04, 0.02
    exact = x * y * z + 2 * r * (x * y + y * z + z * x) + np.pi * r**2 * (x + y + z) + 4 / 3 * np.pi * r**3
    assert solid.volume() == pytest.approx(exact, rel=0.01)


def test_rounded_prism_is_one_solid_between_its_sharp_and_its_inset_one() -> None:
    outline = polygon([(0, 0), (0.1, 0), (0.1, 0.04), (0.05, 0.02), (0, 0.04)], radius_m=0.003)
    solid = prism(outline, 0.02, radius_m=0.004)
    assert len(solid.decompose()) == 1 and size_of(solid)[2] == pytest.approx(0.02)
    assert outline.offset(-0.004).area() * 0.02 < solid.volume() < outline.area() * 0.02


def test_rounding_a_profile_keeps_its_ends_and_stays_inside_its_corners() -> None:
    curve = np.array(rounded([(0.0, 0.0), (0.05, 0.0), (0.05, 0.1)], 0.02))
    assert curve[0].tolist() == [0.0, 0.0] and curve[-1].tolist() == [0.05, 0.1]
    assert (curve[:, 0] <= 0.05).all() and (curve[:, 1] >= 0.0).all()
    assert np.linalg.norm(curve - [0.05, 0.0], axis=1).min() > 0.005


def test_curve_goes_through_its_points_in_equal_steps() -> None:
    points = [(0.0, 0.0, 0.0), (0.05, 0.0, 0.04), (0.0, 0.0, 0.08)]
    curve = arc(points, samples=41)
    steps = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    assert steps.max() < 1.05 * steps.min()
    assert all(np.linalg.norm(curve - point, axis=1).min() < 0.5 * steps.max() for point in points)


def test_swept_section_does_not_twist_along_a_planar_curve() -> None:
    flat = tube(arc([(0, 0, 0), (0.05, 0, 0.05), (0.1, 0, 0)]), 0.01, flatten=0.1)
    assert size_of(flat)[1] == pytest.approx(0.02, rel=1e-3), "its broad side stays across the plane of the curve"


@pytest.mark.parametrize(
    "make",
    [
        lambda: box(0.1, 0.1, 0.0),
        lambda: lathe([(0.0, 0.0), (0.0, 0.1), (0.0, 0.2)]),
        lambda: tube(np.array([(0, 0, 0), (0, 0, 0)]), 0.01),
        lambda: cylinder(0.0, 0.1),
    ],
)
def test_measures_that_give_no_solid_are_refused(make) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(SolidError):
        make()


def mug() -> Assembly:
    assembly = Assembly().add("body", cylinder(0.04, 0.09))
    assembly.add("handle", tube(arc([(0.035, 0, 0.07), (0.07, 0, 0.045), (0.035, 0, 0.02)]), 0.005))
    assembly.cut("inside", cylinder(0.036, 0.1).translate((0, 0, 0.004)))
    return assembly.region("rim", "body", lambda centers: centers[:, 2] > 0.0899)


def test_every_face_of_a_union_knows_its_part() -> None:
    mesh = mug().mesh()
    surface = as_trimesh(mesh)
    assert surface.is_watertight and surface.body_count == 1
    centers, normals = surface.triangles_center, surface.face_normals
    inside, handle, rim = mesh.faces_of("inside"), mesh.faces_of("handle"), mesh.faces_of("rim")
    radius = np.hypot(centers[:, 0], centers[:, 1])
    walls = inside[np.abs(normals[inside, 2]) < 0.5]
    assert (radius[walls] < 0.0361).all() and ((normals[walls, :2] * centers[walls, :2]).sum(1) < 0).all()
    assert (centers[handle, 0] > 0.03).all() and (radius[handle] > 0.036).all(), "cut off where the vessel is hollow"
    assert normals[rim, 2].min() > 0.99
    assert sorted(set(mesh.part.tolist())) == list(range(len(mesh.names)))


def test_what_parts_add_sums_up_to_the_union() -> None:
    assembly = mug()
    whole = as_trimesh(assembly.mesh()).volume
    added = {name: solid.volume() for name, solid in assembly.solids()}
    assert sum(added.values()) == pytest.approx(whole, rel=1e-4)
    assert set(added) == {"body", "handle"} and added["handle"] < 0.1 * added["body"]


def test_moved_assembly_keeps_its_regions() -> None:
    moved = mug().moved((0.0, 0.0, 0.5))
    mesh = moved.mesh()
    assert moved.lowest_m() == pytest.approx(0.5, abs=1e-6)
    assert as_trimesh(mesh).triangles_center[mesh.faces_of("rim")][:, 2].min() == pytest.approx(0.59, abs=1e-4)


def test_ellipsoid_has_its_extents() -> None:
    assert size_of(ellipsoid(0.1, 0.06, 0.04)) == pytest.approx([0.1, 0.06, 0.04], rel=5e-3)
