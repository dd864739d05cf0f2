"""Client of the Messages API: Anthropic, and vLLM, which serves the same API at ``/v1/messages``.

API: https://docs.claude.com/en/api/messages and https://docs.claude.com/en/api/errors; the schema of the answer is
``output_config.format`` (https://platform.claude.com/docs/en/build-with-claude/structured-outputs). Pictures are sent as
``image/png``, one of the four supported types (https://docs.claude.com/en/docs/vision).
"""

from __future__ import annotations

import base64
import re
import time
from collections.abc import Callable
from typing import Any

from manitwin.config import ServicesConfig, VlmConfig
from manitwin.errors import ConfigError
from manitwin.models.services.http import HttpService
from manitwin.models.services.keys import bearer
from manitwin.models.services.refusal import Refusal, RequestRejected, refusal_by_status
from manitwin.models.vlm.client import Completion, ServedChat, counted_tokens
from manitwin.models.vlm.openai_dialect import instructions_with_schema, titled_schema
from manitwin.models.vlm.prices import estimated_usage
from manitwin.models.vlm.protocol import Picture, Question, Reply, Turn, Usage

ANTHROPIC_URL = "https://api.anthropic.com"
VERSION = "2023-06-01"
# an account without credit gets an invalid-request error: https://github.com/anthropics/claude-code/issues/66314
_OUT_OF_CREDIT = re.compile(r"credit balance is too low|reached your specified .* usage limits")


def _key_headers(base_url: str, key: str | None) -> dict[str, str]:
    """Return the headers with the key; other servers with this API (vLLM) read only the Authorization header."""
    if key is None:
        return {}
    own = {"x-api-key": key}
    return own if base_url == ANTHROPIC_URL else own | bearer(key)


class AnthropicMessages(ServedChat):
    """Chat with one model at one server.

    If the server refuses ``output_config``, the schema is given in the instructions instead; if it refuses ``temperature``
    (as Opus 4.7 and later do, https://github.com/anomalyco/models.dev/pull/1468), that is left out; both for all later
    requests. Errors and charges are those of ``OpenAiChat``. The API has no seed: votes differ by what is asked. Raises
    ConfigError for a temperature above 1.
    """

    name = "anthropic"
    endpoint = "/v1/messages"

    def __init__(
        self,
        model: str,
        base_url: str,
        key: str | None,
        settings: VlmConfig,
        services: ServicesConfig,
        sleep: Callable[[float], None] = time.sleep,
        *,
        key_name: str = "ANTHROPIC_API_KEY",
    ):
        if settings.temperature is not None and settings.temperature > 1:
            raise ConfigError(f"vlm.temperature is {settings.temperature}: anthropic takes 0 to 1")
        super().__init__(model, base_url.removesuffix("/v1"), settings, services, key_name)
        self._schema_taken, self._temperature_taken = True, settings.temperature is not None
        self._service = HttpService(
            self._who,
            self.base_url,
            authorization={"anthropic-version": VERSION, **_key_headers(self.base_url, key)},
            services=services,
            key=key,
            remedy=self._remedy,
            refusal=anthropic_refusal,
            sleep=sleep,
        )

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        """Answer a question, given the turns that followed it."""
        while True:
            try:
                answer = self._service.post_json(self.endpoint, self._body(question, turns))
            except RequestRejected as error:
                if not self._does_without(error.words):
                    raise
            else:
                return self._completion(answer, question).paid(self.price, self._who)

    def _does_without(self, complaint: str) -> bool:
        """Drop the field that a complaint refuses from later requests; return whether there was one."""
        words = complaint.lower()
        # a refused schema is an error of this package and must be reported
        if "format.schema:" in words:
            return False
        if self._temperature_taken and "temperature" in words:
            self._temperature_taken = False
            return True
        if self._schema_taken and re.search(r"output_config|output_format|structured output", words):
            self._schema_taken = False
            return True
        return False

    def _body(self, question: Question, turns: tuple[Turn, ...]) -> dict[str, Any]:
        body: dict[str, Any] = {
            "model": self.model,
            "max_tokens": self._settings.max_tokens,
            "system": question.instructions,
            "messages": [
                {"role": "user", "content": [_block(part) for part in question.parts]},
                *({"role": turn.role, "content": turn.text} for turn in turns),
            ],
        }
        if self._temperature_taken:
            body["temperature"] = self._settings.temperature
        if self._schema_taken:
            body["output_config"] = {"format": {"type": "json_schema", "schema": titled_schema(question)}}
        else:
            body["system"] = instructions_with_schema(question)
        return body

    def _completion(self, answer: dict[str, Any], question: Question) -> Completion:
        blocks = answer.get("content")
        if not isinstance(blocks, list) or not all(isinstance(block, dict) for block in blocks):
            raise self._service.unreadable("list of blocks in 'content': it is no message")
        texts = [block.get("text") for block in blocks if block.get("type") == "text"]
        if not all(isinstance(text, str) for text in texts):
            raise self._service.unreadable("text in its blocks: it is no message")
        text, stopped = "".join(map(str, texts)), answer.get("stop_reason")
        if not isinstance(stopped, str):
            raise self._service.unreadable("'stop_reason': it is no message")
        usage = _usage(answer.get("usage")) or estimated_usage(question, text)
        model = self._service.said(str(answer.get("model") or ""))
        return Completion(text, usage, model, self._fault(stopped))

    def _fault(self, stopped: Any) -> str | None:
        if stopped == "refusal":
            return "it refuses to answer"
        if stopped == "max_tokens":
            return f"its answer was cut at {self._settings.max_tokens} tokens; raise vlm.max_tokens (thinking counts)"
        if stopped == "model_context_window_exceeded":
            return "its answer was cut where its context ends; lower vlm.picture_px"
        return None


def anthropic_refusal(status: int, body: Any) -> Refusal | None:
    """Parse an error body ``{"type": "error", "error": {"type", "message"}}``; None for 2xx."""
    refusal = refusal_by_status(status, body)
    error = body.get("error") if isinstance(body, dict) else None
    kind = error.get("type") if isinstance(error, dict) else None
    if refusal is not None and (kind == "billing_error" or _OUT_OF_CREDIT.search(refusal.message)):
        return Refusal(refusal.message, "denied")
    return refusal


def _block(part: str | Picture) -> dict[str, Any]:
    if isinstance(part, str):
        return {"type": "text", "text": part}
    data = base64.b64encode(part.png).decode("ascii")
    return {"type": "image", "source": {"type": "base64", "media_type": "image/png", "data": data}}


def _usage(counted: Any) -> Usage | None:
    if not isinstance(counted, dict):
        return None
    # tokens of a prompt cache are counted separately, if at all; this package does not use one
    cached = [counted.get(f"cache_{kind}_input_tokens") for kind in ("creation", "read")]
    read = [counted_tokens(count) for count in (counted.get("input_tokens"), *(count or 0 for count in cached))]
    written, whole = counted_tokens(counted.get("output_tokens")), [count for count in read if count is not None]
    return Usage(sum(whole), written) if written is not None and len(whole) == len(read) else None
