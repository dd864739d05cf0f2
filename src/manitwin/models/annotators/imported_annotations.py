"""Annotator that keeps the annotations of an imported asset, and asks another annotator for the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar, get_args

import numpy as np

from manitwin.config import Resource
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.protocol import (
    Annotator,
    AnnotatorQuestion,
    CloserLook,
    LooksCloser,
    PhysicalEstimates,
    PointsRequest,
    QualityVerdict,
    SelectedPoints,
    Subject,
)
from manitwin.twin.import_record import GivenPoint, ImportRecord
from manitwin.twin.point_records import FunctionalFrame, FunctionalPoint, GraspPoint, GraspType
from manitwin.twin.record import Language
from manitwin.twin.record_values import Estimate

NEAR_M, NEAR_SHARE = 0.02, 0.1
"""Maximum distance of a candidate from a given point: 2 cm, or 10 % of the longest side, the usual spacing of 42 candidates."""

FACING_KINDS = ("face", "button", "surface")
"""Kinds of frames whose Z axis is the outward normal of the surface on which the point lies."""
OPPOSED = -0.1
"""Cosine between a candidate's normal and that direction; a candidate below it is on the other side of the wall."""

LEAST, MOST = {"functional": 2, "grasp": 2}, {"functional": 4, "grasp": 3}
"""Minimum and maximum number of points of an object (paper: 2-4 functional and 2-3 grasp points)."""

Point = TypeVar("Point", FunctionalPoint, GraspPoint)


class ImportedPoints:
    """Given points of one object, snapped to candidates; a point without a candidate nearby is a finding."""

    def __init__(self, given: ImportRecord, request: PointsRequest):
        self._given, self._request = given, request
        extents = np.ptp(request.subject.solid.vertices, axis=0)
        self._limit_m = max(NEAR_M, NEAR_SHARE * float(extents.max()))
        self.findings: list[str] = []
        self._functional = [
            self._functional_point(n, point, candidate, distance_m)
            for n, (point, candidate, distance_m) in enumerate(
                self._snap_to_candidates("functional", given.functional_points)
            )
        ]
        self._grasp = [
            self._grasp_point(n, point, candidate, distance_m)
            for n, (point, candidate, distance_m) in enumerate(self._snap_to_candidates("grasp", given.grasp_points))
        ]

    def is_sufficient(self) -> bool:
        """Tell whether there are enough given points, so that no other annotator has to be asked."""
        return len(self._functional) >= LEAST["functional"] and len(self._grasp) >= LEAST["grasp"]

    def selection(self, others: SelectedPoints | None) -> SelectedPoints:
        """Return the given points, filled up with others to the minimum number."""
        functional, grasp, findings = self._functional, self._grasp, self.findings
        spare = () if others is None else others.spare
        if others is not None:
            functional = _fill_points(functional, others.functional, LEAST["functional"], "f")
            grasp = _fill_points(grasp, others.grasp, LEAST["grasp"], "g")
            findings = findings + list(others.findings or ())
        return SelectedPoints(tuple(functional), tuple(grasp), tuple(findings), spare)

    def _snap_to_candidates(self, kind: str, points: list[GivenPoint]) -> list[tuple[GivenPoint, int, float]]:
        """Return each point with its candidate and the distance (m); no candidate is used twice."""
        snapped: list[tuple[GivenPoint, int, float]] = []
        taken: set[int] = set()
        for number, point in enumerate(points):
            distances_m = self._distances(point)
            distances_m[list(taken)] = np.inf
            limit_m = self._limit_m
            if point.frame is not None and point.frame.kind in FACING_KINDS:
                distances_m[self._request.normals @ _approach_axis(point.frame) < OPPOSED] = np.inf
                limit_m = max(limit_m, point.frame.size_m)  # any place on the face is valid
            candidate = int(distances_m.argmin())
            if distances_m[candidate] > limit_m:
                nearest = f"{distances_m[candidate] * 1000:.0f} mm" if np.isfinite(distances_m[candidate]) else "none"
                self.findings.append(
                    f"{kind} point {number} ({self._given.source}) has no candidate within {limit_m * 1000:.0f} mm"
                    f" (the nearest free one: {nearest})"
                )
            elif len(snapped) == MOST[kind]:
                self.findings.append(
                    f"{kind} points beyond the first {MOST[kind]} of {len(points)} ({self._given.source}) were left out"
                )
                break
            else:
                taken.add(candidate)
                snapped.append((point, candidate, float(distances_m[candidate])))
        return snapped

    def _distances(self, point: GivenPoint) -> np.ndarray:
        """Return the distances of the candidates (N,) in m.

        For a point with a closing direction, the distance is that from the segment between the fingers, which ends on the
        surface.
        """
        offset = self._request.positions_m - np.array(point.position_m)
        if point.closing is not None:
            closing, half = np.array(point.closing), self._request.max_opening_m / 2
            offset = offset - np.clip(offset @ closing, -half, half)[:, None] * closing
        return np.asarray(np.linalg.norm(offset, axis=1))

    def _functional_point(self, number: int, point: GivenPoint, candidate: int, distance_m: float) -> FunctionalPoint:
        label = point.label or "functional point"
        return FunctionalPoint(
            id=f"f{number}",
            **self._request.place(candidate),
            label=label,
            description=label,
            confidence=1.0,
            rationale=self._rationale(distance_m),
            frame=None if point.frame is None else point.frame.model_copy(update={"source": self._given.source}),
        )

    def _grasp_point(self, number: int, point: GivenPoint, candidate: int, distance_m: float) -> GraspPoint:
        said = point.label.lower().replace(" ", "_")
        kind: GraspType = next((name for name in get_args(GraspType) if name == said), "parallel_jaw")
        return GraspPoint(
            id=f"g{number}",
            **self._request.place(candidate),
            type=kind,
            scenario=point.label or "hold it here",
            confidence=1.0,
            rationale=self._rationale(distance_m),
        )

    def _rationale(self, distance_m: float) -> str:
        return f"{self._given.source}: annotated {distance_m * 1000:.0f} mm from this candidate"


