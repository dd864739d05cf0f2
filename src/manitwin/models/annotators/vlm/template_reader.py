"""Template reader: asks a vision-language model to choose and fill in a template, and to compare the result with the input."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

from manitwin.config import VlmConfig
from manitwin.models.annotators.vlm.prompt_files import Prompt
from manitwin.models.annotators.vlm.template_choice import (
    NONE_OF_THESE,
    TemplateInput,
    choice_answer,
    choice_question,
    examine_choice,
)
from manitwin.models.annotators.vlm.template_likeness import (
    Likeness,
    examine_likeness,
    likeness_answer,
    likeness_question,
    likeness_verdict,
)
from manitwin.models.annotators.vlm.template_measures import (
    about,
    examine_measures,
    filled_answer,
    filled_template,
    measures_question,
)
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.filled_template import FilledTemplate
from manitwin.models.vlm.prices import expected_usd
from manitwin.models.vlm.protocol import ChatModel, Picture
from manitwin.models.vlm.strict_schema import strict_schema
from manitwin.models.vlm.structured import ask

PROMPTS = ("template", "template_measures", "template_likeness")
MODEL_VIEWS = 3
"""Number of pictures of a model that are compared with its input."""
_USUAL = "mug"  # a template of average size, for cost estimates
_PICTURES = {"template": 1, "template_measures": 1, "template_likeness": 1 + MODEL_VIEWS}
# approximate characters of the form and the filled placeholders for a mug
_FORM_CHARACTERS = {"template": 5600, "template_measures": 2500, "template_likeness": 3200}
ANSWER_TOKENS = {
    "template": 80,
    "template_measures": 200,
    "template_likeness": 250,
}  # for answers like those in fakes.vlm_answers


@dataclass(frozen=True)
class Choice:
    """The category of a template, None for none of them; ``findings`` remained after asking again."""

    category: str | None
    findings: tuple[str, ...]


@cache
def _forms() -> str:
    """Return all forms and the texts about each template as JSON; the forms of other templates differ in nothing else."""
    forms = [strict_schema(form) for form in (choice_answer(), filled_answer(_USUAL), likeness_answer(_USUAL))]
    templates = [
        [category, about(each), {name: vars(measure) for name, measure in each.measures.items()}, dict(each.slots)]
        for category, each in load_templates().items()
    ]
    return json.dumps([forms, templates], sort_keys=True)


class TemplateReader:
    """Ask a chat model three questions about a photo or a text: which template, its measures, and the likeness of the result.

    Each raises the errors of the chat model, and BadReply for an answer that is invalid twice.
    """

    def __init__(self, chat: ChatModel, settings: VlmConfig, prompts: Mapping[str, Prompt]):
        self.chat, self.settings = chat, settings
        self._prompts = {name: prompts[name] for name in PROMPTS}

    @property
    def source(self) -> str:
        """``source`` of an estimate by this model."""
        return f"vlm:{self.chat.model}"

    @cached_property
    def model(self) -> str:
        """'MODEL, prompt template v1 and ... 0123abcd': model, prompt versions, and a digest of prompts, forms and settings."""
        settings = self.settings.model_dump(mode="json", include={"picture_px", "max_tokens", "temperature"})
        asked = [prompt.text for prompt in self._prompts.values()]
        text = json.dumps([asked, _forms(), settings], sort_keys=True)
        versions = " and ".join(f"{name} v{prompt.version}" for name, prompt in self._prompts.items())
        return f"{self.chat.model}, prompt {versions} {hashlib.sha256(text.encode()).hexdigest()[:8]}"

    @property
    def expected_usd(self) -> float:
        """Approximate cost of a photo that needs one round; 0 if the chat model has no price."""
        price = getattr(self.chat, "price", None)
        if price is None:
            return 0.0
        return sum(
            expected_usd(
                price,
                characters=len(prompt.instructions) + len(prompt.question) + _FORM_CHARACTERS[name],
                pictures=_PICTURES[name],
                picture_px=self.settings.picture_px,
                answer_tokens=ANSWER_TOKENS[name],
            )
            for name, prompt in self._prompts.items()
        )

    def choose(self, shown: TemplateInput) -> Choice:
        """Choose the template."""
        question = choice_question(shown, self._prompts["template"], self.settings.picture_px)
        answered = ask(self.chat, question, choice_answer(), lambda answer: examine_choice(answer, shown.name))
        category = answered.value.category
        return Choice(None if category == NONE_OF_THESE else category, answered.findings)

    def fill(self, shown: TemplateInput, category: str) -> tuple[FilledTemplate, tuple[str, ...]]:
        """Fill in a template; return it with the findings that remained. Measures with findings are left out."""
        question = measures_question(shown, category, self._prompts["template_measures"], self.settings.picture_px)
        form = filled_answer(category)
        answered = ask(self.chat, question, form, lambda answer: examine_measures(category, answer.measures))
        return filled_template(category, answered.value.measures, answered.value.looks), answered.findings

    def compare(
        self,
        shown: TemplateInput,
        category: str,
        measures: Mapping[str, float],
        pictures: Sequence[str | Picture],
        round_line: str,
    ) -> Likeness:
        """Compare a model with these measures with the input."""
        prompt, side_px = self._prompts["template_likeness"], self.settings.picture_px
        question = likeness_question(shown, category, measures, pictures, prompt, side_px, round_line=round_line)
        answered = ask(
            self.chat, question, likeness_answer(category), lambda answer: examine_likeness(category, answer)
        )
        return likeness_verdict(category, answered.value, answered.findings)
