import numpy as np
import pytest
import trimesh

from manitwin.geometry.distance import closest_faces, distance_to_surface, signed_distance
from real_meshes import load_real_mesh


def _segment_distance(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    along = np.clip(((points - start) * (end - start)).sum(-1) / ((end - start) ** 2).sum(-1), 0, 1)
    return np.linalg.norm(points - start - along[..., None] * (end - start), axis=-1)


def _brute_force(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the distance by the plane where the projection falls inside all three edges, else by the edges."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    nearest = []
    for point in points:
        inside = np.ones(len(triangles), dtype=bool)
        for start, end in ((a, b), (b, c), (c, a)):
            inside &= (np.cross(end - start, point - start) * normal).sum(1) >= 0
        edges = np.min([_segment_distance(point, start, end) for start, end in ((a, b), (b, c), (c, a))], axis=0)
        nearest.append(np.where(inside, np.abs(((point - a) * normal).sum(1)), edges).min())
    return np.array(nearest)


def test_distance_to_a_box_is_the_closed_form() -> None:
    box = trimesh.creation.box((0.2, 0.1, 0.04))
    points = np.random.default_rng(0).uniform(-0.3, 0.3, (2000, 3))
    beyond = np.abs(points) - np.array([0.1, 0.05, 0.02])
    expected = np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(1), 0)
    assert np.allclose(signed_distance(points, box), expected, atol=1e-12)
    assert np.allclose(distance_to_surface(points, box), np.abs(expected), atol=1e-12)


def test_distance_equals_brute_force_on_triangles_of_every_size() -> None:
    rng = np.random.default_rng(1)
    big = rng.uniform(-1, 1, (40, 3, 3))
    small = rng.uniform(-1, 1, (500, 1, 3)) + rng.normal(0, 0.01, (500, 3, 3))
    triangles = np.concatenate([big, small])
    mesh = trimesh.Trimesh(triangles.reshape(-1, 3), np.arange(len(triangles) * 3).reshape(-1, 3), process=False)
    points = np.concatenate([rng.uniform(-2, 2, (150, 3)), rng.uniform(-30, 30, (30, 3)), triangles[:20, 0]])
    faces, distance = closest_faces(points, mesh)
    assert np.allclose(distance, _brute_force(points, triangles), atol=1e-12)
    own = [_brute_force(point[None], triangles[face][None])[0] for point, face in zip(points, faces, strict=True)]
    assert np.allclose(own, distance, atol=1e-12)


def test_distance_from_the_centre_of_a_sphere_where_all_triangles_are_equally_far() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    expected = _brute_force(np.zeros((1, 3)), np.asarray(sphere.triangles))
    assert distance_to_surface(np.zeros((1, 3)), sphere) == pytest.approx(expected, abs=1e-14)


def test_triangle_without_area_counts_as_its_edge() -> None:
    mesh = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0.5, 0, 0]], [[0, 1, 2]], process=False)
    distance = distance_to_surface(np.array([[0.25, 0.3, 0], [2, 0, 0]]), mesh)
    assert distance == pytest.approx([0.3, 1.0])


@pytest.mark.shared_data
def test_inside_of_a_real_mug_agrees_with_rays(shared_data) -> None:
    mug = load_real_mesh(shared_data, "mug_ycb")
    points = np.random.default_rng(2).uniform(*mug.bounds, (3000, 3))
    away = distance_to_surface(points, mug) > 1e-5
    assert np.array_equal(signed_distance(points, mug)[away] < 0, mug.ray.contains_points(points)[away])
