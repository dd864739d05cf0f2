"""The second look at grasp points: more trials where too few held, another point where none can, and the reason beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from grasp_drafts import PANDA, Scripted, box_draft, run_all
from manitwin.config import GraspConfig, VerifyConfig
from manitwin.engine.stage import Draft
from manitwin.models.graspers.surface_sampling import AntipodalGrasper
from manitwin.pipeline.grasp_regions import PartedSolid, region_columns
from manitwin.pipeline.grasps import GraspsStage
from manitwin.pipeline.point_trials import DISPROVED, PointTrialsStage
from manitwin.pipeline.quality import agreement_checks, point_checks
from manitwin.pipeline.tried_grasps import POINT_PROPOSALS, POINT_VERDICTS, read_arrays, read_tried
from manitwin.pipeline.verify import VerifyStage
from manitwin.twin.point_records import GraspPoint

BAR = [0.04, 0.04, 0.25]
TOP, LOW, MIDDLE = [0.0, 0.0, 0.25], [0.0, 0.02, 0.03], [0.02, 0.0, 0.13]
SETTINGS = GraspConfig(
    simulated=12, unfiltered=4, raw_per_round=1500, rounds=1, near_enough=50, least_per_point=6, tries_per_point=30
)


def grasp_point(name: str, place: list[float], candidate: int) -> dict[str, Any]:
    return GraspPoint(
        id=name,
        candidate=candidate,
        position_m=tuple(place),
        normal=(1.0, 0.0, 0.0),
        type="parallel_jaw",
        scenario=f"pick it up at {place[2]:g}",
        confidence=0.8,
        rationale="",
    ).model_dump()


def answered(folder: Path, *, held_above_m: float, spares: list[list[float]]) -> Draft:
    """Run the trials of a bar whose grasps hold above a height only: the first grasp point is at 3 cm, the other at 13."""
    draft = box_draft(folder, BAR, [TOP, LOW, MIDDLE])
    draft.fields["points"]["grasp"] = [grasp_point("g0", LOW, 1), grasp_point("g1", MIDDLE, 2)]
    draft.fields["spare_grasp_points"] = [grasp_point("spare", place, 3 + n) for n, place in enumerate(spares)]

    def outcome(pose: np.ndarray, settings: object) -> str:
        tip_m = pose[2, 3] + PANDA.tip_depth_m * pose[2, 2]
        return "held" if tip_m > held_above_m else "slips"

    grasper, trial = AntipodalGrasper(), Scripted(outcome)
    return run_all(
        draft,
        folder,
        GraspsStage(SETTINGS, grasper, PANDA),
        VerifyStage(VerifyConfig(), trial, PANDA),
        PointTrialsStage(SETTINGS, VerifyConfig(), grasper, trial, PANDA),
    )


def columns_of(draft: Draft) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    rows, verdicts = read_tried(draft, "")
    held = PartedSolid.read(draft, PANDA, SETTINGS.association_radius_m)
    points = draft.field("points") | draft.field("grasp_points")
    return rows | region_columns(rows, held, points["functional"], points["grasp"]), verdicts


def held_at(draft: Draft, name: str) -> int:
    """Count by the table's own columns: the grasp point that is served, and verified."""
    rows, verdicts = columns_of(draft)
    chosen = ~np.char.endswith(rows["proposer"], ":unfiltered")
    return int((chosen & (rows["grasp_point_id"] == name) & (verdicts["outcome"] == "held")).sum())


def test_every_point_gets_its_share_and_is_topped_up_from_its_own_surroundings(tmp_path: Path) -> None:
    draft = answered(tmp_path, held_above_m=0.035, spares=[])  # at the low point only what is gripped high holds
    first, more = read_arrays(draft, "proposals.npz"), read_arrays(draft, POINT_PROPOSALS)
    low, middle = draft.field("grasp_points")["grasp"]
    assert (low["verified"], middle["verified"]) >= (6, 6)
    assert low["shortfall"] == middle["shortfall"] == ""
    assert held_at(draft, "g0") == low["verified"]
    count = len(first["score"])
    np.testing.assert_array_equal(more["gripper_to_object"][:count], first["gripper_to_object"])
    extra = more["gripper_to_object"][count:]
    assert len(extra) > 0  # the first pass alone was not enough
    tips = extra[:, :3, 3] + PANDA.tip_depth_m * extra[:, :3, 2]
    assert np.abs(tips[:, 2] - LOW[2]).max() < SETTINGS.association_radius_m + 0.02
    assert len(read_arrays(draft, POINT_VERDICTS)["outcome"]) == count + len(extra)
    assert point_checks(draft)[0].passed


