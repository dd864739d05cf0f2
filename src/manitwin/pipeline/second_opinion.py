"""Trials in a second engine, and negative controls in both (paper, "Simulation Verification", extended beyond one solver)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from manitwin.config import Resource, SecondOpinionConfig, VerifyConfig
from manitwin.engine.stage import Draft
from manitwin.geometry.grasp_diversity import approach_octants
from manitwin.physics.robustness import jittered
from manitwin.physics.trial import GraspTrial, TrialResult
from manitwin.pipeline.grasps import UNFILTERED
from manitwin.pipeline.object_state import joints_of, load_body
from manitwin.pipeline.tried_grasps import read_tried, tried_names
from manitwin.pipeline.verify import trial_settings
from manitwin.robots.grippers.gripper import Gripper
from manitwin.twin.grasp_summary import SecondOpinion as SecondOpinionRecord

SECOND_OPINION = "second_opinion{}.npz"
AGREEMENT = "second_opinion{}"
NOT_TRIED, FAILS, HOLDS = -1, 0, 1
SAMPLE_STREAM = 8
JITTER_STREAM = 7  # separates these random draws from those of other stages with the same seed


class SecondOpinionStage:
    """Repeat in a second engine the held grasps or a sample of them, a share of the failed ones, and jittered ones.

    Writes ``holds (N,) int8`` and ``outcome (N,)`` of the second engine per proposal, and the jittered grasps with the verdicts
    of both engines.
    """

    version = "9"
    needs: Resource = "cpu"

    def __init__(
        self,
        settings: SecondOpinionConfig,
        verify: VerifyConfig,
        first: GraspTrial,
        second: GraspTrial,
        gripper: Gripper,
        suffix: str = "",
    ):
        """Take the settings of the second opinion and trials, both engines and the gripper."""
        self.settings, self.verify, self.first, self.second, self.gripper = settings, verify, first, second, gripper
        self.backend = second.name
        self.model: str | None = (
            f"beside {first.name}, {gripper.name} {gripper.sha256[:12]}, {verify.model_dump_json()}"
        )
        self.name = f"second_opinion{suffix}"
        self.suffix = suffix
        self.file, self.field = SECOND_OPINION.format(suffix), AGREEMENT.format(suffix)
        self.reads: tuple[str, ...] = (*tried_names(suffix), "solid.npz", "hulls.npz", "physical")
        self.writes: tuple[str, ...] = (self.file, self.field)

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Write the second engine's verdicts, and return the agreement of the two engines."""
        proposals, verdicts = read_tried(draft, self.suffix)
        poses, depth_m = proposals["gripper_to_object"], proposals["depth_m"]
        chosen = ~np.char.endswith(proposals["proposer"], UNFILTERED)
        held = verdicts["outcome"] == "held"
        joints = joints_of(proposals, np.arange(len(poses)))
        rng = np.random.default_rng([draft.seed, JITTER_STREAM])
        good, bad = np.flatnonzero(held & chosen), np.flatnonzero(~held & chosen)
        some_good = self._sample(good, poses, np.random.default_rng([draft.seed, SAMPLE_STREAM]))
        some_bad = np.sort(rng.permutation(bad)[: round(self.settings.share_of_failed * len(bad))])
        of = np.sort(rng.permutation(good)[: self.settings.jittered])
        moved = jittered(
            poses[of], depth_m[of], rng, sigma_deg=self.settings.jitter_deg, sigma_m=self.settings.jitter_m
        )
        body, settings = load_body(draft), trial_settings(self.verify, self.gripper)
        tried = np.concatenate([some_good, some_bad])
        outcome = np.full(len(poses), "", "U16")
        outcome[tried] = verdicts["second_outcome"][tried]  # those that the second engine has judged already
        asked = tried[outcome[tried] == ""]
        again = self.second.run(
            body,
            self.gripper,
            np.concatenate([poses[asked], moved]),
            settings,
            **{name: values[np.concatenate([asked, of])] for name, values in joints.items()},
        )
        first = self.first.run(
            body, self.gripper, moved, settings, **{name: values[of] for name, values in joints.items()}
        )
        outcome[asked] = [result.outcome for result in again[: len(asked)]]
        holds = np.full(len(poses), NOT_TRIED, np.int8)
        holds[tried] = outcome[tried] == "held"
        second = np.array([result.outcome == "held" for result in again[len(asked) :]], bool)
        np.savez(
            folder / self.file,
            holds=holds,
            outcome=outcome,
            jittered_of=of,
            jittered_gripper_to_object=moved,
            jittered_outcome=np.array([result.outcome for result in first], "U16"),
            jittered_displacement_m=np.array([result.displacement_m for result in first], float),
            jittered_rotation_rad=np.array([result.rotation_rad for result in first], float),
            jittered_holds=second.astype(np.int8),
        )
        record = _agreement(self.second.name, holds[some_good], holds[some_bad], first, second)
        return {self.field: record.model_dump(mode="json")}

    def _sample(self, held: np.ndarray, poses: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the held grasps to try: all, or a systematic sample in the order of their approach octants.

        Each octant gets its share of the sample (systematic sampling with a random start; Cochran 1977, 8.1 and 5.4).
        """
        count = self.settings.sample_of_held
        if count is None or len(held) <= count:
            return held
        shuffled = rng.permutation(held)
        ordered = shuffled[np.argsort(approach_octants(poses[shuffled]), kind="stable")]
        places = (np.arange(count) + rng.random()) * len(held) / count
        return np.sort(ordered[places.astype(int)])


def _agreement(
    engine: str, held: np.ndarray, failed: np.ndarray, first: list[TrialResult], second: np.ndarray
) -> SecondOpinionRecord:
    controls = np.array([result.outcome == "held" for result in first], bool)
    return SecondOpinionRecord(
        engine=engine,
        held_tried=len(held),
        holds_share=float((held == HOLDS).mean()) if len(held) else None,
        failed_tried=len(failed),
        failed_pass_share=float((failed == HOLDS).mean()) if len(failed) else None,
        jittered=len(controls),
        jittered_held=int(controls.sum()),
        jittered_hold_in_second_engine=int(second.sum()),
        jittered_agree=int((controls == second).sum()),
        kappa=cohens_kappa(controls, second),
    )


def cohens_kappa(first: np.ndarray, second: np.ndarray) -> float | None:
    """Return Cohen's kappa of two boolean verdicts ``(N,)``; None if undefined: no rows, or agreement by chance is certain.

    kappa = (p_o - p_e) / (1 - p_e) with p_e from the two marginals (Cohen 1960, "A coefficient of agreement for nominal
    scales").
    """
    if not len(first):
        return None
    p, q = float(np.mean(first)), float(np.mean(second))
    observed, by_chance = float(np.mean(first == second)), p * q + (1 - p) * (1 - q)
    return None if by_chance == 1 else (observed - by_chance) / (1 - by_chance)
