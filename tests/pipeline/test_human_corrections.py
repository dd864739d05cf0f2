"""What people put right: only the stages that it concerns have other keys, and its source says who it was."""

from __future__ import annotations

import inspect
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

import manitwin
from manitwin.cli.main import app
from manitwin.config import BuildConfig
from manitwin.dataset.review.corrections import resolve_corrections
from manitwin.dataset.review.store import ReviewStore, Stored
from manitwin.dataset.review.verdicts import Review
from manitwin.engine.amendments import amendments_name, read_amendments, write_amendments
from manitwin.engine.stage import Draft
from manitwin.engine.stage_runner import stage_key
from manitwin.errors import BadReply, UsageError
from manitwin.geometry.boxes import upright_extents
from manitwin.models.annotators.protocol import PointsRequest, SelectedPoints, Subject
from manitwin.pipeline.guesses import naming_checks
from manitwin.pipeline.human_corrections import (
    CATEGORY,
    NAME,
    NAME_STAGES,
    STAGES,
    corrected_category,
    corrected_points,
    name_by_person,
    place_in_box,
)
from manitwin.pipeline.item import Item
from manitwin.pipeline.object_state import object_name
from manitwin.pipeline.recipe import TwinRecipe, stages_for
from manitwin.pipeline.stage_order import STAGE_ORDER
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.point_records import GraspPoint
from manitwin.twin.store import read_record

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
SMALL = BuildConfig(
    grasps={"simulated": 16, "unfiltered": 0, "least_per_point": 2, "tries_per_point": 4},
    second_opinion={"enabled": False}, robustness={"enabled": False},
)  # fmt: skip


def said(
    annotator: str, answer: str = "no", number: int = 1, dimension: str = "category", **corrections: object
) -> Stored:
    body = {"annotator": annotator, "twin_id": "t", "revision": "r", "answers": {dimension: answer}}
    return Stored(number, 0.0, Review.model_validate({**body, "corrections": corrections}))


def mass(value: float) -> dict[str, float]:
    return {"value": value, "low": value, "high": value}


def test_what_nobody_contradicts_is_applied_with_the_names_of_all_who_said_it() -> None:
    agreed, conflicts = resolve_corrections(
        [said("ada", category="Coffee Mug"), said("ben", category="coffee mug"), said("eva", "unsure")]
    )
    assert [(each.name, each.source) for each in agreed] == [("category", "human:ada+ben")] and not conflicts


@pytest.mark.parametrize("other", [said("ben", category="bowl"), said("ben", "yes")])
def test_contradictions_are_listed_and_not_applied(other: Stored) -> None:
    agreed, conflicts = resolve_corrections([said("ada", category="mug"), other])
    assert not agreed
    assert conflicts[0].said == {"ada": "mug", "ben": "bowl" if other.review.corrections.category else "yes"}


def test_one_value_may_be_settled_where_another_is_disputed() -> None:
    of_ada = said("ada", dimension="physical", mass_kg=mass(0.2), longest_side_m=mass(0.1))
    agreed, conflicts = resolve_corrections([of_ada, said("ben", dimension="physical", mass_kg=mass(0.3))])
    assert ([each.name for each in agreed], [each.name for each in conflicts]) == (["longest_side_m"], ["mass_kg"])


def test_an_amendment_changes_the_keys_of_its_stages_alone() -> None:
    stages = {stage.name: stage for stage in TwinRecipe(SMALL).stages("mesh")}
    assert {name for names in STAGES.values() for name in names} <= set(stages) & set(STAGE_ORDER)
    plain, amended = (Draft("t" * 16, Item("/x.obj"), 0) for _ in range(2))
    amended.amendments = {"physical": {"mass_kg": mass(0.2)}}
    for name in ("mesh", "physical"):
        stage = stages[name]
        for draft in (plain, amended):
            draft.digests |= {read.removesuffix("?"): "d" for read in stage.reads}
            draft.fields |= {read: None for read in stage.reads if not read.endswith(("?", "/")) and "." not in read}
            draft.paths |= {read: Path("x") for read in stage.reads if read.endswith("/") or "." in read}
        assert (stage_key(stage, plain) == stage_key(stage, amended)) == (name == "mesh")


