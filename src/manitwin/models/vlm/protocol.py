"""Questions to a vision-language model, and its replies."""

from __future__ import annotations

import json
from dataclasses import dataclass
from hashlib import sha256
from typing import Any, Literal, Protocol


@dataclass(frozen=True)
class Picture:
    """A picture of a question, as PNG."""

    png: bytes


@dataclass(frozen=True)
class Question:
    """One question: standing ``instructions``, then text and pictures in order, and the JSON schema of the answer.

    ``name`` names the schema (``[a-z_]+``). ``vote`` tells equal questions apart that are to be asked independently.
    """

    name: str
    instructions: str
    parts: tuple[str | Picture, ...]
    schema: dict[str, Any]
    vote: int = 0


@dataclass(frozen=True)
class Turn:
    """A turn after the question: what was answered, or what was wrong with that."""

    role: Literal["assistant", "user"]
    text: str


@dataclass(frozen=True)
class Usage:
    """Tokens read and written, as the server counts them."""

    input_tokens: int
    output_tokens: int


@dataclass(frozen=True)
class Reply:
    """The text that a model wrote; ``model`` is the server's own name of what answered."""

    text: str
    usage: Usage
    model: str


class ChatModel(Protocol):
    """A model that answers questions.

    Raises AccessDenied, RateLimited, Unavailable, or BadReply for an answer that was cut, refused or empty.
    """

    name: str
    model: str

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        """Answer a question, given the turns that followed it."""
        ...


def question_digest(question: Question, turns: tuple[Turn, ...] = ()) -> str:
    """Return the SHA-256 of a question and the turns after it: instructions, texts, pictures, schema in its order, vote."""
    said: list[Any] = [question.name, question.instructions, question.schema, question.vote]
    said.append([part if isinstance(part, str) else {"png": sha256(part.png).hexdigest()} for part in question.parts])
    said.append([[turn.role, turn.text] for turn in turns])
    return sha256(json.dumps(said, ensure_ascii=True, separators=(",", ":")).encode("ascii")).hexdigest()
