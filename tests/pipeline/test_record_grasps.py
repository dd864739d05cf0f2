"""The table and the summary from made-up verdicts: what counts where, in which order, and what agreement changes."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from grasp_drafts import PANDA, Scripted, proposed_draft, run_all
from manitwin.config import SecondOpinionConfig, VerifyConfig
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.pipeline.record_grasps import RecordGraspsStage
from manitwin.pipeline.second_opinion import SecondOpinionStage
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.twin.grasp_summary import GraspSummary, OtherGripper

OUTCOMES = ["slips", "held", "held", "drops", "held", "held", "held", "held", "slips"]  # the last two are unfiltered
HELD, FAILED_THERE, CHOSEN = {1, 2, 4, 5, 6}, {2, 5}, 7
TRIALS = {1: (2, 4), 2: (4, 4), 4: (8, 8), 5: (0, 2), 6: (4, 4)}


def second_engine(pose: np.ndarray, settings: object) -> str:
    number = round(1000 * float(pose[0, 3]))
    return "penetrates" if pose[1, 3] == 0 == pose[2, 3] and number in FAILED_THERE else "held"


def draft_with_all(folder: Path, jittered: int = 3) -> Draft:
    draft = proposed_draft(folder, OUTCOMES, unfiltered=2)
    settings = SecondOpinionConfig(jittered=jittered, share_of_failed=1.0)
    first, second = Scripted(lambda *_: "drops", "first"), Scripted(second_engine, "second")
    run_all(draft, folder, SecondOpinionStage(settings, VerifyConfig(), first, second, PANDA))
    held, trials = np.zeros(len(OUTCOMES), np.int32), np.zeros(len(OUTCOMES), np.int32)
    for number, (some, all_) in TRIALS.items():
        held[number], trials[number] = some, all_
    np.savez(folder / "robustness.npz", held=held, trials=trials)
    draft.paths["robustness.npz"] = folder / "robustness.npz"
    return draft


def record(draft: Draft, folder: Path, *, require_agreement: bool = False) -> tuple[dict[str, list[Any]], GraspSummary]:
    settings = SecondOpinionConfig(require_agreement=require_agreement)
    run_all(draft, folder, RecordGraspsStage(settings, [(PANDA, "")]))
    return pq.read_table(draft.path("grasps.parquet")).to_pydict(), GraspSummary(**draft.field("grasps"))


def numbers(rows: dict[str, list[Any]]) -> list[int]:
    return [int(name.split("-")[1].split(":")[0]) for name in rows["grasp_id"]]


def test_rows_are_best_first_then_failed_then_unfiltered_then_jittered(tmp_path: Path) -> None:
    rows, _ = record(draft_with_all(tmp_path), tmp_path)
    # 8 of 8 before 4 of 4 (as proposed: 2, 6) before 2 of 4 before 0 of 2; then the failed, as proposed; the unfiltered
    assert numbers(rows)[:9] == [4, 2, 6, 1, 5, 0, 3, 7, 8]
    assert [name.partition(":")[2] for name in rows["proposer"]] == [""] * 7 + ["unfiltered"] * 2 + ["jittered"] * 3
    assert rows["robustness"][:5] == [1.0, 1.0, 1.0, 0.5, 0.0]
    assert rows["robustness_trials"][:7] == [8, 4, 4, 4, 2, None, None]


def test_jittered_rows_count_nowhere(tmp_path: Path) -> None:
    summaries = []
    for jittered in (0, 3):
        folder = tmp_path / str(jittered)
        folder.mkdir()
        rows, summary = record(draft_with_all(folder, jittered), folder)
        summaries.append(summary)
        assert sum(name.endswith(":jittered") for name in rows["proposer"]) == jittered
        assert sum(name.endswith(":jittered") for name in rows["grasp_id"]) == jittered
    none, some = (s.model_copy(update={"second_opinion": None}) for s in summaries)
    assert none == some
    assert (some.simulated, some.verified, some.unfiltered_simulated) == (CHOSEN, len(HELD), 2)
    assert some.success_rate == pytest.approx(5 / 7)
    assert some.unfiltered_success_rate == 0.5


def test_require_agreement_takes_the_second_engines_outcome_where_it_refuses(tmp_path: Path) -> None:
    free, _ = record(draft_with_all(tmp_path), tmp_path)
    rows, summary = record(draft_with_all(tmp_path), tmp_path, require_agreement=True)
    assert rows["verified"] == [outcome == "held" for outcome in rows["outcome"]]
    plain = {n: i for i, n in enumerate(numbers(rows)) if ":" not in rows["proposer"][i]}
    before = {n: free["outcome"][i] for i, n in enumerate(numbers(free)) if ":" not in free["proposer"][i]}
    for number, i in plain.items():
        refused = number in FAILED_THERE
        assert rows["outcome"][i] == ("penetrates" if refused else before[number])
        assert rows["holds_in_second_engine"][i] == (not refused)
    assert summary.verified == len(HELD - FAILED_THERE) == 3
    assert summary.failures == {"drops": 1, "penetrates": 2, "slips": 1}
    assert [plain[n] for n in FAILED_THERE] > [plain[n] for n in HELD - FAILED_THERE], "refused ones come after"
    unfiltered = [o for o, name in zip(rows["outcome"], rows["proposer"], strict=True) if name.endswith(":unfiltered")]
    assert unfiltered == ["held", "slips"], "the second engine is not asked of them"


def test_without_require_agreement_a_refusal_is_noted_only(tmp_path: Path) -> None:
    rows, summary = record(draft_with_all(tmp_path), tmp_path)
    noted = dict(zip(rows["grasp_id"], rows["holds_in_second_engine"], strict=True))
    assert noted["panda-0002"] is False and noted["panda-0001"] is True and noted["panda-0007"] is None
    assert summary.verified == len(HELD)


def test_twin_on_which_the_engines_never_agree_is_rejected_where_they_must(tmp_path: Path) -> None:
    draft = proposed_draft(tmp_path, ["held", "held", "slips"])
    engine = Scripted(lambda *_: "unstable", "second")
    settings = SecondOpinionConfig(share_of_failed=0.0, jittered=0, require_agreement=True)
    run_all(draft, tmp_path, SecondOpinionStage(settings, VerifyConfig(), engine, engine, PANDA))
    with pytest.raises(Rejected, match="of 2 grasps that held in first none holds in second: 2 unstable") as answer:
        run_all(draft, tmp_path, RecordGraspsStage(settings, [(PANDA, "")]))
    assert answer.value.reason == "none_held"
    accepted = RecordGraspsStage(SecondOpinionConfig(require_agreement=False), [(PANDA, "")])
    assert run_all(draft, tmp_path, accepted).field("grasps")["verified"] == 2


def test_what_the_second_engine_has_said_already_is_not_asked_again(tmp_path: Path) -> None:
    said = ["", "held", "", "drops", "", "", "", "", ""]
    draft = proposed_draft(tmp_path, OUTCOMES, unfiltered=2, second_outcomes=said)
    settings = SecondOpinionConfig(jittered=0, share_of_failed=1.0)
    first, second = Scripted(lambda *_: "drops", "first"), Scripted(second_engine, "second")
    run_all(draft, tmp_path, SecondOpinionStage(settings, VerifyConfig(), first, second, PANDA))
    assert second.asked == CHOSEN - 2
    with np.load(draft.path("second_opinion.npz")) as arrays:
        assert arrays["outcome"].tolist() == [
            "held",
            "held",
            "penetrates",
            "drops",
            "held",
            "penetrates",
            "held",
            "",
            "",
        ]
        assert arrays["holds"].tolist() == [1, 1, 0, 0, 1, 0, 1, -1, -1]


@pytest.mark.parametrize("require_agreement", [False, True])
def test_failure_tables_add_up_to_the_simulated(tmp_path: Path, require_agreement: bool) -> None:
    rows, summary = record(draft_with_all(tmp_path), tmp_path, require_agreement=require_agreement)
    plain = [i for i, name in enumerate(rows["proposer"]) if ":" not in name]
    outcomes = Counter(rows["outcome"][i] for i in plain)
    for table in (summary.failure_table.by_grasp_type, summary.failure_table.by_region):
        assert sum(sum(counts.values()) for counts in table.values()) == summary.simulated == CHOSEN
        assert sum((Counter(counts) for counts in table.values()), Counter()) == outcomes
    assert set(summary.failure_table.by_grasp_type) == {"parallel_jaw", "pinch"}
    assert summary.failure_table.by_grasp_type["pinch"] == Counter(
        rows["outcome"][i] for i in plain if rows["grasp_point_id"][i] == "g1"
    )
    assert set(summary.failure_table.by_region) == {"no part"}


def test_equal_inputs_give_equal_bytes(tmp_path: Path) -> None:
    tables = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        draft = draft_with_all(tmp_path / name)
        record(draft, tmp_path / name)
        tables.append((draft.path("grasps.parquet").read_bytes(), draft.field("grasps")))
    assert tables[0] == tables[1]


def other_gripper(folder: Path, first: list[str], outcomes: list[str], **proposed: Any) -> OtherGripper:
    """The summary of a second gripper: both grippers' proposals belong to g0, g1, g0, ... and end as said."""
    draft = proposed_draft(folder, first)
    proposed_draft(folder, outcomes, suffix="-wsg50_110", draft=draft)
    if proposed:
        draft.fields["proposals-wsg50_110"] = proposed
    grippers = [(PANDA, ""), (load_gripper("wsg50_110"), "-wsg50_110")]
    run_all(draft, folder, RecordGraspsStage(SecondOpinionConfig(), grippers))
    rows = pq.read_table(draft.path("grasps.parquet")).to_pydict()
    assert rows["gripper"] == ["panda"] * len(first) + ["wsg50_110"] * len(outcomes)
    return GraspSummary(**draft.field("grasps")).other_grippers["wsg50_110"]


@pytest.mark.parametrize(
    ("first", "second", "transferable", "transferred"),
    [
        (["held", "held", "slips"], ["held", "slips", "held", "drops"], 2, 1),
        (["held", "slips"], ["held", "held"], 1, 1),
        (["slips", "held"], ["held", "slips", "held"], 1, 0),
    ],
)
def test_transfer_counts_the_points_that_both_grippers_hold(
    tmp_path: Path, first: list[str], second: list[str], transferable: int, transferred: int
) -> None:
    other = other_gripper(tmp_path, first, second)
    assert (other.transferable, other.transferred) == (transferable, transferred)
    assert other.summary is not None and other.summary.verified == second.count("held")
    assert other.reason is other.detail is None


def test_gripper_without_proposals_has_a_reason_and_no_summary(tmp_path: Path) -> None:
    other = other_gripper(
        tmp_path,
        ["held", "held"],
        [],
        none_because={"reason": "too_wide", "detail": "narrowest grip is 120.0 mm"},
        point_radius_m=0.03,
    )
    assert other == OtherGripper(
        summary=None, reason="too_wide", detail="narrowest grip is 120.0 mm", transferable=2, transferred=0
    )
