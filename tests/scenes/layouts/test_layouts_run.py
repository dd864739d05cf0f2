"""Where scenes lie, and whose twins they are of."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import pytest
from typer.testing import CliRunner

import manitwin
from manitwin.cli.main import app
from manitwin.config import RunConfig
from manitwin.engine.ledger.reading import read_ledger
from manitwin.errors import UsageError
from manitwin.pipeline.settings import stored_config
from manitwin.scenes.layouts.layouts_recipe import LayoutStage
from manitwin.scenes.layouts.layouts_run import layout_totals, make_layouts
from manitwin.scenes.scene_files import scene_ids, scene_name
from manitwin.scenes.settings import LayoutsConfig, LayoutSettings
from manitwin.twin.dataset_root import DatasetRoot
from scene_twins import THINGS, write_things

CONFIG = LayoutsConfig(seed=4, layout=LayoutSettings(objects=(2, 4)))


def test_a_run_of_layouts_is_found_loaded_and_goes_on(tmp_path: Path) -> None:
    write_things(tmp_path / "twins_here")
    out = tmp_path / "made"
    report = make_layouts(tmp_path / "twins_here", out, 3, CONFIG, executor="inline")
    assert report.exit_code == 0 and scene_ids(out) == [f"layout_4_{n:06d}" for n in range(3)]
    scene = manitwin.load_scene(out / scene_name("layout_4_000001"))
    assert scene.to_mujoco().nbody == len(scene.placed_objects()) + 1
    before = (out / scene_name("layout_4_000001") / "scene.json").read_bytes()
    opened: list[int] = []
    make_layouts(
        tmp_path / "twins_here", out, 5, CONFIG, executor="inline", on_start=lambda items, todo: opened.append(todo)
    )
    assert opened == [2] and (out / scene_name("layout_4_000001") / "scene.json").read_bytes() == before
    with pytest.raises(UsageError, match="contains layouts, not twins"):
        stored_config(DatasetRoot(out))
    totals = layout_totals(out)
    assert totals.accepted == 5 and totals.acceptance == 1.0
    assert 0 <= totals.max_penetration_m <= 0.001 and totals.max_moved_m <= 0.01


def test_a_category_that_no_twin_has_is_said_at_once(tmp_path: Path) -> None:
    write_things(tmp_path / "twins_here")
    config = LayoutsConfig(layout=LayoutSettings(include=("kettle",)))
    with pytest.raises(UsageError, match=r"kettle.*there are: board, box, can"):
        make_layouts(tmp_path / "twins_here", tmp_path / "made", 1, config, executor="inline")
    assert not (tmp_path / "made").exists()


def test_a_scene_that_lies_elsewhere_needs_its_data_set(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="say which data set"):
        manitwin.load_scene(tmp_path / "scene.json")


def test_scenes_are_exported_like_twins(tmp_path: Path) -> None:
    write_things(tmp_path / "twins_here")
    make_layouts(tmp_path / "twins_here", tmp_path / "made", 1, CONFIG, executor="inline")
    done = CliRunner().invoke(
        app, ["export", str(tmp_path / "made"), "-o", str(tmp_path / "out"), "--to", "mjcf,sdf,usd"]
    )
    assert done.exit_code == 0, done.output
    model = mujoco.MjModel.from_xml_path(str(next((tmp_path / "out" / "layout_4_000000" / "mjcf").glob("*.xml"))))
    assert model.nbody >= 3
    assert (tmp_path / "out" / "layout_4_000000" / "sdf" / "scene.sdf").is_file()
    assert any((tmp_path / "out" / "layout_4_000000" / "usd").iterdir())
    refused = CliRunner().invoke(app, ["export", str(tmp_path / "made"), "-o", str(tmp_path / "out"), "--to", "urdf"])
    assert isinstance(refused.exception, UsageError) and "Valid: mjcf, sdf, usd" in str(refused.exception)


def scenes_of(out: Path) -> dict[str, bytes]:
    return {path.parent.name: path.read_bytes() for path in out.glob("scenes/*/*/scene.json")}


def test_scenes_that_another_version_made_stay_as_they_are_and_the_run_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_things(tmp_path / "twins")
    write_things(tmp_path / "built_anew", THINGS[:3])
    out, config = tmp_path / "made", CONFIG.model_copy(update={"run": RunConfig(keep_work=False)})
    with monkeypatch.context() as earlier:
        earlier.setattr(LayoutStage, "version", "of an earlier version")
        make_layouts(tmp_path / "twins", out, 2, config, executor="inline")
    before = scenes_of(out)
    opened: list[int] = []
    report = make_layouts(
        tmp_path / "built_anew", out, 3, config, executor="inline", on_start=lambda items, todo: opened.append(todo)
    )
    assert opened == [3] and report.exit_code == 0
    after = scenes_of(out)
    assert len(after) == 3 and {name: after[name] for name in before} == before
    (said,) = [line for line in report.remarks if "another version" in line]
    assert said.startswith("2 were made by another version") and "their scenes stay as they are" in said


def test_a_scene_of_a_newer_version_is_refused_and_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_things(tmp_path / "twins_here")
    out, config = tmp_path / "made", CONFIG.model_copy(update={"run": RunConfig(keep_work=False, attempts=1)})
    make_layouts(tmp_path / "twins_here", out, 1, config, executor="inline")
    (scene,) = out.glob("scenes/*/*/scene.json")
    scene.write_text(json.dumps({**json.loads(scene.read_text()), "schema_version": 3, "weather": "fine"}))
    before = scenes_of(out)
    monkeypatch.setattr(LayoutStage, "version", "another")
    assert make_layouts(tmp_path / "twins_here", out, 1, config, executor="inline").exit_code == 4
    with read_ledger(out / "ledger.sqlite") as ledger:
        (detail,) = ledger.execute("SELECT detail FROM items").fetchone()
    assert "scene.json: of schema 3, this version reads up to 2; use the version that wrote it" in detail
    assert scenes_of(out) == before
