"""Measures question: a template's measures, and the colours and materials of its parts, with a form per template."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, create_model

from manitwin.models.annotators.vlm.prompt_files import Prompt
from manitwin.models.annotators.vlm.question_parts import name_line
from manitwin.models.annotators.vlm.template_choice import TemplateInput
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.filled_template import FilledTemplate, assignable_parts, parse_color
from manitwin.models.generators.templates.look_phrases import LookRequest
from manitwin.models.generators.templates.looks import COLORS, MATERIALS
from manitwin.models.generators.templates.template import Template
from manitwin.models.vlm.protocol import Question
from manitwin.models.vlm.strict_schema import strict_schema

UNSAID = "unsaid"
MOST_LOOKS = 8
_ROUNDING = 0.02  # a bound given to three digits may be answered with two


def _known_color(text: str) -> str:
    if text != UNSAID and parse_color(text) is None:
        raise ValueError(f"no color: give a word of {', '.join(COLORS)}, #rrggbb, or {UNSAID!r}")
    return text


class MeasuresAnswer(BaseModel):
    """Measures by name; null for one that is not said."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def said(self) -> dict[str, float]:
        """Return the measures that are given."""
        return {name: float(value) for name, value in self if value is not None}


class PartLook(BaseModel):
    """The colour and material of a part."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    part: str
    color: Annotated[
        str, Field(max_length=32, description="a color word, #rrggbb, or unsaid"), AfterValidator(_known_color)
    ]
    material: Literal[(*MATERIALS, UNSAID)]  # type: ignore[valid-type]

    @property
    def look_request(self) -> LookRequest:
        """The requested colour and material."""
        return LookRequest(parse_color(self.color), MATERIALS.get(self.material))


class FilledAnswer(BaseModel):
    """The answer: what is seen or read, then measures and looks."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    shown: str = Field(description="proportions, parts and matter, in one or two sentences")
    measures: MeasuresAnswer
    looks: list[PartLook] = Field(max_length=MOST_LOOKS, description="of the parts that are seen or named")


@cache
def measures_answer(category: str) -> type[MeasuresAnswer]:
    """Return the model class of a template's measures."""
    template = load_templates()[category]
    fields = {
        name: (Annotated[float, Field(gt=0, strict=True, allow_inf_nan=False)] | None, Field(description=said))
        for name, said in measures_in_words(template).items()
    }
    return create_model("MeasuresAnswer", __base__=MeasuresAnswer, **fields)  # type: ignore[call-overload]


@cache
def look_answer(category: str) -> type[PartLook]:
    """Return the model class of the looks of a template's parts."""
    one_of = Literal[tuple(assignable_parts(load_templates()[category]))]  # type: ignore[valid-type]
    return create_model("PartLook", __base__=PartLook, part=(one_of, ...))  # type: ignore[arg-type]


@cache
def filled_answer(category: str) -> type[FilledAnswer]:
    """Return the model class of an answer for a template."""
    look = look_answer(category)
    looks = Annotated[list[look], Field(max_length=MOST_LOOKS, description="of the parts that are seen or named")]  # type: ignore[valid-type]
    return create_model(
        "FilledAnswer", __base__=FilledAnswer, measures=(measures_answer(category), ...), looks=(looks, ...)
    )


def measures_in_words(template: Template) -> dict[str, str]:
    """Return the description of each measure with its interval: 'a ratio, 0.75 to 1, usually 0.85'."""
    kinds = {"m": "metres", "": "a ratio"}
    return {
        name: f"{kinds[measure.unit]}, {measure.low:g} to {measure.high:g}, usually {measure.typical:g}"
        for name, measure in template.measures.items()
    }


def about(template: Template) -> str:
    """Return what the template builds and to what its ratios refer, from the docstring of its builder."""
    words = " ".join((template.build.__doc__ or "").replace("``", "").split())
    return re.sub(r"^Build ", "It is ", words)


def template_values(category: str, measures: Mapping[str, float] | None = None) -> dict[str, str]:
    """Return the prompt values of a template; ``measures`` adds the current measures of the object."""
    template = load_templates()[category]
    listed = [
        f"{name} ({said})" if measures is None else f"{name} {measures[name]:.3g} ({said})"
        for name, said in measures_in_words(template).items()
    ]
    return {
        "category": category,
        "about": about(template),
        "measures": "; ".join(listed),
        "parts": ", ".join(assignable_parts(template)),
        "colors": ", ".join(COLORS),
    }


def measures_question(shown: TemplateInput, category: str, prompt: Prompt, picture_px: int) -> Question:
    """Ask for a template's measures and looks."""
    values = {"given": shown.given, "name": name_line(shown.name), **template_values(category)}
    instructions, parts = prompt.filled(values, shown.pictures(picture_px))
    return Question("template_measures", instructions, parts, strict_schema(filled_answer(category)))


def filled_template(category: str, measures: MeasuresAnswer, looks: Sequence[PartLook]) -> FilledTemplate:
    """Return the filled template of an answer; measures outside their intervals are left out."""
    template, said = load_templates()[category], measures.said()
    kept = {name: value for name, value in said.items() if _within(template, name, value)}
    filled = FilledTemplate(category, kept, {look.part: look.look_request for look in looks})
    return filled if filled.solid_error() is None else FilledTemplate(category, {}, filled.wishes)


def examine_measures(category: str, measures: MeasuresAnswer) -> list[str]:
    """Return findings about measures outside their intervals, or why they give no solid."""
    template, said = load_templates()[category], measures.said()
    words = measures_in_words(template)
    findings = [
        f"{name} {value:.3g}, but nearly every {category} has {words[name]}"
        for name, value in said.items()
        if not _within(template, name, value)
    ]
    why = None if findings else FilledTemplate(category, said).solid_error()
    return findings if why is None else [f"these measures give no {category}: {why}"]


def _within(template: Template, name: str, value: float) -> bool:
    measure = template.measures[name]
    return (1 - _ROUNDING) * measure.low <= value <= (1 + _ROUNDING) * measure.high
