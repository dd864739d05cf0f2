"""Data model of a review: answers by dimension, corrections, a note."""

from __future__ import annotations

import re
from typing import Annotated, Literal, get_args

from pydantic import AfterValidator, Field, ValidationError, model_validator

from manitwin.formats.printable import printable_line
from manitwin.twin.record_values import CONTROLS, LARGEST_KG, LARGEST_M, Finite, FolderName, Record

Dimension = Literal["category", "language", "functional", "physical", "grasp", "mesh", "simulation"]
"""The paper's five dimensions of annotation quality, the mesh quality, and the simulation result."""
Answer = Literal["yes", "no", "unsure"]
DIMENSIONS: tuple[Dimension, ...] = get_args(Dimension)
ANSWERS: tuple[Answer, ...] = get_args(Answer)
DECIDING_STAGE: dict[Dimension, str] = {
    "category": "caption",
    "language": "caption",
    "functional": "points",
    "physical": "physical",
    "grasp": "points",
    "mesh": "gate",
    "simulation": "verify",
}
"""The stage whose result a dimension judges; its backend, model and prompt are stored with each verdict."""
PAPER_ACCURACY: dict[Dimension, float] = {
    "category": 1.0,
    "language": 0.996,
    "functional": 0.922,
    "physical": 0.922,
    "grasp": 0.848,
}
"""Share of annotations judged correct on 500 sampled objects (paper, "Human Evaluation of Annotation Quality")."""
MOST_NOTE_CHARACTERS, MOST_NAME_CHARACTERS = 4000, 80
MOST_SECONDS = 30 * 86400.0
_ANNOTATOR = re.compile(r"[\w][\w.@+-]{0,63}")


def _annotator_name(name: str) -> str:
    if not _ANNOTATOR.fullmatch(name):
        raise ValueError(f"{name[:40]!r} is not a valid annotator name: use letters, digits and . _ - @ +, at most 64")
    return name


def _plain(text: str) -> str:
    if CONTROLS.search(text):
        raise ValueError("has control characters")
    return text.strip()


AnnotatorName = Annotated[str, AfterValidator(_annotator_name)]
Name = Annotated[str, Field(min_length=1, max_length=MOST_NAME_CHARACTERS), AfterValidator(_plain)]


class Measure(Record):
    """A quantity as stated by a person with a certain interval; ``low`` = ``high`` = ``value`` if exact."""

    value: Annotated[Finite, Field(gt=0)]
    low: Annotated[Finite, Field(gt=0)]
    high: Annotated[Finite, Field(gt=0)]

    @model_validator(mode="after")
    def _check_interval(self) -> Measure:
        if not self.low <= self.value <= self.high:
            raise ValueError(f"{self.value:g} is outside [{self.low:g}, {self.high:g}]")
        return self


class Corrections(Record):
    """Corrected values; ``points`` maps the id of a point to the candidate where it should be."""

    category: Name | None = None
    mass_kg: Measure | None = None
    longest_side_m: Measure | None = None
    points: dict[str, Annotated[int, Field(ge=0)]] = Field(default_factory=dict, max_length=64)

    @model_validator(mode="after")
    def _check_values(self) -> Corrections:
        if self.mass_kg is not None and self.mass_kg.high > LARGEST_KG:
            raise ValueError(f"mass_kg of {self.mass_kg.high:g} kg, which is impossible")
        if self.longest_side_m is not None and self.longest_side_m.high > LARGEST_M:
            raise ValueError(f"longest_side_m of {self.longest_side_m.high:g} m, which is impossible")
        for point in self.points:
            if not re.fullmatch(r"[fg]\d{1,3}", point):
                raise ValueError(
                    f"point {point[:20]!r}: ids are f0, f1, ... of functional and g0, g1, ... of grasp points"
                )
        return self

    def of(self, dimension: Dimension) -> dict[str, object]:
        """Return the corrections in one dimension, by name, as JSON values; empty if there are none."""
        if dimension == "category":
            return {} if self.category is None else {"category": self.category}
        if dimension == "physical":
            said = {"mass_kg": self.mass_kg, "longest_side_m": self.longest_side_m}
            return {name: each.model_dump() for name, each in said.items() if each is not None}
        kind = {"functional": "f", "grasp": "g"}.get(dimension)
        return {point: place for point, place in sorted(self.points.items()) if point[0] == kind}


class Review(Record):
    """One person's verdict on one twin at ``revision``.

    ``seconds`` is the time it took. ``blind`` reviews are made without seeing other verdicts or the annotation's confidence.
    ``prompts`` gives, per dimension, the origin of the judged annotations: backend, model and prompt version.
    """

    annotator: AnnotatorName
    twin_id: FolderName
    revision: Annotated[str, Field(min_length=1, max_length=128)]
    answers: dict[Dimension, Answer]
    corrections: Corrections = Field(default_factory=Corrections)
    note: Annotated[str, Field(max_length=MOST_NOTE_CHARACTERS), AfterValidator(_plain)] = ""
    blind: bool = False
    seconds: Annotated[Finite, Field(ge=0, le=MOST_SECONDS)] | None = None
    prompts: dict[Dimension, str] = Field(default_factory=dict)
    origin: Literal["browser", "file"] = "browser"

    @model_validator(mode="after")
    def _require_content(self) -> Review:
        if not self.answers:
            raise ValueError(f"no dimension is answered; answer one of {', '.join(DIMENSIONS)}")
        for dimension in DIMENSIONS:
            if self.corrections.of(dimension) and self.answers.get(dimension) != "no":
                raise ValueError(f"{dimension} is corrected and not answered 'no'")
        return self


def reason_of(error: ValidationError) -> str:
    """Return the first validation error of a verdict and its location as one line of text."""
    first = error.errors()[0]
    where = ".".join(str(each) for each in first["loc"])
    said = first["msg"].removeprefix("Value error, ")
    return printable_line(f"{where}: {said}" if where else said, max_characters=200)
