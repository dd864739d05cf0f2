"""What is seen from outside: boxes within boxes, open boxes, sheets."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.render.cameras import orbit_cameras
from manitwin.render.drawable import prepare_drawable
from manitwin.render.renderer import shared_renderer
from manitwin.render.surfaces import plain_part
from manitwin.render.visibility import externally_visible_faces, is_closed_and_outward


def box(side_m: float) -> trimesh.Trimesh:
    return trimesh.creation.box([side_m] * 3)


def both_sides(mesh: trimesh.Trimesh) -> list[np.ndarray]:
    return [externally_visible_faces(mesh, from_behind=behind) for behind in (False, True)]


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
    front = externally_visible_faces(together(box(0.1), bar))
    sides = np.abs(bar.face_normals[:, 2]) < 0.5
    assert front[12:][sides].sum() >= 4 and front[12:][bar.face_normals[:, 2] > 0.5].all()
    assert not front[12:][bar.face_normals[:, 2] < -0.5].any()


def test_drawable_leaves_out_what_is_hidden_where_it_is_asked_to() -> None:
    parts = [plain_part(box(0.1), (200, 80, 40)), plain_part(box(0.03), (20, 80, 40))]
    assert [len(s.faces) for s in prepare_drawable(parts).surfaces] == [12, 12]
    lean = prepare_drawable(parts, hidden_left_out=True)
    assert [len(s.faces) for s in lean.surfaces] == [12] and len(lean.shadow.faces) == 12
    assert lean.surfaces[0].color == prepare_drawable(parts).surfaces[0].color


def test_drawable_has_backs_of_those_faces_alone_that_are_seen_from_behind() -> None:
    """An open box beside a closed one."""
    closed = box(0.08).apply_translation([0.2, 0, 0])
    parts = [plain_part(without_lid(box(0.1)), (200, 80, 40)), plain_part(closed, (20, 80, 40))]
    assert [len(s.faces) for s in prepare_drawable(parts).surfaces] == [20, 24]
    lean = prepare_drawable(parts, hidden_left_out=True)
    assert [len(s.faces) for s in lean.surfaces] == [20, 12] and len(lean.shadow.faces) == 32


def test_closed_pieces_that_face_outward_show_no_back() -> None:
    apart = box(0.05).apply_translation([0.2, 0, 0])
    assert is_closed_and_outward(together(box(0.1), apart))
    assert is_closed_and_outward(trimesh.Trimesh([*box(0.1).vertices, [0.3, 0, 0]], box(0.1).faces, process=False))
    assert not is_closed_and_outward(without_lid(box(0.1)))
    apart.invert()
    assert not is_closed_and_outward(together(box(0.1), apart))
    assert not is_closed_and_outward(together(box(0.1), trimesh.Trimesh(box(0.1).vertices, box(0.1).faces[:4])))


def test_seams_of_textures_are_no_open_edges() -> None:
    mesh = box(0.1)
    split = trimesh.Trimesh(mesh.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False)
    assert is_closed_and_outward(split)


def test_closed_things_look_the_same_without_their_backs() -> None:
    mesh = trimesh.creation.torus(0.05, 0.02)
    parts = [plain_part(mesh, (200, 80, 40)), plain_part(box(0.03).apply_translation([0, 0, 0.06]), (20, 80, 40))]
    cameras = orbit_cameras(np.asarray(mesh.vertices), fov_y_deg=30.0, size_px=128, elevations_deg=(20.0, 50.0))
    both, fronts = (shared_renderer().render(parts, cameras, with_backs=backs) for backs in (True, False))
    for one, other in zip(both, fronts, strict=True):
        differs = (one.rgb != other.rgb).any(2)
        assert differs.sum() <= 4  # along the outline, where a back has the same depth
        assert (one.coverage > 0).sum() > 3000
