from dataclasses import replace

import numpy as np
import pytest
import trimesh

from manitwin.geometry.repair.cascade import repair
from manitwin.geometry.repair.halfedges import group_edges, is_closed_and_consistent
from manitwin.geometry.repair.nonmanifold import fins, glue_faces, separate_coincident_edges
from manitwin.geometry.repair.orientation import wind_consistently
from manitwin.geometry.repair.surface import Surface
from manitwin.geometry.repair.welding import weld_equal


def _surface(mesh: trimesh.Trimesh) -> Surface:
    vertices, faces = weld_equal(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64))
    loose = Surface.unglued(vertices, faces, np.arange(len(faces)), np.zeros(len(faces), dtype=bool))
    return wind_consistently(replace(loose, twin=glue_faces(vertices, faces)[0]))


def test_fins_are_found_and_nothing_else() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    a, b = ball.edges_unique[[5, 60, 200]].T
    tips = 1.3 * ball.vertices[a]
    faces = np.concatenate((ball.faces, np.stack((a, b, len(ball.vertices) + np.arange(3)), 1)))
    vertices = np.concatenate((ball.vertices, tips))
    found = fins(vertices, faces, group_edges(faces, len(vertices)))
    assert np.flatnonzero(found).tolist() == [len(ball.faces), len(ball.faces) + 1, len(ball.faces) + 2]


def test_ears_of_an_open_sheet_without_fins_are_kept() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 1.0]])
    faces = np.array([[0, 1, 2], [1, 3, 2]])
    assert not fins(vertices, faces, group_edges(faces, 4)).any()


def test_cubes_that_touch_along_an_edge_come_apart_as_two_solids() -> None:
    cubes = trimesh.util.concatenate(
        [trimesh.creation.box((1, 1, 1)), trimesh.creation.box((1, 1, 1)).apply_translation((1, 1, 0))]
    )
    split = _surface(cubes).with_split_vertices()
    assert is_closed_and_consistent(split.faces, len(split.vertices))
    assert len(split.vertices) == 16
    assert split.components().tolist() == [0] * 12 + [1] * 12


def test_sheet_that_leans_on_a_plane_is_left_open_and_the_plane_is_not() -> None:
    plane = [[-1, 0, 0], [0, 0, 0], [1, 0, 0], [-1, 1, 0], [0, 1, 0], [1, 1, 0], [0, 0.5, 1]]
    faces = np.array([[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [1, 4, 6]])
    twin, crowded = glue_faces(np.array(plane, dtype=float), faces)
    assert twin[12] == -1 and crowded[12]
    assert {int(twin[3]) // 3} == {2}  # half-edge 1 -> 4 of face 1 meets face 2, across the lean-to


def test_two_edges_between_the_same_vertices_are_told_apart() -> None:
    """A torus with three vertices around the tube, one edge of that ring contracted: the other two now coincide."""
    torus = trimesh.creation.torus(1.0, 0.3, major_sections=8, minor_sections=3)
    surface = _surface(torus)
    faces, twin = surface.faces.copy(), surface.twin.copy()
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    tube = np.hypot(surface.vertices[:, 0], surface.vertices[:, 1])
    turn = np.arctan2(surface.vertices[:, 1], surface.vertices[:, 0])
    halfedge = int(np.flatnonzero(np.isclose(turn[start], turn[end]) & ~np.isclose(tube[start], tube[end]))[0])
    keep = np.ones(len(faces), dtype=bool)
    for h in (halfedge, int(twin[halfedge])):
        keep[h // 3] = False
        one, other = (int(twin[h - h % 3 + (h + k) % 3]) for k in (1, 2))
        twin[one], twin[other] = other, one
    faces[faces == start[halfedge]] = end[halfedge]
    pinched = replace(surface, faces=faces, twin=twin).select_faces(keep).with_split_vertices()
    assert group_edges(pinched.faces, len(pinched.vertices)).counts.max() == 4
    parted, count = separate_coincident_edges(pinched)
    assert count == 1 and len(parted.faces) == len(pinched.faces) + 2
    assert is_closed_and_consistent(parted.faces, len(parted.vertices))
    assert parted.areas.sum() == pytest.approx(pinched.areas.sum())
    started = parted.faces.ravel()
    ended = np.roll(parted.faces, -1, axis=1).ravel()
    assert np.array_equal(started[parted.twin], ended)


def test_a_floor_that_a_wall_touches_along_an_edge_is_not_turned_inside_out() -> None:
    """A bowl whose wall and floor share a ring of edges, its foot wound the other way: no brackets tell the pairs."""
    floor = trimesh.creation.revolve([(0, 0), (1, 0), (1, 0.2), (0, 0.2)], sections=24)
    wall = trimesh.creation.revolve([(1, 0.2), (1.5, 0.6), (1.3, 0.65), (1, 0.2)], sections=24)
    foot = floor.triangles_center[:, 2] < 0.199
    faces = np.where(foot[:, None], floor.faces[:, ::-1], floor.faces)
    bowl = trimesh.util.concatenate([trimesh.Trimesh(floor.vertices, faces, process=False), wall])
    result = repair(bowl)
    assert result.watertight and result.mesh.volume == pytest.approx(floor.volume + wall.volume, rel=1e-6)
    up = result.mesh.face_normals[result.mesh.triangles_center[:, 2] < 1e-6, 2]
    assert len(up) and (up < -0.9).all()
