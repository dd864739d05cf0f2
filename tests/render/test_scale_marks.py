"""What is drawn of a thing's size is as long as it says: counted in pixels against the camera's own projection."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.geometry.boxes import longest_edges, upright_extents
from manitwin.render.cameras import Camera, orbit_cameras, project
from manitwin.render.markers import INK
from manitwin.render.scale_marks import ROUND_LENGTHS_M, best_camera, draw_dimension, draw_scale_bar, length_words

GROUND, RED = (230, 230, 230), (226, 26, 92)


def plain(camera: Camera) -> np.ndarray:
    return np.full((camera.height_px, camera.width_px, 3), GROUND, np.uint8)


@pytest.fixture(scope="module")
def cameras() -> tuple[np.ndarray, list[Camera]]:
    points = np.asarray(trimesh.creation.box([0.3, 0.04, 0.08]).vertices)
    return points, list(orbit_cameras(points, fov_y_deg=35.0, size_px=256))


@pytest.mark.parametrize("turn_deg", [0, 30, 75])
@pytest.mark.parametrize("extents", [(0.3, 0.04, 0.08), (0.05, 0.02, 0.2)])
def test_longest_edges_are_those_of_the_box(extents: tuple[float, ...], turn_deg: float) -> None:
    box = trimesh.creation.box(extents)
    box.apply_transform(trimesh.transformations.rotation_matrix(np.radians(turn_deg), [0, 0, 1]))
    edges = longest_edges(np.asarray(box.vertices))
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    assert lengths == pytest.approx(upright_extents(np.asarray(box.vertices)).max())
    corners = np.asarray(box.vertices)
    for end in edges.reshape(-1, 3):
        assert np.linalg.norm(corners - end, axis=1).min() < 1e-6


def test_the_line_is_drawn_whole_where_it_is_longest(cameras: tuple[np.ndarray, list[Camera]]) -> None:
    points, views = cameras
    edges = longest_edges(points)
    best, edge = best_camera(edges, views)
    seen = []
    for camera in views:
        ends = project(edges.reshape(-1, 3), camera)[0].reshape(-1, 2, 2)
        seen.append(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max() / max(camera.width_px, camera.height_px))
    assert best == int(np.argmax(seen))
    drawn = draw_dimension(plain(views[best]), edges[edge], views[best], "30.0 cm", RED)
    start, stop = project(edges[edge], views[best])[0]
    rows, columns = np.nonzero((np.abs(drawn.astype(int) - RED) < 40).all(-1))
    assert np.hypot(np.ptp(rows), np.ptp(columns)) == pytest.approx(np.linalg.norm(stop - start), abs=20)
    assert rows.min() > 0 and columns.min() > 0 and rows.max() < len(drawn) - 1 and columns.max() < len(drawn[0]) - 1


def test_the_bar_is_as_long_as_it_says(cameras: tuple[np.ndarray, list[Camera]]) -> None:
    points, views = cameras
    for camera in views:
        middle = points.mean(0)
        drawn = draw_scale_bar(plain(camera), camera, middle)
        ink = (np.abs(drawn.astype(int) - INK) < 30).all(-1)
        bar_px = max(np.flatnonzero(row)[-1] - np.flatnonzero(row)[0] for row in ink if row.any())
        right = camera.camera_to_object[:3, 0]
        px_per_m = np.linalg.norm(np.diff(project(np.array([middle, middle + 0.01 * right]), camera)[0], axis=0)) / 0.01
        assert min(abs(bar_px - length * px_per_m) for length in ROUND_LENGTHS_M) < 5
        assert bar_px < 0.4 * camera.width_px


def test_lengths_are_said_in_round_words() -> None:
    assert [length_words(each) for each in (0.002, 0.01, 0.2, 1.0)] == ["2 mm", "1 cm", "20 cm", "1 m"]
