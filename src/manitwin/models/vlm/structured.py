"""Asking for an answer of a given form: parsed leniently, validated strictly, asked once more for what is wrong with it."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeVar

import numpy as np
from PIL import Image, ImageDraw
from pydantic import BaseModel, ValidationError

from manitwin.errors import BadReply
from manitwin.formats.image_file import png_of
from manitwin.models.services.bodies import MOST_LEVELS, levels
from manitwin.models.vlm.client import Forgetful
from manitwin.models.vlm.protocol import ChatModel, Picture, Question, Turn
from manitwin.models.vlm.strict_schema import strict_schema

T = TypeVar("T", bound=BaseModel)
MAX_COMPLAINTS = 12
MOST_STARTS = 1000  # braces of a text at which an object is looked for: each may be read to the end of the text in vain
# models that think aloud put that before the answer: Qwen, DeepSeek
_THINKING, _THOUGHT = "<think>", "</think>"
# control characters, those that turn the direction of writing (Unicode's Bidi_Control), and halves of pairs of UTF-16
_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]+")
_FENCE = "```"
_AFTER_FENCE = re.compile(r"[a-zA-Z]*[^\S\n]*\n")
PROBE_PX = 256
SHOWN_CHARACTERS = 80
LONGEST_COMPLAINT = 240
"""Characters that a person is shown of one; the model is told all of it."""


@dataclass(frozen=True)
class Answered(Generic[T]):
    """An answer of the right form, and what contradicts it still."""

    value: T
    findings: tuple[str, ...]


def nothing_found(value: BaseModel) -> Sequence[str]:
    """Find nothing wrong with an answer."""
    return ()


def ask(
    chat: ChatModel, question: Question, answer: type[T], examine: Callable[[T], Sequence[str]] = nothing_found
) -> Answered[T]:
    """Ask a question and return its answer as an ``answer``.

    An answer that cannot be parsed or validated is asked for once more with the error; after that BadReply names what is
    wrong. One that ``examine`` finds fault with is asked for once more with the findings; those that are left then are
    returned, for the caller to decide. Raises what ``chat`` raises.
    """
    turns: tuple[Turn, ...] = ()
    repaired = examined = False
    while True:
        reply = chat.ask(question, turns)
        try:
            value = answer.model_validate(json_object_in(reply.text))
        except ValueError as error:
            wrong = complaints(error)
            if repaired:
                _forget(chat, question, turns)
                raise BadReply(
                    f"{chat.model} gave no usable answer to {question.name!r} when asked again:"
                    f" {'; '.join(map(_without_the_middle, wrong))}"
                ) from None
            repaired = True
            said = _listed(
                "Your answer cannot be used:", wrong, "Answer again with the whole JSON object and nothing else."
            )
        else:
            findings = tuple(examine(value))
            if examined or not findings:
                return Answered(value, findings)
            examined = True
            said = _listed(
                "Please check your answer again. It contradicts what is known:",
                findings,
                "Correct what is wrong, keep what you are sure of, and answer with the whole JSON object and nothing else.",
            )
        turns += (Turn("assistant", reply.text), Turn("user", said))


def complaints(error: ValueError) -> list[str]:
    """Return what is wrong with an answer, one line each, the place first."""
    if not isinstance(error, ValidationError):
        return [str(error)]
    found = []
    for detail in error.errors(include_url=False):
        place = ".".join(map(str, detail["loc"])) or "the answer"
        found.append(f"{place}: {detail['msg']}, not {str(detail['input'])[:80]!r}")
    return found[:MAX_COMPLAINTS]


def _without_the_middle(line: str) -> str:
    """Return a complaint for a person: of a long one, which lists all that could be said, its place and what was said."""
    half = LONGEST_COMPLAINT // 2
    return line if len(line) <= LONGEST_COMPLAINT else f"{line[:half]} ... {line[-half:]}"


def _listed(opening: str, lines: Sequence[str], closing: str) -> str:
    return "\n".join([opening, *(f"- {line}" for line in lines), closing])


def _forget(chat: ChatModel, question: Question, turns: tuple[Turn, ...]) -> None:
    # what was kept of a conversation that led nowhere would lead there again
    if isinstance(chat, Forgetful):
        for length in range(0, len(turns) + 1, 2):
            chat.forget(question, turns[:length])


def json_object_in(text: str) -> dict[str, Any]:
    """Return the JSON object in a text: alone, in a code fence, or with words around it.

    Control characters inside strings are taken (xgrammar lets them through under ``maxLength``) and become spaces: what a
    model writes ends on terminals. Of several objects the last one counts: models correct themselves in that order. Raises
    ValueError saying what is wrong. The time that it takes grows with the length of the text, whatever is in it.
    """
    found = _object_in(_without_thinking(text).strip())
    if levels(found) > MOST_LEVELS:
        raise ValueError(f"it is nested deeper than {MOST_LEVELS} levels")
    return {_readable(key): _readable(value) for key, value in found.items()}


def _without_thinking(text: str) -> str:
    kept, at = [], 0
    while (start := text.find(_THINKING, at)) >= 0 and (end := text.find(_THOUGHT, start)) >= 0:
        kept.append(text[at:start])
        at = end + len(_THOUGHT)
    return "".join(kept) + text[at:]


def _fenced(text: str) -> list[str]:
    """Return what stands in code fences, in order."""
    found, at = [], 0
    while (start := text.find(_FENCE, at)) >= 0:
        head = _AFTER_FENCE.match(text, start + len(_FENCE))
        if head is None:
            at = start + 1
            continue
        end = text.find(_FENCE, head.end())
        if end < 0:
            break
        found.append(text[head.end() : end])
        at = end + len(_FENCE)
    return found


def _readable(value: Any) -> Any:
    if isinstance(value, str):
        return _CONTROL.sub(" ", value)
    if isinstance(value, list):
        return [_readable(part) for part in value]
    return {_readable(key): _readable(part) for key, part in value.items()} if isinstance(value, dict) else value


def _object_in(text: str) -> dict[str, Any]:
    for candidate in (text, *reversed(_fenced(text))):
        value = _parsed(candidate)
        if isinstance(value, dict):
            return value
    found = list(_objects(text))
    if found:
        return found[-1]
    try:
        value = _DECODER.decode(text)
    except RecursionError:
        raise ValueError("it is no JSON that can be read: it is nested too deep") from None
    except ValueError as error:
        begin = _CONTROL.sub(" ", text[:SHOWN_CHARACTERS])
        raise ValueError(f"it is no JSON ({str(error).split(';')[0]}), and begins {begin!r}") from None
    raise ValueError(f"it is a JSON {type(value).__name__}, not an object")


def _not_finite(word: str) -> float:
    raise ValueError(f"{word} is no JSON number")


def _finite(digits: str) -> float:
    value = float(digits)
    return value if math.isfinite(value) else _not_finite(digits[:40])


_DECODER = json.JSONDecoder(strict=False, parse_constant=_not_finite, parse_float=_finite)


def _parsed(text: str) -> Any:
    try:
        return _DECODER.decode(text.strip())
    except (ValueError, RecursionError):
        return None


def _objects(text: str) -> Iterator[dict[str, Any]]:
    start, left = text.find("{"), MOST_STARTS
    while start >= 0 and left:
        left -= 1
        try:
            value, end = _DECODER.raw_decode(text, start)
        except (ValueError, RecursionError):
            end = start + 1
        else:
            if isinstance(value, dict):
                yield value
        start = text.find("{", end)


class _Color(BaseModel):
    color: Literal["red", "green", "blue", "none"]


def probe_question() -> Question:
    """Return the question: the color of a disc on white."""
    picture = Image.new("RGB", (PROBE_PX, PROBE_PX), "white")
    ImageDraw.Draw(picture).ellipse((64, 64, 192, 192), fill=(220, 30, 30))
    parts = (Picture(png_of(np.asarray(picture))), "Which color has the disc in this picture?")
    return Question("probe", "You look at pictures and answer in JSON.", parts, strict_schema(_Color))


def probe(chat: ChatModel) -> str:
    """Ask the question and return what works, as a short phrase; raises what ``chat`` raises.

    A wrong color is said, not raised: it is the model's eyesight, not its connection.
    """
    seen = ask(chat, probe_question(), _Color).value.color
    sight = "" if seen == "red" else f", but sees {seen} where red is"
    return f"{chat.model} answers JSON about a picture{sight}"
