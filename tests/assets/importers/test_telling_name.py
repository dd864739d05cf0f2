"""The name of an imported asset."""

from __future__ import annotations

from pathlib import Path

import pytest

from manitwin.assets.importers.telling_name import telling_name


@pytest.mark.parametrize(
    ("name", "path", "told"),
    [
        ("red mug", "assets/model.sdf", "red mug"),
        ("textured", "assets/milk/milk.xml", "milk"),
        ("World", "assets/lamp_bulb.usd", "lamp_bulb"),
        ("model.urdf", "ycb_objects/YcbBanana/model.urdf", "YcbBanana"),
        ("MuJoCo Model", "milk/scene.xml", "milk"),
        ("object_1", "ketchup", "ketchup"),  # a folder
        ("base_link", "scene/model.urdf", "base_link"),  # nothing of it says anything
        ("model car", "assets/model.sdf", "model car"),
        ("bowl.urdf", "bowls/bowl.urdf", "bowl"),
        ("cube.urdf", "assets/pallet.urdf", "pallet"),  # copied from another one
        ("cube.urdf", "assets/model.urdf", "cube"),
    ],
)
def test_a_name_that_tools_write_gives_way_to_that_of_the_file(name: str, path: str, told: str) -> None:
    assert telling_name(name, Path("/") / path) == told
