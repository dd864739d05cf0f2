"""Points questions over marked candidates: functional points in one query, grasp points in several with different numbering."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, create_model, model_validator

from manitwin.models.annotators.protocol import PointsRequest
from manitwin.models.annotators.vlm.place_checks import PINCH_M, PlaceChecks
from manitwin.models.annotators.vlm.prompt_files import Prompt
from manitwin.models.annotators.vlm.question_parts import (
    extents_of,
    length_phrase,
    name_line,
    size_line,
)
from manitwin.models.annotators.vlm.view_pictures import marked_views
from manitwin.models.annotators.vlm.vote_views import QueryViews, own_views, views_of_vote
from manitwin.models.vlm.protocol import Picture, Question
from manitwin.models.vlm.strict_schema import strict_schema
from manitwin.twin.point_records import FunctionalPoint, GraspType

FUNCTIONAL, GRASP = (2, 4), (2, 3)
"""Minimum and maximum number of points of an object (paper)."""

CONTRADICTED = 0.5
"""Factor on the confidence of a point that geometry still contradicts after asking twice."""

_FUNCTIONAL_STREAM, _GRASP_STREAM = 0, 1
_NUMBER_SAID = re.compile(
    r"\b(markers?|points?|ids?|numbers?|dots?)((?:\s*(?:(?:,|and|or|#|no\.?)\s*)?\d+\b)+)", re.IGNORECASE
)


class FunctionalChoice(BaseModel):
    """A functional point: reason and name before the number."""

    model_config = ConfigDict(frozen=True)

    rationale: str = Field(description="where the place is and why it has this function")
    label: str = Field(min_length=1, description="the part on which the dot lies, 1 to 3 words")
    description: str = Field(min_length=1, description="what the place is for, one phrase")
    id: str = Field(description="the marker's number")
    confidence: float = Field(ge=0, le=1)


class GraspChoice(BaseModel):
    """A grasp point: reason and name before the number."""

    model_config = ConfigDict(frozen=True)

    rationale: str = Field(description="surface, distance from the center of gravity, safety")
    label: str = Field(min_length=1, description="the part on which the dot lies, 1 to 3 words")
    id: str = Field(description="the marker's number")
    type: GraspType
    scenario: str = Field(min_length=1, description="the use it is for, one phrase")
    confidence: float = Field(ge=0, le=1)


class PointsAnswer(BaseModel):
    """Points with numbers of their own."""

    model_config = ConfigDict(frozen=True)

    shown: str = Field(description="the object's parts and where they are, in one or two sentences")
    points: list[Any]

    @model_validator(mode="after")
    def _check_distinct(self) -> PointsAnswer:
        ids = [point.id for point in self.points]
        if len(set(ids)) < len(ids):
            raise ValueError(f"each id may be used once; they are {', '.join(ids)}")
        return self


def functional_answer(ids: Sequence[str]) -> type[PointsAnswer]:
    """Return the model class of an answer, with ``ids`` as the allowed marker numbers."""
    return _answer("FunctionalAnswer", FunctionalChoice, ids, FUNCTIONAL)


def grasp_answer(ids: Sequence[str]) -> type[PointsAnswer]:
    """Return the model class of an answer, with ``ids`` as the allowed marker numbers."""
    return _answer("GraspAnswer", GraspChoice, ids, GRASP)


def _answer(name: str, choice: type[BaseModel], ids: Sequence[str], limits: tuple[int, int]) -> type[PointsAnswer]:
    # ids are strings, because some servers support no enum of numbers; a JSON number is accepted for the same id
    one_of = Annotated[Literal[tuple(ids)], BeforeValidator(str)]  # type: ignore[valid-type]
    seen = create_model(choice.__name__, __base__=choice, id=(one_of, Field(description="the marker's number")))  # type: ignore[arg-type]
    points = Annotated[list[seen], Field(min_length=limits[0], max_length=limits[1])]  # type: ignore[valid-type]
    return create_model(name, __base__=PointsAnswer, points=(points, ...))


class Numbering:
    """Marker numbers of the candidates in one query, ``numbers (N,)``, a random permutation, and the views of the query."""

    def __init__(self, request: PointsRequest, stream: int, vote: int, views: QueryViews):
        self.numbers, self.views = _numbers(request, stream, vote), views
        seen = sorted(views.seen, key=lambda i: int(self.numbers[i]))
        self.candidates = {str(self.numbers[i]): i for i in seen}

    @property
    def ids(self) -> list[str]:
        """Numbers of the candidates that some view shows, ascending."""
        return list(self.candidates)

    def translate_numbers(self, text: str) -> str:
        """Return a text with marker numbers replaced by candidate numbers, which are valid outside the query."""

        def said(found: re.Match[str]) -> str:
            return "candidates" + re.sub(r"\d+", lambda n: str(self.candidates.get(n.group(), "?")), found.group(2))

        return _NUMBER_SAID.sub(said, text)


def _numbers(request: PointsRequest, stream: int, vote: int) -> np.ndarray:
    rng = np.random.default_rng([request.subject.seed, stream, vote])
    return rng.permutation(len(request.positions_m)) + 1


def grasp_numbers(request: PointsRequest, vote: int) -> np.ndarray:
    """Return the marker number of each candidate ``(N,)`` in one of the grasp queries."""
    return _numbers(request, _GRASP_STREAM, vote)


def functional_numbering(request: PointsRequest) -> Numbering:
    """Return the numbering of the functional query."""
    return Numbering(request, _FUNCTIONAL_STREAM, 0, own_views(request))


def grasp_numbering(request: PointsRequest, vote: int, votes: int) -> Numbering:
    """Return the numbering and views of one of the grasp queries; ``vote`` is its index from 0."""
    return Numbering(request, _GRASP_STREAM, vote, views_of_vote(request, vote, votes))


def functional_question(request: PointsRequest, numbering: Numbering, prompt: Prompt) -> Question:
    """Ask for functional points."""
    above_m = request.positions_m[:, 2]
    ids = "; ".join(f"{number}: {length_phrase(above_m[i])}" for number, i in numbering.candidates.items())
    pictures, color = _pictures(request, numbering)
    values = _values(request) | {"ids": ids, "marker": color}
    instructions, parts = prompt.filled(values, pictures)
    return Question("functional_points", instructions, parts, strict_schema(functional_answer(numbering.ids)))


def grasp_question(checks: PlaceChecks, numbering: Numbering, prompt: Prompt, vote: int) -> Question:
    """Ask for grasp points, with a different wording per vote; ``vote`` is the index of the query from 0."""
    request = checks.request
    away_m = np.linalg.norm(request.positions_m - request.center_of_mass_m, axis=1)
    above_m = request.positions_m[:, 2]
    ids = "; ".join(
        f"{number}: {length_phrase(away_m[i])}, {length_phrase(above_m[i])}, {checks.width_phrase(i)}"
        for number, i in numbering.candidates.items()
    )
    pictures, color = _pictures(request, numbering)
    values = _values(request) | {
        "ids": ids,
        "marker": color,
        "opening": length_phrase(request.max_opening_m),
        "pinch": length_phrase(PINCH_M),
    }
    instructions, parts = prompt.filled(values, pictures, wording=vote)
    return Question("grasp_points", instructions, parts, strict_schema(grasp_answer(numbering.ids)), vote)


def _pictures(request: PointsRequest, numbering: Numbering) -> tuple[list[str | Picture], str]:
    views = numbering.views
    return marked_views(request, numbering.numbers, views.pictures, views.cameras, views.visible)


def _values(request: PointsRequest) -> dict[str, str]:
    return {
        "count": str(len(request.subject.views)),
        "name": name_line(request.subject.name, request.subject.known_as),
        "size": size_line(request.subject, extents_of(request.subject.parts)),
    }


def examine_points(answer: PointsAnswer, numbering: Numbering, checks: PlaceChecks) -> list[str]:
    """Return findings where geometry contradicts a label or a grasp, in the query's own numbers."""
    findings = []
    for point in answer.points:
        wrong = contradiction(point, numbering.candidates[point.id], checks)
        if wrong is not None:
            findings.append(f"marker {point.id}, {point.label!r}: {wrong}")
    return findings


