"""Proposals in rounds: ask, filter, and ask again until enough are near the selected points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from manitwin.config import GraspConfig
from manitwin.geometry.grasp_diversity import fingertips
from manitwin.models.graspers.protocol import Grasper, GraspProposals, GraspRequest
from manitwin.simulate.grasp_filters import GraspFilter, likely_to_hold, torque_ratio
from manitwin.simulate.pad_contact import PadContacts
from manitwin.stages.association import distances_to_grasps


@dataclass(frozen=True)
class Kept:
    """Grasps that passed the filters: what their pads meet, and how far each is from each point ``(N, P)`` m.

    ``raw`` are the first round's proposals before any filter; ``counts`` says how many were left after each filter.
    """

    proposals: GraspProposals
    contacts: PadContacts
    distance_m: np.ndarray
    raw: GraspProposals
    counts: dict[str, int]


def contact_friction(request: GraspRequest) -> float:
    """Return the friction between finger and object: the mean, as PhysX combines materials."""
    return (request.gripper.finger_friction + request.object_friction) / 2


def torque_ratios(request: GraspRequest, contacts: PadContacts) -> np.ndarray:
    """Return the torque that each grasp needs over what its friction can hold."""
    return torque_ratio(
        contacts.lever_m,
        mass_kg=request.mass_kg,
        force_n=request.gripper.force_n,
        friction=contact_friction(request),
    )


def propose_in_rounds(request: GraspRequest, grasper: Grasper, settings: GraspConfig) -> Kept:
    """Propose and filter until ``near_enough`` are within the radius of a point, or the rounds are used up.

    There are more rounds while fewer than are to be simulated are likely to hold; while fewer have passed at all, the
    next round looks around those that did.
    """
    friction = contact_friction(request)
    passes = GraspFilter(request.gripper, request.hulls, request.center_of_mass_m, friction)
    points = request.focus_points_m
    rounds: list[Kept] = []
    total = near = likely = 0
    while len(rounds) < (settings.rounds if likely >= settings.simulated else settings.scarce_rounds):
        seed = int(np.random.SeedSequence([request.seed, len(rounds)]).generate_state(1)[0])
        focus = points if not rounds or total >= settings.simulated else _around(points, rounds)
        rounds.append(_one_round(replace(request, focus_points_m=focus, seed=seed), grasper, passes, points))
        total += len(rounds[-1].proposals)
        likely += int(likely_to_hold(rounds[-1].contacts, torque_ratios(request, rounds[-1].contacts)).sum())
        near += int((rounds[-1].distance_m.min(1) <= settings.association_radius_m).sum())
        if near >= settings.near_enough or total >= settings.max_proposals:
            break
    first = np.arange(min(total, settings.max_proposals))
    return Kept(
        _joined_proposals([some.proposals for some in rounds]).take(first),
        PadContacts.joined([some.contacts for some in rounds]).take(first),
        np.concatenate([some.distance_m for some in rounds])[first],
        rounds[0].raw,
        {name: sum(some.counts[name] for some in rounds) for name in rounds[0].counts},
    )


def _around(points: np.ndarray, rounds: list[Kept]) -> np.ndarray:
    tips = [fingertips(some.proposals.gripper_to_object, some.proposals.depth_m) for some in rounds]
    return np.concatenate([points, *tips])


def _one_round(request: GraspRequest, grasper: Grasper, passes: GraspFilter, points: np.ndarray) -> Kept:
    raw = grasper.propose(request)
    left = passes(raw.gripper_to_object)
    proposals = replace(raw.take(left.index), width_m=left.contacts.width_m)
    distance_m = distances_to_grasps(points, proposals.gripper_to_object, proposals.depth_m, proposals.width_m)
    counts = {"raw": len(raw), "after_pad": left.after_pad, "after_collision": len(proposals)}
    return Kept(proposals, left.contacts, distance_m, raw, counts)


def _joined_proposals(some: list[GraspProposals]) -> GraspProposals:
    return GraspProposals(
        np.concatenate([p.gripper_to_object for p in some]),
        np.concatenate([p.width_m for p in some]),
        np.concatenate([p.depth_m for p in some]),
        np.concatenate([p.score for p in some]),
    )
