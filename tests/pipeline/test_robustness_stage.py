"""The robustness stage: which grasps are tried again, how often, and what is summed up."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from grasp_drafts import PANDA, Scripted, number_of, proposed_draft, run_all
from manitwin.config import RobustnessConfig, VerifyConfig
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.robustness import FillCurve, PerturbationRanges, draw_perturbations
from manitwin.physics.trial import TrialResult
from manitwin.pipeline.robustness import RobustnessStage, rank_values
from manitwin.twin.grasp_summary import RobustnessSummary

OUTCOMES = ["held", "slips", "held", "held", "drops", "held", "held"]  # the last is unfiltered
STILL = RobustnessConfig(pose_m=0, pose_deg=0)


def test_held_grasps_are_tried_until_the_test_is_clear_and_no_others(tmp_path: Path) -> None:
    # proposal 2 fails always, 3 never, 0 and 5 with little force only
    def outcome(pose: np.ndarray, settings: object) -> str:
        number = number_of(pose)
        weak = settings.force_n < 30 and number in {0, 5}
        return "slips" if number == 2 or weak else "held"

    engine = Scripted(outcome)
    draft = proposed_draft(tmp_path, OUTCOMES, unfiltered=1)
    stage = RobustnessStage(STILL, VerifyConfig(), engine, PANDA)
    run_all(draft, tmp_path, stage)
    arrays = np.load(draft.path("robustness.npz"))
    held, trials = arrays["held"], arrays["trials"]
    assert (trials > 0).tolist() == [True, False, True, True, False, True, False]
    assert (held[2], trials[2]) == (0, 2)
    assert (held[3], trials[3]) == (4, 4)
    assert held[0] == held[5] and trials[0] == trials[5], "the same draws for every grasp"
    assert 0 < held[0] < trials[0] <= 10
    assert engine.asked == trials.sum()
    summary = RobustnessSummary(**draft.field("robustness"))
    assert summary.trials == trials.sum()
    assert summary.median == pytest.approx(np.median([held[i] / trials[i] for i in (0, 2, 3, 5)]))
    assert summary.mass_kg == pytest.approx((0.21, 0.42))
    assert summary.center_of_mass_m == 0.005
    settled = 1.8 ** held[0] * 0.2 ** (trials[0] - held[0])
    assert summary.robust == (3 if settled > 1 else 1)


def test_perturbations_reach_pose_body_and_settings_within_their_ranges(tmp_path: Path) -> None:
    seen: list[tuple[float, float, float]] = []

    def outcome(pose: np.ndarray, settings: object) -> str:
        tip = pose[:3, 3] + PANDA.tip_depth_m * pose[:3, 2]
        seen.append(
            (float(np.linalg.norm(tip - [0, 0, PANDA.tip_depth_m])), settings.force_n, settings.finger_friction)
        )
        return "held"

    run_all(
        proposed_draft(tmp_path, ["held"]),
        tmp_path,
        RobustnessStage(RobustnessConfig(error=1e-6), VerifyConfig(), Scripted(outcome), PANDA),
    )
    shift_m, force_n, friction = np.array(seen).T
    assert len(seen) == 10
    assert 0 < shift_m.max() <= 0.005 and len(np.unique(shift_m)) == 10
    assert 25 <= force_n.min() < 35 and 40 < force_n.max() <= 50
    assert 0.6 <= friction.min() < 0.8 and 1.2 < friction.max() <= 1.4


def test_a_vessel_that_weighs_less_has_less_in_it_and_its_centre_of_mass_lies_lower(tmp_path: Path) -> None:
    bodies: list[RigidBody] = []

    class Seen(Scripted):
        def run(self, body: RigidBody, *rest: Any, **more: Any) -> list[TrialResult]:
            bodies.append(body)
            return super().run(body, *rest, **more)

    draft = proposed_draft(tmp_path, ["held"])
    physical = draft.fields["physical"]
    physical["center_of_mass_uncertainty_m"] = 0.0
    masses, heights_m = (0.05, 0.175, 0.3), (0.125, 0.08, 0.125)  # empty, half full and full
    physical["mass_kg"] = physical["mass_kg"] | {"low": 0.05, "high": 0.4}
    physical["filling"] = {
        "assumption": "full",
        "states": [
            {"share": share, "mass_kg": mass, "center_of_mass_m": [0, 0, z], "inertia_kg_m2": (0.001 * mass * np.eye(3)).tolist()}
            for share, mass, z in zip((0, 0.5, 1), masses, heights_m, strict=True)
        ],
    }  # fmt: skip
    run_all(
        draft,
        tmp_path,
        RobustnessStage(RobustnessConfig(error=1e-6), VerifyConfig(), Seen(lambda pose, settings: "held"), PANDA),
    )
    weights = np.array([body.mass_kg for body in bodies])
    assert len(bodies) == 10 and weights.min() < 0.1 and weights.max() > 0.3
    assert np.allclose([body.center_of_mass_m[2] for body in bodies], np.interp(weights, masses, heights_m))
    assert np.allclose([body.inertia_kg_m2[0, 0] for body in bodies], 0.001 * weights)


def test_what_falls_at_first_is_not_tried_again(tmp_path: Path) -> None:
    asked = []

    def outcome(pose: np.ndarray, settings: object) -> str:
        asked.append(settings.doubts_tried_again)
        return "held"

    run_all(
        proposed_draft(tmp_path, ["held"]), tmp_path, RobustnessStage(STILL, VerifyConfig(), Scripted(outcome), PANDA)
    )
    assert VerifyConfig().doubts_tried_again and asked and not any(asked)


def test_center_of_a_half_empty_vessel_is_moved_by_what_its_own_state_says() -> None:
    filling = FillCurve(np.array([0.1, 0.5]), np.zeros((2, 3)), np.zeros((2, 3, 3)), np.array([0.02, 0.0]))
    spread = PerturbationRanges(0.0, 0.0, (1.0, 1.0), (1.0, 1.0), (0.1, 0.5), center_of_mass_m=0.02)
    body = RigidBody((np.eye(3),), 0.5, np.zeros(3), np.eye(3), 0.5, 0.5)
    shares = []
    for draw in draw_perturbations(spread, 64, 0):
        moved_m = float(np.linalg.norm(draw.body(body, filling).center_of_mass_m))
        allowed_m = 0.02 * (0.5 - draw.mass_kg) / 0.4
        assert moved_m <= allowed_m + 1e-12
        shares.append(moved_m / allowed_m)
    assert max(shares) > 0.9 and min(shares) < 0.6


def test_nothing_held_is_nothing_tried(tmp_path: Path) -> None:
    draft = proposed_draft(tmp_path, ["slips", "drops"])
    engine = Scripted(lambda pose, settings: "held")
    run_all(draft, tmp_path, RobustnessStage(RobustnessConfig(), VerifyConfig(), engine, PANDA))
    summary = RobustnessSummary(**draft.field("robustness"))
    assert (engine.asked, summary.trials, summary.robust, summary.median) == (0, 0, 0, None)


def test_rank_values_order_by_evidence_and_the_untried_come_last() -> None:
    values = rank_values(np.array([4, 8, 7, 0, 0]), np.array([4, 8, 8, 2, 0]))
    assert np.argsort(-values).tolist() == [1, 0, 2, 3, 4]
