"""A file of a kind that is not read says so by itself as it does in a folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from manitwin.errors import InputError
from manitwin.formats.sniff import sniff
from manitwin.pipeline.left_alone import why_no_input


@pytest.mark.parametrize("content", [b"", b"ISO-10303-21;\nHEADER;", b"PK\3\4" + bytes(60)])
@pytest.mark.parametrize("name", ["thing.step", "a.zip", "robot.URDF", "clip.mp4"])
def test_single_file_is_refused_with_the_reason_of_a_folder(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError) as refused:
        sniff(path)
    assert refused.value.reason == "wrong_type" and str(refused.value).endswith(f"{name}: {why_no_input(path)}")


def test_image_under_such_a_name_is_an_image(tmp_path: Path) -> None:
    path = tmp_path / "photo.zip"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(64))
    assert sniff(path).format == "png"
