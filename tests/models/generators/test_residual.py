"""How well a solid explains a photo, against pictures whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.geometry.poses import transform
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.generators.lift.residual import compute_fit_quality, parallel_camera
from manitwin.render.cameras import Camera, framing_camera
from manitwin.render.raycast import cast_camera

BOX = trimesh.creation.box((0.06, 0.04, 0.1))


def _camera(mesh: trimesh.Trimesh) -> Camera:
    points = np.asarray(mesh.vertices)
    return framing_camera(points, azimuth_deg=-60, elevation_deg=30, fov_y_deg=30, width_px=320, height_px=240)


def _picture(mesh: trimesh.Trimesh, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return the mask, and a photo in which each direction has its own grey."""
    _, normals, face = cast_camera(RayCaster(mesh), camera)
    grey = 60 + 120 * np.abs(normals @ np.array([0.2, 0.5, 1.0]))
    return face >= 0, np.repeat(grey[..., None], 3, axis=2).astype(np.uint8)


def test_a_solid_explains_its_own_picture_wholly() -> None:
    camera = _camera(BOX)
    mask, rgb = _picture(BOX, camera)
    found = compute_fit_quality(BOX, camera, mask, rgb)
    assert found.silhouette_iou > 0.985 and found.edge_support == pytest.approx(1.0, abs=0.03)
    assert found.unexplained_share == pytest.approx(1 - found.score) and found.score > 0.98


def test_a_solid_of_half_the_size_explains_a_quarter() -> None:
    camera = _camera(BOX)
    mask, _ = _picture(BOX, camera)
    small = BOX.copy()
    small.apply_scale(0.5)
    assert compute_fit_quality(small, camera, mask).silhouette_iou == pytest.approx(0.25, abs=0.02)


def test_creases_that_the_photo_does_not_show_cost() -> None:
    camera = _camera(BOX)
    mask, _ = _picture(BOX, camera)
    rng = np.random.default_rng(0)
    even = (128 + rng.normal(0, 1.5, (240, 320, 3))).astype(np.uint8)
    found = compute_fit_quality(BOX, camera, mask, even)
    assert found.edge_support is not None and found.edge_support < 0.5 and found.score < found.silhouette_iou - 0.05


def test_letters_on_a_ball_cost_nothing() -> None:
    ball = trimesh.creation.icosphere(4, 0.05)
    camera = _camera(ball)
    mask, rgb = _picture(ball, camera)
    rgb[100:140:6, 130:190] = 0
    assert compute_fit_quality(ball, camera, mask, rgb).edge_support is None


def test_a_parallel_camera_sees_pixels_where_they_are() -> None:
    solid = trimesh.creation.box((41, 21, 30), transform(np.eye(3), [60, -40, 0]))
    mask = np.zeros((100, 150), bool)
    mask[30:51, 40:81] = True
    assert compute_fit_quality(solid, parallel_camera(mask.shape), mask).silhouette_iou > 0.94
