from dataclasses import replace

import numpy as np
import pytest
import trimesh

from manitwin.geometry.repair.halfedges import group_edges, is_closed_and_consistent, twins_of_manifold_edges
from manitwin.geometry.repair.hole_filling import boundary_loops, fill_loops, loop_lengths
from manitwin.geometry.repair.orientation import wind_consistently
from manitwin.geometry.repair.surface import Surface


def glued(mesh: trimesh.Trimesh) -> Surface:
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64)
    loose = Surface.unglued(vertices, faces, np.arange(len(faces)), np.zeros(len(faces), dtype=bool))
    return replace(loose, twin=twins_of_manifold_edges(group_edges(faces, len(vertices))))


def closed(mesh: trimesh.Trimesh) -> tuple[Surface, np.ndarray, list[np.ndarray]]:
    surface = wind_consistently(glued(mesh))
    loops = boundary_loops(surface)
    filled = fill_loops(surface, loops)
    return filled.surface.with_split_vertices(), filled.loop_of_face, loops


def without(mesh: trimesh.Trimesh, gone: np.ndarray) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces[~gone], process=False)


@pytest.mark.parametrize("rim", [5, 60, 400])
def test_flat_loop_of_any_length_is_closed_with_its_own_area(rim: int) -> None:
    """A star-shaped floor that is not convex; 400 edges take the cutting of long loops."""
    angle = 2 * np.pi * np.arange(rim) / rim
    radius = 1 + 0.5 * np.sin(3 * angle)
    floor = np.stack((radius * np.cos(angle), radius * np.sin(angle), np.zeros(rim)), 1)
    tent = trimesh.Trimesh(
        np.concatenate((floor, [[0, 0, 1.0]])), [(i, (i + 1) % rim, rim) for i in range(rim)], process=False
    )
    surface, loop_of_face, loops = closed(tent)
    shoelace = 0.5 * abs((floor[:, 0] * np.roll(floor[:, 1], -1) - np.roll(floor[:, 0], -1) * floor[:, 1]).sum())
    assert len(loops) == 1 and (loop_of_face == 0).sum() == rim - 2
    assert is_closed_and_consistent(surface.faces, len(surface.vertices))
    assert surface.areas[loop_of_face == 0].sum() == pytest.approx(shoelace, rel=1e-6)


def test_missing_face_comes_back_as_it_was() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    gone = np.arange(len(ball.faces)) == 17
    surface, loop_of_face, loops = closed(without(ball, gone))
    assert sorted(surface.faces[loop_of_face == 0][0]) == sorted(ball.faces[17])
    assert loop_lengths(glued(without(ball, gone)), loops)[0] == pytest.approx(
        np.linalg.norm(np.diff(ball.triangles[17][[0, 1, 2, 0]], axis=0), axis=1).sum()
    )
    assert is_closed_and_consistent(surface.faces, len(surface.vertices))


def test_holes_that_touch_at_a_vertex_are_closed_one_by_one() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    fan = np.flatnonzero((ball.faces == 200).any(1))
    for first in fan:
        for second in fan:
            if len(set(ball.faces[first]) & set(ball.faces[second])) != 1:
                continue
            gone = np.isin(np.arange(len(ball.faces)), (first, second))
            surface, _, loops = closed(without(ball, gone))
            assert sorted(map(len, loops)) == [3, 3]
            assert len(surface.vertices) == len(ball.vertices)
            assert trimesh.Trimesh(surface.vertices, surface.faces, process=False).volume == pytest.approx(ball.volume)


def test_many_random_holes_close_near_the_sphere() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    gone = np.random.default_rng(3).random(len(ball.faces)) < 0.06
    surface, _, _ = closed(without(ball, gone))
    result = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert result.is_watertight and result.is_winding_consistent
    assert result.volume == pytest.approx(ball.volume, rel=2e-3)


def test_edge_that_the_surface_has_already_is_not_used_again() -> None:
    """Two faces with a common edge missing from a tetrahedron: the only free diagonal is the edge that was lost."""
    tetrahedron = trimesh.Trimesh(
        np.vstack((np.zeros(3), np.eye(3))), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], process=False
    )
    surface, _, _ = closed(without(tetrahedron, np.array([True, True, False, False])))
    assert is_closed_and_consistent(surface.faces, len(surface.vertices))
    assert trimesh.Trimesh(surface.vertices, surface.faces, process=False).volume == pytest.approx(1 / 6)
