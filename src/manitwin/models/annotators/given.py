"""An annotator that keeps what an imported asset gives, and asks another one for the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manitwin.config import Resource
from manitwin.models.annotators.given_points import GivenPoints
from manitwin.models.annotators.protocol import (
    Annotator,
    PhysicalEstimates,
    PointsRequest,
    QualityVerdict,
    Question,
    SelectedPoints,
    Subject,
)
from manitwin.twin.import_record import ImportRecord
from manitwin.twin.record import Estimate, Language


class KeepsGiven:
    """Answer with what is given of the subject (source ``imported:FORMAT``) and with the inner annotator's answers.

    A given number has no interval: its low and high are the value. It is held against what the inner annotator says, and
    what contradicts it is a finding; the plausibility checks of the physical stage hold for it as for an estimate. For a
    subject of which nothing is given, the answers are the inner annotator's own.
    """

    def __init__(self, inner: Annotator):
        self._inner = inner
        self.name = inner.name
        self.needs: Resource = inner.needs
        self.picture_px = inner.picture_px

    def model_for(self, question: Question) -> str | None:
        """Return what decides the inner annotator's answer; what is given is part of the twin's id."""
        return self._inner.model_for(question)

    def expected_usd(self, question: Question) -> float:
        """Return about what the inner annotator's answer costs."""
        return self._inner.expected_usd(question)

    def judge_quality(self, subject: Subject) -> QualityVerdict:
        """Ask the inner annotator: no asset can say this of itself."""
        return self._inner.judge_quality(subject)

    def estimate_physical(self, subject: Subject) -> PhysicalEstimates:
        """Keep the given mass, friction, restitution and material."""
        answer, given = self._inner.estimate_physical(subject), subject.given
        return answer if given is None else _with_given(answer, given)

    def describe(self, subject: Subject, material: str, extents_m: np.ndarray) -> Language:
        """Keep the given category and captions; the other words are the inner annotator's."""
        language, given = self._inner.describe(subject, material, extents_m), subject.given
        if given is None:
            return language
        captions = list(dict.fromkeys([*given.captions, language.caption, *language.captions]))
        return language.model_copy(
            update={
                "category": given.category or language.category,
                "caption": captions[0],
                "captions": captions[1:] if given.captions else language.captions,
            }
        )

    def select_points(self, request: PointsRequest) -> SelectedPoints:
        """Keep the given points at their nearest candidates; fill up with the inner annotator's."""
        given = request.subject.given
        if given is None or not (given.functional_points or given.grasp_points):
            return self._inner.select_points(request)
        points = GivenPoints(given, request)
        if points.enough():
            return points.selection(None)
        return points.selection(self._inner.select_points(request))


def _with_given(answer: PhysicalEstimates, given: ImportRecord) -> PhysicalEstimates:
    source, findings = given.source, []
    static, dynamic = answer.friction_static, answer.friction_dynamic
    if given.mass_kg is not None and answer.mass_kg is not None:
        findings += _contradiction("mass", given.mass_kg, answer.mass_kg, "kg", source)
    if given.friction_static is not None:
        findings += _contradiction("static friction", given.friction_static, static, "", source)
        static = exactly(given.friction_static, source)
    if given.friction_dynamic is not None:
        dynamic = exactly(given.friction_dynamic, source)
    elif given.friction_static is not None and dynamic.value > static.value:
        dynamic = exactly(static.value, source)  # nothing slides harder than it sticks
    if given.friction_static is None and static.value < dynamic.value:
        static = exactly(dynamic.value, source)
    mass_kg = answer.mass_kg if given.mass_kg is None else exactly(given.mass_kg, source)
    restitution = answer.restitution if given.restitution is None else exactly(given.restitution, source)
    return replace(
        answer,
        mass_kg=mass_kg,
        friction_static=static,
        friction_dynamic=dynamic,
        restitution=restitution,
        material=given.material or answer.material,
        findings=(*(answer.findings or ()), *findings),
    )


def exactly(value: float, source: str) -> Estimate:
    """Return a number that was given without an interval."""
    return Estimate(value=value, low=value, high=value, source=source)


def _contradiction(what: str, value: float, other: Estimate, unit: str, source: str) -> list[str]:
    if other.low <= value <= other.high:
        return []
    return [
        f"{what} {value:.4g} {unit} ({source}) is outside of {other.low:.3g} to {other.high:.3g} {unit} ({other.source})"
    ]
