"""What the fakes of both chat protocols have in common: reading a question, and spoiling an answer."""

from __future__ import annotations

import base64
import binascii
import io
import json
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from PIL import Image

from manitwin.models.fakes.faults import Faults

Answer = Callable[[str, dict[str, Any], str, list[bytes]], dict[str, Any]]
"""Answers a question: the schema's name (its title where the protocol has no other), the schema, all that was said, the
pictures."""

# the four types that both vendors read: https://docs.claude.com/en/docs/vision, https://platform.openai.com/docs/guides/images-vision
PICTURE_FORMATS = {"image/png": "PNG", "image/jpeg": "JPEG", "image/webp": "WEBP", "image/gif": "GIF"}


@dataclass
class Asked:
    """What a request says: texts in order, pictures, and the schema of the answer."""

    texts: list[str] = field(default_factory=list)
    pictures: list[bytes] = field(default_factory=list)
    longest_side_px: int = 0
    name: str = ""
    schema: dict[str, Any] | None = None

    def picture(self, mime: str, encoded: str) -> str | None:
        """Take in a picture in base64; return what is wrong with it."""
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
        """Return about how many tokens it has: 4 characters each, and one for each 28 x 28 pixels of a picture."""
        pixels = 0
        for data in self.pictures:
            with Image.open(io.BytesIO(data)) as image:
                pixels += math.ceil(image.width / 28) * math.ceil(image.height / 28)
        return pixels + sum(math.ceil(len(text) / 4) for text in self.texts)


@dataclass(frozen=True)
class Written:
    """What a model writes: ``stopped`` is ``end``, ``length`` or ``refusal``."""

    text: str
    stopped: str = "end"

    @property
    def tokens(self) -> int:
        """About how many tokens it has."""
        return math.ceil(len(self.text) / 4)


def write(asked: Asked, answer: Answer, faults: Faults) -> Written:
    """Answer what was asked, with the faults that strike."""
    schema = asked.schema or schema_in(asked.texts)
    if faults.strike("refusal"):
        return Written("I'm sorry, but I can't help with that.", "refusal")
    if faults.strike("empty_answer"):
        return Written("")
    if faults.strike("not_json") or schema is None:
        return Written("It looks like a nice object, but I would rather describe it in prose.")
    if faults.strike("wrong_schema"):
        return Written(json.dumps({"thoughts": "something else was asked"}))
    value = answer(asked.name or str(schema.get("title", "")), schema, "\n".join(asked.texts), asked.pictures)
    if faults.strike("implausible"):
        value = _far_too_heavy(value)
    text = json.dumps(value)
    return Written(text[: len(text) // 2], "length") if faults.strike("cut_answer") else Written(text)


def schema_in(texts: list[str]) -> dict[str, Any] | None:
    """Return the JSON schema of an object that stands in a text, where none is given otherwise."""
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
    """Keep whoever asked waiting."""
    threading.Event().wait(seconds)


def _far_too_heavy(value: Any, mass: bool = False) -> Any:
    """Return an answer whose masses (keys that end in ``_kg``) are a thousand times theirs."""
    if isinstance(value, dict):
        return {key: _far_too_heavy(part, mass or key.endswith("_kg")) for key, part in value.items()}
    if isinstance(value, list):
        return [_far_too_heavy(part, mass) for part in value]
    return value * 1000 if mass and isinstance(value, float) else value
