"""What is seen from outside: boxes within boxes, open boxes, sheets."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.render.drawable import drawable
from manitwin.render.surfaces import plain_part
from manitwin.render.visibility import faces_seen_from_outside


def box(side_m: float) -> trimesh.Trimesh:
    return trimesh.creation.box([side_m] * 3)


def both_sides(mesh: trimesh.Trimesh) -> list[np.ndarray]:
    return [faces_seen_from_outside(mesh, from_behind=behind) for behind in (False, True)]


def together(*meshes: trimesh.Trimesh) -> trimesh.Trimesh:
    vertices, faces = trimesh.util.append_faces([m.vertices for m in meshes], [m.faces for m in meshes])
    return trimesh.Trimesh(vertices, faces, process=False)


def without_lid(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces[mesh.face_normals[:, 2] < 0.5], process=False)


def test_convex_thing_is_seen_whole_and_never_from_behind() -> None:
    front, back = both_sides(trimesh.creation.icosphere(3, 0.05))
    assert front.all() and not back.any()


def test_closed_box_hides_what_is_in_it() -> None:
    outer, inner = box(0.1), trimesh.creation.icosphere(2, 0.03)
    front, back = both_sides(together(outer, inner))
    assert front[: len(outer.faces)].all() and not front[len(outer.faces) :].any()
    assert not back.any()


def test_open_box_shows_what_is_in_it_and_its_walls_from_behind() -> None:
    outer, inner = without_lid(box(0.1)), box(0.03)
    front, back = both_sides(together(outer, inner))
    assert front[: len(outer.faces)].all() and back[: len(outer.faces)].all()
    of_inner = front[len(outer.faces) :]
    assert of_inner[inner.face_normals[:, 2] > 0.5].all()  # through the opening
    assert not back[len(outer.faces) :].any()


def test_part_of_a_long_triangle_that_shows_is_enough() -> None:
    """A bar that is stuck in a box by nine tenths: its sides, two triangles each, are seen."""
    bar = trimesh.creation.box([0.02, 0.02, 0.1]).apply_translation([0, 0, 0.01])
    front = faces_seen_from_outside(together(box(0.1), bar))
    sides = np.abs(bar.face_normals[:, 2]) < 0.5
    assert front[12:][sides].sum() >= 4 and front[12:][bar.face_normals[:, 2] > 0.5].all()
    assert not front[12:][bar.face_normals[:, 2] < -0.5].any()


def test_drawable_leaves_out_what_is_hidden_where_it_is_asked_to() -> None:
    parts = [plain_part(box(0.1), (200, 80, 40)), plain_part(box(0.03), (20, 80, 40))]
    assert [len(s.faces) for s in drawable(parts).surfaces] == [12, 12]
    lean = drawable(parts, hidden_left_out=True)
    assert [len(s.faces) for s in lean.surfaces] == [12] and len(lean.shadow.faces) == 12
    assert lean.surfaces[0].color == drawable(parts).surfaces[0].color


def test_drawable_has_backs_of_those_faces_alone_that_are_seen_from_behind() -> None:
    """An open box beside a closed one."""
    closed = box(0.08).apply_translation([0.2, 0, 0])
    parts = [plain_part(without_lid(box(0.1)), (200, 80, 40)), plain_part(closed, (20, 80, 40))]
    assert [len(s.faces) for s in drawable(parts).surfaces] == [20, 24]
    lean = drawable(parts, hidden_left_out=True)
    assert [len(s.faces) for s in lean.surfaces] == [20, 12] and len(lean.shadow.faces) == 32
