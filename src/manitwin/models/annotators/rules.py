"""The built-in annotator: rules over a table of priors and the mesh itself. Needs no weights, no key and no network."""

from __future__ import annotations

import numpy as np

from manitwin.config import Resource
from manitwin.models.annotators.physical_rules import estimate_physical
from manitwin.models.annotators.point_rules import select_points
from manitwin.models.annotators.priors import lookup
from manitwin.models.annotators.protocol import (
    AnnotatorQuestion,
    PhysicalEstimates,
    PointsRequest,
    QualityVerdict,
    SelectedPoints,
    Subject,
)
from manitwin.models.annotators.words import describe
from manitwin.twin.record import Language


class RulesAnnotator:
    """Answer the paper's four questions from what is usually true of a thing of this name, and from its geometry.

    What a picture alone shows is not judged. Without a name, the answers are wide and say so.
    """

    name = "rules"
    needs: Resource = "cpu"
    picture_px = 512  # nobody but people looks at them

    def model_for(self, question: AnnotatorQuestion) -> str | None:
        """Return None: there is no model."""
        return None

    def expected_usd(self, question: AnnotatorQuestion) -> float:
        """Return 0."""
        return 0.0

    def judge_quality(self, subject: Subject) -> QualityVerdict:
        """Judge nothing: rules cannot see."""
        return QualityVerdict(None, None, "rules do not look at pictures")

    def estimate_physical(self, subject: Subject) -> PhysicalEstimates:
        """Estimate size, mass and friction from the prior, the bulk density and the volume."""
        return estimate_physical(subject, lookup(subject.name))

    def describe(self, subject: Subject, material: str, extents_m: np.ndarray) -> Language:
        """Describe the object in words: colour and size as measured, the rest from the prior and the shape."""
        return describe(subject, lookup(subject.name), material, extents_m)

    def select_points(self, request: PointsRequest) -> SelectedPoints:
        """Choose functional and grasp points: the prior's parts, found as geometry."""
        return select_points(request, lookup(request.subject.name))
