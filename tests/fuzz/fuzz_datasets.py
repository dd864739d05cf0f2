"""Data sets that are damaged: index, ledger and settings, by the commands that read them."""

from __future__ import annotations

import contextlib
import io
import json
from pathlib import Path

import typer
from fuzz_target import Case, target

from manitwin.config import BuildConfig
from manitwin.dataset.index.parts import write_part
from manitwin.dataset.index.query import Index
from manitwin.dataset.index.rows import rows_of
from manitwin.dataset.statistics.query import ReportTables
from manitwin.dataset.statistics.report import run_queries
from manitwin.engine.ledger.ledger import LEDGER, Ledger
from manitwin.engine.ledger.location import CONFIG
from manitwin.pipeline.item import Item
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import read_record
from twin_folders import write_set


def command(*arguments: object) -> int:
    """Run a command in this process; what it raises is raised, and what it prints is not seen."""
    from manitwin.cli.main import CommandLineError, app

    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        try:
            return int(app([str(each) for each in arguments], prog_name="manitwin", standalone_mode=False) or 0)
        except (CommandLineError, typer.Exit):
            return 2


def dataset(folder: Path, accepted: int = 3) -> None:
    """Some twins and a rejected one, indexed in two parts, with a ledger of a finished run."""
    ids = write_set(folder, accepted=accepted, rejected=1)
    root = DatasetRoot(folder)
    write_part(root, ids[::2])
    write_part(root, ids[1::2])
    ledger = Ledger(folder / LEDGER)
    numbers, _ = ledger.add_items(Item(file=f"/inputs/{i}.glb", name=f"thing {i}") for i in range(len(ids)))
    run = ledger.begin_run("ab" * 32)
    for number, twin_id in zip(numbers, ids, strict=True):
        record = read_record(folder / root.twin_name(twin_id))
        ledger.identify(number, twin_id, "mesh")
        ledger.stage_started(number, "mesh", 1)
        ledger.commit()
        _end(ledger, number, record)
    ledger.end_run(run, "finished")
    ledger.close()
    (folder / CONFIG).write_text(json.dumps(BuildConfig().model_dump(mode="json")))


def _end(ledger: Ledger, number: int, record: object) -> None:
    status = record.status  # type: ignore[attr-defined]
    ledger.connection.execute(
        "UPDATE items SET state = ?, reason = ?, revision = ?, ended_at = 1.0 WHERE number = ?",
        (status, None if status == "accepted" else "several_objects", record.revision, number),  # type: ignore[attr-defined]
    )
    ledger.connection.execute("UPDATE stages SET state = 'done' WHERE number = ?", (number,))
    ledger.commit()


def query(case: Case) -> None:
    index = Index(case.folder)
    for table in ("twins", "grasps", "placements"):
        index.select(table)
    index.count("twins", "mass_kg > 0.1")


def status(case: Case) -> None:
    command("status", case.folder)
    command("status", case.folder, "--json")


def check(case: Case) -> None:
    command("check", case.folder)


def rows(case: Case) -> None:
    """Make the rows of the index from the twins' folders."""
    root = DatasetRoot(case.folder)
    for twin_id in root.twin_ids():
        rows_of(case.folder / root.twin_name(twin_id))


def statistics(case: Case) -> None:
    run_queries(ReportTables.of_index(DatasetRoot(case.folder)))


INDEX = ("index/*", "index/*/*", "*.parquet", "index*.json")
target("index", dataset, query, files=INDEX, weight=0.5)
target("ledger", dataset, status, files=(LEDGER, "config.json"), fresh=True, weight=0.3)
target("check", dataset, check, files=(LEDGER, "config.json", "*.parquet", "*.json"), fresh=True, weight=0.1)
target("index-rows", dataset, rows, files=("twin.json", "run.json", "grasps.parquet", "visual.glb"), weight=0.3)
target("stats", dataset, statistics, files=INDEX, weight=0.1)
