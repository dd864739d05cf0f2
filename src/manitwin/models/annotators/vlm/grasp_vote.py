"""Vote over several grasp queries: elects the places that many queries chose, independent of their numbering."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.models.annotators.vlm.place_checks import PlaceChecks
from manitwin.models.annotators.vlm.points import (
    CONTRADICTED,
    GRASP,
    GraspChoice,
    Numbering,
    PointsAnswer,
    contradiction,
)
from manitwin.twin.point_records import GraspPoint


@dataclass(frozen=True)
class Ballot:
    """One point of one query: its candidate, and how geometry contradicts it, if so."""

    vote: int
    candidate: int
    choice: GraspChoice
    rationale: str
    contradiction: str | None

    @property
    def confidence(self) -> float:
        """Confidence given by the query, reduced if geometry contradicts it."""
        return self.choice.confidence * (1.0 if self.contradiction is None else CONTRADICTED)


@dataclass(frozen=True)
class ElectedPlace:
    """A candidate with the supporting ballots: of each query the nearest one."""

    candidate: int
    ballots: tuple[Ballot, ...]
    votes: int

    @property
    def support(self) -> int:
        """Number of queries that chose this place."""
        return len(self.ballots)

    @property
    def confidence(self) -> float:
        """Mean confidence of the supporters, times their share of all queries."""
        return float(np.mean([ballot.confidence for ballot in self.ballots])) * self.support / self.votes

    @property
    def exact(self) -> int:
        """Number of queries that chose exactly this candidate."""
        return sum(ballot.candidate == self.candidate for ballot in self.ballots)

    @property
    def rank(self) -> tuple[float, ...]:
        """Sort key: support, then confidence."""
        return -self.support, -round(self.confidence, 6)


def ballots(answer: PointsAnswer, numbering: Numbering, checks: PlaceChecks, vote: int) -> list[Ballot]:
    """Return the points of one query by candidate."""
    found = []
    for choice in answer.points:
        candidate = numbering.candidates[choice.id]
        wrong = contradiction(choice, candidate, checks)
        found.append(Ballot(vote, candidate, choice, numbering.translate_numbers(choice.rationale), wrong))
    return found


def elect_grasps(cast: list[Ballot], votes: int, checks: PlaceChecks) -> tuple[tuple[GraspPoint, ...], tuple[str, ...]]:
    """Return 2 to 3 grasp points by support, then confidence, with the findings about them.

    A query supports a place if it chose its candidate or one within 2 cm; places that a symmetry of the solid maps onto each
    other are the same place. This is self-consistency (Wang et al. 2022, arXiv 2203.11171) with places as answers. Points
    without a majority are taken only if there would be fewer than two otherwise. Findings: no majority, a tie for the last
    place, a contradiction with geometry.
    """
    elected = _elected(cast, votes, checks)
    majority = [place for place in elected if 2 * place.support > votes]
    chosen = majority[: GRASP[1]] if len(majority) >= GRASP[0] else elected[: GRASP[0]]
    findings = [
        f"grasp point g{number} at candidate {place.candidate}: chosen by {place.support} of {votes} queries, no majority"
        for number, place in enumerate(chosen)
        if 2 * place.support <= votes
    ]
    if len(elected) > len(chosen) and elected[len(chosen)].rank == chosen[-1].rank:
        findings.append(
            f"grasp points: candidates {chosen[-1].candidate} and {elected[len(chosen)].candidate} are tied for the last place"
        )
    for number, place in enumerate(chosen):
        wrong = _leading_ballot(place).contradiction
        if wrong is not None:
            what = f"grasp point g{number}, {_leading_ballot(place).choice.label!r} at candidate {place.candidate}"
            findings.append(f"{what}: {wrong}")
    return tuple(_grasp_point(number, place, checks) for number, place in enumerate(chosen)), tuple(findings)


def spare_grasps(cast: list[Ballot], votes: int, checks: PlaceChecks, taken: list[int]) -> tuple[GraspPoint, ...]:
    """Return the other places in the order of the vote, except at the candidates ``taken``."""
    others = [place for place in _elected(cast, votes, checks) if place.candidate not in taken]
    return tuple(_grasp_point(len(taken) + number, place, checks) for number, place in enumerate(others))


def _elected(cast: list[Ballot], votes: int, checks: PlaceChecks) -> list[ElectedPlace]:
    """Return places in order; each ballot supports only one of them."""
    left, found = list(cast), list[ElectedPlace]()
    while left:
        places = [_supporters(candidate, left, votes, checks) for candidate in {b.candidate for b in left}]
        best = min(places, key=lambda place: (*place.rank, -place.exact, place.candidate))
        found.append(best)
        left = [b for b in left if b not in best.ballots and b.candidate != best.candidate]
    return sorted(found, key=lambda place: place.rank)


def _supporters(candidate: int, cast: list[Ballot], votes: int, checks: PlaceChecks) -> ElectedPlace:
    nearest: dict[int, Ballot] = {}
    # the candidate itself precedes its mirror images, which also have distance 0
    nearest_first = sorted(
        cast, key=lambda b: (_distance_m(b.candidate, candidate, checks), b.candidate != candidate, b.candidate)
    )
    for ballot in nearest_first:
        if _distance_m(ballot.candidate, candidate, checks) <= checks.same_place_m:
            nearest.setdefault(ballot.vote, ballot)
    return ElectedPlace(candidate, tuple(nearest[vote] for vote in sorted(nearest)), votes)


def _distance_m(first: int, second: int, checks: PlaceChecks) -> float:
    positions = checks.request.positions_m
    return 0.0 if first == second else checks.symmetries.apart_m(positions[first], positions[second])


def _leading_ballot(place: ElectedPlace) -> Ballot:
    """Return the ballot whose texts are used: of the most frequent type, then at this candidate, then most confident."""
    types = [ballot.choice.type for ballot in place.ballots]
    return max(
        place.ballots,
        key=lambda b: (types.count(b.choice.type), b.candidate == place.candidate, b.confidence, -b.vote),
    )


def _grasp_point(number: int, place: ElectedPlace, checks: PlaceChecks) -> GraspPoint:
    leading, request = _leading_ballot(place), checks.request
    return GraspPoint(
        id=f"g{number}",
        **request.place(place.candidate),
        type=leading.choice.type,
        scenario=leading.choice.scenario,
        confidence=round(place.confidence, 3),
        rationale=f"{leading.rationale} (chosen by {place.support} of {place.votes} queries)",
        label=leading.choice.label,
    )
