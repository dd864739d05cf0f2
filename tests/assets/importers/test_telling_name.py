"""The name of an imported asset."""

from __future__ import annotations

from pathlib import Path

import pytest

from manitwin.assets.importers.asset_name import informative_name


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
        ("physics", "robots/r2d2.urdf", "r2d2"),  # ROS's tutorial
    ],
)
def test_a_name_that_tools_write_gives_way_to_that_of_the_file(name: str, path: str, told: str) -> None:
    assert informative_name(name, Path("/") / path) == told


@pytest.mark.parametrize(
    ("name", "file", "expected"),
    [
        ("cube", "dinner/plate.urdf", "plate"),  # copied from cube.urdf, which lies above
        ("cube", "dinner/cube_small.urdf", "cube"),  # a cube too
        ("cube", "cube.urdf", "cube"),
        ("cube", "dinner/model.urdf", "cube"),  # whose file says nothing
        ("bowl", "dinner/dish.urdf", "bowl"),  # no file around is called so
        ("cube", "dinner/plates/big/plate.urdf", "cube"),  # too far away to be what it was copied from
        ("../cube", "dinner/plate.urdf", "../cube"),
    ],
)
def test_the_name_of_another_file_around_says_nothing(tmp_path: Path, name: str, file: str, expected: str) -> None:
    for each in ("cube.urdf", file):
        (tmp_path / each).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / each).touch()
    assert informative_name(name, tmp_path / file) == expected
