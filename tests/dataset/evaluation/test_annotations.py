"""Annotations against labels: every rule says yes and says no, and what cannot be scored is not."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from json_documents import check_keys
from manitwin.cli.main import app
from manitwin.dataset.evaluation.annotations import AnnotationReport, evaluate_annotations
from manitwin.dataset.evaluation.labels import read_labels
from manitwin.errors import UsageError
from manitwin.twin.proportions import wilson_interval
from manitwin.twin.store import RECORD, write_twin_record
from twin_folders import write_set

TRUE = {
    "category": "mug", "category_synonyms": "cup;beaker", "colors": "brown;white", "materials": "ceramic",
    "functional_parts": "handle=hold;rim=drink", "plausible_mass_low_kg": "0.09", "plausible_mass_high_kg": "0.11",
    "longest_side_low_m": "0.001", "longest_side_high_m": "1", "typical_grasp_type": "pinch;power",
}  # fmt: skip


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three accepted twins, a mug of 0.1 kg, a bowl, a can, and a rejected one."""
    root = tmp_path_factory.mktemp("labelled")
    write_set(root, accepted=3, rejected=1)
    return root


def labels(folder: Path, *rows: dict[str, str]) -> Path:
    columns = sorted({name for row in rows for name in row})
    lines = [",".join(columns), *(",".join(row.get(name, "") for name in columns) for row in rows)]
    path = folder / "labels.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def scored(place: Path, tmp_path: Path, **changes: str) -> AnnotationReport:
    return evaluate_annotations(str(place), labels(tmp_path, {**TRUE, "twin_id": twin_of(place), **changes}))


def twin_of(place: Path) -> str:
    """The mug's twin."""
    for record in place.glob("twins/*/*/twin.json"):
        if '"category":"mug"' in record.read_text().replace(" ", ""):
            return record.parent.name
    raise AssertionError("no mug")


def test_everything_is_right_of_a_twin_that_is_as_its_label_says(place: Path, tmp_path: Path) -> None:
    report = scored(place, tmp_path)
    assert report.twins == 1
    assert all(right == asked for right, asked in report.shares().values()), report.lines()
    assert {"category", "language", "functional", "physical", "grasp"} <= set(report.shares())
    assert report.shares()["physical"] == (3, 3)


def test_a_part_that_only_a_grasp_column_names_is_a_part(place: Path, tmp_path: Path) -> None:
    label = {"functional_parts": "spout=pour", "bad_grasp_regions": "handle;rim"}
    assert scored(place, tmp_path, **label).shares()["functional"] == scored(place, tmp_path).shares()["functional"]


@pytest.mark.parametrize(
    ("column", "value", "wrong"),
    [
        ("category", "bowl", ("category", "category")),
        ("colors", "blue;green", ("language", "color")),
        ("materials", "steel", ("language", "material")),
        ("functional_parts", "spout=pour", ("functional", "f0")),
        ("plausible_mass_high_kg", "9", ("physical", "mass interval")),
        ("longest_side_high_m", "0.002", ("physical", "longest side")),
        ("typical_grasp_type", "enveloping", ("grasp", "g0 type")),
    ],
)
def test_what_differs_from_the_label_is_wrong(
    place: Path, tmp_path: Path, column: str, value: str, wrong: tuple[str, str]
) -> None:
    changes = {column: value} | ({"category_synonyms": ""} if column == "category" else {})
    report = scored(place, tmp_path, **changes)
    assert wrong in {(score.dimension, score.question) for score in report.scores if not score.right}


@pytest.mark.parametrize(("high_kg", "right"), [("0.3", True), ("0.095", False)])
def test_a_mass_without_an_interval_lies_in_the_labels(tmp_path: Path, high_kg: str, right: bool) -> None:
    write_set(tmp_path, accepted=3, rejected=0)
    folder = next(tmp_path.glob(f"twins/*/{twin_of(tmp_path)}"))
    record = json.loads((folder / RECORD).read_bytes())
    record["physical"]["mass_kg"] |= {"value": 0.1, "low": 0.1, "high": 0.1, "source": "template:mug"}
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    report = scored(tmp_path, tmp_path, plausible_mass_low_kg="0.09", plausible_mass_high_kg=high_kg)
    assert [score.right for score in report.scores if score.question == "mass interval"] == [right]


def test_empty_cells_are_not_scored(place: Path, tmp_path: Path) -> None:
    report = evaluate_annotations(
        str(place), labels(tmp_path, {"twin_id": twin_of(place), "category": "mug", "colors": ""})
    )
    assert set(report.shares()) == {"category"}


def test_labels_without_an_accepted_twin_are_named(place: Path, tmp_path: Path) -> None:
    rows = [{"twin_id": twin_of(place), "category": "mug"}, {"twin_id": "0" * 16, "category": "mug"}]
    assert evaluate_annotations(str(place), labels(tmp_path, *rows)).without_twin == ("0" * 16,)
    with pytest.raises(UsageError, match="none of its 1 labels"):
        evaluate_annotations(str(place), labels(tmp_path, rows[1]))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "no labels"),
        ("file,categry\na,b\n", "categry"),
        ("category\nmug\n", "file and twin_id are missing"),
        ("file,plausible_mass_low_kg,plausible_mass_high_kg\na,1,\n", "not two numbers"),
        ("file,plausible_mass_low_kg,plausible_mass_high_kg\na,2,1\n", "not an interval above 0"),
        ("file,plausible_mass_low_kg,plausible_mass_high_kg\na,nan,1\n", "not an interval above 0"),
        ("file,typical_grasp_type\na,paralel jaw\n", "did you mean 'parallel_jaw'"),
    ],
)
def test_labels_that_cannot_be_read_are_one_line(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "labels.csv"
    path.write_text(content)
    with pytest.raises(UsageError, match=message):
        read_labels(path)


@pytest.mark.parametrize("said", ["parallel_jaw;pinch", "parallel jaw; Pinch", "parallel-jaw;pinch"])
def test_grasp_types_may_be_written_as_words(tmp_path: Path, said: str) -> None:
    (label,) = read_labels(labels(tmp_path, {"file": "a", "typical_grasp_type": said}))
    assert label.grasp_types == ("parallel_jaw", "pinch")


def test_interval_is_wilsons() -> None:
    low, high = wilson_interval(9, 10)
    assert (low, high) == pytest.approx((0.5958, 0.9821), abs=1e-4)  # Brown, Cai and DasGupta 2001, table of n = 10
    assert wilson_interval(0, 0) == (0.0, 1.0)


def test_command_prints_the_table_and_its_document(place: Path, tmp_path: Path) -> None:
    path = labels(tmp_path, {**TRUE, "twin_id": twin_of(place), "category": "bowl", "category_synonyms": ""})
    said = CliRunner().invoke(app, ["evaluate", "annotations", str(place), "--labels", str(path)])
    assert said.exit_code == 0 and "0 of 1" in said.stdout and "wrong:" in said.stdout
    document = json.loads(
        CliRunner().invoke(app, ["evaluate", "annotations", str(place), "--labels", str(path), "--json"]).stdout
    )
    check_keys(document, "evaluate annotations")
    assert document["shares"]["category"]["right"] == 0