def contradiction(point: FunctionalChoice | GraspChoice, candidate: int, checks: PlaceChecks) -> str | None:
    """Return how geometry contradicts a point, None if it does not."""
    wrong = checks.label_contradiction(point.label, candidate)
    if wrong is None and isinstance(point, GraspChoice):
        wrong = checks.grasp_contradiction(point.type, candidate)
    return wrong


def functional_points(
    answer: PointsAnswer, numbering: Numbering, checks: PlaceChecks
) -> tuple[tuple[FunctionalPoint, ...], tuple[str, ...]]:
    """Return the points of the last answer, and findings about contradictions; such points lose half of their confidence."""
    request, points, findings = checks.request, list[FunctionalPoint](), list[str]()
    for number, choice in enumerate(answer.points):
        candidate = numbering.candidates[choice.id]
        wrong = contradiction(choice, candidate, checks)
        if wrong is not None:
            findings.append(f"functional point f{number}, {choice.label!r} at candidate {candidate}: {wrong}")
        points.append(
            FunctionalPoint(
                id=f"f{number}",
                **request.place(candidate),
                label=choice.label,
                description=choice.description,
                confidence=round(choice.confidence * (1.0 if wrong is None else CONTRADICTED), 3),
                rationale=numbering.translate_numbers(choice.rationale),
            )
        )
    return tuple(points), tuple(findings)
