"""Captions question: the paper's six attributes, and sentences of different length and style."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from manitwin.errors import BadReply
from manitwin.models.annotators.protocol import Subject
from manitwin.models.annotators.vlm.physical import SameAsNamed
from manitwin.models.annotators.vlm.prompt_files import Prompt
from manitwin.models.annotators.vlm.question_parts import name_line, size_line, size_phrase
from manitwin.models.annotators.vlm.view_pictures import clean_views
from manitwin.models.vlm.protocol import Question
from manitwin.models.vlm.strict_schema import strict_schema
from manitwin.twin.record import Language

LEAST_SENTENCES = 6
ATTRIBUTES = ("category", "color", "material", "size", "shape", "function")
SENTENCES = ("caption", "label", "sentence", "detailed", "by_use", "by_look", "by_size", "request")

_NOT_THE_OBJECT = re.compile(
    r"\b(views?|pictures?|pictured|images?|photos?|photographs?|renders?|rendered|renderings?|renderer|cameras?|background|"
    r"backdrop|screenshots?|3d models?|azimuth|elevation|markers?|numbered|candidates?)\b",
    re.IGNORECASE,
)
_LENGTH = re.compile(
    r"(?<!\d)(\d++(?:\.\d++)?)\s*+(?:-\s*+)?(mm|millimet(?:er|re)s?|cm|centimet(?:er|re)s?|m|met(?:er|re)s?|inch(?:es)?)\b",
    re.IGNORECASE,
)
_METRES = {"mm": 0.001, "mi": 0.001, "cm": 0.01, "ce": 0.01, "m": 1.0, "me": 1.0, "in": 0.0254}
_LENGTH_FACTOR = 1.3  # tolerance for a length that is rounded or measured along a curve


class CaptionsAnswer(BaseModel):
    """The answer: what is seen, six attributes, eight sentences."""

    model_config = ConfigDict(frozen=True)

    shown: str = Field(description="parts, colors and materials that are seen, in one or two sentences")
    same_as_named: SameAsNamed = Field(description="whether it is what the user calls it")
    category: str = Field(min_length=1)
    color: str = Field(min_length=1)
    material: str = Field(min_length=1)
    size: str = Field(min_length=1)
    shape: str = Field(min_length=1)
    function: str = Field(min_length=1)
    caption: str = Field(min_length=1, description="one complete sentence: category, color, material, use")
    label: str = Field(min_length=1, description="2 to 5 words")
    sentence: str = Field(min_length=1, description="6 to 12 words")
    detailed: str = Field(min_length=1, description="30 to 60 words")
    by_use: str = Field(min_length=1)
    by_look: str = Field(min_length=1)
    by_size: str = Field(min_length=1)
    request: str = Field(min_length=1, description="a person asks a robot for it")


def captions_question(subject: Subject, material: str, extents_m: np.ndarray, prompt: Prompt) -> Question:
    """Ask for attributes and sentences; measured values are stated in the question."""
    values = {
        "count": str(len(subject.views)),
        "name": name_line(subject.name, subject.known_as),
        "size": size_line(subject, extents_m),
        "material": material,
    }
    instructions, parts = prompt.filled(values, clean_views(subject))
    return Question("captions", instructions, parts, strict_schema(CaptionsAnswer))


def caption_findings(answer: CaptionsAnswer, name: str | None, extents_m: np.ndarray) -> list[str]:
    """Return the findings about inadmissible texts."""
    findings = []
    for field in (*ATTRIBUTES, *SENTENCES):
        findings += [f"{field}: {fault}" for fault in _text_faults(getattr(answer, field), answer, name, extents_m)]
    for field, other in _repeated_sentences(answer):
        findings.append(f"{field} repeats {other}: write another sentence")
    if len(answer.label.split()) >= len(answer.detailed.split()):
        findings.append("label is not shorter than detailed: a label has 2 to 5 words, detailed 30 to 60")
    if name is not None and answer.same_as_named == "no":
        findings.append(f"the user calls it {name!r}, but the category is {answer.category!r}: look again")
    return findings


def admissible_language(answer: CaptionsAnswer, name: str | None, extents_m: np.ndarray) -> Language:
    """Return the admissible texts, the main caption first.

    If the model says twice that the object is not what the user calls it, the category says so. Raises BadReply if an
    attribute, or more than two of the eight sentences, are inadmissible.
    """
    for field in ATTRIBUTES:
        faults = _text_faults(getattr(answer, field), answer, name, extents_m)
        if faults:
            raise BadReply(
                f"the model's words for {field} cannot be used when asked twice: {faults[0]}; ask another model"
            )
    repeated = {field for field, _ in _repeated_sentences(answer)}
    kept = [
        getattr(answer, field).strip()
        for field in SENTENCES
        if field not in repeated and not _text_faults(getattr(answer, field), answer, name, extents_m)
    ]
    if len(kept) < LEAST_SENTENCES:
        raise BadReply(
            f"only {len(kept)} of the model's {len(SENTENCES)} sentences can be used when asked twice; ask another model"
        )
    category = answer.category.strip()
    if name is not None and answer.same_as_named == "no":
        category = f"{category} (the user says {' '.join(name.split())})"
    attributes = {field: getattr(answer, field).strip() for field in ATTRIBUTES}
    return Language(**attributes | {"category": category}, caption=kept[0], captions=kept)


def _text_faults(text: str, answer: CaptionsAnswer, name: str | None, extents_m: np.ndarray) -> list[str]:
    """Return why a text is inadmissible: it refers to the presentation of the object, or states an impossible length."""
    # words of the name and category are admissible: a camera may be called a camera
    own = f"{name or ''} {answer.category}".lower()
    faults = [
        f"{word!r} speaks of how the object is shown, not of the object"
        for word in dict.fromkeys(found.group(1).lower() for found in _NOT_THE_OBJECT.finditer(text))
        if word.rstrip("s") not in own
    ]
    low = float(np.min(extents_m)) / 10  # allows walls and thin strokes
    high = float(np.linalg.norm(extents_m)) * _LENGTH_FACTOR
    for number, unit in _LENGTH.findall(text):
        length_m = float(number) * _METRES[unit.lower()[:2] if len(unit) > 1 else "m"]
        if not low <= length_m <= high:
            faults.append(f"{number} {unit} is no length of an object of {size_phrase(extents_m)}")
    return faults


def _repeated_sentences(answer: CaptionsAnswer) -> list[tuple[str, str]]:
    """Return the sentences with the same words as an earlier one, with that sentence."""
    seen: dict[tuple[str, ...], str] = {}
    found = []
    for field in SENTENCES:
        words = _content_words(getattr(answer, field).split())
        if words in seen:
            found.append((field, seen[words]))
        seen.setdefault(words, field)
    return found


def _content_words(words: Iterable[str]) -> tuple[str, ...]:
    plain = (re.sub(r"[^a-z0-9]", "", word.lower()) for word in words)
    return tuple(word for word in plain if word and word not in ("a", "an", "the"))
