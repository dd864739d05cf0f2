"""Matter behind a surface point, against shapes of known thickness."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import cup
from manitwin.geometry.parts.local_thickness import local_thickness


def test_a_box_is_as_thick_as_its_sides() -> None:
    box = trimesh.creation.box([0.1, 0.06, 0.02])
    normals = np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, 1]])
    points = normals * np.array([0.05, 0.03, 0.01])
    assert local_thickness(box, points, normals) == pytest.approx([0.1, 0.06, 0.02], abs=1e-6)


def test_a_cup_is_as_thick_as_its_wall_from_both_sides() -> None:
    points = np.array([[0.04, 0, 0.05], [0.037, 0, 0.05], [0.0, 0, 0.0]])
    normals = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 0, -1]])
    assert local_thickness(cup(), points, normals) == pytest.approx([0.003, 0.003, 0.003], abs=1e-4)


def test_normals_need_not_be_of_unit_length() -> None:
    box = trimesh.creation.box([0.1, 0.06, 0.02])
    assert local_thickness(box, np.array([[0, 0, 0.01]]), np.array([[0, 0, 7.0]])) == pytest.approx([0.02], abs=1e-6)
