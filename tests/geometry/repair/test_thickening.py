from dataclasses import replace

import numpy as np
import pytest
import trimesh

from manitwin.geometry.distance import distance_to_surface
from manitwin.geometry.repair.halfedges import group_edges, is_closed_and_consistent, twins_of_manifold_edges
from manitwin.geometry.repair.surface import Surface
from manitwin.geometry.repair.thickening import thicken


def _walls(mesh: trimesh.Trimesh, thickness_m: float) -> tuple[Surface, trimesh.Trimesh]:
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64)
    loose = Surface.unglued(vertices, faces, np.arange(len(faces)), np.zeros(len(faces), dtype=bool))
    sheet = replace(loose, twin=twins_of_manifold_edges(group_edges(faces, len(vertices)))).with_split_vertices()
    walls = thicken(sheet, thickness_m)
    return walls, trimesh.Trimesh(walls.vertices, walls.faces, process=False)


def _open_top(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces[mesh.face_normals[:, 2] < 0.99], process=False)


def test_open_box_has_the_volume_of_its_walls() -> None:
    """Outside 100 x 80 x 60 mm, open at the top; corner vertices move so that every plane moves by the thickness."""
    box = trimesh.creation.box((0.1, 0.08, 0.06))
    for _ in range(3):
        box = box.subdivide()
    walls, mesh = _walls(_open_top(box), 0.003)
    assert is_closed_and_consistent(walls.faces, len(walls.vertices))
    assert mesh.volume == pytest.approx(0.1 * 0.08 * 0.06 - 0.094 * 0.074 * 0.057, rel=0.02)
    assert np.allclose(mesh.extents, (0.1, 0.08, 0.06))


def test_wall_of_a_cup_is_as_thick_as_asked_everywhere() -> None:
    cup = trimesh.creation.cylinder(radius=0.04, height=0.1, sections=96).subdivide().subdivide()
    walls, _ = _walls(_open_top(cup), 0.002)
    count = int((walls.source >= 0).sum())
    outside = trimesh.Trimesh(walls.vertices, walls.faces[:count], process=False)
    inside = walls.vertices[np.unique(walls.faces[count : 2 * count])]
    distance = distance_to_surface(inside, outside)
    assert np.percentile(distance, 5) > 0.0019 and distance.max() < 0.0022
    assert walls.source[count:].max() == -1


def test_wall_stays_inside_a_tube_thinner_than_two_walls() -> None:
    tube = trimesh.creation.cylinder(radius=0.002, height=0.1, sections=32).subdivide().subdivide()
    _, mesh = _walls(_open_top(tube), 0.003)
    assert mesh.is_watertight
    assert 0 < mesh.volume < np.pi * 0.002**2 * 0.1
    assert np.allclose(mesh.bounds[:, :2], [[-0.002, -0.002], [0.002, 0.002]], atol=1e-5)
