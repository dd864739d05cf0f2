"""``manitwin layout``: what is asked for on the command line is in the scenes, and what is said of them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import typer
from PIL import Image
from typer.testing import CliRunner

from manitwin.commands.layout import layout
from manitwin.dataset_root import twin_name
from manitwin.scenes.scene import SCENE
from manitwin.scenes.scene_file import read_scene
from manitwin.store import RECORD, seal
from scene_twins import slab, write_thing

app = typer.Typer()
app.command()(layout)

ON_ITS_SIDE = {"position_m": [-0.1, 0.0, 0.03], "quaternion_wxyz": [0.5**0.5, 0.0, 0.5**0.5, 0.0], "upright": False,
               "settled": True, "probability": 0.96, "collision_radius_m": 0.12}  # fmt: skip


@pytest.fixture
def bottles(tmp_path: Path) -> Path:
    """Three bottles that mostly lie, and a ruler that only does."""
    root = tmp_path / "twins"
    bottle, ruler = slab("bottle", 0.06, 0.06, 0.2), slab("ruler", 0.2, 0.03, 0.01)
    for number, thing in enumerate((bottle, bottle, bottle, ruler)):
        folder = root / twin_name(write_thing(root, number, thing))
        record = json.loads((folder / RECORD).read_bytes())
        standing = record["placements"][0]
        if thing is ruler:
            record["placements"] = [{**standing, "upright": False}]
        else:
            record["placements"] = [ON_ITS_SIDE, {**standing, "probability": 0.04}]
        del record["revision"], record["files"]
        seal(folder, record)
    return root


def test_upright_is_what_the_scenes_are_and_who_lies_is_said(bottles: Path, tmp_path: Path) -> None:
    arguments = [str(bottles), "-o", str(tmp_path / "out"), "-n", "2", "--objects", "4..4", "--upright", "--jobs", "1"]
    arguments.append("--sheet")
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    assert "twins that have no upright placement and lie as they rest: 1" in done.output
    assert f"2 of 2 scenes in {tmp_path / 'out'}/contact_sheet.webp" in done.output
    with Image.open(tmp_path / "out" / "contact_sheet.webp") as sheet:
        assert sheet.width > 512
    scenes = [read_scene(path) for path in sorted((tmp_path / "out").rglob(SCENE))]
    assert len(scenes) == 2
    for scene in scenes:
        assert {(each.category, each.placement) for each in scene.objects} == {("bottle", 1), ("ruler", 0)}
