"""``manitwin layout``: what is asked for on the command line is in the scenes, and what is said of them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import typer
from PIL import Image
from typer.testing import CliRunner

from manitwin.cli.commands.layout import layout
from manitwin.errors import UsageError
from manitwin.scenes.layouts.layouts_run import CONTACT_SHEET
from manitwin.scenes.scene import SCENE
from manitwin.scenes.scene_files import read_scene
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.store import RECORD, write_twin_record
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
        write_twin_record(folder, record)
    return root


def test_upright_is_what_the_scenes_are_and_who_lies_is_said(bottles: Path, tmp_path: Path) -> None:
    arguments = [str(bottles), "-o", str(tmp_path / "out"), "-n", "2", "--objects", "4..4", "--upright", "--jobs", "1"]
    arguments.append("--sheet")
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    assert "twins without an upright placement, placed in another resting pose: 1" in done.output
    assert "joints" not in done.output
    assert f"2 of 2 scenes in {tmp_path / 'out'}/contact_sheet.webp" in done.output
    with Image.open(tmp_path / "out" / "contact_sheet.webp") as sheet:
        assert sheet.width > 512
    scenes = [read_scene(path) for path in sorted((tmp_path / "out").rglob(SCENE))]
    assert len(scenes) == 2
    for scene in scenes:
        assert {(each.category, each.placement) for each in scene.objects} == {("bottle", 1), ("ruler", 0)}


@pytest.mark.slow
def test_scenes_of_other_settings_stay_as_they_are(bottles: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    made = [str(bottles), "-o", str(out), "--jobs", "1", "--objects", "1..1", "--seed", "3"]
    assert CliRunner().invoke(app, [*made, "-n", "2", "--sheet", "--pictures"]).exit_code == 0
    drawn = {path: path.read_bytes() for path in sorted(out.rglob("scenes/**/*")) if path.is_file()}
    sheet = (out / CONTACT_SHEET).read_bytes()
    assert any(path.suffix == ".webp" for path in drawn)
    refused = CliRunner().invoke(app, [*made, "-n", "1", "--upright", "--objects", "2..3"])
    assert isinstance(refused.exception, UsageError)
    assert re.search(
        r"out: 2 scenes in it were made with other settings \(layout\.objects: \[1, 1\] there, \[2, 3\] now;"
        r" layout\.upright: false there, true now\); .* or another folder",
        str(refused.exception),
    )
    assert {path: path.read_bytes() for path in drawn} == drawn
    assert (out / CONTACT_SHEET).read_bytes() == sheet
    # more of the same: those that were drawn stay so, the new one is drawn, and the sheet shows it
    done = CliRunner().invoke(app, [*made, "-n", "3"])
    assert done.exit_code == 0, done.output
    assert "3 layouts, 1 to do" in done.output
    assert {path: path.read_bytes() for path in drawn} == drawn
    assert len(list(out.rglob("pictures.json"))) == 3
    assert (out / CONTACT_SHEET).read_bytes() != sheet


def test_a_folder_of_something_else_is_refused(bottles: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "config.json").write_text('{"kind": "trajectories"}')
    refused = CliRunner().invoke(app, [str(bottles), "-o", str(tmp_path / "out"), "-n", "1"])
    assert "contains trajectories, not layouts; give another folder" in str(refused.exception)
