from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh

HEADER = """ply
format {format} 1.0
element vertex 5
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face 2
property list uchar int vertex_indices
end_header
"""
VERTICES = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0.5, 0)]
COLORS = [(255, 0, 0)] * 5
FACES = [(0, 1, 2, 3), (1, 4, 2)]


def _binary(order: str) -> bytes:
    rows = b"".join(struct.pack(order + "3f3B", *v, *c) for v, c in zip(VERTICES, COLORS, strict=True))
    return rows + b"".join(struct.pack(f"{order}B{len(f)}i", len(f), *f) for f in FACES)


def _write(path: Path, format: str) -> Path:
    if format == "ascii":
        body = "".join(f"{' '.join(map(str, (*v, *c)))}\n" for v, c in zip(VERTICES, COLORS, strict=True))
        data = (body + "".join(f"{len(f)} {' '.join(map(str, f))}\n" for f in FACES)).encode()
    else:
        data = _binary("<" if format == "binary_little_endian" else ">")
    path.write_bytes(HEADER.format(format=format).encode() + data)
    return path


@pytest.mark.parametrize("format", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_mixed_polygons_and_colours_are_read_in_every_encoding(tmp_path: Path, format: str) -> None:
    (part,) = read_mesh(_write(tmp_path / "a.ply", format)).parts
    assert len(part.faces) == 3
    assert part.area == pytest.approx(1.5)
    assert part.visual.material.baseColorTexture.getpixel((0, 0)) == (255, 0, 0)


@pytest.mark.parametrize("encoding", ["binary", "ascii"])
def test_plys_of_trimesh_come_back_whole(tmp_path: Path, encoding: str) -> None:
    sphere = trimesh.creation.icosphere(subdivisions=2)
    sphere.export(tmp_path / "a.ply", encoding=encoding)
    (part,) = read_mesh(tmp_path / "a.ply").parts
    assert len(part.faces) == len(sphere.faces)
    assert part.volume == pytest.approx(sphere.volume, rel=1e-5)


def test_texture_beside_the_file_is_used(tmp_path: Path) -> None:
    Image.new("RGB", (2, 2), (0, 0, 255)).save(tmp_path / "skin of it.png")
    text = "ply\nformat ascii 1.0\ncomment TextureFile skin of it.png\nelement vertex 3\n"
    text += (
        "".join(f"property float {n}\n" for n in "xyzst")
        + "element face 1\nproperty list uchar int vertex_index\nend_header\n"
    )
    (tmp_path / "a.ply").write_text(text + "0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n")
    (part,) = read_mesh(tmp_path / "a.ply").parts
    assert part.visual.material.baseColorTexture.getpixel((1, 1)) == (0, 0, 255)
    assert part.visual.uv.shape == (3, 2)


def test_point_cloud_has_no_faces(tmp_path: Path) -> None:
    trimesh.PointCloud(np.eye(3)).export(tmp_path / "a.ply")
    with pytest.raises(InputError, match="3 vertices") as caught:
        read_mesh(tmp_path / "a.ply")
    assert caught.value.reason == "no_faces"


def test_absurd_row_count_is_refused_before_memory_is_asked_for(tmp_path: Path) -> None:
    header = HEADER.format(format="binary_little_endian").replace("vertex 5", f"vertex {10**12}")
    (tmp_path / "a.ply").write_bytes(header.encode() + _binary("<"))
    with pytest.raises(InputError, match="truncated"):
        read_mesh(tmp_path / "a.ply")


def test_ascii_and_binary_stl_give_the_same_closed_solid(tmp_path: Path) -> None:
    sphere = trimesh.creation.icosphere(subdivisions=1)
    sphere.export(tmp_path / "b.stl")
    sphere.export(tmp_path / "a.stl", file_type="stl_ascii")
    for name in ("a.stl", "b.stl"):
        (part,) = read_mesh(tmp_path / name).parts
        assert len(part.faces) == 80
        assert part.volume == pytest.approx(sphere.volume, rel=1e-5)
