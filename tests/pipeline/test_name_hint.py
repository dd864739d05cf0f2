"""A name is suggested where it would change something, by what the record says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.pipeline.assembly import NAME_HINT, _rejection, name_would_help
from manitwin.pipeline.guesses import OF_ANYTHING, SIZE_UNSAID, typical_size_words
from manitwin.pipeline.item import Item
from manitwin.pipeline.recipe import ending_of
from manitwin.pipeline.size_remarks import CHECK_SCALE
from manitwin.pipeline.suspicious_size import usual_size_checks
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.record import REJECTION_REASONS, TwinRecord
from manitwin.twin.store import RECORD, parse_record
from record_overlay import overlaid
from twin_folders import write_accepted, write_rejected

UNKNOWN = {"mass_kg": {"source": "prior:unknown"}, "friction_static": {"source": "prior:unknown"}}
SEEN = {"mass_kg": {"source": "vlm:qwen"}, "friction_static": {"source": "vlm:qwen"}}


def accepted(root: Path, name: str | None, physical: dict[str, Any]) -> TwinRecord:
    folder = root / twin_name(write_accepted(root, 1))
    return changed(folder, {"name": name, "physical": physical})


def rejected(
    root: Path,
    reason: str,
    *,
    name: str | None = None,
    metric: bool = False,
    backend: str = "rules",
    lifted: bool = False,
) -> TwinRecord:
    folder = root / twin_name(write_rejected(root, 2))
    stage = next(stage for stage, reasons in REJECTION_REASONS.items() if reason in reasons)
    ran = {"physical": {"version": "1", "backend": backend, "model": None}}
    ran |= {"generate": {"version": "1", "backend": "lift", "model": None}} if lifted else {}
    checks = [{"name": "plausible_size", "passed": True if metric else None}]
    said = {"stage": stage, "reason": reason, "detail": "so"}
    return changed(
        folder, {"name": name, "rejection": said, "provenance": {"stages": ran}, "quality": {"checks": checks}}
    )


def changed(folder: Path, changes: dict[str, Any]) -> TwinRecord:
    return parse_record(json.dumps(overlaid(json.loads((folder / RECORD).read_bytes()), changes)).encode())


def test_an_accepted_nameless_twin_of_the_prior_of_anything_is_weak(tmp_path: Path) -> None:
    assert name_would_help(accepted(tmp_path, None, UNKNOWN))
    assert not name_would_help(accepted(tmp_path, "mug", UNKNOWN)), "it has a name"
    guessed = {"mass_kg": {"source": "prior:likeliest"}, "friction_static": {"source": "prior:plastic"}}
    assert name_would_help(accepted(tmp_path, None, guessed))
    assert not name_would_help(accepted(tmp_path, None, SEEN)), "a model has seen what it is"


@pytest.mark.parametrize("reason", ["too_wide", "too_thin", "no_proposal", "none_held"])
def test_a_guessed_size_may_have_rejected_it(tmp_path: Path, reason: str) -> None:
    assert name_would_help(rejected(tmp_path, reason))
    assert not name_would_help(rejected(tmp_path, reason, name="mug"))
    assert not name_would_help(rejected(tmp_path, reason, backend="openai"))
    assert name_would_help(rejected(tmp_path, reason, metric=True)) == (reason == "none_held"), (
        "of the mass that is left"
    )


def test_a_name_changes_nothing_about_a_bad_file_or_photo(tmp_path: Path) -> None:
    for reason in set().union(*(REJECTION_REASONS[stage] for stage in ("input", "generate", "gate"))):
        assert not name_would_help(rejected(tmp_path, reason)), reason


def test_other_reasons_that_a_name_has_a_say_in(tmp_path: Path) -> None:
    assert name_would_help(rejected(tmp_path, "implausible_mass", backend="openai"))
    assert name_would_help(rejected(tmp_path, "no_stable_pose", lifted=True))
    assert not name_would_help(rejected(tmp_path, "no_stable_pose")), "a mesh stands as it stands"


def test_the_result_line_says_it(tmp_path: Path) -> None:
    weak = ending_of(accepted(tmp_path, None, UNKNOWN))
    assert weak.detail_and_hint == f"{weak.detail}; {NAME_HINT}" and "--name (mug, fork, ...)" in NAME_HINT
    assert ending_of(rejected(tmp_path, "too_wide")).detail_and_hint == f"so; {NAME_HINT}"
    named = ending_of(accepted(tmp_path, "mug", UNKNOWN))
    assert named.detail_and_hint == named.detail and "--name" not in named.detail_and_hint


def test_the_result_line_says_that_such_things_are_of_another_size(tmp_path: Path) -> None:
    folder = tmp_path / twin_name(write_accepted(tmp_path, 1))
    message = f"it is 403 mm long, but nearly every fork has 130 mm to 220 mm: {CHECK_SCALE}"
    checks = [{"name": "usual_size", "passed": False, "message": message}]
    ending = ending_of(changed(folder, {"name": "fork", "quality": {"checks": checks}}))
    assert ending.detail_and_hint == f"{ending.detail}; {message}"


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("muug", "did you mean 'mug'"),
        ("beer", "did you mean 'beer bottle', 'beer can' or 'beer glass'?"),
        ("zorbling", "say what kind of thing it is with --name, in English"),
    ],
)
def test_a_name_that_the_priors_do_not_know_is_said_in_the_result_line(tmp_path: Path, name: str, told: str) -> None:
    known_by_none = ending_of(accepted(tmp_path, name, UNKNOWN))
    assert (
        f"know no '{name}': mass and friction are those of any object" in known_by_none.detail_and_hint
        and told in known_by_none.detail_and_hint
    )
    assert told in ending_of(rejected(tmp_path, "too_wide", name=name)).detail_and_hint
    seen = ending_of(accepted(tmp_path, name, SEEN))
    assert seen.detail_and_hint == seen.detail, "a model has seen what it is"


@pytest.mark.parametrize(
    ("source", "of"),
    [
        ("prior:unknown", OF_ANYTHING),
        ("prior:likeliest", f"{OF_ANYTHING} that looks like it"),
        ("prior:orange", "usual of an orange"),
    ],
)
def test_a_size_from_a_prior_is_told_as_nobodys_statement(source: str, of: str) -> None:
    size = {"value": 0.15, "low": 0.02, "high": 0.6, "source": source}
    draft = Draft(item_id="0" * 16, payload=Item(file=None, text="x"), seed=0, fields={"size": size})
    assert typical_size_words(draft) == f"{SIZE_UNSAID}: 15 cm is what is {of} (2 to 60 cm)"


@pytest.mark.parametrize("said", [None, {"value": 0.15, "low": 0.15, "high": 0.15, "source": "vlm:qwen"}])
def test_a_size_that_a_mesh_or_a_model_says_is_no_guess(said: dict[str, Any] | None) -> None:
    draft = Draft(item_id="0" * 16, payload=Item(file=None, text="x"), seed=0, fields={"size": said})
    assert typical_size_words(draft) is None


@pytest.mark.parametrize(
    ("name", "longest_m", "said"),
    [
        (
            "mug",
            0.013,
            "it is 13 mm long, but nearly every mug has 80 mm to 160 mm (centimetres taken for millimetres?)",
        ),
        (None, 0.013, "it is 13 mm long, but things of a hand's size have 20 mm to 600 mm (centimetres taken for"),
        ("mug", 100.0, "it is 100 m long, but nearly every mug has 80 mm to 160 mm (millimetres taken for metres?)"),
        ("parts bin", 0.95, "it is 950 mm long, but nearly every bin has 100 mm to 720 mm"),
        ("mug", 0.1, None),
        ("laptop", 0.40001, None),  # "400 mm long, but nearly every laptop has 260 mm to 400 mm"
        ("tray", 0.595, None),
        (None, 0.1, None),
    ],
)
def test_a_suspicious_scale_is_named_first(name: str | None, longest_m: float, said: str | None) -> None:
    physical = {"extents_m": [longest_m / 2, longest_m, longest_m / 3]}
    fields = {"size": None, "geometry": {"metric": True}, "physical": physical}
    draft = Draft(item_id="0" * 16, payload=Item(file=None, name=name), seed=0, fields=fields)
    told = _rejection(Rejected("none_held", "none of 12 simulated grasps held: 12 drops"), "verify", draft)
    if said is None:
        assert told.detail == "none of 12 simulated grasps held: 12 drops"
    else:
        assert told.detail.startswith(said)
        assert told.detail.endswith(f"{CHECK_SCALE}; none of 12 simulated grasps held: 12 drops")
    other = _rejection(Rejected("no_stable_pose", "so"), "placement", draft)
    assert other.detail == "so"
    checks = usual_size_checks(draft)
    assert [check.passed for check in checks] == [False] * (said is not None), "nor is it accepted in silence"
    assert all(check.name == "usual_size" and check.message.startswith(said or "") for check in checks)
