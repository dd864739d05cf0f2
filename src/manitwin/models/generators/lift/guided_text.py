"""Job for a text with a vision-language model that reads what the rule-based reader does not fully understand."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from manitwin.errors import Rejected, Unsupported, UsageError
from manitwin.geometry.solids.shapes import SolidError
from manitwin.models.annotators.vlm.template_choice import Shown
from manitwin.models.annotators.vlm.template_likeness import Likeness
from manitwin.models.annotators.vlm.template_reader import TemplateReader
from manitwin.models.generators.lift.made_photo import Job
from manitwin.models.generators.lift.made_text import job_of, made_as_read
from manitwin.models.generators.lift.rounds import Agreed, in_two_rounds, noted, pictures_of, require_right
from manitwin.models.generators.templates.filled import Filled, make_filled
from manitwin.models.generators.templates.made import Made, visual_parts
from manitwin.models.generators.templates.text import MAX_CHARACTERS
from manitwin.twin.import_record import FILLED

_SEEN_FROM_DEG = (-55.0, 25.0)  # azimuth and elevation; the front faces -Y


@dataclass(frozen=True)
class _Thing:
    filled: Filled
    made: Made


def guided_from_text(text: str, seed: int, reader: TemplateReader) -> Job:
    """Return the object described by a text: by the rule-based reader if it understands every word, else filled in by a model.

    If the model chooses no template, the result is that of the rule-based reader, or Unsupported is raised with the nearest
    categories. Raises the errors of the model, and Rejected if it says in both rounds that the result does not match the
    text.
    """
    if len(text) > MAX_CHARACTERS:
        raise Unsupported(f"a text of {len(text)} characters; at most {MAX_CHARACTERS} describe an object")
    plain, why = None, ""
    try:
        made, unused = made_as_read(text, seed)
        plain = job_of(made, text, unused)
    except (UsageError, SolidError) as error:
        why = str(error)
    else:
        if not unused:
            return plain
    shown = Shown(None, text, None)
    choice = reader.choose(shown)
    if choice.category is None:
        finding = f"{reader.source} says that it is none of the templates"
        if plain is None:
            raise Unsupported(f"{finding}, and {why}")
        return noted(plain, reader, None, [*choice.findings, finding])
    filled, left_out = reader.fill(shown, choice.category)
    first = _Thing(filled, _made(filled, text, seed))

    def compare(thing: _Thing, before: str) -> Likeness:
        pictures = pictures_of(visual_parts(thing.made), *_SEEN_FROM_DEG, reader.settings.picture_px)
        return reader.compare(shown, filled.category, thing.made.measures, pictures, before)

    def correct(thing: _Thing, corrected: Filled) -> tuple[_Thing, str]:
        other = thing.filled.corrected(corrected)
        if other == thing.filled:
            return thing, "Nothing was corrected: this is how it is now."
        return _Thing(other, _made(other, text, seed)), "This is how it is with your corrections."

    agreed: Agreed[_Thing] = in_two_rounds(first, compare, correct)
    require_right(agreed, f"a {filled.category} made of the words {text!r}", reader)
    findings = [*choice.findings, *left_out, *agreed.findings]
    job = job_of(agreed.kept.made, text, ())
    assert job.known is not None
    known = job.known.model_copy(update={"format": FILLED, "attribution": reader.source})
    return noted(replace(job, known=known), reader, agreed.kept.filled, findings, agreed)


def _made(filled: Filled, text: str, seed: int) -> Made:
    try:
        return make_filled(filled, text, np.random.default_rng(seed))
    except (UsageError, SolidError) as error:
        raise Rejected("generator_failed", f"lift: {error}; rephrase the text", "generate") from error
