"""The stages of grasps on a box whose grasps are known, in real engines, and on things that cannot be gripped."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import trimesh

from grasp_drafts import PANDA, Scripted, box_draft, run_all
from manitwin.config import GraspConfig, RobustnessConfig, SecondOpinionConfig, VerifyConfig
from manitwin.engine.stage import Draft, Stage
from manitwin.errors import Rejected
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.models.graspers.surface_sampling import AntipodalGrasper
from manitwin.physics.mujoco.trial import MujocoTrial
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.pipeline.grasps import GraspsStage
from manitwin.pipeline.record_grasps import RecordGraspsStage
from manitwin.pipeline.robustness import RobustnessStage
from manitwin.pipeline.second_opinion import SecondOpinionStage
from manitwin.pipeline.verify import VerifyStage
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.twin.grasp_summary import GraspSummary

FEW = GraspConfig(simulated=12, unfiltered=4, raw_per_round=2000, rounds=3, near_enough=200)
SECOND = SecondOpinionConfig(jittered=6)
ROBUST = RobustnessConfig(max_trials=4)
SAPIEN, MUJOCO, VERIFY = SapienTrial(), MujocoTrial(), VerifyConfig()
COLUMNS = [
    *("grasp_id", "gripper", "position_m", "quaternion_wxyz", "width_m", "depth_m", "score", "proposer"),
    *("grasp_point_id", "functional_point_id", "distance_to_point_m", "outcome", "verified", "displacement_m"),
    *("rotation_rad", "holds_in_second_engine", "robustness", "robustness_trials", "retired"),
]
BAR_POINTS = [[0.0, 0.0, 0.25], [0.0, 0.02, 0.04], [0.02, 0, 0.12]]


def grasps_stage(settings: GraspConfig = FEW, gripper: Any = PANDA, suffix: str = "") -> GraspsStage:
    return GraspsStage(settings, AntipodalGrasper(), gripper, suffix)


def trial_stages(gripper: Any = PANDA, suffix: str = "") -> list[Stage]:
    return [
        grasps_stage(FEW, gripper, suffix),
        VerifyStage(VERIFY, SAPIEN, gripper, suffix),
        SecondOpinionStage(SECOND, VERIFY, SAPIEN, MUJOCO, gripper, suffix),
        RobustnessStage(ROBUST, VERIFY, SAPIEN, gripper, suffix),
    ]


def run_grasps(draft: Draft, folder: Path) -> dict[str, np.ndarray]:
    run_all(draft, folder, grasps_stage())
    return dict(np.load(draft.path("proposals.npz")))


def table_of(draft: Draft) -> dict[str, list[Any]]:
    return pq.read_table(draft.path("grasps.parquet")).to_pydict()


@pytest.fixture(scope="module")
def bar(tmp_path_factory: pytest.TempPathFactory) -> Draft:
    folder = tmp_path_factory.mktemp("bar")
    draft = box_draft(folder, [0.04, 0.04, 0.25], BAR_POINTS)
    return run_all(draft, folder, *trial_stages(), RecordGraspsStage(SECOND, [(PANDA, "")]))


def test_stages_of_two_grippers_read_what_is_there_and_write_artifacts_of_their_own(tmp_path: Path) -> None:
    there = box_draft(tmp_path, [0.04, 0.04, 0.25], BAR_POINTS).names()
    both = [(PANDA, ""), (PANDA, "-other")]
    for stage in [*trial_stages(), *trial_stages(PANDA, "-other"), RecordGraspsStage(SECOND, both)]:
        assert {name for name in stage.reads if not name.endswith("?")} <= there
        assert there.isdisjoint(stage.writes)
        there |= set(stage.writes)


def test_chosen_grasps_are_near_a_selected_point(bar: Draft) -> None:
    proposals = dict(np.load(bar.path("proposals.npz")))
    chosen = proposals["proposer"] == "antipodal"
    assert chosen.sum() == 12
    assert not bar.field("proposals")["association_radius_widened"]
    assert bar.field("proposals")["share_beyond_3cm"] == 0
    tips = proposals["gripper_to_object"][:, :3, 3] + proposals["gripper_to_object"][:, :3, 2] * PANDA.tip_depth_m
    away_m = np.linalg.norm(tips[chosen][:, None] - np.array(BAR_POINTS), axis=2)
    assert (away_m.min(1) <= 0.03 + 0.03).all()  # from a fingertips' middle it is half of the bar to a contact


def test_counts_by_filter_fall_and_octants_are_several(bar: Draft) -> None:
    field = bar.field("proposals")
    filters = ("raw", "after_pad", "after_collision", "after_load", "after_association", "after_diversity")
    counts = [field["proposed_by_filter"][name] for name in filters]
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] == 12
    assert field["proposed"] == field["proposed_by_filter"]["after_load"]
    assert field["approach_octants"] >= 4


def test_table_has_the_columns_of_the_contract_and_agrees_with_the_summary(bar: Draft) -> None:
    rows, summary = table_of(bar), GraspSummary(**bar.field("grasps"))
    assert set(COLUMNS) <= set(rows)
    raw = np.array([name.endswith(":unfiltered") for name in rows["proposer"]])
    moved = np.array([name.endswith(":jittered") for name in rows["proposer"]])
    assert raw.sum() == summary.unfiltered_simulated == 4
    assert summary.second_opinion is not None and moved.sum() == summary.second_opinion.jittered == 6
    assert len(raw) == 12 + 4 + 6
    assert np.array(rows["verified"])[~raw & ~moved].sum() == summary.verified
    assert summary.simulated == 12
    assert summary.verified + sum(summary.failures.values()) == 12
    assert [outcome == "held" for outcome in rows["outcome"]] == rows["verified"]
    assert summary.verified >= 11
    assert len(set(rows["grasp_id"])) == len(raw)


def test_second_engine_and_robustness_are_there_for_what_held(bar: Draft) -> None:
    rows, summary = table_of(bar), GraspSummary(**bar.field("grasps"))
    plain = [i for i, name in enumerate(rows["proposer"]) if ":" not in name]
    held = [i for i in plain if rows["verified"][i]]
    assert summary.second_opinion is not None and summary.robustness is not None
    assert None not in [rows["holds_in_second_engine"][i] for i in held]
    share = np.mean([rows["holds_in_second_engine"][i] for i in held])
    assert share == summary.second_opinion.holds_share >= 0.9
    for i in range(len(rows["proposer"])):
        tried = i in held
        assert (rows["robustness"][i] is not None) == (rows["robustness_trials"][i] is not None) == tried
    trials = [rows["robustness_trials"][i] for i in held]
    assert summary.robustness.trials == sum(trials)
    assert min(trials) >= 2 and max(trials) <= 4
    controls = [i for i, name in enumerate(rows["proposer"]) if name.endswith(":jittered")]
    assert None not in [rows["holds_in_second_engine"][i] for i in controls]
    both = [rows["holds_in_second_engine"][i] == rows["verified"][i] for i in controls]
    assert sum(both) == summary.second_opinion.jittered_agree


def test_table_poses_are_gripper_to_object_with_width_along_x(bar: Draft) -> None:
    rows = table_of(bar)
    rotation = rotation_from_quaternion_wxyz(np.array(rows["quaternion_wxyz"]))
    tips = np.array(rows["position_m"]) + rotation[:, :, 2] * np.array(rows["depth_m"])[:, None]
    closing = np.abs(rotation[:, :, 0])
    held = np.array(rows["verified"]) & np.array([":" not in name for name in rows["proposer"]])
    assert (np.abs(tips[held, :2]) <= 0.03).all()
    # the only sides that the stroke takes are the four long ones: closing is horizontal, and as wide as the bar
    assert closing[held, 2].max() < 0.5
    assert np.array(rows["width_m"])[held] == pytest.approx(0.04, abs=0.01)


def test_same_seed_writes_the_same_bytes(bar: Draft, tmp_path: Path) -> None:
    again = box_draft(tmp_path, [0.04, 0.04, 0.25], BAR_POINTS)
    run_all(again, tmp_path, *trial_stages(), RecordGraspsStage(SECOND, [(PANDA, "")]))
    for name in ("proposals.npz", "verdicts.npz", "second_opinion.npz", "robustness.npz", "grasps.parquet"):
        assert again.path(name).read_bytes() == bar.path(name).read_bytes(), name
    assert again.fields == bar.fields


def test_without_second_engine_and_robustness_the_columns_are_empty_and_the_verdicts_the_same(
    bar: Draft, tmp_path: Path
) -> None:
    quick = Draft("box", bar.payload, bar.seed, dict(bar.fields), dict(bar.paths))
    for name in ("second_opinion", "robustness"):
        del quick.fields[name], quick.paths[f"{name}.npz"]
    run_all(quick, tmp_path, RecordGraspsStage(SECOND, [(PANDA, "")]))
    rows, summary = table_of(quick), GraspSummary(**quick.field("grasps"))
    for name in ("holds_in_second_engine", "robustness", "robustness_trials"):
        assert rows[name] == [None] * 16
    full = GraspSummary(**bar.field("grasps"))
    assert summary == full.model_copy(update={"second_opinion": None, "robustness": None})


def test_radius_grows_where_the_points_cannot_be_gripped(tmp_path: Path) -> None:
    # the middle of the broad faces is out of the stroke's reach
    draft = box_draft(tmp_path, [0.04, 0.2, 0.2], [[0.02, 0.0, 0.1], [0.02, 0.0, 0.1]])
    run_grasps(draft, tmp_path)
    field = draft.field("proposals")
    assert field["association_radius_widened"]
    assert field["association_radius_m"] > 0.03
    assert field["share_beyond_3cm"] == 1


def test_too_wide_box_is_rejected_with_its_smallest_width(tmp_path: Path) -> None:
    draft = box_draft(tmp_path, [0.1, 0.12, 0.14], [[0.05, 0, 0.07], [0, 0.06, 0.07]])
    with pytest.raises(Rejected, match=r"narrowest grip is 100\.0 mm, the panda opens 80 mm") as answer:
        run_grasps(draft, tmp_path)
    assert answer.value.reason == "too_wide"


def test_too_wide_jar_is_rejected_with_its_width_and_not_that_of_a_line_across_it(tmp_path: Path) -> None:
    draft = box_draft(tmp_path, [0.09, 0.09, 0.165], [[0.045, 0, 0.08], [0, 0.045, 0.08]])
    jar = trimesh.creation.cylinder(0.045, 0.165, sections=48)
    jar.apply_translation([0, 0, 0.0825])
    np.savez(tmp_path / "solid.npz", vertices=jar.vertices, faces=jar.faces)
    np.savez(tmp_path / "hulls.npz", hull_00=jar.vertices)
    np.savez(tmp_path / "parts.npz", solid=np.full(len(jar.faces), 255, np.uint8))
    with pytest.raises(Rejected, match=r"narrowest grip is (88|89|90)\.\d mm, the panda opens 80 mm") as answer:
        run_grasps(draft, tmp_path)
    assert answer.value.reason == "too_wide"


def test_a_wide_can_is_too_wide_although_its_rim_is_thin(tmp_path: Path) -> None:
    """Of a can 102 mm wide the rim above its lid alone is narrower, which no hand reaches; grips were '0.6 mm wide and more'."""
    draft = box_draft(tmp_path, [0.102, 0.102, 0.14], [[0.051, 0, 0.07], [0, 0.051, 0.07]])
    profile = np.array([(0, 0), (51, 0), (51, 140), (49.5, 140), (49.5, 137), (0, 137)]) / 1000
    can = trimesh.creation.revolve(profile, sections=64)
    np.savez(tmp_path / "solid.npz", vertices=can.vertices, faces=can.faces)
    np.savez(tmp_path / "hulls.npz", hull_00=can.vertices)
    np.savez(tmp_path / "parts.npz", solid=np.full(len(can.faces), 255, np.uint8))
    with pytest.raises(
        Rejected, match=r"it is at least (99|10[0-2])\.\d mm wide, the panda opens 80 mm, and no hand reaches"
    ) as answer:
        run_grasps(draft, tmp_path)
    assert answer.value.reason == "too_wide"


def test_a_cube_as_wide_as_the_hand_opens_is_too_wide(tmp_path: Path) -> None:
    draft = box_draft(tmp_path, [0.08, 0.08, 0.08], [[0.04, 0, 0.04], [0, 0.04, 0.04]])
    with pytest.raises(Rejected, match=r"narrowest grip is 80\.0 mm, the panda opens 80 mm") as answer:
        run_grasps(draft, tmp_path)
    assert answer.value.reason == "too_wide"


def test_a_cube_hardly_narrower_than_the_hand_opens_is_told_what_has_to_stay_free(tmp_path: Path) -> None:
    draft = box_draft(tmp_path, [0.0795, 0.0795, 0.0795], [[0.03975, 0, 0.04], [0, 0.03975, 0.04]])
    said = r"narrowest grip is 79\.5 mm, the panda opens 80 mm, of which 0\.5 mm beside each pad stay free"
    with pytest.raises(Rejected, match=said) as answer:
        run_grasps(draft, tmp_path)
    assert answer.value.reason == "too_wide"


def test_foil_is_rejected_as_too_thin(tmp_path: Path) -> None:
    draft = box_draft(tmp_path, [0.1, 0.12, 0.0003], [[0.05, 0, 0], [0, 0.06, 0]])
    with pytest.raises(Rejected) as answer:
        run_grasps(draft, tmp_path)
    assert answer.value.reason == "too_thin"


def test_another_gripper_without_proposals_does_not_reject_the_twin_and_says_why(tmp_path: Path) -> None:
    # 100 mm: wide enough for the 110 mm of the first gripper, too wide for the second
    wide = load_gripper("wsg50_110")
    draft = box_draft(tmp_path, [0.1, 0.12, 0.14], [[0.05, 0, 0.07], [0.05, 0, 0.12], [-0.05, 0, 0.12]])
    record = RecordGraspsStage(SECOND, [(wide, ""), (PANDA, "-panda")])
    run_all(draft, tmp_path, *trial_stages(wide), *trial_stages(PANDA, "-panda"), record)
    summary = GraspSummary(**draft.field("grasps"))
    assert summary.gripper == "wsg50_110" and summary.verified >= 1
    other = summary.other_grippers["panda"]
    assert (other.summary, other.reason) == (None, "too_wide")
    assert other.detail == "narrowest grip is 100.0 mm, the panda opens 80 mm"
    assert (other.transferable, other.transferred) == (2, 0)
    rows = table_of(draft)
    panda = [i for i, name in enumerate(rows["gripper"]) if name == "panda"]
    assert not any(rows["verified"][i] for i in panda)
    assert all(rows["proposer"][i].endswith(":unfiltered") for i in panda)


def test_two_grippers_share_a_table_and_what_one_can_hold_of_the_others_points_is_counted(
    bar: Draft, tmp_path: Path
) -> None:
    robotiq = load_gripper("robotiq_2f85")
    draft = Draft("box", bar.payload, bar.seed, dict(bar.fields), dict(bar.paths))
    few = [
        grasps_stage(FEW, robotiq, "-robotiq_2f85"),
        VerifyStage(VERIFY, SAPIEN, robotiq, "-robotiq_2f85"),
        RecordGraspsStage(SECOND, [(PANDA, ""), (robotiq, "-robotiq_2f85")]),
    ]
    run_all(draft, tmp_path, *few)
    rows, summary = table_of(draft), GraspSummary(**draft.field("grasps"))
    other = summary.other_grippers["robotiq_2f85"]
    assert other.summary is not None and other.summary.trial.force_n == 100
    assert (other.summary.second_opinion, other.summary.robustness) == (None, None)

    def points(gripper: str) -> set[str]:
        found = {
            rows["grasp_point_id"][i]
            for i, name in enumerate(rows["gripper"])
            if name == gripper and rows["verified"][i] and ":" not in rows["proposer"][i]
        }
        return found - {None}

    assert other.transferable == len(points("panda"))
    assert other.transferred == len(points("panda") & points("robotiq_2f85")) >= 1
    assert len(set(rows["grasp_id"])) == len(rows["grasp_id"])
    first = summary.model_copy(update={"other_grippers": {}})
    assert first == GraspSummary(**bar.field("grasps")), "another gripper changes nothing of the first one's"


def test_object_of_which_nothing_holds_is_rejected_with_the_failures(bar: Draft, tmp_path: Path) -> None:
    nothing = Scripted(lambda pose, settings: "drops")
    with pytest.raises(Rejected, match="none of 12 simulated grasps held: 12 drops") as answer:
        VerifyStage(VerifyConfig(), nothing, PANDA).run(bar, tmp_path)
    assert answer.value.reason == "none_held"


def test_another_gripper_of_which_nothing_holds_is_counted_and_not_rejected(bar: Draft, tmp_path: Path) -> None:
    nothing = Scripted(lambda pose, settings: "drops")
    draft = Draft("box", bar.payload, bar.seed, dict(bar.fields), dict(bar.paths))
    robotiq, suffix = load_gripper("robotiq_2f85"), "-robotiq_2f85"
    stages = [grasps_stage(FEW, robotiq, suffix), VerifyStage(VERIFY, nothing, robotiq, suffix)]
    stages += [SecondOpinionStage(SECOND, VERIFY, nothing, nothing, robotiq, suffix)]
    stages += [RobustnessStage(ROBUST, VERIFY, nothing, robotiq, suffix)]
    run_all(draft, tmp_path, *stages, RecordGraspsStage(SECOND, [(PANDA, ""), (robotiq, suffix)]))
    other = GraspSummary(**draft.field("grasps")).other_grippers["robotiq_2f85"]
    assert other.summary is not None
    assert (other.summary.verified, other.summary.failures) == (0, {"drops": 12})
    assert other.transferred == 0
