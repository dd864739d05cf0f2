"""glTF whose geometry Draco has compressed: what comes out is what went in, and broken data is one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from draco_document import BALL, DRACO, compressed_ball, document_of_ball, write_glb_of
from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh


def test_what_was_compressed_is_there_in_each_instance(tmp_path: Path) -> None:
    data = compressed_ball()
    parts = read_mesh(write_glb_of(tmp_path / "ball.glb", document_of_ball(data), data)).parts
    assert len(parts) == 2
    upper, lower = parts
    assert len(lower.faces) == len(BALL.faces)
    assert lower.bounds == pytest.approx(BALL.bounds, abs=1e-4)
    assert upper.bounds == pytest.approx(BALL.bounds + np.array([0, 1, 0]), abs=1e-4)
    shown = np.asarray(lower.visual.material.baseColorTexture).reshape(-1, 3)
    assert np.median(shown, axis=0).tolist() == [255, 0, 0]
    merged = trimesh.Trimesh(lower.vertices, lower.faces, process=True, merge_tex=True, merge_norm=True)
    assert merged.is_watertight and merged.volume == pytest.approx(BALL.volume, rel=1e-3)


def test_accessors_with_data_of_their_own_are_read_without_a_decoder(tmp_path: Path) -> None:
    positions, faces = BALL.vertices.astype("<f4").tobytes(), BALL.faces.astype("<u4").tobytes()
    tree = document_of_ball(b"")
    tree["buffers"] = [{"byteLength": len(positions) + len(faces)}]
    tree["bufferViews"] = [
        {"buffer": 0, "byteLength": len(positions)},
        {"buffer": 0, "byteOffset": len(positions), "byteLength": len(faces)},
    ]
    (primitive,) = tree["meshes"][0]["primitives"]
    primitive["attributes"] = {"POSITION": 0}
    tree["accessors"][0]["bufferView"], tree["accessors"][3]["bufferView"] = 0, 1
    del tree["extensionsRequired"]
    parts = read_mesh(write_glb_of(tmp_path / "ball.glb", tree, positions + faces)).parts
    assert parts[1].bounds == pytest.approx(BALL.bounds, abs=1e-6)


@pytest.mark.parametrize("broken", ["cut", "noise", "id", "no attributes", "view", "count"])
def test_broken_data_is_unreadable_in_one_line(tmp_path: Path, broken: str) -> None:
    data = compressed_ball()
    tree = document_of_ball(data)
    extension = tree["meshes"][0]["primitives"][0]["extensions"][DRACO]
    if broken == "cut":
        data = data[: len(data) // 2] + bytes(len(data) - len(data) // 2)
    elif broken == "noise":
        data = np.random.default_rng(0).bytes(len(data))
    elif broken == "id":
        extension["attributes"]["POSITION"] = 77
    elif broken == "no attributes":
        extension["attributes"] = None
    elif broken == "view":
        extension["bufferView"] = 5
    else:
        tree["accessors"][0]["count"] = 2**40
    with pytest.raises(InputError) as caught:
        read_mesh(write_glb_of(tmp_path / "ball.glb", tree, data))
    assert caught.value.reason in ("unreadable", "too_large") and "\n" not in caught.value.detail
    assert caught.value.detail.startswith("ball.glb: ")
