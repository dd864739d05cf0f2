"""Likeness question: compares a model with its photo or text, and asks for corrections."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, create_model

from manitwin.models.annotators.vlm.prompt_files import Prompt
from manitwin.models.annotators.vlm.quality import Decision
from manitwin.models.annotators.vlm.question_parts import name_line
from manitwin.models.annotators.vlm.template_choice import TemplateInput
from manitwin.models.annotators.vlm.template_measures import (
    MOST_LOOKS,
    MeasuresAnswer,
    PartLook,
    examine_measures,
    filled_template,
    look_answer,
    measures_answer,
    template_values,
)
from manitwin.models.generators.templates.filled_template import FilledTemplate
from manitwin.models.vlm.protocol import Picture, Question
from manitwin.models.vlm.strict_schema import strict_schema

FIRST_LOOK = "You see it for the first time."


class Difference(BaseModel):
    """One way in which the model differs from what it was made from."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    aspect: Literal["kind", "parts", "proportions", "colors", "materials", "other"]
    evidence: str = Field(description="what is seen of it, and in which pictures")
    severity: Literal["minor", "severe"]


class LikenessAnswer(BaseModel):
    """The answer: what is seen, the differences, the decision, and what has to change."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    shown: str = Field(description="what both show, in one or two sentences")
    differences: list[Difference] = Field(max_length=8)
    right: Decision = Field(description="the model is like what it was made from")
    corrected: MeasuresAnswer
    looks: list[PartLook] = Field(max_length=MOST_LOOKS, description="those that have to change")

    @property
    def severe(self) -> list[str]:
        """Descriptions of the severe differences."""
        return [f"{said.aspect}: {said.evidence}" for said in self.differences if said.severity == "severe"]


@dataclass(frozen=True)
class Likeness:
    """Whether a model is like its input, the reason if not, and the corrections; ``findings`` remained after asking again."""

    right: bool
    detail: str
    corrected: FilledTemplate
    findings: tuple[str, ...] = ()


@cache
def likeness_answer(category: str) -> type[LikenessAnswer]:
    """Return the model class of an answer for a template."""
    look = look_answer(category)
    looks = Annotated[list[look], Field(max_length=MOST_LOOKS, description="those that have to change")]  # type: ignore[valid-type]
    return create_model(
        "LikenessAnswer", __base__=LikenessAnswer, corrected=(measures_answer(category), ...), looks=(looks, ...)
    )


def likeness_question(
    shown: TemplateInput,
    category: str,
    measures: Mapping[str, float],
    pictures: Sequence[str | Picture],
    prompt: Prompt,
    picture_px: int,
    *,
    round_line: str,
) -> Question:
    """Ask whether a model with these measures, shown in ``pictures``, is like the input."""
    values = {"given": shown.given, "name": name_line(shown.name), "round": round_line}
    values |= template_values(category, measures)
    instructions, parts = prompt.filled(values, [*shown.pictures(picture_px), *pictures])
    return Question("template_likeness", instructions, parts, strict_schema(likeness_answer(category)))


def examine_likeness(category: str, answer: LikenessAnswer) -> list[str]:
    """Return why the answer is not a decision: it is unsure, contradicts its evidence, or has impossible measures."""
    findings = []
    if answer.right == "unsure":
        findings.append("right is unsure: look at every picture again and answer yes or no")
    if answer.right == "yes" and answer.severe:
        findings.append("right is yes, but a difference is severe: one of the two is wrong")
    if answer.right == "no" and not answer.severe:
        findings.append("right is no, but no difference is severe: name the severe one, or answer yes")
    return findings + examine_measures(category, answer.corrected)


def likeness_verdict(category: str, answer: LikenessAnswer, findings: tuple[str, ...]) -> Likeness:
    """Convert the last answer to the verdict; an unsure answer, or a yes against the evidence, counts as no."""
    right = answer.right == "yes" and not answer.severe
    said = "; ".join(answer.severe) or answer.shown
    if answer.right == "unsure":
        said = f"unsure when asked twice: {said}"
    return Likeness(right, said, filled_template(category, answer.corrected, answer.looks), findings)
