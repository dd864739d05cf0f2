"""Parsing of answers of a chat completions server, and remedies for its refusals."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

_PICTURES = re.compile(r"image|vision|multi-?modal|picture", re.IGNORECASE)
_CONTEXT = re.compile(r"context (?:length|window|size)|maximum context|too many tokens|n_ctx", re.IGNORECASE)
NOT_THERE = "check the model's name, and the address: that of most servers ends in /v1"


def text_of(content: Any) -> str | None:
    """Return the text of a message's content, a string or a list of parts (Mistral); None for another form."""
    if content is None or isinstance(content, str):
        return content or ""
    if not isinstance(content, list) or not all(isinstance(part, dict) for part in content):
        return None
    said = [part.get("text") for part in content if part.get("type") == "text"]
    return "".join(said) if said and all(isinstance(each, str) for each in said) else None


def is_reasoning_only(message: Mapping[str, Any], text: str) -> bool:
    """Tell whether a model returned only its reasoning: vLLM and others return reasoning beside an empty answer."""
    thoughts = [message.get(name) for name in ("reasoning_content", "reasoning")]
    return not text.strip() and any(isinstance(each, str) and each.strip() for each in thoughts)


def refusal_remedy(words: str) -> str | None:
    """Return the remedy for a refused request by the server's message; None for an unknown message."""
    if _CONTEXT.search(words):
        return "serve it with a longer context, or ask with smaller pictures (vlm.picture_px)"
    return "choose a model that sees pictures" if _PICTURES.search(words) else None
