"""What USD says is wrong with a file, beside the line that is."""

from __future__ import annotations

from pathlib import Path

import pytest
from pxr import Sdf, Tf

from manitwin.assets.readers.usd import read_here
from manitwin.errors import AssetError
from manitwin.formats.meshes.usd_errors import cause_of

BROKEN = '#usda 1.0\n(\n framesPerSecond = 0\n)\ndef Cube "box" {\n}\n'


def test_the_line_and_what_is_wrong_with_it_are_said(tmp_path: Path) -> None:
    (tmp_path / "box.usda").write_text(BROKEN)
    with pytest.raises(Tf.ErrorException) as caught:
        Sdf.Layer.OpenAsAnonymous(str(tmp_path / "box.usda"))
    assert cause_of(caught.value).startswith('line 3: invalid value for field "framesPerSecond"')


def test_usds_own_names_of_its_parser_are_left_out(tmp_path: Path) -> None:
    (tmp_path / "list.usda").write_text('#usda 1.0\ndef Xform "a" {\n float[] x = [1,2\n')
    with pytest.raises(Tf.ErrorException) as caught:
        Sdf.Layer.OpenAsAnonymous(str(tmp_path / "list.usda"))
    cause = cause_of(caught.value)
    assert cause.startswith("line ") and "pxrInternal" not in cause and "\n" not in cause


def test_bytes_that_are_no_text_are_told_too(tmp_path: Path) -> None:
    (tmp_path / "bytes.usda").write_bytes(b'#usda 1.0\ndef Mesh "a"\n{\n int[] face\x80Counts = [4]\n}\n')
    with pytest.raises(AssetError, match=r"its USD is broken \(line 4: "):
        read_here(tmp_path / "bytes.usda")


def test_a_broken_stage_is_refused_with_the_cause_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "box.usda").write_text(BROKEN)
    with pytest.raises(AssetError, match=r"its USD is broken \(line 3: invalid value .*; mend it there") as caught:
        read_here(tmp_path / "box.usda")
    assert "\n" not in str(caught.value)


def test_a_layer_that_is_not_fetched_is_told_and_the_rest_is_read(tmp_path: Path) -> None:
    (tmp_path / "mass.usda").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
    (tmp_path / "box.usda").write_text('#usda 1.0\n(\n subLayers = [@./mass.usda@]\n)\ndef Cube "box"\n{\n}\n')
    asset = read_here(tmp_path / "box.usda")
    assert asset.missing_files == ("./mass.usda",)
    assert any("mass.usda' holds a pointer of Git LFS, not the file" in each for each in asset.remarks)
