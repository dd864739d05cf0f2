"""build, status, retry and check as a person types them, on inputs that end at once."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import manitwin as package
import manitwin.cli.main as main_module
from manitwin.config import BuildConfig
from manitwin.engine import drive
from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.ledger.reading import read_ledger
from manitwin.errors import UsageError
from manitwin.pipeline.item import Item
from manitwin.pipeline.recipe import TwinRecipe
from manitwin.pipeline.settings import stored_config
from manitwin.twin.dataset_root import DatasetRoot
from scene_twins import THINGS, write_things


def manitwin(*arguments: object, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "XDG_STATE_HOME": str(folder / "state"), "COLUMNS": "160"}
    command = [sys.executable, "-m", "manitwin", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=environment, cwd=folder)


@pytest.fixture
def manifest(tmp_path: Path) -> Path:
    (tmp_path / "empty.png").write_bytes(b"")
    Image.fromarray(np.zeros((1, 1, 3), np.uint8)).save(tmp_path / "dot.png")
    (tmp_path / "text.obj").write_text("no mesh")
    path = tmp_path / "list.csv"
    path.write_text("file,name\nempty.png,mug\ndot.png,cup\ntext.obj,bowl\n")
    return path


def test_a_run_from_manifest_to_tables(tmp_path: Path, manifest: Path) -> None:
    done = manitwin("build", manifest, "-o", "data", "--quick", "--jobs", "1", folder=tmp_path)
    assert done.returncode == 3, done.stderr
    assert "3 inputs, 3 to do" in done.stdout and "3 rejected" in done.stdout and "dot.png" in done.stdout
    again = manitwin("build", "-o", "data", "--jobs", "1", folder=tmp_path)
    assert again.returncode == 3 and "3 inputs, 0 to do" in again.stdout

    status = manitwin("status", "data", folder=tmp_path)
    assert status.returncode == 0 and "3 of 3 items ended: 3 rejected" in status.stdout
    assert "too_small" in status.stdout and "last run: finished" in status.stdout
    counts = [line.split() for line in status.stdout.splitlines()]
    columns = {line[0]: line for line in counts if line[0] in ("input", "photo")}
    assert columns["input"][1:3] == ["1", "2"], "one is read, two rejected as they are read"
    rejected = status.stdout.splitlines()[0].index("rejected") + len("rejected")
    assert status.stdout.splitlines()[1][:rejected].endswith("2"), status.stdout
    assert columns["photo"][1] == "1"
    why = manitwin("status", "data", "--why", "text.obj", folder=tmp_path)
    assert "rejected (wrong_type)" in why.stdout and "wrong_type: text.obj" in why.stdout

    retried = manitwin("retry", "data", "--state", "rejected", "--reason", "too_small", folder=tmp_path)
    assert retried.returncode == 0 and "1 items are open again" in retried.stdout
    third = manitwin("build", "-o", "data", "--jobs", "1", folder=tmp_path)
    assert "3 inputs, 1 to do" in third.stdout and "3 rejected" in third.stdout
    check = manitwin("check", "data", folder=tmp_path)
    assert check.returncode == 0 and "agree" in check.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["build"], "no data set"),
        (["build", "missing.csv", "-o", "data"], "missing.csv"),
        (["build", "list.csv", "-o", "data", "--executor", "rai"], "did you mean 'ray'"),
        (["build", "list.csv", "-o", "data", "--jobs", "0"], "jobs is 0"),
        (["build", "list.csv", "-o", "nowhere://data"], "nowhere"),
        (["status", "data"], "manitwin build INPUT"),
        (["retry", "data", "--state", "lost"], "unknown state 'lost'"),
        (["check", "data"], "no ledger"),
    ],
)
def test_wrong_use_is_one_line_and_makes_no_data_set(
    tmp_path: Path,
    manifest: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr(sys, "argv", ["manitwin", *arguments])
    assert main_module._run() == 2
    said = capsys.readouterr()
    assert message in said.err and said.err.count("\n") == 1 and not said.out
    assert not (tmp_path / "data").exists()


def test_without_a_driver_that_renders_nothing_is_begun(
    tmp_path: Path, manifest: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MANITWIN_RENDER_DEVICE_FOUND", raising=False)
    monkeypatch.setenv("VK_DRIVER_FILES", "/nowhere.json")
    monkeypatch.setenv("VK_ICD_FILENAMES", "/nowhere.json")
    done = manitwin("build", "list.csv", "-o", "data", folder=tmp_path)
    assert done.returncode == 4, done.stdout
    assert "no Vulkan device can render (/nowhere.json" in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / "data").exists()


def test_a_bad_manifest_removes_no_ledger_that_another_run_made_meanwhile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "data" / "ledger.sqlite"

    class LateLedger(Ledger):
        def __init__(self, path: Path):
            other = Ledger(path)  # makes, fills and closes it before the lock is taken here
            other.add_items([Item(file=None, text="a mug")])
            other.close()
            super().__init__(path)

    def bad_rows() -> Iterator[Item]:
        yield Item(file=None, text="a cup")
        raise UsageError("a bad row")

    monkeypatch.setattr(drive, "Ledger", LateLedger)
    with pytest.raises(UsageError, match="a bad row"):
        drive._open_ledger_with_items(bad_rows(), TwinRecipe(BuildConfig()), path)
    with read_ledger(path) as kept:
        assert "a mug" in kept.execute("SELECT item FROM items").fetchone()[0]


def test_a_bad_manifest_leaves_no_new_ledger_and_no_folder(tmp_path: Path) -> None:
    def bad_rows() -> Iterator[Item]:
        yield Item(file=None, text="a cup")
        raise UsageError("a bad row")

    with pytest.raises(UsageError, match="a bad row"):
        drive._open_ledger_with_items(bad_rows(), TwinRecipe(BuildConfig()), tmp_path / "data" / "ledger.sqlite")
    assert not (tmp_path / "data").exists()


@pytest.mark.slow
def test_check_names_and_repairs(tmp_path: Path, manifest: Path) -> None:
    manitwin("build", manifest, "-o", "data", "--quick", folder=tmp_path)
    lost = next((tmp_path / "data" / "twins").glob("*/*/twin.json"))
    lost.unlink()
    ledger = Ledger(tmp_path / "data" / "ledger.sqlite")
    ledger.close()
    said = manitwin("check", "data", "--dry-run", folder=tmp_path)
    assert said.returncode == 4 and "its folder is missing" in said.stderr
    repaired = manitwin("check", "data", folder=tmp_path)
    assert repaired.returncode == 0 and "repaired" in repaired.stdout
    manitwin("build", "-o", "data", folder=tmp_path)
    assert lost.is_file() and manitwin("check", "data", folder=tmp_path).returncode == 0


def test_the_old_name_says_so_in_one_line_and_builds(tmp_path: Path, manifest: Path) -> None:
    done = manitwin("run", manifest, "--dataset", "data", "--quick", "--executor", "inline", folder=tmp_path)
    assert done.returncode == 3 and "3 rejected" in done.stdout
    assert (
        done.stderr.splitlines()[0]
        == "`manitwin run` is deprecated and will be removed in the next version; use `manitwin build`"
    )
    assert "│ run " not in manitwin("--help", folder=tmp_path).stdout


@pytest.mark.slow
def test_other_settings_make_again_what_is_given_and_without_inputs_all(tmp_path: Path, manifest: Path) -> None:
    here = ("-o", "data", "--executor", "inline")
    manitwin("build", "empty.png", *here, folder=tmp_path)
    other = manitwin("build", "dot.png", *here, "--seed", 5, folder=tmp_path)
    assert "2 inputs, 1 to do" in other.stdout and "0 accepted, 1 rejected, 0 unfinished" in other.stdout
    same = manitwin("build", "dot.png", *here, folder=tmp_path)
    assert "2 inputs, 0 to do" in same.stdout and "dot.png" in same.stdout and "(already there)" in same.stdout
    everything = manitwin("build", *here, folder=tmp_path)
    assert "2 inputs, 1 to do" in everything.stdout and "0 accepted, 2 rejected, 0 unfinished" in everything.stdout
    status = manitwin("status", "data", folder=tmp_path)
    assert "2 of 2 items ended" in status.stdout


@pytest.mark.slow
def test_tables_are_there_at_once(tmp_path: Path, manifest: Path) -> None:
    manitwin("build", manifest, "-o", "data", "--quick", folder=tmp_path)
    asked = manitwin("query", "data", "reason = 'empty'", "--table", "rejections", "-f", "csv", folder=tmp_path)
    assert asked.returncode == 0 and "mug" in asked.stdout, asked.stderr
    assert manitwin("check", "data", folder=tmp_path).returncode == 0


def test_one_input_twice_is_one_twin_and_a_duplicate(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        (tmp_path / name).write_bytes(b"")
    report = package.build([tmp_path / "a.png", tmp_path / "b.png"], tmp_path / "data", executor="inline")
    assert [result.status for result in report.results] == ["rejected", "duplicate"]
    assert report.results[1].detail == "the same input as item 1"
    assert [report.count(status) for status in ("rejected", "duplicate", "unfinished")] == [1, 1, 0]
    again = package.build([tmp_path / "a.png"], tmp_path / "data", executor="inline")
    assert [(result.status, result.reused) for result in again.results] == [("rejected", True)]


@pytest.fixture
def flat(tmp_path: Path) -> Path:
    """Two twins as an earlier version left them: directly below a folder."""
    folder = tmp_path / "flat"
    write_things(tmp_path / "data", THINGS[1:3])
    for twin in (tmp_path / "data" / "twins").glob("*/*"):
        shutil.copytree(twin, folder / twin.name)
    return folder


@pytest.mark.slow
def test_the_flat_layout_is_read_and_said_to_be_old(tmp_path: Path, flat: Path) -> None:
    old = f"{flat.name}: uses the flat layout of earlier versions, which can be read but not extended"
    for words, said in (
        (("check", "flat"), "2 twins: all their files are there"),
        (("index", "flat"), "2 accepted, 0 rejected"),
        (("query", "flat", "--format", "ids"), "\n"),
        (("export", "flat", "--to", "mjcf", "-o", "exports"), "2 twins exported"),
    ):
        done = manitwin(*words, folder=tmp_path)
        assert done.returncode == 0 and said in done.stdout and old in done.stderr, (words, done)
    assert len(package.Dataset(flat)) == 2
    twin = package.Dataset(flat)[0]
    (twin.folder / "visual.glb").unlink()
    damaged = manitwin("check", "flat", folder=tmp_path)
    assert damaged.returncode == 4 and "lacks visual.glb" in damaged.stderr


def test_nothing_is_built_into_the_flat_layout(tmp_path: Path, flat: Path, manifest: Path) -> None:
    before = sorted(path.name for path in flat.iterdir())
    done = manitwin("build", manifest, "-o", "flat", folder=tmp_path)
    assert done.returncode == 2 and "flat layout of earlier versions" in done.stderr and "new folder" in done.stderr
    assert sorted(path.name for path in flat.iterdir()) == before


def test_settings_of_an_earlier_version_that_decided_nothing_are_passed_over(tmp_path: Path) -> None:
    (tmp_path / "config.json").write_text('{"seed": 7, "item_timeout_s": 1800.0}')
    assert stored_config(DatasetRoot(tmp_path)).seed == 7
    (tmp_path / "config.json").write_text("[]")
    with pytest.raises(UsageError, match="give --config"):
        stored_config(DatasetRoot(tmp_path))
