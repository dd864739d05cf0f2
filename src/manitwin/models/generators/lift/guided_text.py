"""Job for a text with a vision-language model that reads what the rule-based reader does not fully understand."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from manitwin.errors import Rejected, Unsupported, UsageError
from manitwin.geometry.solids.shapes import SolidError
from manitwin.models.annotators.vlm.template_choice import TemplateInput
from manitwin.models.annotators.vlm.template_likeness import Likeness
from manitwin.models.annotators.vlm.template_reader import TemplateReader
from manitwin.models.generators.lift.photo_generation import LiftResult
from manitwin.models.generators.lift.review_rounds import (
    ReviewResult,
    add_review_notes,
    render_review_pictures,
    require_accepted,
    review_twice,
)
from manitwin.models.generators.lift.text_generation import make_from_text, text_result
from manitwin.models.generators.templates.description_parser import MAX_CHARACTERS
from manitwin.models.generators.templates.filled_template import FilledTemplate, make_filled
from manitwin.models.generators.templates.template_object import TemplateObject, visual_parts
from manitwin.twin.import_record import FILLED

_SEEN_FROM_DEG = (-55.0, 25.0)  # azimuth and elevation; the front faces -Y


@dataclass(frozen=True)
class _FilledObject:
    filled: FilledTemplate
    made: TemplateObject


def generate_text_guided(text: str, seed: int, reader: TemplateReader) -> LiftResult:
    """Return the object described by a text: by the rule-based reader if it understands every word, else filled in by a model.

    If the model chooses no template, the result is that of the rule-based reader, or Unsupported is raised with the nearest
    categories. Raises the errors of the model, and Rejected if it says in both rounds that the result does not match the
    text.
    """
    if len(text) > MAX_CHARACTERS:
        raise Unsupported(f"a text of {len(text)} characters; at most {MAX_CHARACTERS} describe an object")
    plain, why = None, ""
    try:
        made, unused = make_from_text(text, seed)
        plain = text_result(made, text, unused)
    except (UsageError, SolidError) as error:
        why = str(error)
    else:
        if not unused:
            return plain
    shown = TemplateInput(None, text, None)
    choice = reader.choose(shown)
    if choice.category is None:
        finding = f"{reader.source} says that it is none of the templates"
        if plain is None:
            raise Unsupported(f"{finding}, and {why}")
        return add_review_notes(plain, reader, None, [*choice.findings, finding])
    filled, left_out = reader.fill(shown, choice.category)
    first = _FilledObject(filled, _make_object(filled, text, seed))

    def compare(thing: _FilledObject, before: str) -> Likeness:
        pictures = render_review_pictures(visual_parts(thing.made), *_SEEN_FROM_DEG, reader.settings.picture_px)
        return reader.compare(shown, filled.category, thing.made.measures, pictures, before)

    def correct(thing: _FilledObject, corrected: FilledTemplate) -> tuple[_FilledObject, str]:
        other = thing.filled.merged_with(corrected)
        if other == thing.filled:
            return thing, "Nothing was corrected: this is how it is now."
        return _FilledObject(other, _make_object(other, text, seed)), "This is how it is with your corrections."

    agreed: ReviewResult[_FilledObject] = review_twice(first, compare, correct)
    require_accepted(agreed, f"a {filled.category} made of the words {text!r}", reader)
    findings = [*choice.findings, *left_out, *agreed.findings]
    job = text_result(agreed.final.made, text, ())
    assert job.known is not None
    known = job.known.model_copy(update={"format": FILLED, "attribution": reader.source})
    return add_review_notes(replace(job, known=known), reader, agreed.final.filled, findings, agreed)


def _make_object(filled: FilledTemplate, text: str, seed: int) -> TemplateObject:
    try:
        return make_filled(filled, text, np.random.default_rng(seed))
    except (UsageError, SolidError) as error:
        raise Rejected("generator_failed", f"lift: {error}; rephrase the text", "generate") from error