def test_point_at_which_nothing_holds_is_withdrawn_for_the_next_best_that_holds(tmp_path: Path) -> None:
    high = [0.02, 0.0, 0.2]
    draft = answered(tmp_path, held_above_m=0.09, spares=[[0.0, -0.02, 0.05], high])  # the first spare is no better
    left, (gone,) = draft.field("grasp_points")["grasp"], draft.field("grasp_points")["withdrawn"]
    assert [(point["id"], list(point["position_m"])) for point in left] == [("g2", high), ("g1", MIDDLE)]
    assert all(point["verified"] >= 6 and not point["shortfall"] for point in left)
    assert (gone["id"], gone["confidence"], gone["verified"]) == ("g0", DISPROVED, 0)
    assert "0 of" in gone["shortfall"] and "slips" in gone["shortfall"] and "after_collision" in gone["shortfall"]
    assert set(columns_of(draft)[0]["grasp_point_id"]) <= {"", "g1", "g2"}  # no row names a point that is gone
    check = point_checks(draft)[0]
    assert not check.passed and "withdrawn" in check.message


def test_point_without_a_substitute_stays_and_says_that_it_is_not_to_be_believed(tmp_path: Path) -> None:
    draft = answered(tmp_path, held_above_m=0.09, spares=[])
    low, middle = draft.field("grasp_points")["grasp"]
    assert (low["id"], low["confidence"], low["verified"]) == ("g0", DISPROVED, 0)
    assert low["shortfall"] and draft.field("grasp_points")["withdrawn"] == []
    assert (middle["confidence"], middle["shortfall"]) == (0.8, "")
    assert "confidence 0.1" in point_checks(draft)[0].message


def test_same_draft_gives_the_same_bytes(tmp_path: Path) -> None:
    both = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        draft = answered(tmp_path / name, held_above_m=0.035, spares=[])
        both.append([draft.path(POINT_PROPOSALS).read_bytes(), draft.path(POINT_VERDICTS).read_bytes()])
    assert both[0] == both[1]


@pytest.mark.parametrize("least", [0, 6])
def test_nobody_asked_means_nobody_answers(tmp_path: Path, least: int) -> None:
    draft = box_draft(tmp_path, BAR, [TOP, LOW, MIDDLE])
    draft.fields["points"]["grasp"] = [grasp_point("g0", LOW, 1), grasp_point("g1", MIDDLE, 2)]
    draft.fields["spare_grasp_points"] = [grasp_point("spare", [0.02, 0.0, 0.2], 3)]
    settings, grasper = SETTINGS.model_copy(update={"least_per_point": least}), AntipodalGrasper()
    first = Scripted(lambda pose, _: "held" if pose[2, 3] > 0.2 else "slips")
    run_all(draft, tmp_path, GraspsStage(settings, grasper, PANDA), VerifyStage(VerifyConfig(), first, PANDA))
    later = Scripted(lambda *_: "slips")
    run_all(draft, tmp_path, PointTrialsStage(settings, VerifyConfig(), grasper, later, PANDA))
    assert (later.asked > 0) == (least > 0)
    assert draft.field("grasp_points")["withdrawn"] == []


def test_object_on_which_the_engines_disagree_has_a_failed_check() -> None:
    def check(share: float | None) -> list[bool]:
        opinion = {"engine": "mujoco", "holds_share": share, "held_tried": 50}
        return [c.passed for c in agreement_checks({"second_opinion": opinion, "verified": 50})]

    assert (check(0.78), check(0.9), check(None), agreement_checks({"second_opinion": None})) == (
        [False],
        [True],
        [],
        [],
    )
