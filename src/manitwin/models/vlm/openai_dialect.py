"""Differences between servers of the chat completions API, learned from their refusals.

Every server accepts most of https://platform.openai.com/docs/api-reference/chat/create: reasoning models accept no
``max_tokens`` and only their own temperature; Ollama accepts only ``max_tokens``
(https://docs.ollama.com/api/openai-compatibility); some accept no ``response_format``, or only ``json_object``.
"""

from __future__ import annotations

import base64
import json
import re
from dataclasses import dataclass, replace
from typing import Any, Literal

from manitwin.models.vlm.protocol import Picture, Question, Turn

# messages about an unsupported field: OpenAI, vLLM and other pydantic servers, Gemini, transformers serve
_NOT_TAKEN = re.compile(
    r"unsupported|not support|not available|unknown|unrecogni[sz]ed|unexpected|extra inputs|not permitted|not allowed"
    r"|cannot find field|invalid parameter|invalid value|supported values|only the default|deprecated"
)
_FORMATS: tuple[Literal["json_schema", "json_object", "prompt"], ...] = ("json_schema", "json_object", "prompt")


@dataclass(frozen=True)
class Dialect:
    """Fields that a server accepts, as far as known; ``format`` is how the form of the answer is specified."""

    format: Literal["json_schema", "json_object", "prompt"] = "json_schema"
    length_fields: tuple[str, ...] = ("max_tokens", "max_completion_tokens")
    temperature: bool = True
    seed: bool = True

    def without(self, complaint: str) -> Dialect | None:
        """Return the dialect without the field that a complaint refuses; None if it names no field that can be left out."""
        words = complaint.lower()
        if not _NOT_TAKEN.search(words) or "invalid schema" in words:
            return None
        if self.temperature and "temperature" in words:
            return replace(self, temperature=False)
        if self.seed and re.search(r"\bseed\b", words):
            return replace(self, seed=False)
        if len(self.length_fields) > 1 and re.search(rf"\b{self.length_fields[0]}\b", words):
            return replace(self, length_fields=self.length_fields[1:])
        if self.format != "prompt" and re.search(r"response_format|json_schema|json_object|structured", words):
            return replace(self, format=_FORMATS[_FORMATS.index(self.format) + 1])
        return None


def request_body(
    question: Question,
    turns: tuple[Turn, ...],
    dialect: Dialect,
    *,
    model: str,
    max_tokens: int,
    temperature: float | None,
) -> dict[str, Any]:
    """Return the body of a chat completions request.

    The schema is also part of the instructions, because a server that only constrains decoding with it does not show the
    model its descriptions and limits (as https://docs.ollama.com/capabilities/structured-outputs advises). ``seed`` is the
    question's vote.
    """
    body: dict[str, Any] = {"model": model, "messages": messages(question, turns)}
    body[dialect.length_fields[0]] = max_tokens
    if dialect.temperature and temperature is not None:
        body["temperature"] = temperature
    if dialect.seed:
        body["seed"] = question.vote
    if dialect.format == "json_schema":
        described = {"name": question.name, "strict": True, "schema": question.schema}
        body["response_format"] = {"type": "json_schema", "json_schema": described}
    elif dialect.format == "json_object":
        body["response_format"] = {"type": "json_object"}
    return body


def messages(question: Question, turns: tuple[Turn, ...]) -> list[dict[str, Any]]:
    """Return the messages of a question and the turns after it; pictures are data URLs in full detail."""
    return [
        {"role": "system", "content": instructions_with_schema(question)},
        {"role": "user", "content": [_content(part) for part in question.parts]},
        *({"role": turn.role, "content": turn.text} for turn in turns),
    ]


def instructions_with_schema(question: Question) -> str:
    """Return the instructions of a question, followed by the JSON schema of its answer."""
    schema = json.dumps(titled_schema(question), ensure_ascii=False)
    form = "Answer with one JSON object that follows this JSON schema, and nothing else:"
    return f"{question.instructions}\n\n{form}\n{schema}"


def titled_schema(question: Question) -> dict[str, Any]:
    """Return the schema of a question's answer with the question's name as title, for APIs that name it nowhere else."""
    return {"title": question.name, **question.schema}


def _content(part: str | Picture) -> dict[str, Any]:
    if isinstance(part, str):
        return {"type": "text", "text": part}
    url = f"data:image/png;base64,{base64.b64encode(part.png).decode('ascii')}"
    return {"type": "image_url", "image_url": {"url": url, "detail": "high"}}
