"""What is doubtful at the solver's step is tried again as the reference is, and nothing else is."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from manitwin.physics.mujoco.trial import MujocoTrial
from manitwin.physics.robustness import jittered
from manitwin.physics.sapien import trial as sapien_trial
from manitwin.physics.sapien.trial import LEAST_TIMESTEP_S, SapienTrial
from manitwin.physics.trial import TrialResult, TrialSettings
from manitwin.twin.grasp_summary import Outcome
from rigid_boxes import PANDA, SETTINGS, above, box, try_one

REFERENCE = replace(SETTINGS, timestep_s=1 / 960, solver_iterations=40, steps_per_frame=16, max_steps=8000)
CUBE_M = [0.04, 0.04, 0.04]


def test_bar_that_trembles_in_a_coarse_step_is_held_as_finer_steps_and_the_other_engine_hold_it() -> None:
    bar, poses = box([0.02, 0.14, 0.02], 0.1), np.repeat(above([0, 0.02, 0])[None], 24, 0)
    askew = jittered(poses, np.full(24, 0.01), np.random.default_rng(3), sigma_deg=20.0, sigma_m=0.006)[7]
    assert try_one(SapienTrial(), bar, askew, REFERENCE).outcome == "held"
    assert try_one(MujocoTrial(), bar, askew).outcome == "held"
    assert try_one(SapienTrial(), bar, askew).outcome == "held"
    assert SapienTrial().record(bar, PANDA, askew, SETTINGS).result.outcome == "held", "and is shown as it was judged"
    assert try_one(SapienTrial(), bar, askew, replace(SETTINGS, doubts_tried_again=False)).outcome == "unstable"


@pytest.mark.parametrize(
    ("first", "moved_m"),
    [
        ("held", 0.004), ("held", 0.006), (None, 0.0), ("collides", 0.0), ("misses", 0.0), ("penetrates", 0.0),
        ("drops", 0.03), ("unstable", 0.0), ("slips", 0.011),
    ],
)  # fmt: skip
@pytest.mark.parametrize("timestep_s", [1 / 240, 1 / 480, LEAST_TIMESTEP_S])
@pytest.mark.parametrize("asked", [True, False])
def test_only_what_is_doubtful_is_tried_again_and_with_the_settings_of_the_reference(
    monkeypatch: pytest.MonkeyPatch, first: Outcome | None, moved_m: float, timestep_s: float, asked: bool
) -> None:
    tried: list[tuple[float, int, bool]] = []

    def answer(grasp: Any, settings: TrialSettings, recorder: Any, *, briefly: bool) -> TrialResult | None:
        assert settings.frame_s == pytest.approx(SETTINGS.frame_s * timestep_s * 240), "the protocol's frames stay"
        tried.append((settings.timestep_s, settings.solver_iterations, briefly))
        if len(tried) > 1:
            return TrialResult("held", 0.0, 0.0, 0.0, (50.0, 50.0), 2)
        return None if first is None else TrialResult(first, moved_m, 0.0, 0.0, (50.0, 50.0), 1)

    monkeypatch.setattr(sapien_trial, "_try_once", answer)
    settings = replace(SETTINGS, timestep_s=timestep_s, doubts_tried_again=asked)
    result = try_one(SapienTrial(), box(CUBE_M, 1.0), above([0, 0, 0]), settings)
    doubtful = asked and (first is None or first in {"drops", "unstable", "slips"} or moved_m == 0.006)
    expected = [(timestep_s, 20, True)]
    if doubtful:
        expected.append((pytest.approx(LEAST_TIMESTEP_S), 40, False))
    elif first is None:
        expected.append((timestep_s, 20, False))
    assert tried == expected
    assert result.outcome == ("held" if len(tried) > 1 else first), "the last verdict counts"


@pytest.mark.parametrize(("settings", "steps"), [(SETTINGS, SETTINGS.max_steps), (REFERENCE, 9)])
def test_trial_that_ran_out_of_time_or_is_the_reference_is_not_tried_again(
    monkeypatch: pytest.MonkeyPatch, settings: TrialSettings, steps: int
) -> None:
    tried: list[TrialSettings] = []

    def answer(grasp: Any, given: TrialSettings, recorder: Any, *, briefly: bool) -> TrialResult:
        tried.append(given)
        return TrialResult("unstable", 0.0, 0.0, 0.0, (50.0, 50.0), steps)

    monkeypatch.setattr(sapien_trial, "_try_once", answer)
    assert try_one(SapienTrial(), box(CUBE_M, 1.0), above([0, 0, 0]), settings).outcome == "unstable"
    assert tried == [settings]


def test_box_beyond_what_friction_carries_falls_at_both_steps() -> None:
    assert try_one(SapienTrial(), box(CUBE_M, 1.2 * 2 * 0.75 * 50 / 9.81), above([0, 0, 0])).outcome == "drops"
