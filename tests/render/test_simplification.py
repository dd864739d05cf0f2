"""Simplified meshes against the surfaces they stand for."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import mug
from manitwin.geometry.distance import distance_to_surface
from manitwin.render.simplification import simplified


def of(vertices: np.ndarray, faces: np.ndarray) -> trimesh.Trimesh:
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.remove_unreferenced_vertices()
    return mesh


def assert_close(mesh: trimesh.Trimesh, lean: trimesh.Trimesh, limit_m: float) -> None:
    for one, other in ((mesh, lean), (lean, mesh)):
        points = np.concatenate([one.vertices, one.triangles_center])
        assert distance_to_surface(points, other).max() < limit_m


@pytest.mark.parametrize("tolerance_m", [0.0003, 0.001])
def test_sphere_stays_within_the_tolerance_and_closed(tolerance_m: float) -> None:
    ball = trimesh.creation.icosphere(5, 0.05)
    lean = of(ball.vertices, simplified(ball.vertices, ball.faces, tolerance_m))
    assert len(lean.faces) < 0.3 * len(ball.faces)
    assert lean.is_watertight and lean.is_winding_consistent and lean.euler_number == 2
    assert_close(ball, lean, 2 * tolerance_m)
    assert lean.volume == pytest.approx(ball.volume, rel=6 * tolerance_m / 0.05)


def test_more_tolerance_takes_more() -> None:
    ball = trimesh.creation.icosphere(5, 0.05)
    counts = [len(simplified(ball.vertices, ball.faces, tolerance_m)) for tolerance_m in (2e-4, 5e-4, 2e-3)]
    assert counts[0] > counts[1] > counts[2]


def test_flat_sides_lose_what_lies_within_them_and_keep_the_box() -> None:
    box = trimesh.creation.box([0.1, 0.06, 0.04]).subdivide().subdivide().subdivide()
    lean = of(box.vertices, simplified(box.vertices, box.faces, 1e-5))
    assert len(lean.faces) < 0.1 * len(box.faces)
    assert lean.volume == pytest.approx(0.1 * 0.06 * 0.04, rel=1e-9)
    assert lean.area == pytest.approx(box.area, rel=1e-9)


def test_open_edges_stay_as_they_are() -> None:
    sheet = trimesh.creation.box([0.1, 0.1, 0.1]).subdivide().subdivide()
    sheet.update_faces(sheet.triangles_center[:, 2] < 0.0499)  # without its top
    lean = of(sheet.vertices, simplified(sheet.vertices, sheet.faces, 1e-5))
    rims = []
    for mesh in (sheet, lean):
        edges = np.sort(mesh.edges, axis=1)
        unique, uses = np.unique(edges, axis=0, return_counts=True)
        rims.append({tuple(p) for p in np.round(mesh.vertices[unique[uses == 1]].reshape(-1, 3), 9)})
    assert rims[0] == rims[1] and len(rims[0]) == 16
    assert len(lean.faces) < 0.6 * len(sheet.faces)


def test_mug_keeps_wall_and_handle() -> None:
    mesh = mug()
    lean = of(mesh.vertices, simplified(mesh.vertices, mesh.faces, 0.0004))
    assert len(lean.faces) < 0.8 * len(mesh.faces)
    assert lean.is_watertight and lean.euler_number == mesh.euler_number
    assert_close(mesh, lean, 0.001)


def test_nothing_is_left_of_nothing_and_no_tolerance_changes_nothing_round() -> None:
    assert simplified(np.zeros((0, 3)), np.zeros((0, 3), int), 0.001).shape == (0, 3)
    ball = trimesh.creation.icosphere(2, 0.05)
    assert len(simplified(ball.vertices, ball.faces, 1e-9)) == len(ball.faces)


def test_open_edges_that_may_move_keep_their_line() -> None:
    """A box without its top, cut into many triangles: its rim is a square of four corners afterwards."""
    sheet = trimesh.creation.box([0.1, 0.1, 0.1]).subdivide().subdivide()
    sheet.update_faces(sheet.triangles_center[:, 2] < 0.0499)
    lean = of(sheet.vertices, simplified(sheet.vertices, sheet.faces, 1e-5, keep_open_edges=False))
    assert len(lean.faces) == 10
    assert lean.area == pytest.approx(sheet.area, rel=1e-9)
    np.testing.assert_allclose(np.ptp(lean.vertices, axis=0), 0.1, atol=1e-9)


def test_vertices_of_a_seam_move_together_and_along_it() -> None:
    """A tube whose texture goes once around: where it begins and ends no gap opens, and coordinates stay those of places."""
    around, along = 64, 40
    angle, height = np.meshgrid(np.linspace(0, 1, around + 1), np.linspace(0, 1, along + 1))
    uv = np.column_stack([angle.ravel(), height.ravel()])
    places = (np.arange(along + 1)[:, None] * around + np.arange(around + 1) % around).ravel()
    vertices = np.column_stack(
        [0.05 * np.cos(2 * np.pi * (uv[:, 0] % 1)), 0.05 * np.sin(2 * np.pi * (uv[:, 0] % 1)), uv[:, 1]]
    )
    corner = (np.arange(along)[:, None] * (around + 1) + np.arange(around)).ravel()
    right, up = corner + 1, corner + around + 1
    faces = np.concatenate([np.stack([corner, right, up + 1], 1), np.stack([corner, up + 1, up], 1)])
    lean = simplified(vertices, faces, 0.0005, places=places, keep_open_edges=False)
    assert len(lean) < 0.2 * len(faces)
    edges = np.sort(places[lean][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, uses = np.unique(edges, axis=0, return_counts=True)
    assert uses.max() == 2
    assert np.isin(
        np.unique(vertices[[int(np.flatnonzero(places == p)[0]) for p in unique[uses == 1].ravel()], 2]), (0, 1)
    ).all()
    assert np.abs(np.ptp(uv[lean][..., 0], axis=1)).max() < 0.5  # no triangle runs the long way round in the texture
    doubled = uv[lean][..., 1].mean() - vertices[lean][..., 2].mean()
    assert doubled == pytest.approx(0.0, abs=1e-12)
