"""Sections of long things: at sharp changes, joints and grooves, and none where a thing only tapers."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from trimesh.creation import box, revolve

from manitwin.geometry.parts.segmentation import Segmentation, segment_by_rule
from manitwin.geometry.parts.shape import HeadEnd, measure_shape


def lying(*profile: tuple[float, float]) -> trimesh.Trimesh:
    """Return the solid of revolution of radii and places (m) about the x axis, in small faces."""
    mesh = revolve(np.array([(0.0, profile[0][1]), *profile, (0.0, profile[-1][1])]), sections=36)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    mesh = mesh.subdivide_to_size(0.006)
    return trimesh.Trimesh(mesh.vertices, mesh.faces)


def marker(turned: bool) -> trimesh.Trimesh:
    mesh = lying((0.0085, -0.06), (0.0085, 0.028), (0.0093, 0.028), (0.0093, 0.06))
    return mirrored(mesh) if turned else mesh


def mirrored(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.pi, [0, 0, 1]))
    return mesh


def told(mesh: trimesh.Trimesh, head_end: HeadEnd = "narrow", noise_m: float = 0.0) -> Segmentation | None:
    mesh.vertices += np.random.default_rng(0).normal(0, noise_m, mesh.vertices.shape) if noise_m else 0.0
    shape = measure_shape(mesh, mesh.center_mass, head_end, False, np.random.default_rng(0))
    return segment_by_rule(mesh, shape, "sectioned")


def role_at(mesh: trimesh.Trimesh, found: Segmentation, least_m: float, most_m: float) -> dict[str, float]:
    """Return the shares of the roles of the area between two places along x."""
    x = mesh.triangles_center[:, 0]
    mine = (x > least_m) & (x < most_m)
    share = np.bincount(found.role[mine], mesh.area_faces[mine], len(found.roles)) / mesh.area_faces[mine].sum()
    return {role: value for role, value in zip(found.roles, share.tolist(), strict=True) if value > 0.01}


@pytest.mark.parametrize("noise_m", [0.0, 0.0002])
@pytest.mark.parametrize("turned", [False, True])
def test_shorter_section_is_the_cap_whichever_way_it_lies(turned: bool, noise_m: float) -> None:
    mesh = marker(turned)
    found = told(mesh, "short", noise_m)
    assert found is not None and found.roles == ("shaft", "tip", "end")
    cap, barrel = ((-0.06, -0.031), (-0.025, 0.06)) if turned else ((0.031, 0.06), (-0.06, 0.025))
    assert role_at(mesh, found, *cap).keys() == {"tip"} and role_at(mesh, found, *barrel).keys() == {"shaft"}


def test_without_a_border_the_wider_end_is_the_head() -> None:
    mesh = lying((0.006, -0.06), (0.012, 0.06))
    shape = measure_shape(mesh, mesh.center_mass, "short", False, np.random.default_rng(0))
    assert shape.axis.direction @ [1, 0, 0] < -0.99  # from the wider end to the narrower


def test_groove_is_a_border_where_both_sides_are_alike() -> None:
    mesh = lying((0.009, -0.06), (0.009, 0.026), (0.0075, 0.029), (0.009, 0.032), (0.009, 0.06))
    found = told(mesh, "short")
    assert found is not None
    assert role_at(mesh, found, 0.034, 0.06).keys() == {"tip"}
    assert role_at(mesh, found, -0.06, 0.024).keys() == {"shaft"}


def test_both_ends_are_told_from_the_middle_that_is_wider() -> None:
    pin = lying((0.01, -0.2), (0.01, -0.11), (0.025, -0.11), (0.025, 0.11), (0.01, 0.11), (0.01, 0.2))
    found = told(pin)
    assert found is not None
    assert role_at(pin, found, -0.105, 0.105).keys() == {"shaft"}
    ends = [role_at(pin, found, *sorted((side * 0.115, side * 0.2))).keys() for side in (-1, 1)]
    assert sorted(map(tuple, ends)) == [("end",), ("tip",)]


def test_joint_of_two_levers_is_between_jaws_and_handles() -> None:
    bars = []
    for angle in (0.35, -0.35):
        bar = box((0.16, 0.012, 0.012))
        bar.apply_transform(trimesh.transformations.rotation_matrix(angle, [0, 0, 1]))
        bars.append(bar)
    mesh = trimesh.boolean.union(bars).subdivide_to_size(0.004)
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces)
    found = told(mesh)
    assert found is not None
    sides = [role_at(mesh, found, *sorted((side * 0.04, side * 0.08))).keys() for side in (-1, 1)]
    assert sorted(map(tuple, sides)) == [("end",), ("tip",)]
    assert role_at(mesh, found, -0.01, 0.01).keys() == {"shaft"}


@pytest.mark.parametrize(
    "profile",
    [
        ((0.009, -0.06), (0.009, 0.06)),  # a bar
        ((0.004, -0.06), (0.012, 0.06)),  # a taper
        ((0.009, -0.06), (0.009, -0.002), (0.0092, 0.0), (0.0092, 0.06)),  # 2 % wider: a seam
        (
            *((0.009, -0.06), (0.009, -0.03), (0.0075, -0.025), (0.009, -0.02)),
            *((0.009, 0.02), (0.0075, 0.025), (0.009, 0.03), (0.009, 0.06)),
        ),  # two grooves: neither is the border
    ],
)
def test_nothing_is_told_where_no_border_shows(profile: tuple[tuple[float, float], ...]) -> None:
    assert told(lying(*profile)) is None
