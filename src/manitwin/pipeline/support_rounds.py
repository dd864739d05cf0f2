"""More proposals for objects that are hard to take from a table: from above, with the hand clear of what they stand on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manitwin.config import GraspConfig
from manitwin.models.graspers.protocol import Grasper, GraspProposals, GraspRequest, Screen
from manitwin.physics.grasp_filters import lowest_points_m, raised
from manitwin.physics.grasp_selection import Merits
from manitwin.pipeline.association import distances_to_grasps
from manitwin.pipeline.proposal_rounds import Kept
from manitwin.robots.grippers.parallel import ParallelGripper

FIRST_SEED = 1000
"""Seeds of these rounds begin here, those of the others at 0."""
HOPELESS_ROUNDS = 4
"""After so many rounds without a single one there are no more: a plate's rim is too low for the hand."""


def with_support_rounds(
    kept: Kept, request: GraspRequest, grasper: Grasper, screen: Screen, settings: GraspConfig
) -> Kept:
    """Propose until enough grasps near the points leave room for each of ``request.supports``, or the rounds are used up.

    Proposals that would reach through a support are drawn back along their approach until they do not. What has enough
    already, has none at all, or is not for a parallel gripper, stays as it is. A grasper that bounds its rounds is asked
    once more at most.
    """
    gripper = request.gripper
    if not isinstance(gripper, ParallelGripper) or not len(kept.proposals):
        return kept
    wanted = round(settings.on_support_share * settings.simulated)
    most = settings.scarce_rounds if grasper.rounds is None else 1
    for place, support in enumerate(request.supports):
        for number in range(most):
            found = on_support(kept, gripper, support, settings.association_radius_m).sum()
            if found >= wanted or (number >= HOPELESS_ROUNDS and not found):
                break
            words = [request.seed, FIRST_SEED * (place + 1) + number]
            seed = int(np.random.SeedSequence(words).generate_state(1)[0])
            raw = _clear_of(support, gripper, grasper.propose(replace(request, seed=seed)))
            if len(raw):
                kept = _joined(kept, raw, screen, request.focus_points_m)
    return kept


def on_support(kept: Kept, gripper: ParallelGripper, support: np.ndarray, radius_m: float) -> np.ndarray:
    """Tell which grasps ``(N,)`` are near a point and leave room for a support."""
    near = kept.distance_m.min(1) <= radius_m if len(kept.proposals) else np.zeros(0, bool)
    return near & (lowest_points_m(gripper, kept.proposals.gripper_to_object, support) > 0)


def _clear_of(support: np.ndarray, gripper: ParallelGripper, raw: GraspProposals) -> GraspProposals:
    """Return the proposals whose hand is clear of a support, and others drawn back until it is."""
    clear = np.flatnonzero(lowest_points_m(gripper, raw.gripper_to_object, support) > 0)
    poses, index = raised(gripper, raw.gripper_to_object, support)
    return GraspProposals.joined([raw.take(clear), replace(raw.take(index), gripper_to_object=poses)])


def _joined(kept: Kept, raw: GraspProposals, screen: Screen, points_m: np.ndarray) -> Kept:
    left = screen(raw)
    some = left.proposals
    distance_m = distances_to_grasps(points_m, some.gripper_to_object, some.depth_m, some.width_m)
    return Kept(
        GraspProposals.joined([kept.proposals, some]),
        Merits.joined([kept.merits, left.merits]),
        np.concatenate([kept.distance_m, distance_m]),
        kept.raw,
        {name: kept.counts[name] + left.counts[name] for name in kept.counts},
    )
