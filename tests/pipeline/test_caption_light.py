"""Whose photo's light the words for colours discount."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from manitwin.engine.stage import Draft
from manitwin.pipeline.caption import is_photographed, light_of_texture
from manitwin.pipeline.item import Item

MADE = {"generation": {"generator": "lift"}, "matte": {"method": "network"}}


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    """A black square on a sheet of paper that the camera has made grey."""
    rgba = np.full((200, 200, 4), (170, 170, 170, 0), np.uint8)
    rgba[70:130, 70:130] = (50, 50, 50, 255)
    path = tmp_path / "photo.png"
    Image.fromarray(rgba).save(path)
    return path


def draft(fields: dict[str, Any], photo: Path) -> Draft[Item]:
    return Draft("id", Item(file="/photo.jpg"), 0, fields, {"photo.png": photo})


def test_a_mesh_that_was_painted_with_a_photo_has_its_light(photo: Path) -> None:
    light = light_of_texture(draft(MADE, photo))
    assert light is not None and 0.5 < light.white < 0.7
    assert is_photographed(draft(MADE, photo))
    assert not is_photographed(draft({"generation": {"generator": "meshy"}}, photo))
    assert not is_photographed(draft({}, photo))


@pytest.mark.parametrize(
    "fields",
    [
        {"generation": {"generator": "meshy"}, "matte": {"method": "network"}},  # its textures are its own
        {"generation": {"generator": "lift"}, "matte": {"method": "alpha"}},  # what is under alpha 0 is no ground
        {},
    ],
)
def test_other_meshes_have_no_light(fields: dict[str, Any], photo: Path) -> None:
    assert light_of_texture(draft(fields, photo)) is None
