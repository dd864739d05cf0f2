"""Textures in KTX2: decoded where the transcoder is there, told and left out otherwise, and never a crash."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ktx2_document import BLOCK_PX, ktx2_of_blocks, square_with
from manitwin.formats.meshes import ktx2
from manitwin.formats.meshes.read import MeshFile, read_mesh
from manitwin.formats.meshes.source import MeshLimits
from manitwin.formats.meshes.textures import material_of

COLORS = np.array([[[200, 100, 50, 255], [10, 20, 30, 255]], [[0, 255, 0, 255], [90, 90, 255, 255]]], np.uint8)
BASIS = {"extensions": {"KHR_texture_basisu": {"source": 0}}}


def read(folder: Path, data: bytes, *, limits: MeshLimits | None = None) -> MeshFile:
    (folder / "square.glb").write_bytes(data if data[:4] == b"glTF" else square_with([(data, "image/ktx2")], BASIS))
    return read_mesh(folder / "square.glb", limits=limits or MeshLimits())


def texture_in(read: MeshFile) -> np.ndarray | None:
    texture = material_of(read.parts[0]).baseColorTexture
    return None if texture is None else np.asarray(texture)


@pytest.mark.parametrize("alpha", [255, 100])
def test_a_texture_is_decoded_with_its_first_row_on_top(tmp_path: Path, alpha: int) -> None:
    colors = COLORS.copy()
    colors[0, 1, 3] = alpha
    square = read(tmp_path, ktx2_of_blocks(colors))
    expected = colors.repeat(BLOCK_PX, axis=0).repeat(BLOCK_PX, axis=1)
    assert square.findings == []
    assert np.array_equal(texture_in(square), expected if alpha < 255 else expected[..., :3])


def test_a_picture_of_a_plain_kind_goes_before_its_twin_in_ktx2(tmp_path: Path) -> None:
    stream = io.BytesIO()
    Image.new("RGB", (2, 2), (1, 2, 3)).save(stream, "PNG")
    both = [(ktx2_of_blocks(COLORS), "image/ktx2"), (stream.getvalue(), "image/png")]
    square = read(tmp_path, square_with(both, {"source": 1, **BASIS}))
    assert texture_in(square)[0, 0].tolist() == [1, 2, 3]


def test_where_the_transcoder_is_missing_its_installation_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ktx2, "find_spec", lambda name: None)
    square = read(tmp_path, ktx2_of_blocks(COLORS))
    assert texture_in(square) is None
    assert any(ktx2.INSTALL in finding and "left out" in finding for finding in square.findings)


@pytest.mark.parametrize(
    "broken",
    [
        ktx2_of_blocks(COLORS)[:20],
        ktx2_of_blocks(COLORS)[:90],
        ktx2_of_blocks(COLORS)[:-8],
        ktx2_of_blocks(COLORS, supercompression=2),
        ktx2_of_blocks(COLORS).replace(bytes([166, 1, 2]), bytes([1, 1, 2])),
        ktx2_of_blocks(COLORS)[:20] + bytes(8) + ktx2_of_blocks(COLORS)[28:],
    ],
)
def test_a_broken_texture_is_left_out_and_told(tmp_path: Path, broken: bytes) -> None:
    square = read(tmp_path, broken)
    assert texture_in(square) is None and len(square.parts[0].faces) == 2
    (finding,) = square.findings
    assert "left out" in finding and "\n" not in finding


@pytest.mark.parametrize("side_px", [4096, 60_000])
def test_a_texture_that_says_to_be_large_is_left_out_before_it_is_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, side_px: int
) -> None:
    monkeypatch.setattr(ktx2, "run_isolated", lambda *a, **k: pytest.fail("decoded"))
    large = bytearray(ktx2_of_blocks(COLORS))
    large[20:28] = side_px.to_bytes(4, "little") * 2
    square = read(tmp_path, bytes(large), limits=replace(MeshLimits(), max_texture_pixels=1 << 20))
    assert texture_in(square) is None and "limit" in square.findings[0]


def test_pixels_that_are_not_wanted_at_once_are_decoded_when_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(ktx2, "run_isolated", lambda *a, **k: pytest.fail("decoded"))
        square = read(tmp_path, ktx2_of_blocks(COLORS), limits=replace(MeshLimits(), decode_textures=False))
        texture = material_of(square.parts[0]).baseColorTexture
        assert texture.size == (8, 8)
    assert texture.convert("RGB").getpixel((0, 0)) == (200, 100, 50)
    assert texture.mode == "RGB" and np.array_equal(np.asarray(texture)[-1, -1], COLORS[1, 1, :3])