def _approach_axis(frame: FunctionalFrame) -> np.ndarray:
    """Return a frame's Z axis ``(3,)``."""
    return np.asarray(rotation_from_quaternion_wxyz(np.array(frame.quaternion_wxyz))[:, 2])


def _fill_points(given: list[Point], others: tuple[Point, ...], least: int, letter: str) -> list[Point]:
    """Fill given points up to ``least`` with others, preferring labels that are not among the given ones."""
    filled, said = list(given), {point.label for point in given}
    for point in sorted(others, key=lambda point: point.label is not None and point.label in said):
        if len(filled) < least and point.candidate not in {kept.candidate for kept in given}:
            filled.append(point)
    return [point.model_copy(update={"id": f"{letter}{number}"}) for number, point in enumerate(filled)]


class ImportedAnnotator:
    """Annotator that keeps the given properties of a subject (source ``imported:FORMAT``) and asks an inner one for the rest.

    A given number has no interval: low and high equal the value, except for a friction that varies over surfaces. It is
    compared with the inner annotator's estimate, and a contradiction is a finding; the plausibility checks of the physical
    stage apply as for an estimate. For a subject without given properties, all answers are the inner annotator's.
    """

    def __init__(self, inner: Annotator):
        self._inner = inner
        self.name = inner.name
        self.needs: Resource = inner.needs
        self.picture_px = inner.picture_px

    def model_for(self, question: AnnotatorQuestion) -> str | None:
        """Return the inner annotator's model; the given properties are part of the twin's id."""
        return self._inner.model_for(question)

    def expected_usd(self, question: AnnotatorQuestion) -> float:
        """Return the approximate cost of the inner annotator's answer."""
        return self._inner.expected_usd(question)

    def judge_quality(self, subject: Subject) -> QualityVerdict:
        """Ask the inner annotator, because no asset states its own quality."""
        return self._inner.judge_quality(subject)

    def estimate_physical(self, subject: Subject) -> PhysicalEstimates:
        """Keep the given mass, friction, restitution and material."""
        answer, given = self._inner.estimate_physical(subject), subject.given
        return answer if given is None else _override_estimates(answer, given)

    def describe(self, subject: Subject, material: str, extents_m: np.ndarray) -> Language:
        """Keep the given category and captions; the inner annotator, which is told that category, supplies the other texts."""
        given = subject.given
        if given is None:
            return self._inner.describe(subject, material, extents_m)
        if given.category and find_prior(given.category) is not None:
            subject = replace(subject, name=given.category)
        language = self._inner.describe(subject, material, extents_m)
        captions = list(dict.fromkeys([*given.captions, language.caption, *language.captions]))
        return language.model_copy(
            update={
                "category": given.category or language.category,
                "caption": captions[0],
                "captions": captions[1:] if given.captions else language.captions,
            }
        )

    def select_points(self, request: PointsRequest) -> SelectedPoints:
        """Keep the given points at their nearest candidates; fill up with the inner annotator's points."""
        given = request.subject.given
        if given is None or not (given.functional_points or given.grasp_points):
            return self._inner.select_points(request)
        points = ImportedPoints(given, request)
        if points.is_sufficient():
            return points.selection(None)
        return points.selection(self._inner.select_points(request))

    def look_closer(self, request: PointsRequest, points: Sequence[FunctionalPoint]) -> CloserLook:
        """Let the inner annotator refine the points if it can; given points stay at their candidates."""
        given = request.subject.given
        if not isinstance(self._inner, LooksCloser) or (given is not None and given.functional_points):
            return CloserLook()
        return self._inner.look_closer(request, points)


