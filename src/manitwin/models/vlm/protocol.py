"""Protocol of chat models: questions with pictures to a vision-language model, and its replies."""

from __future__ import annotations

import json
from dataclasses import dataclass
from hashlib import sha256
from typing import Any, Literal, Protocol


@dataclass(frozen=True)
class Picture:
    """A picture in a question, as PNG."""

    png: bytes


@dataclass(frozen=True)
class Question:
    """A question: system ``instructions``, text and pictures in order, and the JSON schema of the answer.

    ``name`` is the name of the schema (``[a-z_]+``). ``vote`` distinguishes equal questions that are asked independently.
    """

    name: str
    instructions: str
    parts: tuple[str | Picture, ...]
    schema: dict[str, Any]
    vote: int = 0


@dataclass(frozen=True)
class Turn:
    """A turn after the question: an answer, or a correction of it."""

    role: Literal["assistant", "user"]
    text: str


@dataclass(frozen=True)
class Usage:
    """Input and output tokens, as counted by the server."""

    input_tokens: int
    output_tokens: int


@dataclass(frozen=True)
class Reply:
    """The text of an answer; ``model`` is the server's name of the model."""

    text: str
    usage: Usage
    model: str


class ChatModel(Protocol):
    """Protocol of a model that answers questions.

    ``ask`` raises AccessDenied, RateLimited, Unavailable, or BadReply for an answer that is truncated, refused or empty.
    """

    name: str
    model: str

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        """Answer a question, given the turns that followed it."""
        ...


def question_digest(question: Question, turns: tuple[Turn, ...] = ()) -> str:
    """Return the SHA-256 of a question and the turns after it: name, instructions, texts, pictures, ordered schema, and vote."""
    said: list[Any] = [question.name, question.instructions, question.schema, question.vote]
    said.append([part if isinstance(part, str) else {"png": sha256(part.png).hexdigest()} for part in question.parts])
    said.append([[turn.role, turn.text] for turn in turns])
    return sha256(json.dumps(said, ensure_ascii=True, separators=(",", ":")).encode("ascii")).hexdigest()
