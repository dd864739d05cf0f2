"""Questions about pictures, as the package asks them, and chat models that count what they are asked."""

from __future__ import annotations

import io
from typing import Any, Literal

import numpy as np
from PIL import Image
from pydantic import BaseModel, Field
from tiny_engine import MODEL

from manitwin.config import ServicesConfig, VlmConfig
from manitwin.models.vlm.anthropic_messages import AnthropicMessages
from manitwin.models.vlm.client import ChatClient
from manitwin.models.vlm.openai_chat import OpenAiChat
from manitwin.models.vlm.protocol import ChatModel, Picture, Question, Reply, Turn
from manitwin.models.vlm.strict_schema import strict_schema
from manitwin.models.vlm.structured import json_object_in

Protocol = Literal["openai", "anthropic"]

SETTINGS = VlmConfig(max_tokens=2048, temperature=1.0)
"""At temperature 0 random weights repeat one word for ever; at 1 they soon come to an end."""


class Part(BaseModel):
    """What a schema nests: a number that is one of some, and free words."""

    label: str
    view: Literal["front", "back"]
    id: Literal["3", "17", "41"]


class Judgement(BaseModel):
    """An answer with all that the schemas of this package have, and limits that any answer keeps."""

    single_object: bool
    quality: Literal["good", "bad", "unsure"]
    views_seen: int
    mass_kg: float
    best: Part
    parts: list[Part]
    shown: str = Field(description="what the pictures show")


def noise(seed: int, side_px: int) -> Picture:
    """A square picture of random pixels."""
    pixels = np.random.default_rng(seed).integers(0, 256, (side_px, side_px, 3), dtype=np.uint8)
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    return Picture(stream.getvalue())


def picture_question(
    count: int, *, side_px: int = 112, seed: int = 0, vote: int = 0, answer: type[BaseModel] = Judgement
) -> Question:
    """A question with so many pictures; another ``seed``, other pictures."""
    pictures = tuple(noise(1000 * seed + number, side_px) for number in range(count))
    parts = (*pictures, "What do the pictures show?")
    return Question("judgement", "You look at pictures and answer in JSON.", parts, strict_schema(answer), vote)


def chat_at(
    url: str,
    protocol: Protocol,
    *,
    model: str = MODEL,
    settings: VlmConfig = SETTINGS,
    services: ServicesConfig | None = None,
    waits: list[float] | None = None,
) -> ChatClient:
    """A client of the server at ``url``; how long it would wait is added to ``waits``."""
    services = services or ServicesConfig()
    sleep = [].append if waits is None else waits.append
    if protocol == "openai":
        return OpenAiChat(model, f"{url}/v1", None, settings, services, sleep)
    return AnthropicMessages(model, url, None, settings, services, sleep)


class Overheard:
    """A chat model that keeps what was asked of ``inner`` and answered."""

    def __init__(self, inner: ChatModel):
        self.inner, self.name, self.model = inner, inner.name, inner.model
        self.asked: list[tuple[Question, tuple[Turn, ...]]] = []
        self.replies: list[Reply] = []

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        """Answer as ``inner`` does."""
        self.asked.append((question, turns))
        reply = self.inner.ask(question, turns)
        self.replies.append(reply)
        return reply

    def last(self, name: str) -> dict[str, Any]:
        """Return the last answer to the question of that name."""
        index = max(index for index, (question, _) in enumerate(self.asked) if question.name == name)
        return json_object_in(self.replies[index].text)
