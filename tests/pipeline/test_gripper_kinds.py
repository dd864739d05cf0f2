"""Who tries the grasps of which gripper, and why none held: by friction or the centre of mass where one number says so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from grasp_drafts import PANDA, box_draft, proposed_draft, run_all
from manitwin.config import BuildConfig, SecondOpinionConfig, VerifyConfig
from manitwin.errors import Rejected
from manitwin.geometry.poses import transform
from manitwin.physics.confirmed_trial import ConfirmedTrial
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.physics.trial import TrialResult
from manitwin.pipeline.gripper_kinds import nearest_lever_m, why_none_held
from manitwin.pipeline.point_trials import PointTrialsStage
from manitwin.pipeline.recipe import stages_for
from manitwin.pipeline.verify import VerifyStage, describe, trial_settings
from rigid_boxes import FROM_ABOVE, SETTINGS, above, box

DROPPED = TrialResult("drops", 0.03, 0.0, 0.0, (50.0, 50.0), 200)


def why(mass_kg: float, *tips_m: list[float], friction: float = 0.5) -> str:
    poses = np.stack([above(tip) for tip in tips_m])
    results = [DROPPED] * (len(poses) - 1) + [replace(DROPPED, outcome="slips")]
    return why_none_held(
        results, poses, np.full(len(poses), PANDA.tip_depth_m), box([0.04, 0.3, 0.04], mass_kg, friction), SETTINGS
    )


def test_failures_are_counted() -> None:
    assert why(0.1, [0, 0, 0], [0, 0.01, 0], [0, 0.02, 0]) == "none of 3 simulated grasps held: 2 drops, 1 slips"


def test_slippery_says_what_friction_carries_and_what_is_needed() -> None:
    # 2 * 0.75 * 50 N; 6 kg * (9.81 + 3.6) m/s2 = 80.5 N
    text = why(6.0, [0, 0, 0])
    assert "slippery for its weight: friction carries 75.0 N, lift and slides need 80.5 N" in text
    assert "slippery" not in why(5.5, [0, 0, 0])
    assert "slippery" in why(5.5, [0, 0, 0], friction=0.2)


def test_center_of_mass_out_of_reach_says_how_far() -> None:
    # 1 kg * 13.41 m/s2 * 0.1 m = 1.341 Nm; pads carry 2 * 0.75 * 50 N * 7 mm = 0.525 Nm: 0.39 of it
    text = why(1.0, [0, 0.12, 0], [0, -0.1, 0])
    assert "centre of mass out of reach: 100 mm from the nearest grip, whose pads carry 0.39 of the torque" in text
    assert "out of reach" not in why(1.0, [0, 0.12, 0], [0, 0.03, 0])


def test_lever_is_the_distance_from_the_nearest_closing_axis() -> None:
    poses = np.stack([above([0.5, 0.03, 0.04]), transform(FROM_ABOVE, np.array([0, 0, 1.0]))])
    # along the closing axis x nothing is lost: 0.03, 0.04 is a distance of 0.05
    depth_m = np.full(2, PANDA.tip_depth_m)
    assert nearest_lever_m(poses, depth_m, np.zeros(3)) == pytest.approx(0.05)


def real_rejection(folder: Path, extents_m: list[float], mass_kg: float, tips_m: list[list[float]]) -> str:
    draft = box_draft(folder, extents_m, [[0, 0, 0.1], [0, 0, 0], [0, 0, 0.05]], mass_kg)
    proposed_draft(folder, ["held"] * len(tips_m), draft=draft)
    arrays = dict(np.load(folder / "proposals.npz"))
    arrays["gripper_to_object"] = np.stack([above(tip) for tip in tips_m])
    arrays["depth_m"] = np.full(len(tips_m), PANDA.tip_depth_m)
    np.savez(folder / "proposals.npz", **arrays)
    with pytest.raises(Rejected) as answer:
        run_all(draft, folder, VerifyStage(VerifyConfig(), SapienTrial(), PANDA))
    assert answer.value.reason == "none_held"
    return answer.value.detail


def test_heavy_box_is_rejected_as_slippery_by_the_real_trial(tmp_path: Path) -> None:
    detail = real_rejection(tmp_path, [0.04, 0.04, 0.04], 9.0, [[0, 0, 0.02], [0, 0.005, 0.02]])
    assert detail.startswith("none of 2 simulated grasps held: 2 drops; too slippery for its weight")
    assert "out of reach" not in detail


def test_long_bar_gripped_at_its_end_only_is_rejected_as_out_of_reach_by_the_real_trial(tmp_path: Path) -> None:
    detail = real_rejection(tmp_path, [0.03, 0.4, 0.03], 2.0, [[0, 0.19, 0.015], [0, -0.18, 0.015]])
    assert "centre of mass out of reach: 180 mm" in detail
    assert "slippery" not in detail


def test_both_engines_judge_what_moved_in_parallel_jaws_in_a_quick_build_too() -> None:
    config = BuildConfig(grippers=("panda", "suction"), second_opinion=SecondOpinionConfig(enabled=False))
    by_name = {stage.name: stage for stage in stages_for("mesh", config)}
    verify, points, suction = (by_name[name] for name in ("verify", "point_trials", "verify-suction"))
    assert isinstance(verify, VerifyStage) and isinstance(points, PointTrialsStage) and isinstance(suction, VerifyStage)
    assert isinstance(verify.trial, ConfirmedTrial) and isinstance(points.trial, ConfirmedTrial)
    settings = trial_settings(config.verify, verify.gripper)
    assert describe(verify.trial, settings, 0.4).confirmed_by == "mujoco"
    assert describe(suction.trial, settings, 0.4).confirmed_by is None, "a closed form has one answer"
