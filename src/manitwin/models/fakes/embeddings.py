"""Fake of OpenAI's embeddings API with bag-of-words vectors, so that texts that share words are similar.

Contract: https://platform.openai.com/docs/api-reference/embeddings/create, fields as of the ``openai`` package 3.52 (2026).
"""

from __future__ import annotations

import re
import zlib
from typing import Any

from manitwin.models.fakes.server import Request, Response

LENGTH = 64
MOST_TEXTS = 2048
FIELDS = frozenset({"input", "model", "dimensions", "encoding_format", "user"})


def embeddings_response(request: Request) -> Response:
    """Answer ``POST /v1/embeddings`` with a vector of 64 numbers per text."""
    try:
        body = request.json()
    except ValueError:
        body = None
    texts = body.get("input") if isinstance(body, dict) else None
    texts = [texts] if isinstance(texts, str) else texts
    if not isinstance(body, dict) or not isinstance(body.get("model"), str) or set(body) - FIELDS:
        return _refused("Give 'model' and 'input', and nothing unknown.")
    if (
        not isinstance(texts, list)
        or not 0 < len(texts) <= MOST_TEXTS
        or not all(isinstance(t, str) and t for t in texts)
    ):
        return _refused("'$.input' is invalid.")
    data: list[dict[str, Any]] = [
        {"object": "embedding", "index": place, "embedding": vector_of(text)} for place, text in enumerate(texts)
    ]
    tokens = sum(len(text.split()) for text in texts)
    usage = {"prompt_tokens": tokens, "total_tokens": tokens}
    return Response(body={"object": "list", "data": data, "model": body["model"], "usage": usage})


def _refused(message: str) -> Response:
    return Response(400, {"error": {"message": message, "type": "invalid_request_error", "param": None, "code": None}})


def vector_of(text: str) -> list[float]:
    """Return a unit vector of hashed word counts; its first component counts 1 for every text."""
    counts = [1.0] + [0.0] * (LENGTH - 1)
    for word in re.findall(r"\w+", text.lower()):
        counts[1 + zlib.crc32(word.encode()) % (LENGTH - 1)] += 1.0
    length = sum(count * count for count in counts) ** 0.5
    return [count / length for count in counts]
