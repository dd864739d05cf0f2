"""Thresholds from verdicts: found where there is one, and not proposed where luck would do."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from manitwin.api import write_index
from manitwin.cli.main import app
from manitwin.dataset.review.store import ReviewStore, reviews_path
from manitwin.dataset.review.tuning import best_threshold, sign_test
from manitwin.dataset.review.verdicts import Review
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.store import RECORD, read_record, write_twin_record
from twin_folders import write_set

TWINS = 30


def test_the_best_threshold_lies_between_right_and_wrong_and_is_never_looser() -> None:
    values, right = np.array([0.5, 0.55, 0.6, 0.8, 0.9]), np.array([False, False, False, True, True])
    assert best_threshold(values, right, 0.5, True) == pytest.approx(0.7)
    assert best_threshold(values, ~right, 0.5, True) == 0.5
    assert best_threshold(values, ~right, 1.0, False) == pytest.approx(0.7)
    assert best_threshold(values, right, 0.1, False) == 0.1


def test_the_sign_test_is_that_of_a_fair_coin() -> None:
    assert sign_test(0, 0) == 1 and sign_test(3, 0) == pytest.approx(1 / 8) and sign_test(2, 1) == pytest.approx(1 / 2)


@pytest.fixture(scope="module")
def reviewed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twins of which those whose cut-out was less sure than 0.91 are called wrong in their mesh; radii tell nothing."""
    root = tmp_path_factory.mktemp("tuned") / "set"
    rng = np.random.default_rng(0)
    for number, each in enumerate(write_set(root, accepted=TWINS, rejected=0)):
        folder = root / twin_name(each)
        record = json.loads((folder / RECORD).read_text())
        del record["revision"]
        confidence = 0.85 + 0.15 * number / TWINS
        record["quality"]["checks"].append(
            {"name": "matte", "passed": True, "value": confidence, "limit": None, "message": ""}
        )
        record["grasps"]["association_radius_m"] = 0.03 + 0.001 * float(rng.random())
        write_twin_record(folder, record)
    write_index(root, jobs=1)
    with ReviewStore(reviews_path(DatasetRoot(str(root)))) as store:
        for path in sorted(root.glob("twins/*/*")):
            record = read_record(path)
            (matte,) = (check for check in record.quality.checks if check.name == "matte")
            answers = {
                "mesh": "yes" if float(str(matte.value)) > 0.91 else "no",
                "grasp": "yes" if rng.random() < 0.5 else "no",
                "category": "yes",
            }
            review = Review(annotator="ada", twin_id=record.twin_id, revision=record.revision, answers=answers)
            store.add([review], [record.twin_id])
    return root


def test_a_threshold_that_holds_on_other_twins_is_proposed_as_a_configuration(reviewed: Path, tmp_path: Path) -> None:
    out = tmp_path / "tuned.toml"
    done = CliRunner().invoke(app, ["review", "tune", str(reviewed), "-o", str(out)])
    assert done.exit_code == 0, done.output
    said = " ".join(done.output.split())
    assert (
        "matting.min_confidence = 0.75: propose 0.91" in said and "would refuse 13 of 13 called wrong in mesh" in said
    )
    assert "grasps.association_radius_m = 0.03: not proposed, may be luck" in said or "nothing stricter" in said
    assert "naming.min_probability = 0.7: too few verdicts" in said
    tuned = tomllib.loads(out.read_text())
    assert list(tuned) == ["matting"] and tuned["matting"]["min_confidence"] == pytest.approx(0.912, abs=0.003)


def test_without_verdicts_it_says_so(tmp_path: Path) -> None:
    (tmp_path / "none").mkdir()
    done = CliRunner().invoke(app, ["review", "tune", str(tmp_path / "none")])
    assert isinstance(done.exception, UsageError) and "no reviews yet" in str(done.exception)
