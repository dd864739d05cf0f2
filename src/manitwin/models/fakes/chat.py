"""Shared parts of the fake chat servers: parsed requests, faulty answers, and the JSON schema subset of each vendor."""

from __future__ import annotations

import base64
import binascii
import io
import json
import math
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from PIL import Image

from manitwin.models.fakes.faults import Faults

Answer = Callable[[str, dict[str, Any], str, list[bytes]], dict[str, Any]]
"""Answers a question, given the schema's name (its title if the protocol has no other), the schema, the concatenated texts and
the pictures.
"""

# The four types that both vendors accept: https://docs.claude.com/en/docs/vision,
# https://platform.openai.com/docs/guides/images-vision
PICTURE_FORMATS = {"image/png": "PNG", "image/jpeg": "JPEG", "image/webp": "WEBP", "image/gif": "GIF"}
_SHARED = {
    "type", "description", "title", "enum", "const", "anyOf", "properties", "required", "items", "$ref", "$defs",
    "additionalProperties", "default", "format",
}  # fmt: skip
_OPENAI = _SHARED | {
    "pattern", "multipleOf", "minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum", "minItems", "maxItems",
}  # fmt: skip
_ANTHROPIC = _SHARED | {"allOf", "minItems", "pattern"}
MAX_PROPERTIES = 5000
MAX_ENUM_VALUES = 1000
MAX_DEPTH = 10


@dataclass
class ChatRequest:
    """A parsed request: texts in order, pictures, and the schema of the answer."""

    texts: list[str] = field(default_factory=list)
    pictures: list[bytes] = field(default_factory=list)
    longest_side_px: int = 0
    name: str = ""
    schema: dict[str, Any] | None = None

    def picture(self, mime: str, encoded: str) -> str | None:
        """Add a base64 picture; return an error message if it is invalid."""
        try:
            data = base64.b64decode(encoded, validate=True)
            with Image.open(io.BytesIO(data)) as image:
                image.load()
                found, side = image.format, max(image.size)
        except (binascii.Error, OSError, SyntaxError, ValueError):
            return "the image cannot be decoded"
        if PICTURE_FORMATS.get(mime) != found:
            return f"the image is {found}, not {mime}"
        self.pictures.append(data)
        self.longest_side_px = max(self.longest_side_px, side)
        return None

    def tokens(self) -> int:
        """Return an estimate of the number of tokens: one per 4 characters, and one per 28 x 28 pixels of a picture."""
        pixels = 0
        for data in self.pictures:
            with Image.open(io.BytesIO(data)) as image:
                pixels += math.ceil(image.width / 28) * math.ceil(image.height / 28)
        return pixels + sum(math.ceil(len(text) / 4) for text in self.texts)


@dataclass(frozen=True)
class WrittenAnswer:
    """A model's answer; ``stopped`` is ``end``, ``length`` or ``refusal``."""

    text: str
    stopped: str = "end"

    @property
    def tokens(self) -> int:
        """Estimated number of tokens."""
        return math.ceil(len(self.text) / 4)


