import numpy as np
import trimesh

from manitwin.geometry.repair.halfedges import is_closed_and_consistent
from manitwin.geometry.repair.welding import collapsed_faces, repeated_faces, weld_equal, weld_near


def _soup(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    corners = np.array(mesh.triangles.reshape(-1, 3))
    return corners, np.arange(len(corners)).reshape(-1, 3)


def test_equal_corners_of_a_soup_become_the_vertices_of_the_mesh() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    vertices, faces = weld_equal(*_soup(ball))
    assert len(vertices) == len(ball.vertices)
    assert np.array_equal(vertices[faces], ball.triangles)
    assert is_closed_and_consistent(faces, len(vertices))


def test_noisy_soup_closes_within_the_noise() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.1)
    vertices, faces = _soup(ball)
    noisy = vertices + np.random.default_rng(0).normal(0, 2e-6, vertices.shape)
    welded, faces, used_m = weld_near(noisy, faces, 3e-5)
    assert 0 < used_m <= 3e-5
    assert is_closed_and_consistent(faces, len(welded))
    assert np.abs(welded[faces] - ball.triangles).max() < 1e-5


def test_thin_wall_survives_a_weld_of_almost_its_thickness() -> None:
    plate = trimesh.creation.box((0.1, 0.1, 0.0015))
    welded, faces, _ = weld_near(*_soup(plate), 1.4e-3)
    assert np.isclose(np.ptp(welded[np.unique(faces)][:, 2]), 0.0015)
    assert len(np.unique(faces)) == 8


def test_closed_detail_finer_than_the_tolerance_is_not_touched() -> None:
    tiny = trimesh.creation.icosphere(subdivisions=3, radius=1e-5)
    welded, faces, used_m = weld_near(np.array(tiny.vertices), np.array(tiny.faces), 1e-4)
    assert used_m == 0.0
    assert np.array_equal(welded, tiny.vertices) and np.array_equal(faces, tiny.faces)


def test_faces_repeat_in_either_winding() -> None:
    faces = np.array([[0, 1, 2], [2, 1, 0], [1, 2, 3], [2, 3, 1], [0, 1, 3]])
    assert repeated_faces(faces).tolist() == [False, True, False, True, False]
    assert collapsed_faces(np.array([[0, 1, 1], [0, 1, 2]])).tolist() == [True, False]
