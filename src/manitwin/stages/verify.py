"""Verify grasps by simulation, and keep every verdict (paper, "Simulation Verification")."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from manitwin.config import VerifyConfig
from manitwin.errors import Rejected
from manitwin.geometry.grasp_diversity import approach_octants
from manitwin.simulate.gripper import Gripper
from manitwin.simulate.rigid_body import RigidBody
from manitwin.simulate.trial import GraspTrial, TrialResult, TrialSettings
from manitwin.stages.grasp_table import write_grasp_table
from manitwin.stages.grasps import PROPOSALS, UNFILTERED
from manitwin.stages.object_arrays import load_body
from manitwin.stages.stage import Draft, Resource
from manitwin.twin import GraspSummary, Trial

TABLE = "grasps.parquet"


class VerifyStage:
    """Try every chosen grasp, and the unfiltered sample beside it."""

    name: ClassVar[str] = "verify"
    version: ClassVar[str] = "3"
    reads: ClassVar[tuple[str, ...]] = (PROPOSALS, "proposals", "hulls.npz", "physical")
    writes: ClassVar[tuple[str, ...]] = (TABLE, "grasps")
    needs: ClassVar[Resource] = "cpu"

    def __init__(self, settings: VerifyConfig, trial: GraspTrial, gripper: Gripper):
        """Take the settings, the engine, and the gripper."""
        self.settings, self.trial, self.gripper = settings, trial, gripper
        self.backend = trial.name
        self.model: str | None = f"{gripper.name} {gripper.sha256[:12]}"

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Write ``grasps.parquet`` and return the field ``grasps``; raises Rejected where no grasp held."""
        with np.load(draft.path(PROPOSALS)) as arrays:
            proposals = dict(arrays)
        body, settings = load_body(draft), self._trial_settings()
        results = self.trial.run(body, self.gripper, proposals["gripper_to_object"], settings)
        unfiltered = np.char.endswith(proposals["proposer"], UNFILTERED)
        summary = self._summary(draft.field("proposals"), proposals, results, unfiltered, body, settings)
        if not summary.verified:
            failures = ", ".join(f"{count} {outcome}" for outcome, count in summary.failures.items())
            raise Rejected("none_held", f"none of {summary.simulated} simulated grasps held: {failures}")
        write_grasp_table(folder / TABLE, self.gripper.name, proposals, results)
        return {"grasps": summary.model_dump(mode="json")}

    def _trial_settings(self) -> TrialSettings:
        return TrialSettings(
            force_n=self.gripper.force_n if self.settings.force_n is None else self.settings.force_n,
            finger_friction=self.gripper.finger_friction,
            timestep_s=self.settings.timestep_s,
            solver_iterations=self.settings.solver_iterations,
            max_steps=self.settings.max_steps,
            stable_frames=self.settings.stable_frames,
            max_displacement_m=self.settings.max_displacement_m,
            slide_m=self.settings.slide_distance_m,
        )

    def _summary(
        self,
        proposed: dict[str, Any],
        proposals: dict[str, np.ndarray],
        results: list[TrialResult],
        unfiltered: np.ndarray,
        body: RigidBody,
        settings: TrialSettings,
    ) -> GraspSummary:
        held = np.array([result.outcome == "held" for result in results])
        verified = held & ~unfiltered
        failures = Counter(
            result.outcome
            for result, raw in zip(results, unfiltered, strict=True)
            if not raw and result.outcome != "held"
        )
        return GraspSummary(
            gripper=self.gripper.name,
            gripper_sha256=self.gripper.sha256,
            proposed=proposed["proposed"],
            proposed_by_filter=proposed["proposed_by_filter"],
            simulated=int((~unfiltered).sum()),
            verified=int(verified.sum()),
            success_rate=float(held[~unfiltered].mean()),
            unfiltered_simulated=int(unfiltered.sum()),
            unfiltered_success_rate=float(held[unfiltered].mean()) if unfiltered.any() else None,
            failures=dict(sorted(failures.items())),
            approach_octants=len(np.unique(approach_octants(proposals["gripper_to_object"][verified]))),
            file=TABLE,
            association_radius_m=proposed["association_radius_m"],
            association_radius_widened=proposed["association_radius_widened"],
            share_beyond_3cm=proposed["share_beyond_3cm"],
            trial=Trial(
                engine=self.trial.name,
                finger_friction=settings.finger_friction,
                object_friction=body.friction_static,
                combine="average",
                force_n=settings.force_n,
                timestep_s=settings.timestep_s,
                solver_iterations=settings.solver_iterations,
                max_steps=settings.max_steps,
                stable_frames=settings.stable_frames,
                max_displacement_m=settings.max_displacement_m,
                slide_distance_m=settings.slide_m,
            ),
        )
