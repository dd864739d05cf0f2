"""Which things show their faces from behind."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import mug
from manitwin.render.drawable import prepare_drawable, shows_back_faces
from manitwin.render.procedural_textures import ProceduralTexture, textured_box
from manitwin.render.surfaces import plain_part


def part(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return plain_part(mesh, (200, 80, 40))


def without_top(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    mesh = mesh.copy()
    mesh.update_faces(mesh.triangles_center[:, 2] < mesh.bounds[1, 2] - 1e-4)
    return mesh


def test_closed_solids_hide_them_even_hollow_ones() -> None:
    for mesh in (trimesh.creation.box([0.1, 0.1, 0.1]), trimesh.creation.icosphere(3, 0.05), mug()):
        assert not shows_back_faces([part(mesh)])


def test_open_boxes_and_turned_faces_show_them() -> None:
    box = trimesh.creation.box([0.1, 0.1, 0.1]).subdivide()
    assert shows_back_faces([part(without_top(box))])
    turned = box.copy()
    turned.invert()
    assert shows_back_faces([part(turned)])


def test_box_of_two_open_halves_hides_them() -> None:
    box = trimesh.creation.box([0.1, 0.1, 0.1]).subdivide()
    upper = box.triangles_center[:, 2] > 0
    halves = [trimesh.Trimesh(box.vertices, box.faces[mask], process=False) for mask in (upper, ~upper)]
    assert not shows_back_faces([part(half) for half in halves])
    assert shows_back_faces([part(halves[0])])


def test_only_things_that_show_them_are_drawn_from_both_sides() -> None:
    box = trimesh.creation.box([0.1, 0.1, 0.1]).subdivide()
    for mesh, sides in ((box, 1), (without_top(box), 2)):
        ready = prepare_drawable([part(mesh)])
        assert len(ready.surfaces[0].faces) == sides * len(mesh.faces) == len(ready.shadow.faces)


def test_textures_are_no_larger_than_asked_for() -> None:
    texture = ProceduralTexture(np.full((256, 128, 3), 90, np.uint8), np.full((256, 128), 140, np.uint8), 0.0, 0.5)
    parts = [textured_box(np.array([0.1, 0.1, 0.1]), texture)]
    assert prepare_drawable(parts).surfaces[0].color_map.shape[:2] == (256, 128)
    assert prepare_drawable(parts, most_texture_px=64).surfaces[0].color_map.shape[:2] == (64, 32)


def test_creases_of_plain_parts_do_not_keep_their_vertices() -> None:
    """A box whose sides have normals of their own, cut into 768 triangles, is a box of twelve after it was simplified."""
    box = trimesh.creation.box([0.1, 0.06, 0.04]).subdivide().subdivide().subdivide()
    apart = trimesh.Trimesh(box.triangles.reshape(-1, 3), np.arange(3 * len(box.faces)).reshape(-1, 3), process=False)
    (surface,) = prepare_drawable([part(apart)], tolerance_m=0.0004).surfaces
    assert len(surface.faces) < 0.1 * len(box.faces)
    corners = surface.vertices[surface.faces].astype(float)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(across, axis=1).sum() / 2 == pytest.approx(box.area, rel=1e-6)
    across /= np.linalg.norm(across, axis=1)[:, None]
    np.testing.assert_allclose(surface.normals[surface.faces], np.repeat(across[:, None], 3, 1), atol=1e-5)
