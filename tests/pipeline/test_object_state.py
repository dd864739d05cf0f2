"""The meshes that stage after stage loads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from manitwin.formats.glb import write_glb
from manitwin.pipeline.object_state import KEPT, load_solid, load_visual
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
