"""Noun phrases for one object, many ways to say what it is: from its captions and its six attributes, never drawn at random."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from manitwin.errors import ExportError
from manitwin.formats.markdown import one_line
from manitwin.twin.record import Language

_MAX_WORDS = 20
_ARTICLE = re.compile(r"^(?:an?|the)\s+", re.IGNORECASE)
_KNOWN_CLAUSE = re.compile(r"^(?:to|for|used)\s", re.IGNORECASE)
# a caption with one of these is a sentence about the object and not a name for it
_FINITE_VERB = re.compile(
    r"\b(?:is|are|was|has|have|sits|stands|lies|can|features|shows|appears|looks)\b", re.IGNORECASE
)


def noun_phrases(language: Language, count: int) -> list[str]:
    """Return ``count`` different phrases without an article, those of the captions first.

    They stand behind "the" in an instruction: captions that are whole sentences or commands are left out. Raises ExportError
    where so many cannot be made.
    """
    captions = (phrase for text in (language.caption, *language.captions) if (phrase := _of_caption(text)))
    phrases = _distinct([*captions, *_of_attributes(language)])
    if len(phrases) < count:
        raise ExportError(
            f"only {len(phrases)} phrases for {language.category!r}, {count} are needed; give it captions"
        )
    return phrases[:count]


def seen_and_unseen(language: Language, seen: int, unseen: int) -> tuple[list[str], list[str]]:
    """Return phrases for training and disjoint ones to test with, the latter spread evenly over all kinds."""
    phrases = noun_phrases(language, seen + unseen)
    step = (seen + unseen) // unseen
    held_out = phrases[step - 1 :: step][:unseen]
    return [phrase for phrase in phrases if phrase not in held_out], held_out


def _of_caption(text: str) -> str | None:
    """Return a caption's noun phrase, None where it is no such thing."""
    line = one_line(text).rstrip(".")
    if not _ARTICLE.match(line) or ". " in line or _FINITE_VERB.search(line) or len(line.split()) > _MAX_WORDS:
        return None
    return _ARTICLE.sub("", line)


def _of_attributes(language: Language) -> Iterator[str]:
    noun, material, shape, size = (
        one_line(text) for text in (language.category, language.material, language.shape, language.size)
    )
    function = one_line(language.function)
    use = function if _KNOWN_CLAUSE.match(function) else f"for {function}"
    color = one_line(language.color)
    if not color.lower().startswith("unknown"):
        yield from (
            f"{color} {noun}",
            f"{color} {material} {noun}",
            f"{color} {noun} {use}",
            f"{color} {noun}, {shape}",
        )
    yield from (
        noun,
        f"{material} {noun}",
        f"{noun} made of {material}",
        f"{noun} {use}",
        f"{material} {noun} {use}",
        f"{noun} made of {material}, {use}",
        f"{noun}, {shape}",
        f"{material} {noun}, {shape}",
        f"{noun} of {size}",
        f"{material} {noun} of {size}",
        f"{noun} {use}, {size}",
        f"{noun}, {shape}, {size}",
        f"{noun} made of {material}, {shape}",
        f"{noun} {use}, {shape}",
        f"{material} {noun} {use}, {shape}",
        f"{noun} made of {material}, {size}, {shape}",
    )


def _distinct(phrases: Iterable[str]) -> list[str]:
    """Return each phrase once, whatever its capitals, where it comes first."""
    distinct: dict[str, str] = {}
    for phrase in phrases:
        distinct.setdefault(phrase.lower(), phrase)
    return list(distinct.values())
