"""Template question: which template has the parts and structure of the object in a photo, or described by a text."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, create_model

from manitwin.models.annotators.vlm.prompt_files import Prompt
from manitwin.models.annotators.vlm.question_parts import name_line
from manitwin.models.annotators.vlm.view_pictures import cut_out_picture
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.fit import alternative_categories, template_for
from manitwin.models.vlm.protocol import Picture, Question
from manitwin.models.vlm.strict_schema import strict_schema

NONE_OF_THESE = "none of these"


@dataclass(frozen=True)
class TemplateInput:
    """The input: the matted photo ``rgba (H, W, 4) uint8``, or a text; ``name`` is the user's name for the object."""

    rgba: np.ndarray | None
    text: str | None
    name: str | None

    @property
    def given(self) -> str:
        """The sentence that tells the model what the input is."""
        if self.rgba is not None:
            return "The picture shows one object, cut out of its photo."
        return f"There is no picture of the object: somebody asks for {' '.join((self.text or '').split())!r}."

    def pictures(self, picture_px: int) -> list[str | Picture]:
        """Return the photo with a caption; an empty list for a text."""
        return [] if self.rgba is None else ["The photo:", cut_out_picture(self.rgba, picture_px)]


class ChoiceAnswer(BaseModel):
    """The answer: what is there and its parts, then the template."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    shown: str = Field(description="the object and its parts, in one or two sentences")
    category: str


@cache
def choice_answer() -> type[ChoiceAnswer]:
    """Return the model class of an answer whose category is one of the templates, or none of them."""
    one_of = Literal[(*load_templates(), NONE_OF_THESE)]  # type: ignore[valid-type]
    return create_model("ChoiceAnswer", __base__=ChoiceAnswer, category=(one_of, ...))  # type: ignore[arg-type]


def choice_question(shown: TemplateInput, prompt: Prompt, picture_px: int) -> Question:
    """Ask which template fits."""
    named = [
        f"{category} ({', '.join(template.names)})" if template.names else category
        for category, template in load_templates().items()
    ]
    values = {"given": shown.given, "name": name_line(shown.name), "categories": "; ".join(named)}
    instructions, parts = prompt.filled(values, shown.pictures(picture_px))
    return Question("template", instructions, parts, strict_schema(choice_answer()))


def examine_choice(answer: ChoiceAnswer, name: str | None) -> list[str]:
    """Return a finding if the user's name for the object is that of another template."""
    said = template_for(name)
    if said is None or answer.category in (said.category, *alternative_categories(said.category)):
        return []
    return [
        f"the user calls it {name!r}, which is the template {said.category!r}, but the answer is {answer.category!r}:"
        " look again"
    ]
