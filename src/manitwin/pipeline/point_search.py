"""Search for further grasps at points with too few successes: denser proposals, tried best first until enough hold or none
will.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from manitwin.config import GraspConfig
from manitwin.models.graspers.protocol import Grasper, GraspProposals, GraspRequest, Screen
from manitwin.physics.grasp_selection import select_likely
from manitwin.physics.trial import TrialResult
from manitwin.pipeline.grasp_regions import Contacts, PartedSolid
from manitwin.pipeline.proposals import ScreenedProposals
from manitwin.twin.point_records import GraspPoint

FIRST_POINT_SEED = 100_000
"""The first seed of rounds at points, apart from those of the rounds for the whole object and for supports."""
POINT_ROUNDS = 3
RAW_SHARE = 0.5
"""Fraction of a round's proposals for the whole object, as a round at a point covers a small part of it."""
HOPELESS_TRIES, HOPELESS_SHARE = 8, 0.5
"""The search at a point ends after this many tries if a smaller share than this has succeeded."""

Try = Callable[[GraspProposals], list[TrialResult]]


@dataclass
class TriedGrasps:
    """Grasps and their outcomes, row by row."""

    grasps: GraspProposals
    outcome: list[str]

    def add(self, grasps: GraspProposals, outcome: list[str]) -> None:
        """Append grasps with their outcomes."""
        self.grasps, self.outcome = GraspProposals.joined([self.grasps, grasps]), self.outcome + outcome


class PointSearch:
    """The search on one object: its grasp points, and all grasps tried at them so far."""

    def __init__(
        self,
        request: GraspRequest,
        grasper: Grasper,
        screen: Screen,
        settings: GraspConfig,
        held: PartedSolid,
        tried: TriedGrasps,
        attempt: Try,
    ):
        """Take the grasper's request, the screen, the settings, the parts, the grasps tried first, and the trial function."""
        self.held = held
        self.request, self.grasper, self.screen, self.settings = request, grasper, screen, settings
        self.tried, self.attempt = tried, attempt
        self.results: list[TrialResult] = []
        self._touched = self._contacts(tried.grasps)  # of all tried grasps, row by row
        self.passed: dict[int, Counter[str]] = {}
        """The number of proposals that passed each filter, by candidate."""

    def outcomes_at(self, point: GraspPoint, others: list[GraspPoint]) -> Counter[str]:
        """Count the outcomes of grasps tried at a point: their fingertips touch its part there, and no other point is nearer."""
        mine = self._serves(self._touched, point, others)
        return Counter(outcome for outcome, is_mine in zip(self.tried.outcome, mine, strict=True) if is_mine)

    def has_shortfall(self, point: GraspPoint, others: list[GraspPoint]) -> bool:
        """Return whether fewer grasps hold at a point than requested."""
        return self.outcomes_at(point, others)["held"] < self.settings.least_per_point

    def search(self, point: GraspPoint, others: list[GraspPoint]) -> None:
        """Propose and try grasps at a point until enough hold, the tries are used up, or too few of many have held."""
        left = self._proposed_at(point, others)
        free = self._belongs(left.proposals, point, others)  # the screen has set their widths to those at the pads
        budget = self.settings.tries_per_point
        while budget > 0 and free.any() and self.has_shortfall(point, others):
            so_far = self.outcomes_at(point, others)
            if so_far.total() >= HOPELESS_TRIES and so_far["held"] < HOPELESS_SHARE * so_far.total():
                return
            among = np.flatnonzero(free)
            some = left.proposals.take(among)
            missing = self.settings.least_per_point - so_far["held"]
            count = min(budget, max(missing, HOPELESS_TRIES - so_far.total()) if so_far["held"] else HOPELESS_TRIES)
            chosen = among[select_likely(some.gripper_to_object, some.depth_m, left.merits.take(among), count)]
            more = left.proposals.take(chosen)
            results = self.attempt(more)
            self.tried.add(more, [result.outcome for result in results])
            self._touched = Contacts.joined([self._touched, self._contacts(more)])
            self.results += results
            free[chosen] = False
            budget -= len(chosen)

    def shortfall(self, point: GraspPoint, others: list[GraspPoint]) -> str:
        """Say why fewer grasps hold at a point than requested; empty if enough hold."""
        outcomes = self.outcomes_at(point, others)
        if outcomes["held"] >= self.settings.least_per_point:
            return ""
        reach = f"within {1000 * self.settings.association_radius_m:.0f} mm"
        counted = ", ".join(f"{count} {outcome}" for outcome, count in sorted(outcomes.items()) if outcome != "held")
        said = f"{outcomes['held']} of {outcomes.total()} grasps tried {reach} held"
        filters = ", ".join(f"{name} {count}" for name, count in self.passed[point.candidate].items())
        return f"{said}{f' ({counted})' if counted else ''}; proposals there: {filters}"

    def _proposed_at(self, point: GraspPoint, others: list[GraspPoint]) -> ScreenedProposals:
        """Return the proposals at a point that pass the screen, with further rounds if they are few."""
        settings, passed, parts = self.settings, Counter[str](), list[ScreenedProposals]()
        rounds = POINT_ROUNDS if self.grasper.rounds is None else min(1, self.grasper.rounds)
        enough = 2 * settings.tries_per_point
        for number in range(rounds):
            words = [self.request.seed, FIRST_POINT_SEED + POINT_ROUNDS * point.candidate + number]
            request = replace(
                self.request,
                focus_points_m=np.array([point.position_m]),
                within_m=settings.association_radius_m,
                max_proposals=max(1, round(RAW_SHARE * settings.raw_per_round)),
                seed=int(np.random.SeedSequence(words).generate_state(1)[0]),
            )
            raw = self.grasper.propose(request)
            raw = raw.take(np.flatnonzero(self._belongs(raw, point, others)))
            parts.append(ScreenedProposals.screened(raw, self.screen, request.focus_points_m))
            passed.update(parts[-1].counts)
            if sum(len(part.proposals) for part in parts) >= enough:
                break
        self.passed[point.candidate] = passed
        return ScreenedProposals.joined(parts, parts[0].raw)

    def _belongs(self, grasps: GraspProposals, point: GraspPoint, others: list[GraspPoint]) -> np.ndarray:
        """Return which grasps ``(N,)`` serve a point, by fingertip contact, with no other point nearer."""
        return self._serves(self._contacts(grasps), point, others)

    def _serves(self, contacts: Contacts, point: GraspPoint, others: list[GraspPoint]) -> np.ndarray:
        places = np.array([p.position_m for p in (point, *(p for p in others if p.id != point.id))])
        return self.held.assign_places(contacts, places) == 0

    def _contacts(self, grasps: GraspProposals) -> Contacts:
        return self.held.contacts(grasps.gripper_to_object, grasps.depth_m, grasps.width_m)
