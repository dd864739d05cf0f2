"""check: damage of every kind is named and put right, and what a build finds damaged it makes again."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from manitwin.cli.main import app
from manitwin.config import RunConfig
from manitwin.dataset.check import damaged_twins, disagreements
from manitwin.dataset.index.parts import IndexTables, indexed_twins
from manitwin.engine.drive import RunReport, drive
from manitwin.engine.ledger.integrity import LedgerDamaged
from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.ledger.reading import read_ledger
from manitwin.errors import UsageError
from manitwin.pipeline.item import Item
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.integrity import write_sizes
from manitwin.twin.migration import SCHEMA_VERSION
from manitwin.twin.store import RECORD, canonical_json, read_record, revision_of
from rehearsal_recipe import RehearsalRecipe
from twin_folders import write_accepted

TEXTS = ("one", "two", "three")


def built(place: Path, texts: tuple[str, ...] = TEXTS) -> RunReport:
    """Build small twins, or go on with them: the same recipe each time."""
    recipe = replace(RehearsalRecipe(size=10), tables=IndexTables())
    items = [Item(file=None, text=text) for text in texts]
    settings = RunConfig(patience_s=0)
    return drive(recipe, items, DatasetRoot(place), settings, configuration={}, executor="inline")


@pytest.fixture
def place(tmp_path: Path) -> Path:
    assert built(tmp_path / "data").exit_code == 0
    return tmp_path / "data"


def twins(place: Path) -> list[Path]:
    return sorted(place.glob("twins/*/*"))


def content(place: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(place)): path.read_bytes() for path in place.glob("twins/*/*/*") if path.name != "run.json"
    }


def found(place: Path, *, repair: bool = False, digests: bool = False) -> list[str]:
    ledger = Ledger(place / "ledger.sqlite")
    try:
        wrong = list(disagreements(ledger, DatasetRoot(place), True, digests=digests))
        for each in wrong if repair else ():
            if each.repair is not None:
                each.repair()
    finally:
        ledger.close()
    return [each.what for each in wrong]


def cut(path: Path) -> None:
    os.truncate(path, path.stat().st_size // 2)


def pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def link_out(path: Path) -> None:
    outside = path.parents[4] / "outside"
    outside.write_text("no one may read this")
    path.unlink()
    path.symlink_to(outside)


DAMAGES: dict[str, Callable[[Path], None]] = {
    "cut": cut,
    "emptied": lambda path: os.truncate(path, 0),
    "removed": lambda path: path.unlink(),
    "a pipe": pipe,
    "a link out": link_out,
    "a device": lambda path: (path.unlink(), path.symlink_to("/dev/zero"))[0],
    "a folder": lambda path: (path.unlink(), path.mkdir())[0],
}


def test_results_of_items_that_have_ended_may_be_removed_whole(place: Path) -> None:
    before = content(place)
    shutil.rmtree(place / ".work")
    assert found(place) == [] and found(place, digests=True) == []
    assert built(place).exit_code == 0 and content(place) == before
    shutil.rmtree(twins(place)[0])
    assert built(place).exit_code == 0 and content(place) == before


def test_results_of_an_item_at_work_may_not_be_removed(place: Path) -> None:
    with sqlite3.connect(place / "ledger.sqlite") as ledger:
        (number,) = ledger.execute("SELECT min(number) FROM items WHERE state = 'accepted'").fetchone()
        ledger.execute("UPDATE items SET state = 'waiting' WHERE number = ?", (number,))
    ledger.close()
    shutil.rmtree(place / ".work")
    assert any(f"item {number}, stage " in each and "its result is missing" in each for each in found(place))


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("file", ["twin.json", "run.json", "grasps.parquet", "visual.glb"])
def test_damaged_file_is_named_and_made_again(place: Path, file: str, damage: str) -> None:
    before = content(place)
    DAMAGES[damage](twins(place)[1] / file)
    said = found(place)
    assert 1 <= len(said) <= 2, "a folder without a record is named as such too"
    assert all(twins(place)[1].name in line and "\n" not in line for line in said)
    assert found(place, repair=True) == said
    assert built(place).exit_code == 0 and content(place) == before and found(place) == []


@pytest.mark.parametrize("damage", ["cut", "removed", "a link out"])
def test_build_makes_damaged_files_again_by_itself(place: Path, damage: str) -> None:
    before = content(place)
    DAMAGES[damage](twins(place)[0] / "grasps.parquet")
    shutil.rmtree(twins(place)[2])
    report = built(place)
    assert "2 finished folders were missing or damaged: they are built again" in report.remarks
    assert report.exit_code == 0 and content(place) == before and found(place) == []
    assert built(place).remarks == ["3 of 3 items were in the data set already"]


def test_altered_byte_is_seen_by_digests_alone(place: Path) -> None:
    path = twins(place)[0] / "visual.glb"
    path.write_bytes(path.read_bytes()[:-1] + b"\1")
    assert found(place) == []
    (said,) = found(place, digests=True)
    assert "visual.glb differs from what was written (its sha256 differs)" in said


def test_foreign_files_are_named_and_left(place: Path) -> None:
    (twins(place)[0] / "views").mkdir()
    (twins(place)[0] / "views/\x1bmine.png").write_text("mine")
    said = found(place, repair=True)
    assert len(said) == 1 and r"contains views/\x1bmine.png, which does not belong to it" in said[0]
    assert (twins(place)[0] / "views/\x1bmine.png").exists()


@pytest.mark.parametrize("file", ["grasps.parquet", "visual.glb"])
def test_twin_without_sizes_is_looked_at_by_its_files_own_ends(tmp_path: Path, file: str) -> None:
    identity = write_accepted(tmp_path, 1)
    root = DatasetRoot(tmp_path)
    assert list(damaged_twins(root)) == []
    cut(tmp_path / root.twin_name(identity) / file)
    (said,) = damaged_twins(root)
    assert f"{file} is truncated" in said


def test_amended_twin_is_whole(tmp_path: Path) -> None:
    from manitwin.twin.store import replace_files

    folder = tmp_path / DatasetRoot(tmp_path).twin_name(write_accepted(tmp_path, 1))
    write_sizes(folder)
    replace_files(folder, {"source.obj": b"other"}, lambda sizes: write_sizes(folder, sizes))
    assert list(damaged_twins(DatasetRoot(tmp_path), digests=True)) == [] and read_record(folder, verify=True)


@pytest.mark.parametrize("result", ["{", "[" * 200_000, '{"digests": 3}', "{}", "x"])
def test_damaged_result_of_a_stage_runs_again(place: Path, result: str) -> None:
    before = content(place)
    shutil.rmtree(twins(place)[0])
    for path in (place / ".work").rglob("result.json"):
        path.write_text(result)
    assert built(place).exit_code == 0 and content(place) == before


def test_damaged_file_of_a_stage_runs_again(place: Path) -> None:
    before = content(place)
    for path in (place / ".work").rglob("*.bin"):
        path.write_bytes(b"x")
    assert found(place) == [] and len(found(place, digests=True)) == 9
    shutil.rmtree(twins(place)[0])
    assert built(place).exit_code == 0 and content(place) == before


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("file", ["parts.json", "twins/*.parquet"])
def test_damaged_index_is_named_by_readers_and_healed(place: Path, file: str, damage: str) -> None:
    from manitwin import Dataset

    before = indexed_twins(DatasetRoot(place))
    DAMAGES[damage](next((place / "index").glob(file)))
    with pytest.raises(UsageError, match=r"run manitwin (check|index)"):
        Dataset(place).grasps()
    assert built(place).exit_code == 0 and indexed_twins(DatasetRoot(place)) == before
    assert len(Dataset(place).ids()) == 3


@pytest.mark.parametrize(
    "parts",
    ["[" * 200_000, "[]", '{"parts": 3}', '{"parts": [{"name": "../../secret", "rows": {}, "first": "a", "last": "b"}]}', "\xff"],
)  # fmt: skip
def test_list_of_parts_that_is_none_is_refused(place: Path, parts: str) -> None:
    (place / "index/parts.json").write_bytes(parts.encode("latin-1"))
    with pytest.raises(UsageError, match="run manitwin check") as caught:
        indexed_twins(DatasetRoot(place))
    assert "\n" not in str(caught.value)


def test_folder_of_other_things_is_refused_and_left(place: Path) -> None:
    (place / "config.json").write_text('{"kind": "trajectories"}')
    shutil.rmtree(place / "twins")
    done = CliRunner().invoke(app, ["check", str(place)])
    assert isinstance(done.exception, UsageError) and "contains trajectories, not twins" in str(done.exception)
    with read_ledger(place / "ledger.sqlite") as ledger:
        assert ledger.execute("SELECT count(*) FROM items WHERE state = 'accepted'").fetchone()[0] == 3


LEDGERS: dict[str, Callable[[Path], object]] = {
    "text": lambda path: path.write_text("hello"),
    "cut": cut,
    "zeros": lambda path: path.write_bytes(b"\0" * 5000),
    "a pipe": pipe,
    "a device": lambda path: (path.unlink(), path.symlink_to("/dev/zero")),
    "a link out": lambda path: (path.unlink(), path.symlink_to("/etc/hostname")),
    "another database": lambda path: path.write_bytes(other_database(path.with_name("other"))),
}


def other_database(path: Path) -> bytes:
    import sqlite3

    connection = sqlite3.connect(path)
    connection.execute(
        "CREATE VIEW items AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i FROM n) SELECT i FROM n"
    )
    connection.commit()
    connection.close()
    return path.read_bytes()


@pytest.mark.parametrize("damage", LEDGERS)
def test_damaged_ledger_is_said_put_aside_and_recovered_from_folders(place: Path, damage: str) -> None:
    before = content(place)
    ledger = place / "ledger.sqlite"
    LEDGERS[damage](ledger)
    with pytest.raises(LedgerDamaged, match="manitwin check"):
        built(place)
    with pytest.raises(LedgerDamaged), read_ledger(ledger) as reader:
        reader.execute("SELECT count(*) FROM items").fetchall()
    (place / "config.json").write_text(canonical_json({}))
    dry = CliRunner().invoke(app, ["check", str(place), "--dry-run"])
    assert dry.exit_code == 4 or "not a readable ledger" in dry.output
    assert os.path.lexists(ledger)
    done = CliRunner().invoke(app, ["check", str(place)])
    assert done.exit_code == 0 and not os.path.lexists(ledger), done.output
    assert "moved aside as ledger.sqlite.damaged" in done.output.replace("\n", " ")
    assert built(place).exit_code == 0 and content(place) == before and found(place) == []


def test_lock_and_log_that_are_links_are_not_written(place: Path, tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    outside.write_text("mine")
    (place / "ledger.lock").unlink(missing_ok=True)
    (place / "ledger.lock").symlink_to(outside)
    with pytest.raises(UsageError, match=r"ledger\.lock: cannot be opened"):
        built(place)
    assert outside.read_text() == "mine"


@pytest.mark.parametrize("name", [".work", "twins", "index"])
def test_folder_that_leads_out_is_not_written(place: Path, tmp_path: Path, name: str) -> None:
    shutil.move(place / name, tmp_path / "elsewhere")
    (place / name).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(UsageError, match="a link to a place outside"):
        built(place)


def made_newer(folder: Path) -> bytes:
    """Make of a twin's record one of the next schema, as a newer version would have left it; returns its bytes."""
    said = json.loads((folder / RECORD).read_text()) | {"schema_version": SCHEMA_VERSION + 1, "weather": "fine"}
    said["revision"] = revision_of(said)
    (folder / RECORD).write_text(canonical_json(said))
    write_sizes(folder)
    return (folder / RECORD).read_bytes()


def test_a_twin_of_a_newer_version_is_named_and_left_as_it_is(place: Path) -> None:
    record = made_newer(twins(place)[0])
    (said,) = [line for line in found(place, repair=True) if "twin.json" in line]
    assert f"of schema {SCHEMA_VERSION + 1}" in said and "use the version that wrote it" in said
    assert (twins(place)[0] / RECORD).read_bytes() == record


def test_a_build_under_another_recipe_stops_at_a_twin_of_a_newer_version(place: Path) -> None:
    record = made_newer(twins(place)[0])
    recipe = replace(RehearsalRecipe(size=10, versions=(("a", "2"),)), tables=IndexTables())
    items = [Item(file=None, text=text) for text in TEXTS]
    report = drive(recipe, items, DatasetRoot(place), RunConfig(patience_s=0), configuration={}, executor="inline")
    assert report.exit_code == 4 and report.stopped is not None
    assert report.stopped.startswith("twins/") and f"twin.json: of schema {SCHEMA_VERSION + 1}" in report.stopped
    assert (twins(place)[0] / RECORD).read_bytes() == record
