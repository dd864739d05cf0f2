"""The meshes that stage after stage loads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.textures import make_part, pbr_material
from manitwin.pipeline import object_state
from manitwin.pipeline.object_state import KEPT, drop_cached_textures, load_solid, load_visual
from manitwin.render.surfaces import plain_part


def written(folder: Path, size_m: float) -> Path:
    box = trimesh.creation.box((size_m, 0.1, 0.1))
    path = folder / f"{size_m}.npz"
    np.savez(path, vertices=box.vertices, faces=box.faces)
    return path


def test_stages_of_items_in_turn_find_their_solids_as_they_left_them(tmp_path: Path) -> None:
    paths = [written(tmp_path, 0.1 * number) for number in range(1, KEPT + 2)]
    in_turn = paths[:KEPT]
    first = [load_solid(path) for path in in_turn]
    assert all(load_solid(path) is solid for path, solid in zip(in_turn, first, strict=True))
    load_solid(paths[-1])
    assert load_solid(paths[0]) is not first[0], "the one that was not asked for longest makes room"


def test_a_solid_that_somebody_changed_is_read_again(tmp_path: Path) -> None:
    path = written(tmp_path, 0.1)
    load_solid(path).vertices[0] += 1.0
    assert np.allclose(load_solid(path).extents, 0.1)


def test_parts_are_the_same_ones_for_stage_after_stage_until_their_file_is_another(tmp_path: Path) -> None:
    path, box = tmp_path / "visual.glb", trimesh.creation.box((0.1, 0.1, 0.1))
    path.write_bytes(write_glb([plain_part(box, (200, 10, 10))]))
    (first,) = load_visual(path)
    assert load_visual(path)[0] is first
    path.write_bytes(write_glb([plain_part(box.apply_scale(2.0), (200, 10, 10))]))
    assert np.allclose(load_visual(path)[0].extents, 0.2)


def test_large_textures_make_room_before_meshes_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    paths = []
    for shade in range(3):
        box = trimesh.creation.box((0.1, 0.1, 0.1))
        picture = Image.new("RGB", (64, 32), (80 * shade, 0, 0))
        part = make_part(
            box.vertices,
            box.faces,
            material=pbr_material(base_color_texture=picture),
            name="box",
            uv=box.vertices[:, :2],
        )
        paths.append(tmp_path / f"{shade}.glb")
        paths[-1].write_bytes(write_glb([part]))
    monkeypatch.setattr(object_state, "MOST_TEXTURE_PIXELS", 2 * 64 * 32)
    first, second, _ = (load_visual(path)[0] for path in paths)
    assert load_visual(paths[1])[0] is second and load_visual(paths[0])[0] is not first
    monkeypatch.setattr(object_state, "MOST_TEXTURE_PIXELS", 0)
    (last,) = load_visual(paths[2])
    assert load_visual(paths[2])[0] is last, "the mesh that was loaded last is kept whatever it has"


def test_textures_are_let_go_before_the_next_thing_is_read_and_what_is_plain_stays(tmp_path: Path) -> None:
    box, paths = trimesh.creation.box((0.1, 0.1, 0.1)), (tmp_path / "textured.glb", tmp_path / "plain.glb")
    material = pbr_material(base_color_texture=Image.new("RGB", (8, 8), (9, 90, 0)))
    parts = (
        make_part(box.vertices, box.faces, material=material, name="box", uv=box.vertices[:, :2]),
        plain_part(box, (9, 9, 9)),
    )
    for path, part in zip(paths, parts, strict=True):
        path.write_bytes(write_glb([part]))
    textured, plain = (load_visual(path)[0] for path in paths)
    drop_cached_textures()
    assert load_visual(paths[1])[0] is plain and load_visual(paths[0])[0] is not textured
