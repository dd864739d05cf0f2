"""Verdicts come in by files, are added up, and go out as tables."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner, Result

from json_documents import check_keys
from manitwin.api import write_index
from manitwin.cli.main import app
from manitwin.dataset.review.report import review_report
from manitwin.dataset.review.store import ReviewStore
from manitwin.dataset.review.verdicts import DIMENSIONS
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.proportions import wilson_interval
from manitwin.twin.store import RECORD, read_record, write_twin_record
from twin_folders import twin_id, write_accepted, write_set


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("made") / "set"
    for each in write_set(root, accepted=6, rejected=1)[:6]:
        folder = root / twin_name(each)
        record = json.loads((folder / RECORD).read_text())
        del record["revision"]
        record["points"]["candidates"] = {"positions_m": [[0.0, 0.0, 0.01]] * 4, "normals": [[0.0, 0.0, 1.0]] * 4}
        write_twin_record(folder, record)
    write_index(root, jobs=1)
    return root


@pytest.fixture
def place(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "set"))


def run(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def accepted(place: Path) -> list[str]:
    records = (read_record(path.parent) for path in sorted(place.glob("twins/*/*/twin.json")))
    return [record.twin_id for record in records if record.status == "accepted"]


def verdicts(folder: Path, *rows: dict[str, object], name: str = "verdicts.csv") -> Path:
    path = folder / name
    if path.suffix == ".jsonl":
        path.write_text("".join(json.dumps(row) + "\n" for row in rows))
        return path
    columns = list(dict.fromkeys(key for row in rows for key in row))
    with path.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, columns)
        writer.writeheader()
        writer.writerows(rows)
    return path


def said(
    of: str, annotator: str = "ada", dimension: str = "category", answer: str = "yes", **more: object
) -> dict[str, object]:
    return {"twin_id": of, "annotator": annotator, "dimension": dimension, "answer": answer, **more}


def test_verdicts_on_twins_as_they_were_before_are_told_as_they_come_in(place: Path, tmp_path: Path) -> None:
    ids = accepted(place)
    rows = [said(ids[0], revision="0" * 64), *(said(each, revision="") for each in ids)]
    told = run("review import", place, verdicts(tmp_path, *rows)).output
    assert "7 reviews imported" in told and "1 of the reviews of " in told and "do not count" in told
    assert "do not count" not in run("review import", place, verdicts(tmp_path, *rows[1:])).output


@pytest.mark.parametrize("suffix", [".csv", ".jsonl"])
def test_verdicts_of_files_are_added_up(place: Path, tmp_path: Path, suffix: str) -> None:
    ids = accepted(place)
    rows = [said(each) for each in ids[:4]]
    rows += [said(ids[4], answer="no", category="cup", note="it is a cup\nand no mug", seconds=12.5)]
    rows += [said(ids[0], "ben"), said(ids[1], "ben", answer="no"), said(ids[5], "ben", answer="unsure")]
    rows += [said(ids[4], dimension="physical", answer="no", mass_kg=0.2, mass_low_kg=0.1, mass_high_kg=0.3)]
    rows += [said(ids[4], dimension="functional", answer="no", points="f0=1")]
    path = verdicts(tmp_path, *rows, name=f"v{suffix}")
    assert "8 reviews imported" in run("review import", place, path).output
    assert "0 reviews imported, 8 were already there" in run("review import", place, path).output
    report = review_report(str(place))
    category, physical = report.accuracies[0], report.accuracies[3]
    assert (category.right, category.wrong, category.undecided, category.unsure_answers) == (3, 1, 2, 1)
    assert category.interval == wilson_interval(3, 4) and category.paper == 1.0
    assert (physical.right, physical.wrong) == (0, 1) and physical.paper == 0.922
    assert category.agreement.items == 2 and category.agreement.raw == 0.5
    assert report.disputed == {"category": [ids[1]]}
    assert [(each.twin_id, each.dimension, each.corrections) for each in report.disagreements] == [
        (ids[4], "category", {"category": "cup"}),
        (ids[4], "functional", {"f0": 1}),
        (ids[4], "physical", {"mass_kg": {"value": 0.2, "low": 0.1, "high": 0.3}}),
    ]
    told = "\n".join(report.lines())
    assert "physical, mass_kg is 0.2 (0.1 to 0.3)" in told and "{" not in told
    assert r"(it is a cup\nand no mug)" in told, "a note takes one line"
    ada = next(each for each in report.speeds if each.annotator == "ada")
    assert (ada.reviews, ada.median_s) == (5, 12.5)
    worst = report.prompts[0]
    assert (worst.dimension, worst.prompt, worst.no, worst.disagreeing) == ("category", "builtin", 2, (ids[1], ids[4]))
    done = run("review report", place, "--json")
    check_keys(json.loads(done.stdout), "review report")
    assert "3 of 4      75.0% [30.1%, 95.4%]" in done.stderr and "100.0%" in done.stderr


def test_a_sample_of_more_than_there_is_says_that_it_is_all(place: Path) -> None:
    count = len(accepted(place))
    assert (
        f"all accepted twins; the sample may have {count + 1}"
        in run("review", "sample", place, "--sample", count + 1).output
    )
    assert "all accepted twins" not in run("review", "sample", place, "--sample", count).output


def test_export_has_a_row_an_answer_in_three_formats_and_csv_comes_back_as_it_was(
    made: Path, place: Path, tmp_path: Path
) -> None:
    ids = accepted(place)
    rows = [
        said(ids[0], answer="no", category="=cmd|x", note='a "note", with commas'),
        said(ids[0], dimension="grasp", answer="no", points="g0=3;g1=0"),
        said(ids[1], "ben", longest_side_m="", dimension="physical"),
    ]
    run("review import", place, verdicts(tmp_path, *rows))
    for suffix in ("parquet", "csv", "jsonl"):
        done = run("review report", place, "--export", tmp_path / f"out.{suffix}")
        assert f"out.{suffix}: 3 verdicts" in done.output
    table = pq.read_table(tmp_path / "out.parquet").to_pylist()
    assert [json.loads(line) for line in (tmp_path / "out.jsonl").read_text().splitlines()] == table
    by = {(row["twin_id"], row["dimension"]): row for row in table}
    assert by[ids[0], "grasp"]["points"] == "g0=3;g1=0" and by[ids[0], "category"]["prompt"] == "builtin"
    other = shutil.copytree(made, tmp_path / "copy")
    run("review import", other, tmp_path / "out.csv")
    run("review report", other, "--export", tmp_path / "again.parquet")
    again = pq.read_table(tmp_path / "again.parquet")
    kept = [name for name in again.column_names if name not in ("at", "number")]
    assert again.select(kept).to_pylist() == [{name: row[name] for name in kept} for row in table]
    assert run("review report", place, "--export", tmp_path / "out.xlsx").exit_code != 0


def test_a_twin_built_anew_is_asked_for_again(place: Path, tmp_path: Path) -> None:
    ids = accepted(place)
    done = run("review sample", place, "--sample", "3", "--seed", "1")
    assert "3 twins of" in done.output
    with ReviewStore(place / "reviews.sqlite") as store:
        plan = store.plan()
    assert plan is not None and len(plan.twins) == 3
    run("review import", place, verdicts(tmp_path, *(said(each) for each in plan.twins)))
    before = review_report(str(place))
    assert (before.reviewed, before.outdated, before.speeds[0].left) == (3, 0, 0)
    number = next(n for n in range(6) if twin_id(n) == plan.twins[0])
    write_accepted(place, number, category="jug")
    write_index(place, jobs=1)
    after = review_report(str(place))
    assert (after.reviewed, after.outdated, after.speeds[0].left) == (2, 1, 1)
    assert len(ids) == 6 and any("built anew since" in line for line in after.lines())


def test_a_form_is_filled_in_and_read(place: Path, tmp_path: Path) -> None:
    names = ("--annotator", "ada", "--annotator", "ben", "--overlap", "1")
    done = run("review sample", place, "--sample", "4", "--form", tmp_path / "f.csv", *names)
    assert done.output.count(f"{4 * len(DIMENSIONS)} rows to fill in") == 2
    form = tmp_path / "f-ada.csv"
    rows = list(csv.DictReader(form.read_text().splitlines()))
    assert {row["dimension"] for row in rows} == set(DIMENSIONS) and "A red" in rows[1]["said"]
    for row in rows[:7]:
        row["answer"] = "yes"
    assert "1 reviews imported" in run("review import", place, verdicts(tmp_path, *rows)).output
    report = review_report(str(place))
    assert (report.sample, report.reviewed) == (4, 1)


@pytest.mark.parametrize(
    ("row", "why"),
    [
        ({"answer": "maybe"}, "'yes', 'no' or 'unsure'"),
        ({"dimension": "colour"}, "colour"),
        ({"twin_id": "0" * 16}, "not a twin of"),
        ({"answer": ""}, "no answer"),
        ({"answer": "no", "dimension": "functional", "points": "f0=99"}, "there are 0 to"),
        ({"answer": "no", "dimension": "functional", "points": "f7=1"}, "unknown point 'f7'"),
        ({"answer": "no", "dimension": "grasp", "points": "g0=1"}, "two points at the same candidate"),
        ({"answer": "no", "dimension": "functional", "points": "f0"}, "give them as 'f0=12;g1=3'"),
        ({"answer": "no", "dimension": "physical", "mass_kg": "heavy"}, "not a number"),
        ({"verdict": "yes"}, "unknown column 'verdict'"),
    ],
)
def test_a_file_is_taken_up_whole_or_not_at_all(place: Path, tmp_path: Path, row: dict[str, object], why: str) -> None:
    good, bad = said(accepted(place)[0]), {**said(accepted(place)[1]), **row}
    done = run("review import", place, verdicts(tmp_path, good, bad))
    assert why in str(done.exception), done.output
    assert not (place / "reviews.sqlite").exists()