def write(asked: ChatRequest, answer: Answer, faults: Faults) -> WrittenAnswer:
    """Answer a request, applying pending faults."""
    schema = asked.schema or schema_in(asked.texts)
    if faults.strike("refusal"):
        return WrittenAnswer("I'm sorry, but I can't help with that.", "refusal")
    if faults.strike("empty_answer"):
        return WrittenAnswer("")
    if faults.strike("not_json") or schema is None:
        return WrittenAnswer("It looks like a nice object, but I would rather describe it in prose.")
    if faults.strike("wrong_schema"):
        return WrittenAnswer(json.dumps({"thoughts": "something else was asked"}))
    value = answer(asked.name or str(schema.get("title", "")), schema, "\n".join(asked.texts), asked.pictures)
    if faults.strike("implausible"):
        value = _inflate_masses(value)
    text = json.dumps(value)
    return WrittenAnswer(text[: len(text) // 2], "length") if faults.strike("cut_answer") else WrittenAnswer(text)


def schema_in(texts: list[str]) -> dict[str, Any] | None:
    """Return the first JSON schema of an object that is embedded in a text, for requests without a schema field."""
    for text in texts:
        start = text.find("{")
        while start >= 0:
            try:
                value, _ = json.JSONDecoder().raw_decode(text, start)
            except ValueError:
                value = None
            if isinstance(value, dict) and value.get("type") == "object" and isinstance(value.get("properties"), dict):
                return value
            start = text.find("{", start + 1)
    return None


def hang(seconds: float) -> None:
    """Delay the answer."""
    threading.Event().wait(seconds)


def _inflate_masses(value: Any, mass: bool = False) -> Any:
    """Return an answer with all masses (keys that end in ``_kg``) multiplied by a thousand."""
    if isinstance(value, dict):
        return {key: _inflate_masses(part, mass or key.endswith("_kg")) for key, part in value.items()}
    if isinstance(value, list):
        return [_inflate_masses(part, mass) for part in value]
    return value * 1000 if mass and isinstance(value, float) else value


def openai_complaint(schema: dict[str, Any]) -> str | None:
    """Return the error message of OpenAI's strict mode for a schema; None if it is valid."""
    if schema.get("type") != "object":
        return f"schema must be a JSON Schema of 'type: \"object\"', got 'type: \"{schema.get('type')}\"'."
    properties = values = 0
    for path, part, depth in _parts(schema, (), 1):
        where = f"In context={path!r}, "
        unknown = sorted(set(part) - _OPENAI)
        if unknown:
            return f"{where}'{unknown[0]}' is not permitted."
        if part.get("type") == "object":
            if part.get("additionalProperties") is not False:
                return f"{where}'additionalProperties' is required to be supplied and to be false."
            missing = sorted(set(part.get("properties", {})) - set(part.get("required", [])))
            if missing:
                return (
                    f"{where}'required' is required to be supplied and to be an array including every key in properties."
                    f" Missing '{missing[0]}'."
                )
        elif not {"type", "anyOf", "$ref", "enum", "const"} & set(part):
            return f"{where}schema must have a 'type' key."
        properties, values = properties + len(part.get("properties", {})), values + len(part.get("enum", []))
        if depth > MAX_DEPTH or properties > MAX_PROPERTIES or values > MAX_ENUM_VALUES:
            return f"{where}schema exceeds the limits of depth, properties or enum values."
    return None


def anthropic_complaint(schema: dict[str, Any]) -> str | None:
    """Return Anthropic's error message for a schema; None if it is valid."""
    for _, part, _ in _parts(schema, (), 1):
        kind = part.get("type", "schema")
        if kind == "object" and part.get("additionalProperties") is not False:
            return "For 'object' type, 'additionalProperties' must be explicitly set to false"
        unknown = sorted(set(part) - _ANTHROPIC)
        if unknown:
            return f"For '{kind}' type, property '{unknown[0]}' is not supported"
        if part.get("minItems", 0) not in (0, 1):
            return "For 'array' type, 'minItems' values other than 0 or 1 are not supported"
        if any(isinstance(value, dict | list) for value in part.get("enum", [])):
            return "Enum values must be primitive"
    return None


def _parts(
    schema: dict[str, Any], path: tuple[str, ...], depth: int
) -> Iterator[tuple[tuple[str, ...], dict[str, Any], int]]:
    yield path, schema, depth
    for name, part in schema.get("properties", {}).items():
        yield from _parts(part, (*path, "properties", name), depth + 1)
    for name, part in schema.get("$defs", {}).items():
        yield from _parts(part, (*path, "$defs", name), depth)
    if isinstance(schema.get("items"), dict):
        yield from _parts(schema["items"], (*path, "items"), depth + 1)
    for word in ("anyOf", "allOf"):
        for index, part in enumerate(schema.get(word, [])):
            yield from _parts(part, (*path, word, str(index)), depth)
