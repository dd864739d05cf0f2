"""glTF that meshoptimizer has compressed: each mode and filter of the extension, and broken streams in one line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from manitwin.errors import InputError
from manitwin.formats.meshes.gltf_meshopt import decode_indices, decode_triangles, decompress_view
from manitwin.formats.meshes.read import read_mesh
from manitwin.formats.meshes.textures import normals_of
from meshopt_document import compressed_document, stream

BALL = trimesh.creation.icosphere(subdivisions=1, radius=0.05)


def _saved(folder: Path, tree: dict[str, Any]) -> Path:
    (folder / "ball.gltf").write_text(json.dumps(tree))
    return folder / "ball.gltf"


@pytest.mark.parametrize(("places", "error_m"), [("places", 1e-8), ("exponential", 5e-6)])
@pytest.mark.parametrize("triangles", ["triangles", "indices"])
def test_a_compressed_ball_is_the_ball(tmp_path: Path, places: str, error_m: float, triangles: str) -> None:
    read = read_mesh(_saved(tmp_path, compressed_document(places, triangles)))
    (part,) = read.parts
    assert np.allclose(part.vertices, BALL.vertices, atol=error_m) and part.is_watertight
    assert part.volume == pytest.approx(BALL.volume, rel=1e-3)
    normals = normals_of(part)
    assert normals is not None and np.allclose(normals, BALL.vertices / 0.05, atol=0.02) and read.findings == []


def test_triangles_keep_their_order_and_sides() -> None:
    faces = decode_triangles(stream("triangles"), 240).reshape(-1, 3)
    turned = [[np.roll(face, k).tolist() for k in range(3)] for face in BALL.faces]
    assert all(face in choices for face, choices in zip(faces.tolist(), turned, strict=True))
    assert np.array_equal(decode_indices(stream("indices"), 240).reshape(-1, 3), BALL.faces)


def test_quaternions_are_unit_ones_with_their_signs() -> None:
    made = decompress_view(stream("quaternions"), mode="ATTRIBUTES", filter="QUATERNION", count=6, stride=8)
    quaternions = np.frombuffer(made, "<i2").reshape(6, 4) / 32767
    given = np.random.default_rng(0).normal(size=(6, 4))
    given /= np.linalg.norm(given, axis=1, keepdims=True)
    assert np.allclose(np.abs((quaternions * given).sum(axis=1)), 1, atol=1e-5)


def test_deltas_of_four_bits_are_the_specifications_example() -> None:
    """Appendix A, mode 0: sixteen deltas, of which two follow as whole bytes."""
    group = bytes.fromhex("175ff0bc77a9210034b5")
    data = b"\xa0" + b"\x02" + group + b"\x00" * 3 + bytes(32)
    made = np.frombuffer(decompress_view(data, mode="ATTRIBUTES", filter="NONE", count=16, stride=4), np.uint8)
    deltas = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0]
    assert made.reshape(16, 4)[:, 0].tolist() == (np.cumsum(deltas) % 256).tolist()


def _told(tree: dict[str, Any], view: int) -> dict[str, Any]:
    told: dict[str, Any] = tree["bufferViews"][view]["extensions"]["EXT_meshopt_compression"]
    return told


@pytest.mark.parametrize(
    ("view", "change", "cause"),
    [
        (0, {"byteLength": 100}, "a stream that ends early"),
        (0, {"byteLength": 20}, "a stream without its end"),
        (0, {"byteOffset": 5}, "no stream of attributes"),
        (0, {"byteStride": 10}, "attributes of 10 bytes"),
        (0, {"filter": "OCTAHEDRAL"}, "filter 'OCTAHEDRAL' of 12 bytes"),
        (0, {"byteLength": 10**9}, "truncated: a compressed view ends at"),
        (2, {"mode": "LINES"}, "mode 'LINES'"),
        (2, {"byteLength": 110}, "EXT_meshopt_compression data is broken"),
        (2, {"count": 239}, "no stream of triangles"),
        (2, {"mode": "INDICES"}, "no stream of indices"),
    ],
)  # fmt: skip
def test_broken_streams_are_one_clear_line(tmp_path: Path, view: int, change: dict[str, Any], cause: str) -> None:
    tree = compressed_document()
    _told(tree, view).update(change)
    with pytest.raises(InputError) as caught:
        read_mesh(_saved(tmp_path, tree))
    assert caught.value.reason == "unreadable" and cause in str(caught.value) and "\n" not in str(caught.value)


def test_absurd_counts_are_refused_before_they_are_decoded(tmp_path: Path) -> None:
    tree = compressed_document()
    _told(tree, 0)["count"] = 10**9
    with pytest.raises(InputError) as caught:
        read_mesh(_saved(tmp_path, tree))
    assert caught.value.reason == "too_large"
