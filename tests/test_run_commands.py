"""run, status, retry and check as a person types them, on inputs that end at once."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from manitwin.engine.ledger.ledger import Ledger, read_ledger
from manitwin.errors import UsageError
from manitwin.pipeline import dataset_run
from manitwin.pipeline.item import Item


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
    done = manitwin("run", manifest, "-o", "data", "--quick", folder=tmp_path)
    assert done.returncode == 3, done.stderr
    assert "3 items, 3 to do" in done.stdout and "3 rejected" in done.stdout and "dot.png" in done.stdout
    again = manitwin("run", "-o", "data", folder=tmp_path)
    assert again.returncode == 3 and "3 items, 0 to do" in again.stdout

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
    third = manitwin("run", "-o", "data", folder=tmp_path)
    assert "3 items, 1 to do" in third.stdout and "3 rejected" in third.stdout
    check = manitwin("check", "data", folder=tmp_path)
    assert check.returncode == 0 and "agree" in check.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run"], "no data set"),
        (["run", "missing.csv", "-o", "data"], "missing.csv"),
        (["run", "list.csv", "-o", "data", "--executor", "rai"], "did you mean 'ray'"),
        (["run", "list.csv", "-o", "data", "--jobs", "0"], "jobs is 0"),
        (["run", "list.csv", "-o", "nowhere://data"], "nowhere"),
        (["status", "data"], "manitwin run MANIFEST"),
        (["retry", "data", "--state", "lost"], "unknown state 'lost'"),
        (["check", "data"], "no ledger"),
    ],
)
def test_wrong_use_is_one_line_and_makes_no_data_set(
    tmp_path: Path, manifest: Path, arguments: list[str], message: str
) -> None:
    done = manitwin(*arguments, folder=tmp_path)
    assert done.returncode == 2, done.stdout
    assert message in done.stderr and done.stderr.count("\n") == 1
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

    monkeypatch.setattr(dataset_run, "Ledger", LateLedger)
    with pytest.raises(UsageError, match="a bad row"):
        dataset_run._opened_with(bad_rows(), path)
    with read_ledger(path) as kept:
        assert "a mug" in kept.execute("SELECT item FROM items").fetchone()[0]


def test_a_bad_manifest_leaves_no_new_ledger_and_no_folder(tmp_path: Path) -> None:
    def bad_rows() -> Iterator[Item]:
        yield Item(file=None, text="a cup")
        raise UsageError("a bad row")

    with pytest.raises(UsageError, match="a bad row"):
        dataset_run._opened_with(bad_rows(), tmp_path / "data" / "ledger.sqlite")
    assert not (tmp_path / "data").exists()


def test_check_names_and_repairs(tmp_path: Path, manifest: Path) -> None:
    manitwin("run", manifest, "-o", "data", "--quick", folder=tmp_path)
    lost = next((tmp_path / "data" / "twins").glob("*/*/twin.json"))
    lost.unlink()
    ledger = Ledger(tmp_path / "data" / "ledger.sqlite")
    ledger.close()
    said = manitwin("check", "data", "--dry-run", folder=tmp_path)
    assert said.returncode == 4 and "no folder" in said.stderr
    repaired = manitwin("check", "data", folder=tmp_path)
    assert repaired.returncode == 0 and "put right" in repaired.stdout
    manitwin("run", "-o", "data", folder=tmp_path)
    assert lost.is_file() and manitwin("check", "data", folder=tmp_path).returncode == 0
