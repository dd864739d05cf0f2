"""Visibility by rays."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import sample_surface
from manitwin.render.cameras import Camera, look_at
from manitwin.render.raycast import cast_camera, merge_parts, visible_points


def camera_at(eye: tuple[float, float, float], fov_deg: float = 40.0) -> Camera:
    return Camera(look_at(np.array(eye), np.zeros(3)), np.deg2rad(fov_deg), 64, 48)


def test_depth_of_a_plane_is_planar() -> None:
    plate = trimesh.creation.box([4.0, 0.1, 4.0])
    depth, normals, face = cast_camera(RayCaster(plate), camera_at((0.0, -1.0, 0.0)))
    assert depth == pytest.approx(np.full((48, 64), 0.95), abs=1e-5)
    assert normals == pytest.approx(np.broadcast_to([0.0, -1.0, 0.0], (48, 64, 3)))
    assert (face >= 0).all()


def test_sphere_shows_the_cap_that_tangents_reach() -> None:
    ball = trimesh.creation.icosphere(5, 0.1)
    points, normals, _ = sample_surface(ball, 4000, np.random.default_rng(0))
    camera = camera_at((0.0, -0.5, 0.0))
    seen = visible_points(points, normals, camera, RayCaster(ball), 1e-4)
    # Tangents from distance d touch a sphere of radius r at y = -r^2 / d.
    assert not seen[points[:, 1] > -0.019].any()
    assert seen[points[:, 1] < -0.028].all()


def test_point_behind_another_part_is_hidden() -> None:
    target = trimesh.creation.box([0.1, 0.1, 0.1])
    wall = trimesh.creation.box([0.1, 0.01, 0.2]).apply_translation([0.0, -0.2, 0.0])
    point, normal = np.array([[0.0, -0.05, 0.0]]), np.array([[0.0, -1.0, 0.0]])
    camera = camera_at((0.0, -1.0, 0.0))
    assert visible_points(point, normal, camera, RayCaster(target), 1e-3).all()
    assert not visible_points(point, normal, camera, RayCaster(merge_parts([target, wall])), 1e-3).any()


def test_back_of_a_thin_wall_is_hidden_though_within_tolerance() -> None:
    sheet = trimesh.creation.box([0.2, 0.0005, 0.2])
    points = np.array([[0.0, -0.00025, 0.0], [0.0, 0.00025, 0.0]])
    normals = np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
    seen = visible_points(points, normals, camera_at((0.0, -1.0, 0.0)), RayCaster(sheet), 1e-3)
    assert seen.tolist() == [True, False]


def test_point_outside_the_picture_is_not_seen() -> None:
    plate = trimesh.creation.box([4.0, 0.1, 4.0])
    points = np.array([[0.0, -0.05, 0.0], [1.5, -0.05, 0.0], [0.0, -0.05, -0.4]])
    normals = np.tile([0.0, -1.0, 0.0], (3, 1))
    seen = visible_points(points, normals, camera_at((0.0, -1.0, 0.0)), RayCaster(plate), 1e-3)
    assert seen.tolist() == [True, False, False]


def test_point_off_the_mesh_is_not_seen() -> None:
    plate = trimesh.creation.box([1.0, 0.1, 1.0])
    point, normal = np.array([[0.0, -0.055, 0.0]]), np.array([[0.0, -1.0, 0.0]])
    assert not visible_points(point, normal, camera_at((0.0, -1.0, 0.0)), RayCaster(plate), 0.001).any()
