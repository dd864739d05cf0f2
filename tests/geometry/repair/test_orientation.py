from dataclasses import replace

import numpy as np
import pytest
import trimesh

from manitwin.geometry.repair.halfedges import group_edges, is_closed_and_consistent, twins_of_manifold_edges
from manitwin.geometry.repair.orientation import enclosing_components, face_outward, wind_consistently, winding_numbers
from manitwin.geometry.repair.surface import Surface


def glued(mesh: trimesh.Trimesh) -> Surface:
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64)
    loose = Surface.unglued(vertices, faces, np.arange(len(faces)), np.zeros(len(faces), dtype=bool))
    return replace(loose, twin=twins_of_manifold_edges(group_edges(faces, len(vertices))))


def reversed_faces(mesh: trimesh.Trimesh, which: np.ndarray) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, np.where(which[:, None], mesh.faces[:, ::-1], mesh.faces), process=False)


@pytest.mark.parametrize("share", [0.1, 0.45])
def test_reversed_faces_turn_back_and_only_they(share: float) -> None:
    torus = trimesh.creation.torus(0.1, 0.03)
    turned = np.random.default_rng(1).random(len(torus.faces)) < share
    surface = wind_consistently(glued(reversed_faces(torus, turned)))
    assert np.array_equal(surface.flipped, turned)
    assert np.array_equal(surface.faces, torus.faces)


def test_gluing_survives_the_turn() -> None:
    torus = trimesh.creation.torus(0.1, 0.03)
    turned = np.random.default_rng(2).random(len(torus.faces)) < 0.3
    surface = wind_consistently(glued(reversed_faces(torus, turned)))
    start, end = surface.faces.ravel(), np.roll(surface.faces, -1, axis=1).ravel()
    assert np.array_equal(start[surface.twin], end) and np.array_equal(
        surface.twin[surface.twin], np.arange(len(start))
    )


def test_moebius_strip_is_cut_open_and_two_sided() -> None:
    count = 30
    turn = 2 * np.pi * np.arange(count) / count
    rim = [
        np.stack(
            (
                (1 + w * np.cos(turn / 2)) * np.cos(turn),
                (1 + w * np.cos(turn / 2)) * np.sin(turn),
                w * np.sin(turn / 2),
            ),
            1,
        )
        for w in (-0.3, 0.3)
    ]
    faces = []
    for i in range(count):
        a, b = i, count + i
        c, d = (i + 1, count + i + 1) if i + 1 < count else (count, 0)
        faces += [(a, c, b), (b, c, d)]
    surface = wind_consistently(glued(trimesh.Trimesh(np.concatenate(rim), faces, process=False)))
    joined = np.flatnonzero(surface.twin >= 0)
    start, end = surface.faces.ravel(), np.roll(surface.faces, -1, axis=1).ravel()
    assert np.array_equal(start[surface.twin[joined]], end[joined])
    assert len(surface.boundary) == 2 * count + 2


def test_inside_out_solid_with_a_cavity_turns_as_a_whole() -> None:
    box, ball = trimesh.creation.box((0.1, 0.1, 0.1)), trimesh.creation.icosphere(subdivisions=2, radius=0.02)
    ball.invert()
    hollow = trimesh.util.concatenate([box, ball])
    true_volume = 0.1**3 - abs(ball.volume)
    for mesh in (hollow, reversed_faces(hollow, np.ones(len(hollow.faces), dtype=bool))):
        surface = face_outward(glued(mesh))
        result = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
        assert is_closed_and_consistent(surface.faces, len(surface.vertices))
        assert result.volume == pytest.approx(true_volume)


def test_matter_inside_a_shell_stays_matter() -> None:
    shell, screw = trimesh.creation.box((0.1, 0.1, 0.1)), trimesh.creation.icosphere(subdivisions=2, radius=0.02)
    mesh = trimesh.util.concatenate([shell, screw])
    assert not face_outward(glued(mesh)).flipped.any()


def test_components_know_the_smallest_that_encloses_them() -> None:
    balls = [trimesh.creation.icosphere(subdivisions=2, radius=r) for r in (0.3, 0.1, 0.2)]
    balls.append(trimesh.creation.icosphere(subdivisions=2, radius=0.05).apply_translation((0.28, 0.28, 0)))
    surface = glued(trimesh.util.concatenate(balls))
    assert enclosing_components(surface.vertices, surface.faces, surface.components()).tolist() == [-1, 2, 0, -1]


def test_winding_number_counts_the_solids_around_a_point() -> None:
    outer, inner = (
        trimesh.creation.icosphere(subdivisions=3, radius=1.0),
        trimesh.creation.icosphere(subdivisions=2, radius=0.5),
    )
    triangles = np.concatenate((outer.triangles, inner.triangles))
    points = np.array([[0.1, 0, 0], [0.7, 0, 0], [2.0, 0, 0]])
    assert np.allclose(winding_numbers(points, triangles), [2, 1, 0], atol=1e-9)
