"""First hits against the faces of a box, whose distances are known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import cup
from manitwin.geometry.ray_caster import RayCaster, local_thickness


def test_first_hit_is_the_near_face_of_a_box() -> None:
    caster = RayCaster(trimesh.creation.box([0.04, 0.06, 0.08]))
    rng = np.random.default_rng(0)
    origins = np.column_stack([np.full(50, -0.1), rng.uniform(-0.029, 0.029, 50), rng.uniform(-0.039, 0.039, 50)])
    distance, face = caster.first_hits(origins, np.tile([1.0, 0, 0], (50, 1)))
    assert distance == pytest.approx(0.08, abs=1e-7)
    assert caster.face_normals[face] == pytest.approx(np.tile([-1.0, 0, 0], (50, 1)))


def test_ray_beside_the_box_hits_nothing() -> None:
    caster = RayCaster(trimesh.creation.box([0.04, 0.06, 0.08]))
    distance, face = caster.first_hits(np.array([[-0.1, 0.0301, 0]]), np.array([[1.0, 0, 0]]))
    assert np.isinf(distance[0])
    assert face[0] == -1


def test_no_rays_give_no_hits() -> None:
    distance, face = RayCaster(trimesh.creation.box()).first_hits(np.zeros((0, 3)), np.zeros((0, 3)))
    assert len(distance) == len(face) == 0


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
