from typing import Any

import numpy as np
import pytest
import trimesh

from manitwin.geometry.seams import close_seams, has_distinct_corners


def unwelded(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    """Every face with corners of its own: each edge is a seam."""
    return mesh.triangles.reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3)


def cut_in_two(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    """Two charts with a seam between them, as a texture has it."""
    right = mesh.triangles_center[:, 0] > 0
    vertices, faces = np.concatenate([mesh.vertices, mesh.vertices]), mesh.faces.copy()
    faces[right] += len(mesh.vertices)
    return vertices, faces


@pytest.mark.parametrize("split", [unwelded, cut_in_two])
@pytest.mark.parametrize("make", [trimesh.creation.box, trimesh.creation.icosphere, trimesh.creation.torus])
def test_seams_of_a_solid_are_closed_without_changing_it(make: Any, split: Any) -> None:
    solid = make(0.1, 0.03) if make is trimesh.creation.torus else make()
    vertices, faces = split(solid)
    assert not trimesh.Trimesh(vertices, faces, process=False).is_watertight
    source, closed = close_seams(vertices, faces)
    mesh = trimesh.Trimesh(vertices[source], closed, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(solid.volume, rel=1e-9)
    assert mesh.area == pytest.approx(solid.area, rel=1e-9)
    kept = has_distinct_corners(mesh.vertices, closed)
    assert kept.sum() == len(faces) and kept[: len(faces)].all()
    assert np.array_equal(vertices[source][closed[: len(faces)]], vertices[faces])


def test_an_open_sheet_stays_open() -> None:
    box = trimesh.creation.box()
    vertices, faces = unwelded(box)
    source, closed = close_seams(vertices, faces[2:])
    mesh = trimesh.Trimesh(vertices[source], closed, process=False)
    borders = mesh.edges_sorted[trimesh.grouping.group_rows(mesh.edges_sorted, require_count=1)]
    lengths = np.linalg.norm(mesh.vertices[borders[:, 0]] - mesh.vertices[borders[:, 1]], axis=1)
    assert (lengths > 0).sum() == 4


def test_a_mesh_without_seams_is_returned_as_it_is() -> None:
    box = trimesh.creation.box()
    source, closed = close_seams(box.vertices, box.faces)
    assert np.array_equal(source, np.arange(8)) and closed is box.faces
