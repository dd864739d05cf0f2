"""Grasps sampled anywhere on a twin and tried in its own trial, none chosen among them: what its surface affords."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import trimesh

from manitwin.errors import UsageError
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest
from manitwin.models.graspers.screens import PadScreen
from manitwin.models.graspers.surface_sampling import AntipodalGrasper
from manitwin.physics.confirmed_trial import ConfirmedTrial
from manitwin.physics.mujoco.trial import MujocoTrial
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.pipeline.trial_replay import settings_of_trial
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.of_twins import gripper_of
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.twin.grasp_summary import GraspSummary
from manitwin.twin.loaded_twin import Twin

PROPOSALS_A_ROUND, ROUNDS = 6000, 6


@dataclass(frozen=True)
class SampledGrasps:
    """Grasps of a ``gripper`` that were tried, of which ``held (N,) bool`` did."""

    gripper: str
    grasps: GraspProposals
    held: np.ndarray


def sample_grasps(
    twin: Twin, solid: trimesh.Trimesh, trials: int, rng: np.random.Generator, grippers: Sequence[Gripper] = ()
) -> SampledGrasps:
    """Sample antipodal grasps all over a twin's surface and try ``trials`` of them as its own grasps were tried.

    They lie no denser at its grasp points, and nothing chooses among them; what a trial could only fail, as the open fingers
    overlap the object, is left out before. Raises UsageError for a twin none of whose grippers has parallel jaws, whose
    gripper is neither shipped nor among ``grippers``, or whose record tells no trial that can be run.
    """
    summary, gripper = _parallel(twin, grippers)
    body = twin.rigid_body()
    request = GraspRequest(
        solid=solid,
        hulls=body.hulls,
        mass_kg=body.mass_kg,
        center_of_mass_m=body.center_of_mass_m,
        object_friction=body.friction_static,
        gripper=gripper,
        focus_points_m=np.empty((0, 3)),
        max_proposals=PROPOSALS_A_ROUND,
        seed=0,
    )
    screen, grasper, found = PadScreen(request), AntipodalGrasper(), list[GraspProposals]()
    while sum(map(len, found)) < trials and len(found) < ROUNDS:
        raw = grasper.propose(replace(request, seed=int(rng.integers(1 << 31))))
        found.append(screen(raw).proposals)
    proposed = GraspProposals.joined(found)
    chosen = proposed.take(np.sort(rng.permutation(len(proposed))[:trials]))
    settings = settings_of_trial(twin, summary.trial, gripper)
    trial = ConfirmedTrial(SapienTrial(), MujocoTrial())  # held is what it is in a build
    results = trial.run(body, gripper, chosen.gripper_to_object, settings)
    return SampledGrasps(summary.gripper, chosen, np.array([result.outcome == "held" for result in results], bool))


def _parallel(twin: Twin, grippers: Sequence[Gripper]) -> tuple[GraspSummary, ParallelGripper]:
    """Return the first of a twin's grippers that has parallel jaws, of which alone contacts are known, and what it did."""
    first = twin.record.grasps
    assert first is not None
    others = [other.summary for other in first.other_grippers.values() if other.summary is not None]
    for summary in (first, *others):
        gripper = gripper_of(summary.gripper, summary.gripper_sha256, grippers)
        if isinstance(gripper, ParallelGripper):
            return summary, gripper
    names = ", ".join(summary.gripper for summary in (first, *others))
    raise UsageError(
        f"{twin.folder}: {names} {'have' if others else 'has'} no parallel jaws, of which alone contacts are known;"
        " build the twin with such a gripper too"
    )