def test_the_category_that_a_person_gave_is_the_name_of_what_comes_after() -> None:
    draft = Draft("t" * 16, Item("/x.obj", name="bowl"), 0, amendments={"physical": {"category": "mug"}})
    assert (object_name(draft), corrected_category(draft)) == ("mug", "mug")
    assert object_name(Draft("t" * 16, Item("/x.obj", name="bowl"), 0)) == "bowl"


def test_a_file_that_is_no_amendment_is_one_line(tmp_path: Path) -> None:
    root = DatasetRoot(tmp_path)
    assert read_amendments(root, "abcd") == {}
    write_amendments(root, "abcd", {"points": {"moves": {}}})
    assert read_amendments(root, "abcd") == {"points": {"moves": {}}}
    (tmp_path / amendments_name("abcd")).write_text('{"points": 3}')
    with pytest.raises(UsageError, match="does not contain a JSON object keyed by stage"):
        read_amendments(root, "abcd")


@pytest.mark.slow
def test_corrections_come_back_with_their_source_and_what_follows_is_made_again(tmp_path: Path) -> None:
    place, runner = tmp_path / "twins", CliRunner()
    shutil.copy(SAMPLES / "mug.glb", tmp_path / "thing.glb")
    report = manitwin.build(tmp_path / "thing.glb", place, name="mug", config=SMALL, executor="inline")
    [folder] = [result.folder for result in report.results]
    assert folder is not None
    before = read_record(folder)
    assert before.points is not None and before.physical is not None
    taken = {point.candidate for point in before.points.functional}
    free = next(number for number in range(42) if number not in taken)
    body = {
        "annotator": "ada", "twin_id": before.twin_id, "revision": before.revision,
        "answers": {"category": "no", "physical": "no", "functional": "no"},
        "corrections": {
            "category": "cup", "points": {"f0": free}, "mass_kg": {"value": 0.35, "low": 0.3, "high": 0.4},
            "longest_side_m": {"value": 0.2, "low": 0.19, "high": 0.21},
        },
    }  # fmt: skip
    with ReviewStore(place / "reviews.sqlite") as store:
        store.add([Review.model_validate(body)], ["1"])
    manitwin.write_index(place, jobs=1)
    done = runner.invoke(app, ["review", "apply", str(place), "--dry-run"])
    assert done.exit_code == 0 and "4 corrections would be applied" in done.output
    assert read_record(folder) == before
    done = runner.invoke(app, ["review", "apply", str(place), "--jobs", "1"])
    assert done.exit_code == 0 and "4 corrections are applied, 0 are disputed" in done.output, done.output
    after = read_record(folder)
    assert (after.status, after.twin_id) == ("accepted", before.twin_id) and after.revision != before.revision
    assert after.physical is not None and after.points is not None and after.language is not None
    assert after.physical.mass_kg.model_dump() == {"value": 0.35, "low": 0.3, "high": 0.4, "source": "human:ada"}
    corners = np.concatenate([mesh.vertices for mesh in manitwin.load(folder).visual])
    assert upright_extents(corners).max() == pytest.approx(0.2, rel=1e-3)
    assert after.language.category == after.name == "cup"
    moved = after.points.functional[0]
    assert (moved.candidate, moved.source) == (free, "human:ada")
    (said,) = read_amendments(DatasetRoot(place), before.twin_id)["points"]["moves"].values()
    assert said["place"] == place_in_box(np.array(before.points.candidates.positions_m), free)
    ratio = after.physical.scale_applied / before.physical.scale_applied
    assert moved.position_m == pytest.approx(
        [ratio * each for each in before.points.candidates.positions_m[free]], abs=1e-4
    )
    again = manitwin.build(tmp_path / "thing.glb", place, name="mug", executor="inline")
    assert [result.reused for result in again.results] == [True], "an amendment holds for later builds"
    assert "0 corrections" in runner.invoke(app, ["review", "apply", str(place)]).output
    assert manitwin.Dataset(place).table(["mass_source"])["mass_source"].to_pylist() == ["human:ada"]
    huge = {
        **body,
        "revision": after.revision,
        "answers": {"physical": "no"},
        "corrections": {"longest_side_m": mass(0.8)},
    }
    with ReviewStore(place / "reviews.sqlite") as store:
        store.add([Review.model_validate(huge)], ["2"])
    done = runner.invoke(app, ["review", "apply", str(place), "--jobs", "1"])
    assert done.exit_code == 3 and f"{before.twin_id} is rejected with its corrections: " in done.output, done.output
    assert amendments_name(before.twin_id) in done.output.replace("\n", "")


