"""Cameras against closed forms."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

from manitwin.render.cameras import (
    Camera,
    framing_camera,
    hero_camera,
    look_at,
    orbit_cameras,
    pixel_rays,
    project,
)

FRAMING = {"fov_y_deg": 30.0, "width_px": 400, "height_px": 300}


def test_point_lands_where_the_pinhole_equation_says() -> None:
    camera = Camera(look_at(np.array([0.0, -2.0, 0.0]), np.zeros(3)), np.deg2rad(60.0), 640, 480)
    pixels, depth = project(np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.5, 0.4]]), camera)
    focal = 240 / np.tan(np.deg2rad(30.0))
    assert depth == pytest.approx([2.0, 2.0, 2.5])
    assert pixels == pytest.approx(np.array([[320, 240], [320 + focal * 0.15, 240], [320, 240 - focal * 0.16]]))


@pytest.mark.parametrize("eye", [(1.0, 2.0, 3.0), (0.0, 0.0, 2.0), (0.0, 0.0, -2.0), (-4.0, 0.1, 0.0)])
def test_look_at_is_a_rotation_that_looks_at_its_target(eye: tuple[float, float, float]) -> None:
    pose = look_at(np.array(eye), np.array([0.1, 0.0, 0.2]))
    assert pose[:3, :3] @ pose[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    pixels, depth = project(np.array([[0.1, 0.0, 0.2]]), Camera(pose, 1.0, 100, 100))
    assert pixels[0] == pytest.approx([50, 50])
    assert depth[0] > 0


def test_framing_fills_the_picture_and_cuts_nothing() -> None:
    points = trimesh.creation.torus(0.1, 0.03).vertices + np.array([3.0, -2.0, 5.0])
    pixels, _ = project(points, framing_camera(points, azimuth_deg=20, elevation_deg=35, **FRAMING))
    reach = np.abs(pixels - [200, 150]).max(0) / [200, 150]
    assert 0.8 < reach.max() < 0.95  # of the way from the middle to the nearer edge
    assert (pixels.min(0) + pixels.max(0)) / 2 == pytest.approx([200, 150], abs=8)


def test_cameras_scale_with_the_object() -> None:
    points = trimesh.creation.capsule(0.2, 0.05).vertices
    for small, large in zip(
        orbit_cameras(points, fov_y_deg=30, size_px=64),
        orbit_cameras(points * 7, fov_y_deg=30, size_px=64),
        strict=True,
    ):
        assert small.scaled(7).camera_to_object == pytest.approx(large.camera_to_object, abs=1e-9)


def test_orbit_sees_every_side_of_a_box() -> None:
    box = trimesh.creation.box([0.3, 0.2, 0.1])
    cameras = orbit_cameras(box.vertices, fov_y_deg=30, size_px=64)
    azimuths = np.sort([np.rad2deg(np.arctan2(*c.camera_to_object[1::-1, 2])) % 360 for c in cameras])
    assert np.diff(azimuths) == pytest.approx(np.full(7, 45.0))
    views = [((box.triangles_center - c.position) * box.face_normals).sum(1) < 0 for c in cameras]
    assert np.sum(views, axis=0).min() >= 1


def test_hero_shows_the_broad_side() -> None:
    board = trimesh.creation.box([0.3, 0.02, 0.2])
    backward = hero_camera(board.vertices, **FRAMING).camera_to_object[:3, 2]
    assert abs(backward[1]) > 0.7


def test_hero_of_a_photo_is_on_its_side_though_more_is_seen_from_behind() -> None:
    points = trimesh.creation.box([0.3, 0.02, 0.2]).vertices
    points[points[:, 2] > 0, 1] -= 0.1  # it leans forward
    assert hero_camera(points, **FRAMING).camera_to_object[1, 2] > 0.5
    assert hero_camera(points, **FRAMING, from_front=True).camera_to_object[1, 2] < -0.5


@pytest.mark.parametrize("extents", [(0.09, 0.15, 0.015), (0.15, 0.09, 0.015), (0.1, 0.1, 0.004)])
def test_hero_of_a_photo_of_a_flat_thing_has_its_upper_edge_above(extents: tuple[float, float, float]) -> None:
    points = trimesh.creation.box(extents).vertices
    points[points[:, 1] < 0, 0] *= 0.6  # narrower towards the viewer: from behind it is seen larger
    camera = hero_camera(points, **FRAMING, from_front=True)
    (_, upper), (_, lower) = project(np.array([[0, extents[1] / 2, 0], [0, -extents[1] / 2, 0]]), camera)[0]
    assert upper < lower


def test_pixel_rays_come_back_to_their_pixels() -> None:
    camera = Camera(look_at(np.array([1.0, 2.0, 0.5]), np.zeros(3)), 0.7, 31, 17)
    origins, directions = pixel_rays(camera)
    pixels, depth = project(origins + 2.5 * directions, camera)
    x, y = np.meshgrid(np.arange(31) + 0.5, np.arange(17) + 0.5)
    assert pixels == pytest.approx(np.stack([x, y], -1).reshape(-1, 2))
    assert depth == pytest.approx(np.full(31 * 17, 2.5))


def test_camera_survives_json() -> None:
    camera = Camera(look_at(np.array([1.0, 2.0, 0.5]), np.zeros(3)), 0.7, 31, 17)
    again = Camera.from_json(json.loads(json.dumps(camera.to_json())))
    assert np.array_equal(again.camera_to_object, camera.camera_to_object)
    assert (again.fov_y_rad, again.width_px, again.height_px) == (0.7, 31, 17)


@pytest.mark.parametrize("sides", [(0.2, 0.03, 0.015), (0.05, 0.05, 0.25), (0.1, 0.09, 0.08), (0.15, 0.1, 0.004)])
def test_orbit_pictures_are_shaped_so_that_the_object_fills_them(sides: tuple[float, float, float]) -> None:
    corners = trimesh.creation.box(sides).vertices
    for camera in orbit_cameras(corners, fov_y_deg=30, size_px=768):
        filled = np.ptp(project(corners, camera)[0], axis=0) / [camera.width_px, camera.height_px]
        assert filled.min() >= 0.6 and filled.max() <= 0.89
        assert camera.width_px * camera.height_px == pytest.approx(768**2, rel=0.02)


def test_two_views_look_from_below_and_a_list_of_heights_is_taken() -> None:
    corners = trimesh.creation.box([0.1, 0.1, 0.1]).vertices

    def heights(**more: object) -> list[float]:
        cameras = orbit_cameras(corners, fov_y_deg=30, size_px=64, **more)  # type: ignore[arg-type]
        return [float(np.degrees(np.arcsin(camera.camera_to_object[2, 2]))) for camera in cameras]

    assert sum(height < -20 for height in heights()) == 2
    said = (0.0, 10.0, -50.0, 70.0, -20.0, 30.0, 45.0, 5.0)
    assert heights(elevations_deg=said) == pytest.approx(said)
