"""OFF texts: what trimesh writes, ModelNet's glued header, colours, and broken ones in one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh
from manitwin.formats.meshes.textures import normals_of

SQUARE = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


def _saved(folder: Path, text: str) -> Path:
    place = folder / "thing.off"
    place.write_text(text)
    return place


def test_what_trimesh_writes_is_read(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    read = read_mesh(_saved(tmp_path, ball.export(file_type="off")))
    (part,) = read.parts
    assert (read.format, read.unit_m, read.up, read.findings) == ("off", None, None, [])
    assert np.allclose(part.vertices[part.faces], ball.vertices[ball.faces], atol=1e-6)


@pytest.mark.parametrize(
    "header", ["OFF\n4 1 0\n", "OFF 4 1 0\n", "OFF4 1 0\n", "\n  OFF\n4 1 0\n", "OFF # of one face\n\n4 1 0\n"]
)
def test_a_polygon_is_a_fan_however_the_counts_are_written(tmp_path: Path, header: str) -> None:
    (part,) = read_mesh(_saved(tmp_path, f"{header}{SQUARE}4 0 1 2 3\n")).parts
    assert len(part.faces) == 2 and part.area == pytest.approx(1)


@pytest.mark.parametrize(
    "text",
    [
        f"OFF\n4 1 0\n{SQUARE}4 0 1 2 3 255 0 0\n",
        f"OFF\n4 1 0\n{SQUARE}4 0 1 2 3 1.0 0.0 0.0 1.0\n",
        "COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n0 1 0 255 0 0 255\n3 0 1 2\n",
    ],
    ids=["bytes of a face", "shares of a face", "of vertices"],
)
def test_colours_of_faces_and_vertices_are_kept(tmp_path: Path, text: str) -> None:
    (part,) = read_mesh(_saved(tmp_path, text)).parts
    shown = np.asarray(part.visual.material.baseColorTexture).reshape(-1, 3)
    assert shown.max(axis=0).tolist() == [255, 0, 0]


def test_normals_are_read(tmp_path: Path) -> None:
    text = "NOFF\n3 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n"
    (part,) = read_mesh(_saved(tmp_path, text)).parts
    normals = normals_of(part)
    assert normals is not None and np.allclose(normals, [0, 0, 1])


@pytest.mark.parametrize(
    ("text", "reason", "cause"),
    [
        ("OFF\n4 1 0\n0 0 0\n", "unreadable", "truncated"),
        ("OFF\n", "unreadable", "counts"),
        ("OFF\n-4 1 0\n", "unreadable", "counts"),
        (f"OFF\n4 1 0\n{SQUARE}4 0 1 2 9\n", "unreadable", "does not exist"),
        (f"OFF\n4 1 0\n{SQUARE}4 0 1\n", "unreadable", "fewer corners"),
        (f"OFF\n4 1 0\n{SQUARE}x 0 1 2\n", "unreadable", "broken"),
        ("OFF\n3 1 0\n0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "unreadable", "as many numbers"),
        ("OFF BINARY\n", "unreadable", "not an OFF text"),
        ("4OFF\n3 1 0\n0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2\n", "unreadable", "more than three"),
        (f"OFF\n4 0 0\n{SQUARE}", "no_faces", "no faces"),
        ("OFF\n4 999999999999 0\n", "too_large", "faces"),
    ],
)
def test_broken_texts_are_refused_in_one_line(tmp_path: Path, text: str, reason: str, cause: str) -> None:
    with pytest.raises(InputError) as caught:
        read_mesh(_saved(tmp_path, text))
    assert caught.value.reason == reason and cause in caught.value.detail and "\n" not in caught.value.detail
    assert caught.value.detail.startswith("thing.off: ")
