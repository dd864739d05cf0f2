"""Repeated trials of held grasps under perturbations until a sequential test decides (paper, "Simulation Verification")."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.config import Resource, RobustnessConfig, VerifyConfig
from manitwin.engine.stage import Draft
from manitwin.physics.robustness import (
    FillCurve,
    PerturbationRanges,
    Robustness,
    SequentialTest,
    draw_perturbations,
    run_sequential_test,
)
from manitwin.physics.trial import GraspTrial
from manitwin.pipeline.grasps import UNFILTERED
from manitwin.pipeline.object_state import joints_of, load_body
from manitwin.pipeline.tried_grasps import read_tried, tried_names
from manitwin.pipeline.verify import trial_settings
from manitwin.robots.grippers.gripper import Gripper
from manitwin.twin.grasp_summary import RobustnessSummary

ROBUSTNESS_FILE = "robustness{}.npz"
ROBUSTNESS = "robustness{}"


class RobustnessStage:
    """Repeat the trials of each held grasp. Writes ``held (N,)`` and ``trials (N,)``; zero trials if it did not hold at first."""

    version = "8"
    needs: Resource = "cpu"

    def __init__(
        self, settings: RobustnessConfig, verify: VerifyConfig, trial: GraspTrial, gripper: Gripper, suffix: str = ""
    ):
        """Take the settings of perturbations and trials, the engine and the gripper."""
        self.settings, self.verify, self.trial, self.gripper = settings, verify, trial, gripper
        self.backend = trial.name
        self.model: str | None = f"{gripper.name} {gripper.sha256[:12]}, {verify.model_dump_json()}"
        self.name = f"robustness{suffix}"
        self.suffix = suffix
        self.file, self.field = ROBUSTNESS_FILE.format(suffix), ROBUSTNESS.format(suffix)
        self.reads: tuple[str, ...] = (*tried_names(suffix), "solid.npz", "hulls.npz", "physical")
        self.writes: tuple[str, ...] = (self.file, self.field)

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Write how many trials each grasp survived, and return the summary."""
        proposals, verdicts = read_tried(draft, self.suffix)
        poses, depth_m = proposals["gripper_to_object"], proposals["depth_m"]
        chosen = ~np.char.endswith(proposals["proposer"], UNFILTERED)
        good = np.flatnonzero((verdicts["outcome"] == "held") & chosen)
        joints = joints_of(proposals, np.arange(len(poses)))
        filling = fill_curve(draft.field("physical"))
        spread = self._spread(draft.field("physical"), filling)
        draws = draw_perturbations(spread, self.settings.max_trials, draft.seed)
        body = load_body(draft)
        # a fall at the first time step size counts here: a robust grasp exceeds the least grasp that holds
        settings = replace(trial_settings(self.verify, self.gripper), doubts_tried_again=False)
        variants = [(draw, draw.body(body, filling), draw.settings(settings)) for draw in draws]

        def survives(index: int, number: int) -> bool:
            draw, other_body, other_settings = variants[number]
            pose = draw.grasp(poses[index], float(depth_m[index]))
            closing = {name: values[index : index + 1] for name, values in joints.items()}
            result = self.trial.run(other_body, self.gripper, pose[None], other_settings, **closing)[0]
            return result.outcome == "held"

        test = SequentialTest(
            self.settings.robust_share, self.settings.fragile_share, self.settings.error, self.settings.max_trials
        )
        held, trials = np.zeros(len(poses), np.int32), np.zeros(len(poses), np.int32)
        for index in good:
            answer = run_sequential_test(lambda number, index=index: survives(index, number), test)  # type: ignore[misc]
            held[index], trials[index] = answer.held, answer.trials
        np.savez(folder / self.file, held=held, trials=trials)
        return {self.field: self._summary(spread, test, held[good], trials[good]).model_dump(mode="json")}

    def _spread(self, physical: dict[str, Any], filling: FillCurve | None) -> PerturbationRanges:
        settings, mass = self.settings, physical["mass_kg"]
        return PerturbationRanges(
            pose_m=settings.pose_m,
            pose_deg=settings.pose_deg,
            friction=settings.friction,
            force=settings.force,
            mass_kg=(mass["low"], mass["high"]),
            center_of_mass_m=physical["center_of_mass_uncertainty_m"]
            if filling is None
            else float(filling.uncertainties_m.max()),
        )

    def _summary(
        self, spread: PerturbationRanges, test: SequentialTest, held: np.ndarray, trials: np.ndarray
    ) -> RobustnessSummary:
        share = held / np.maximum(trials, 1)
        return RobustnessSummary(
            **vars(spread),
            max_trials=self.settings.max_trials,
            trials=int(trials.sum()),
            median=float(np.median(share)) if len(share) else None,
            robust=sum(test.is_robust(int(h), int(n)) for h, n in zip(held, trials, strict=True)),
            robust_share=self.settings.robust_share,
            fragile_share=self.settings.fragile_share,
        )


def fill_curve(physical: dict[str, Any]) -> FillCurve | None:
    """Return a vessel's centre of mass and inertia as functions of its mass; None without fill states."""
    filling = physical.get("filling")
    if filling is None:
        return None
    names = ("mass_kg", "center_of_mass_m", "inertia_kg_m2")
    known_m = physical["center_of_mass_uncertainty_m"]  # of the full state, for states that do not have their own
    off_m = [state.get("center_of_mass_uncertainty_m") for state in filling["states"]]
    masses, centers, inertias = (np.array([state[name] for state in filling["states"]]) for name in names)
    return FillCurve(masses, centers, inertias, np.array([known_m if each is None else each for each in off_m]))


def rank_values(held: np.ndarray, trials: np.ndarray) -> np.ndarray:
    """Return the ranking values of grasps: the posterior mean of the success share, and less than any of these if not tried."""
    return np.array([Robustness(int(h), int(n)).rank_value if n else -1.0 for h, n in zip(held, trials, strict=True)])
