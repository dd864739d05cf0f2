"""How open a place is, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.geometry.openness import unoccluded_share


def test_a_convex_body_is_open_everywhere() -> None:
    box = trimesh.creation.box([0.1, 0.2, 0.3])
    centers, normals = box.triangles_center, box.face_normals
    assert unoccluded_share(box, centers, normals) == pytest.approx(np.ones(len(centers)))


def test_the_bottom_of_a_tube_sees_what_the_view_factor_says() -> None:
    # Of a disc of radius r seen from the middle at a distance h: r^2 / (r^2 + h^2) (Howell, catalog of configuration factors).
    radius, depth = 0.05, 0.05
    tube = trimesh.creation.annulus(r_min=radius, r_max=0.06, height=depth, sections=64)
    place = np.array([[0.0, 0.0, -depth / 2 + 1e-6]])
    share = unoccluded_share(tube, place, np.array([[0.0, 0.0, 1.0]]))
    assert share == pytest.approx(radius**2 / (radius**2 + depth**2), abs=0.12)  # of 24 directions


def test_the_inside_of_a_closed_shell_is_not_open() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=2)
    sphere.invert()
    assert unoccluded_share(sphere, 0.9 * sphere.triangles_center, sphere.face_normals).max() == 0
