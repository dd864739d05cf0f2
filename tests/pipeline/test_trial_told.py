"""What a twin says of the trial that its grasps went through: what was asked for, where its engine does it."""

from __future__ import annotations

import pytest

from grasp_drafts import PANDA
from manitwin.config import BuildConfig
from manitwin.physics.confirmed_trial import ConfirmedTrial
from manitwin.physics.mujoco.trial import MujocoTrial
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.physics.trial import GraspTrial
from manitwin.pipeline.settings import Flags, with_flags
from manitwin.pipeline.verify import describe, trial_settings


@pytest.mark.parametrize(
    ("trial", "tries_again"),
    [(SapienTrial(), True), (ConfirmedTrial(SapienTrial(), MujocoTrial()), True), (MujocoTrial(), False)],
    ids=["sapien", "confirmed", "mujoco"],
)
@pytest.mark.parametrize("quick", [False, True])
def test_doubts_are_told_as_tried_again_where_they_were(trial: GraspTrial, tries_again: bool, quick: bool) -> None:
    verify = with_flags(BuildConfig(), Flags(quick=quick)).verify
    assert verify.doubts_tried_again is not quick
    told = describe(trial, trial_settings(verify, PANDA), 0.5)
    assert told.doubts_tried_again is (tries_again and not quick)
