"""Borders of regions as edges of a mesh."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.geometry.solids.borders import cut_along_border
from manitwin.geometry.solids.parts import Assembly, PartedMesh
from manitwin.geometry.solids.shapes import box, cylinder, ellipsoid


def _closed(mesh: PartedMesh) -> trimesh.Trimesh:
    closed = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert closed.is_watertight and closed.is_winding_consistent
    return closed


def _border(mesh: PartedMesh, one: str, other: str) -> np.ndarray:
    """Return the vertices (N, 3) that faces of both parts have."""
    first, second = (np.unique(mesh.faces[mesh.faces_of(name)]) for name in (one, other))
    return mesh.vertices[np.intersect1d(first, second)]


def test_border_of_a_slanting_region_lies_on_its_plane() -> None:
    normal, at_m = np.array([0.3, -0.5, 0.8]), 0.004
    assembly = Assembly().add("body", ellipsoid(0.1, 0.08, 0.12)).region("top", "body", lambda c: c @ normal > at_m)
    plain, cut = assembly.mesh(), assembly.mesh([("top", "body")])
    assert np.abs(_border(plain, "body", "top") @ normal - at_m).max() > 1e-3  # of whole faces: toothed
    assert np.abs(_border(cut, "body", "top") @ normal - at_m).max() < 2e-5
    assert _closed(cut).volume == pytest.approx(_closed(plain).volume, rel=1e-12)
    assert _closed(cut).area == pytest.approx(_closed(plain).area, rel=1e-12)
    assert _closed(cut).moment_inertia == pytest.approx(_closed(plain).moment_inertia, rel=1e-9, abs=1e-12)


def test_neighbours_that_are_of_other_parts_are_split_and_stay_theirs() -> None:
    assembly = Assembly().add("body", box(0.1, 0.1, 0.1)).add("pin", cylinder(0.02, 0.05).translate((0, 0, 0.09)))
    assembly.region("right", "body", lambda c: c[:, 0] > 0.003)
    plain, cut = assembly.mesh(), assembly.mesh([("right", "body")])
    _closed(cut)
    areas = [
        {
            name: trimesh.Trimesh(mesh.vertices, mesh.faces[mesh.faces_of(name)], process=False).area
            for name in mesh.names
        }
        for mesh in (plain, cut)
    ]
    assert areas[1]["pin"] == pytest.approx(areas[0]["pin"], rel=1e-12)
    assert areas[1]["right"] == pytest.approx(0.01 + 4 * 0.1 * 0.047 - np.pi * 0.02**2 / 2, rel=0.01)


def test_a_region_that_ends_at_edges_cuts_nothing() -> None:
    assembly = Assembly().add("body", box(0.1, 0.1, 0.1)).region("top", "body", lambda c: c[:, 2] > 0.09999)
    plain, cut = assembly.mesh(), assembly.mesh([("top", "body")])
    assert np.array_equal(plain.faces, cut.faces) and np.array_equal(plain.part, cut.part)


def test_only_faces_that_the_border_crosses_are_cut() -> None:
    plain, cut = (
        Assembly().add("body", cylinder(0.05, 0.1)).region("rim", "body", lambda c: c[:, 2] > 0.09).mesh(bordered)
        for bordered in ((), [("rim", "body")])
    )
    walls = (
        np.abs(plain.vertices[plain.faces][:, :, 2].max(axis=1) - plain.vertices[plain.faces][:, :, 2].min(axis=1))
        > 0.09
    )
    assert len(cut.faces) == len(plain.faces) + 2 * int(walls.sum())
    assert np.allclose(np.unique(_border(cut, "body", "rim")[:, 2].round(9)), 0.09)


def test_nothing_is_cut_of_faces_that_are_not_chosen() -> None:
    solid = trimesh.creation.box(extents=(1.0, 1.0, 1.0))
    faces = np.asarray(solid.faces)
    chosen = np.zeros(len(faces), dtype=bool)
    vertices, cut, origin, within = cut_along_border(np.asarray(solid.vertices), faces, chosen, lambda c: c[:, 0] > 0.1)
    assert len(vertices) == 8 and np.array_equal(cut, faces) and not within.any()
    assert np.array_equal(origin, np.arange(len(faces)))


def test_pieces_keep_the_face_that_they_are_of() -> None:
    solid = trimesh.creation.icosphere(subdivisions=2)
    start, faces = np.asarray(solid.vertices), np.asarray(solid.faces)
    everything = np.ones(len(faces), dtype=bool)
    vertices, cut, origin, within = cut_along_border(
        start, faces, everything, lambda c: np.hypot(c[:, 0], c[:, 1]) < 0.4
    )
    normals = np.cross(vertices[cut[:, 1]] - vertices[cut[:, 0]], vertices[cut[:, 2]] - vertices[cut[:, 0]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.einsum("ij,ij->i", normals, solid.face_normals[origin]).min() > 1 - 1e-9
    assert (np.hypot(*vertices[cut[within]].mean(axis=1)[:, :2].T) < 0.4).all()
