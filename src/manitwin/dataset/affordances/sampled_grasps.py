"""Unselected grasps, sampled over a twin's whole surface and simulated in its own trial: the basis of its grasp map."""

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
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.grippers.twin_grippers import find_gripper
from manitwin.twin.grasp_summary import GraspSummary
from manitwin.twin.loaded_twin import Twin

PROPOSALS_A_ROUND, ROUNDS = 6000, 6


@dataclass(frozen=True)
class SampledGrasps:
    """Simulated grasps of a ``gripper``; ``held (N,) bool`` says which held."""

    gripper: str
    grasps: GraspProposals
    held: np.ndarray


def sample_grasps(
    twin: Twin, solid: trimesh.Trimesh, trials: int, rng: np.random.Generator, grippers: Sequence[Gripper] = ()
) -> SampledGrasps:
    """Sample antipodal grasps over a twin's surface and simulate ``trials`` of them in the trial of its own grasps.

    The grasps are not concentrated at grasp points and not ranked. Grasps that must fail because the open fingers overlap the
    object are discarded before. Raises UsageError for a twin without a parallel-jaw gripper, with a gripper that is neither
    shipped nor among ``grippers``, or without a reproducible trial in its record.
    """
    summary, gripper = _parallel_gripper(twin, grippers)
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
    trial = ConfirmedTrial(SapienTrial(), MujocoTrial())  # the same definition of held as in a build
    results = trial.run(body, gripper, chosen.gripper_to_object, settings)
    return SampledGrasps(summary.gripper, chosen, np.array([result.outcome == "held" for result in results], bool))


def _parallel_gripper(twin: Twin, grippers: Sequence[Gripper]) -> tuple[GraspSummary, ParallelGripper]:
    """Return the first parallel-jaw gripper of a twin and its summary; contacts are only defined for parallel jaws."""
    first = twin.record.grasps
    assert first is not None
    others = [other.summary for other in first.other_grippers.values() if other.summary is not None]
    for summary in (first, *others):
        gripper = find_gripper(summary.gripper, summary.gripper_sha256, grippers)
        if isinstance(gripper, ParallelGripper):
            return summary, gripper
    names = ", ".join(summary.gripper for summary in (first, *others))
    raise UsageError(
        f"{twin.folder}: {names} {'have' if others else 'has'} no parallel jaws, of which alone contacts are known;"
        " build the twin with such a gripper too"
    )
