import io

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from manitwin.geometry.hulls.reduction import convex_corners, hull_mesh, hull_to_obj, hull_volume, reduced_hull


def _reload(vertices: np.ndarray) -> trimesh.Trimesh:
    return trimesh.load(io.BytesIO(hull_to_obj(vertices)), file_type="obj", force="mesh")


def test_hull_of_few_points_keeps_them_all() -> None:
    box = trimesh.creation.box((0.1, 0.2, 0.3)).vertices
    assert len(reduced_hull(np.vstack([box, box * 0.5]), 64, 2e-4)) == 8
    assert hull_volume(box) == pytest.approx(0.006)


def test_sphere_is_reduced_to_the_limit_and_covered_evenly() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=4, radius=0.05).vertices
    hull = reduced_hull(sphere, 64, 1e-6)
    assert len(hull) == 64
    equations = ConvexHull(hull).equations
    outside = (sphere @ equations[:, :3].T + equations[:, 3]).max()
    assert outside < 0.0055  # 64 even points leave caps of 0.05 (1 - cos 26 deg) at best
    assert np.abs(hull).max(0) == pytest.approx([0.05, 0.05, 0.05], abs=1e-6)


def test_written_hulls_are_convex_when_read_again_even_of_nearly_flat_points() -> None:
    rng = np.random.default_rng(0)
    for noise_m in (0, 1e-7, 1e-6, 1e-5):
        grid = np.stack(np.meshgrid(np.linspace(0, 0.1, 12), np.linspace(0, 0.07, 9), [0, 0.003]), -1).reshape(-1, 3)
        hull = reduced_hull(grid + rng.normal(0, noise_m, grid.shape) if noise_m else grid, 64, 2e-4)
        mesh = _reload(hull)
        assert mesh.is_convex and len(mesh.vertices) == len(hull) <= 64
        assert mesh.volume == pytest.approx(0.1 * 0.07 * 0.003, rel=0.05)


def test_written_hull_is_the_same_to_the_last_digit() -> None:
    hull = reduced_hull(np.random.default_rng(1).normal(0, 0.03, (500, 3)), 64, 0)
    assert np.array_equal(np.asarray(_reload(hull).vertices), hull)
    assert hull_to_obj(hull) == hull_to_obj(hull.copy())


def test_hull_mesh_faces_point_outward() -> None:
    points = np.random.default_rng(2).normal(0, 0.03, (30, 3))
    corners, volume = convex_corners(points)
    mesh = hull_mesh(corners)
    assert mesh.is_watertight and mesh.volume == pytest.approx(volume)


def test_flat_points_have_no_volume() -> None:
    assert hull_volume(np.random.default_rng(3).random((20, 3)) * [1, 1, 0]) == 0
