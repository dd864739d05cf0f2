"""Proposals in rounds: ask, filter, and ask again until enough are near the selected points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from manitwin.config import GraspConfig
from manitwin.geometry.grasp_diversity import fingertips
from manitwin.models.graspers.protocol import Grasper, GraspProposals, GraspRequest, Screen
from manitwin.physics.grasp_selection import Merits
from manitwin.pipeline.association import distances_to_grasps


@dataclass(frozen=True)
class Kept:
    """Grasps that passed the filters: what speaks for them, and how far each is from each point ``(N, P)`` m.

    ``raw`` are the first round's proposals before any filter; ``counts`` says how many were left after each filter.
    """

    proposals: GraspProposals
    merits: Merits
    distance_m: np.ndarray
    raw: GraspProposals
    counts: dict[str, int]


def propose_in_rounds(request: GraspRequest, grasper: Grasper, screen: Screen, settings: GraspConfig) -> Kept:
    """Propose and filter until ``near_enough`` are within the radius of a point, or the rounds are used up.

    There are more rounds while fewer than are to be simulated are likely to hold; while fewer have passed at all, the
    next round looks around those that did.
    """
    points = request.focus_points_m
    rounds: list[Kept] = []
    total = near = likely = 0
    while len(rounds) < _most(grasper, settings, enough=likely >= settings.simulated):
        seed = int(np.random.SeedSequence([request.seed, len(rounds)]).generate_state(1)[0])
        focus = points if not rounds or total >= settings.simulated else _around(points, rounds)
        rounds.append(_one_round(replace(request, focus_points_m=focus, seed=seed), grasper, screen, points))
        total += len(rounds[-1].proposals)
        likely += int(rounds[-1].merits.likely().sum())
        near += int((rounds[-1].distance_m.min(1) <= settings.association_radius_m).sum())
        if near >= settings.near_enough or total >= settings.max_proposals:
            break
    first = np.arange(min(total, settings.max_proposals))
    return Kept(
        GraspProposals.joined([some.proposals for some in rounds]).take(first),
        Merits.joined([some.merits for some in rounds]).take(first),
        np.concatenate([some.distance_m for some in rounds])[first],
        rounds[0].raw,
        {name: sum(some.counts[name] for some in rounds) for name in rounds[0].counts},
    )


def _most(grasper: Grasper, settings: GraspConfig, *, enough: bool) -> int:
    most = settings.rounds if enough else settings.scarce_rounds
    return most if grasper.rounds is None else min(most, grasper.rounds)


def _around(points: np.ndarray, rounds: list[Kept]) -> np.ndarray:
    tips = [fingertips(some.proposals.gripper_to_object, some.proposals.depth_m) for some in rounds]
    return np.concatenate([points, *tips])


def _one_round(request: GraspRequest, grasper: Grasper, screen: Screen, points: np.ndarray) -> Kept:
    raw = grasper.propose(request)
    left = screen(raw)
    some = left.proposals
    distance_m = distances_to_grasps(points, some.gripper_to_object, some.depth_m, some.width_m)
    return Kept(some, left.merits, distance_m, raw, left.counts)