def test_a_moved_point_that_is_gone_is_never_guessed() -> None:
    move = {"moves": {"f0": {"candidate": 1, "label": "spout", "source": "human:ada"}}}
    with pytest.raises(BadReply, match=r"f0 \(spout\) was moved by human:ada, but is no longer a point"):
        corrected_points(SelectedPoints((), ()), None, move)  # type: ignore[arg-type]


@pytest.fixture
def request_of_points() -> PointsRequest:
    """Candidates all over a box of 8 x 12 x 4 cm."""
    box = trimesh.creation.box((0.08, 0.12, 0.04))
    positions_m, _ = trimesh.sample.sample_surface(box, 42, seed=3)
    subject = Subject("box", box, (box,), True, (), (), 0)
    return PointsRequest(subject, np.asarray(positions_m), np.eye(3)[[2] * 42], (), (), np.zeros(3), 0.08)


def moved_to_5(request: PointsRequest, place: list[float] | None) -> GraspPoint:
    """Move a grasp point to candidate 5, which a person saw at a place."""
    point = GraspPoint.model_validate(
        {**request.place(9), "id": "g0", "type": "pinch", "scenario": "lift", "confidence": 1.0, "rationale": "thin"}
    )
    said = {"candidate": 5, "label": None, "source": "human:ada"} | ({} if place is None else {"place": place})
    return corrected_points(SelectedPoints((), (point,)), request, {"moves": {"g0": said}}).grasp[0]


def test_a_candidate_is_the_one_that_was_seen_whatever_the_size_and_though_the_surface_changed_a_little(
    request_of_points: PointsRequest,
) -> None:
    place = place_in_box(request_of_points.positions_m, 5)
    assert place != place_in_box(request_of_points.positions_m, 6)
    now = replace(request_of_points, positions_m=3 * request_of_points.positions_m + 0.0005)
    assert moved_to_5(now, place).position_m == pytest.approx(now.positions_m[5])


def test_a_candidate_that_is_another_place_by_now_is_never_guessed(request_of_points: PointsRequest) -> None:
    place = place_in_box(request_of_points.positions_m, 5)
    numbered_anew = replace(request_of_points, positions_m=request_of_points.positions_m[::-1])
    with pytest.raises(
        BadReply, match="candidate 5, which is now at another place of the object; review the twin again"
    ):
        moved_to_5(numbered_anew, place)
    assert moved_to_5(numbered_anew, None).candidate == 5, "a correction of an earlier version does not say its place"


def test_name_that_a_person_said_since_counts_before_the_given_one_and_a_corrected_category_before_both() -> None:
    item, named = Item("/photos/a.jpg", name="cup"), {NAME: {"value": "mug", "source": "human:ada"}}
    draft: Draft[Item] = Draft("t", item, seed=0)
    assert name_by_person(draft) == "cup" and name_by_person(Draft("t", Item("/photos/a.jpg"), seed=0)) is None
    draft.amendments = {"finish": named}
    assert name_by_person(draft) == "mug" == object_name(draft)
    [check] = naming_checks(draft)
    assert check.passed and (check.name, check.value, check.message) == ("named", "mug", "human:ada says what it is")
    draft.amendments = {"finish": {**named, CATEGORY: "beaker"}}
    assert name_by_person(draft) == "beaker" and naming_checks(draft) == []


def test_every_stage_that_asks_for_a_name_is_told_the_one_that_a_person_said() -> None:
    """A stage whose module asks for the name, by itself or in the subject that it reads, is among ``NAME_STAGES``."""
    asking = ("object_name(", "read_subject(", "read_scaled_subject(", "likely_names(", "name_by_person(", "said_name(")
    stages = {
        stage.name
        for kind in ("image", "photos", "mesh")
        for stage in stages_for(kind, BuildConfig())  # type: ignore[arg-type]
        if any(call in inspect.getsource(inspect.getmodule(type(stage)) or type(stage)) for call in asking)
    }
    assert stages <= set(NAME_STAGES)