def _override_estimates(answer: PhysicalEstimates, given: ImportRecord) -> PhysicalEstimates:
    """Replace estimates by given values, and add a finding for each given value outside the estimate's interval.

    Dynamic friction is kept at or below static friction.
    """
    source, findings = given.source, []
    static, dynamic = answer.friction_static, answer.friction_dynamic
    if given.mass_kg is not None and answer.mass_kg is not None:
        findings += _interval_findings("mass", given.mass_kg, answer.mass_kg, "kg", source)
    if given.friction_static is not None:
        findings += _interval_findings("static friction", given.friction_static, static, "", source)
        static = _interval_estimate(given.friction_static, given.friction_range, source)
    if given.friction_dynamic is not None:
        same = given.friction_dynamic == given.friction_static
        dynamic = _interval_estimate(given.friction_dynamic, given.friction_range if same else None, source)
    elif given.friction_static is not None and dynamic.value > static.value:
        dynamic = exact_estimate(static.value, source)  # dynamic friction does not exceed static friction
    if given.friction_static is None and static.value < dynamic.value:
        static = exact_estimate(dynamic.value, source)
    mass_kg = answer.mass_kg if given.mass_kg is None else exact_estimate(given.mass_kg, source)
    restitution = answer.restitution if given.restitution is None else exact_estimate(given.restitution, source)
    return replace(
        answer,
        mass_kg=mass_kg,
        friction_static=static,
        friction_dynamic=dynamic,
        restitution=restitution,
        material=given.material or answer.material,
        findings=(*(answer.findings or ()), *findings),
    )


def exact_estimate(value: float, source: str) -> Estimate:
    """Return an estimate with a zero-width interval."""
    return Estimate(value=value, low=value, high=value, source=source)


def _interval_estimate(value: float, between: tuple[float, float] | None, source: str) -> Estimate:
    low, high = between or (value, value)
    return Estimate(value=value, low=min(low, value), high=max(high, value), source=source)


def _interval_findings(what: str, value: float, other: Estimate, unit: str, source: str) -> list[str]:
    if other.low <= value <= other.high:
        return []
    return [
        f"{what} {value:.4g} {unit} ({source}) is outside of {other.low:.3g} to {other.high:.3g} {unit} ({other.source})"
    ]
