"""Structured answers: parsed leniently, validated strictly, and asked for once more if something is wrong."""

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
from manitwin.models.vlm.client import ForgettingChat
from manitwin.models.vlm.protocol import ChatModel, Picture, Question, Turn
from manitwin.models.vlm.strict_schema import strict_schema

T = TypeVar("T", bound=BaseModel)
MAX_COMPLAINTS = 12
MOST_STARTS = (
    1000  # maximum number of braces at which an object is parsed, since each attempt may read to the end of the text
)
# reasoning models (Qwen, DeepSeek) write their reasoning before the answer
_THINKING, _THOUGHT = "<think>", "</think>"
# control characters, bidirectional controls (Unicode's Bidi_Control), and lone UTF-16 surrogates
_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]+")
_FENCE = "```"
_AFTER_FENCE = re.compile(r"[a-zA-Z]*[^\S\n]*\n")
PROBE_PX = 256
SHOWN_CHARACTERS = 80
LONGEST_COMPLAINT = 240
"""Characters of an error that are shown to the user; the model gets all of it."""


@dataclass(frozen=True)
class ValidatedAnswer(Generic[T]):
    """A valid answer, and the remaining findings about its content."""

    value: T
    findings: tuple[str, ...]


def no_findings(value: BaseModel) -> Sequence[str]:
    """Report no findings about an answer."""
    return ()


def ask(
    chat: ChatModel, question: Question, answer: type[T], examine: Callable[[T], Sequence[str]] = no_findings
) -> ValidatedAnswer[T]:
    """Ask a question and return its answer as an instance of ``answer``.

    If the answer cannot be parsed or validated, the model is asked once more with the error; if that fails too, BadReply is
    raised. If ``examine`` returns findings, the model is asked once more with them; findings about the second answer are
    returned for the caller to decide. Raises the errors of ``chat``.
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
                return ValidatedAnswer(value, findings)
            examined = True
            said = _listed(
                "Please check your answer again. It contradicts what is known:",
                findings,
                "Correct what is wrong, keep what you are sure of, and answer with the whole JSON object and nothing else.",
            )
        turns += (Turn("assistant", reply.text), Turn("user", said))


def complaints(error: ValueError) -> list[str]:
    """Return the errors of an answer, one line each, with the location first."""
    if not isinstance(error, ValidationError):
        return [str(error)]
    found = []
    for detail in error.errors(include_url=False):
        place = ".".join(map(str, detail["loc"])) or "the answer"
        found.append(f"{place}: {detail['msg']}, not {str(detail['input'])[:80]!r}")
    return found[:MAX_COMPLAINTS]


def _without_the_middle(line: str) -> str:
    """Shorten a long error for display to its beginning (the location) and its end (the actual value)."""
    half = LONGEST_COMPLAINT // 2
    return line if len(line) <= LONGEST_COMPLAINT else f"{line[:half]} ... {line[-half:]}"


def _listed(opening: str, lines: Sequence[str], closing: str) -> str:
    return "\n".join([opening, *(f"- {line}" for line in lines), closing])


def _forget(chat: ChatModel, question: Question, turns: tuple[Turn, ...]) -> None:
    # cached answers of a failed conversation would make it fail again
    if isinstance(chat, ForgettingChat):
        for length in range(0, len(turns) + 1, 2):
            chat.forget(question, turns[:length])


def json_object_in(text: str) -> dict[str, Any]:
    """Return the JSON object in a text: alone, in a code fence, or surrounded by words.

    Control characters inside strings are accepted (xgrammar permits them under ``maxLength``) and replaced by spaces, because
    the text may be shown on a terminal. Of several objects the last one counts, since models correct themselves in that
    order. Raises ValueError with the reason. The run time is bounded by the length of the text, whatever it contains.
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
    """Return the contents of code fences, in order."""
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
    """Return the last JSON object in a text: the text itself, a code fence, or an object within words."""
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
    """Yield the JSON objects that start at the braces of a text, at most MOST_STARTS attempts."""
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
    """Return the test question: the color of a disc on white."""
    picture = Image.new("RGB", (PROBE_PX, PROBE_PX), "white")
    ImageDraw.Draw(picture).ellipse((64, 64, 192, 192), fill=(220, 30, 30))
    parts = (Picture(png_of(np.asarray(picture))), "Which color has the disc in this picture?")
    return Question("probe", "You look at pictures and answer in JSON.", parts, strict_schema(_Color))


def probe(chat: ChatModel) -> str:
    """Ask the test question and return the result as a short phrase; raises the errors of ``chat``.

    A wrong color is reported, not raised, because it says something about the model, not about the connection.
    """
    seen = ask(chat, probe_question(), _Color).value.color
    sight = "" if seen == "red" else f", but sees {seen} where red is"
    return f"{chat.model} answers JSON about a picture{sight}"
