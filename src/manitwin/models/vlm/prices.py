"""Token prices, and estimates of the number of tokens."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

from manitwin.config import ServicesConfig
from manitwin.errors import ConfigError
from manitwin.models.services.keys import is_local
from manitwin.models.vlm.protocol import Picture, Question, Usage


@dataclass(frozen=True)
class TokenPrice:
    """Price in dollars per million tokens read (input) and written (output)."""

    read_usd_per_million: float
    written_usd_per_million: float

    def usd(self, usage: Usage) -> float:
        """Return the cost of a usage in dollars."""
        return (
            usage.input_tokens * self.read_usd_per_million + usage.output_tokens * self.written_usd_per_million
        ) / 1e6


# approximate, for English
CHARACTERS_PER_TOKEN = 4
FREE = TokenPrice(0.0, 0.0)


def token_price(model: str, base_url: str, services: ServicesConfig) -> TokenPrice:
    """Return the price from the settings; without one, a server on this machine is free.

    Raises ConfigError if the price is unknown, because cost limits could not be enforced.
    """
    if services.usd_per_million_tokens is not None:
        return TokenPrice(*services.usd_per_million_tokens)
    if is_local(base_url):
        return FREE
    raise ConfigError(
        f"what {model} at {base_url} costs is not known: set services.usd_per_million_tokens = [read, written] to the"
        " dollars of your plan ([0, 0] for a server of your own)"
    )


def expected_usd(price: TokenPrice, *, characters: int, pictures: int, picture_px: int, answer_tokens: int) -> float:
    """Return the approximate cost of a question with this much text and this many square pictures."""
    read = math.ceil(characters / CHARACTERS_PER_TOKEN) + pictures * picture_tokens(picture_px, picture_px)
    return price.usd(Usage(read, answer_tokens))


def estimated_usage(question: Question, answer: str) -> Usage:
    """Return the approximate tokens of a question and its answer, for a server that does not count them."""
    texts = [question.instructions, str(question.schema), *(p for p in question.parts if isinstance(p, str))]
    pictures = [png_size(p.png) for p in question.parts if isinstance(p, Picture)]
    read = math.ceil(sum(map(len, texts)) / CHARACTERS_PER_TOKEN) + sum(picture_tokens(*size) for size in pictures)
    return Usage(read, math.ceil(len(answer) / CHARACTERS_PER_TOKEN))


def picture_tokens(width_px: int, height_px: int) -> int:
    """Return the approximate tokens of a picture: one per 28 x 28 pixels.

    This is Anthropic's rule (https://platform.claude.com/docs/en/build-with-claude/vision), up to 1,568 or, for models with
    high-resolution input, 4,784. OpenAI (https://platform.openai.com/docs/guides/images-vision) counts 85 plus 170 per tile
    of 512 px (gpt-4o), or one per 32 x 32 pixels (gpt-4.1), its smaller models up to 2.5 times that. Charges use the server's
    count, not this estimate.
    """
    return math.ceil(width_px / 28) * math.ceil(height_px / 28)


def png_size(png: bytes) -> tuple[int, int]:
    """Return width and height of a PNG, from its IHDR chunk (PNG specification, section 11.2.1)."""
    width, height = struct.unpack(">II", png[16:24])
    return width, height
