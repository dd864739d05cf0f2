"""Verification of grasps by simulation; every verdict is kept (paper, "Simulation Verification")."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.config import Resource, VerifyConfig
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.physics.confirmed_trial import ConfirmedTrial
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.physics.trial import GraspTrial, TrialResult, TrialSettings
from manitwin.pipeline.grasps import PROPOSALS, UNFILTERED
from manitwin.pipeline.gripper_kinds import KINDS
from manitwin.pipeline.object_state import joints_of, load_body
from manitwin.robots.grippers.gripper import Gripper
from manitwin.twin.grasp_summary import Trial

VERDICTS = "verdicts{}.npz"
TRIAL = "trial{}"


class VerifyStage:
    """Try every selected grasp of a gripper, and the unfiltered sample.

    ``suffix`` is part of the artifact names and empty for the twin's first gripper. If no grasp holds, only the first gripper
    rejects the object.
    """

    version = "9"
    needs: Resource = "cpu"

    def __init__(self, settings: VerifyConfig, trial: GraspTrial, gripper: Gripper, suffix: str = ""):
        """Take the settings, the engine and the gripper."""
        self.settings, self.trial, self.gripper = settings, trial, gripper
        self.backend = trial.name
        self.model: str | None = f"{gripper.name} {gripper.sha256[:12]}{confirmation(trial)}"
        self.name = f"verify{suffix}"
        self.proposals, self.verdicts, self.trial_field = (n.format(suffix) for n in (PROPOSALS, VERDICTS, TRIAL))
        self.reads: tuple[str, ...] = (self.proposals, "solid.npz", "hulls.npz", "physical")
        self.writes: tuple[str, ...] = (self.verdicts, self.trial_field)
        self.may_reject = not suffix

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Write the verdicts and return the field ``trial``. Raises Rejected if no grasp held."""
        with np.load(draft.path(self.proposals)) as arrays:
            poses, depth_m, proposer = (arrays[n] for n in ("gripper_to_object", "depth_m", "proposer"))
            joints = joints_of(arrays, np.arange(len(poses)))
        body, settings = load_body(draft), trial_settings(self.settings, self.gripper)
        results = self.trial.run(body, self.gripper, poses, settings, **joints)
        chosen = np.flatnonzero(~np.char.endswith(proposer, UNFILTERED))
        if self.may_reject and not any(results[i].outcome == "held" for i in chosen):
            tried = [results[i] for i in chosen]
            why = KINDS[self.gripper.kind].why_none_held
            raise Rejected("none_held", why(tried, poses[chosen], depth_m[chosen], body, settings))
        np.savez(folder / self.verdicts, allow_pickle=False, **result_arrays(results))
        return {self.trial_field: describe(self.trial, settings, body.friction_static).model_dump(mode="json")}


def trial_settings(settings: VerifyConfig, gripper: Gripper) -> TrialSettings:
    """Return the trial settings from the configuration, with the gripper's own force by default."""
    return TrialSettings(
        force_n=gripper.force_n if settings.force_n is None else settings.force_n,
        finger_friction=gripper.finger_friction,
        slide_m=settings.slide_distance_m,
        **settings.model_dump(exclude={"force_n", "slide_distance_m"}),
    )


def describe(trial: GraspTrial, settings: TrialSettings, object_friction: float) -> Trial:
    """Return the record of a trial's settings, those that a user may set and the friction coefficients."""
    numbers = {name: value for name, value in asdict(settings).items() if name in Trial.model_fields}
    first = trial.first if isinstance(trial, ConfirmedTrial) else trial
    numbers["doubts_tried_again"] = settings.doubts_tried_again and isinstance(first, SapienTrial)
    return Trial(
        engine=trial.name,
        confirmed_by=trial.confirmed_by if isinstance(trial, ConfirmedTrial) else None,
        object_friction=object_friction,
        combine="average",
        slide_distance_m=settings.slide_m,
        **numbers,
    )


def confirmation(trial: GraspTrial) -> str:
    """Return the addition to a stage's model for the engine that confirms a trial's verdicts; empty if there is none."""
    return f", confirmed by {trial.confirmed_by}" if isinstance(trial, ConfirmedTrial) else ""


def result_arrays(results: list[TrialResult]) -> dict[str, np.ndarray]:
    """Return the arrays of ``verdicts.npz``: outcome, displacement (m) and rotation (rad) of each trial.

    ``second_outcome`` is that of the confirming engine, empty if it was not used.
    """
    return {
        "outcome": np.array([result.outcome for result in results], dtype="U16"),
        "displacement_m": np.array([result.displacement_m for result in results], float),
        "rotation_rad": np.array([result.rotation_rad for result in results], float),
        "second_outcome": np.array([result.second_outcome or "" for result in results], dtype="U16"),
    }
