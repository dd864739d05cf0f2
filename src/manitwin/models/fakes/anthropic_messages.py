"""Fake server of Anthropic's Messages API.

Contract: https://docs.claude.com/en/api/messages, errors https://docs.claude.com/en/api/errors, pictures
https://docs.claude.com/en/docs/vision, ``output_config.format``
https://platform.claude.com/docs/en/build-with-claude/structured-outputs (2026). The refusal of an account without credit follows
https://github.com/anthropics/claude-code/issues/66314, that of a temperature https://github.com/RooCodeInc/Roo-Code/issues/12162.
Unverified: the error messages for missing headers and invalid pictures.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from manitwin.models.fakes.chat import Answer, ChatRequest, anthropic_complaint, hang, write
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.server import Request, Response
from manitwin.models.fakes.vlm_answers import rehearsal_answer

FIELDS = frozenset({
    "cache_control", "container", "inference_geo", "max_tokens", "messages", "metadata", "model", "output_config",
    "service_tier", "stop_sequences", "stream", "system", "temperature", "thinking", "tool_choice", "tools", "top_k",
    "top_p",
})  # fmt: skip
VERSIONS = ("2023-01-01", "2023-06-01")
MAX_BODY_BYTES = 32 << 20
MAX_PICTURE_BYTES = 5 << 20
MAX_PICTURES = 100
MAX_SIDE_PX, MANY_PICTURES, MAX_SIDE_OF_MANY_PX = 8000, 20, 2000
_STOPPED = {"end": "end_turn", "length": "max_tokens", "refusal": "refusal"}


class FakeAnthropic:
    """Messages API at ``/v1/messages``.

    ``models`` lists the available models (default: any), ``structured`` whether they support structured outputs, ``sampling``
    whether they accept a temperature. ``retry_after`` is the header value of the fault ``rate_limited``; ``hang_s`` is the
    duration of the fault ``hangs``.
    """

    def __init__(
        self,
        faults: Faults | None = None,
        key: str = "rehearsal-key",
        answer: Answer = rehearsal_answer,
        *,
        models: Sequence[str] | None = None,
        structured: bool = True,
        sampling: bool = True,
        retry_after: str = "1",
        hang_s: float = 3600.0,
    ):
        self._faults, self._key, self._answer = faults or Faults(), key, answer
        self._models, self._structured, self._sampling = models, structured, sampling
        self._retry_after, self._hang_s = retry_after, hang_s

    def answer(self, request: Request, base_url: str) -> Response:
        """Answer a request."""
        refused = self._refused(request)
        if refused is not None:
            return refused
        if (request.method, request.path) != ("POST", "/v1/messages"):
            return _error(404, "not_found_error", "Not found")
        try:
            body = json.loads(request.body)
            if not isinstance(body, dict):
                raise ValueError("no object")
        except ValueError:
            return _error(400, "invalid_request_error", "The request body is not valid JSON")
        asked = ChatRequest()
        complaint = self._complaint_of_fields(body) or self._complaint_of_format(body, asked) or _read(body, asked)
        if complaint is not None:
            return _error(400, "invalid_request_error", complaint)
        if self._models is not None and body["model"] not in self._models:
            return _error(404, "not_found_error", f"model: {body['model']}")
        written = write(asked, self._answer, self._faults)
        refusal = written.stopped == "refusal"
        message = {
            "id": "msg_rehearsal",
            "type": "message",
            "role": "assistant",
            "model": body["model"],
            "content": [{"type": "text", "text": written.text}] if written.text and not refusal else [],
            "stop_reason": _STOPPED[written.stopped],
            "stop_sequence": None,
            "usage": {"input_tokens": asked.tokens(), "output_tokens": written.tokens},
        }
        return Response(body=message, cut_after=20 if self._faults.strike("disconnects") else None)

    def _refused(self, request: Request) -> Response | None:
        faults = self._faults
        if request.headers.get("x-api-key") != self._key or faults.strike("unauthorized"):
            return _error(401, "authentication_error", "invalid x-api-key")
        if "anthropic-version" not in request.headers:
            return _error(400, "invalid_request_error", "anthropic-version: header is required")
        if request.headers["anthropic-version"] not in VERSIONS:
            return _error(400, "invalid_request_error", "anthropic-version: not a valid version")
        if len(request.body) > MAX_BODY_BYTES:
            return _error(413, "request_too_large", "Request exceeds the maximum size")
        if faults.strike("hangs"):
            hang(self._hang_s)
        if faults.strike("out_of_credit"):
            said = (
                "Your credit balance is too low to access the Anthropic API. Please go to Plans & Billing to upgrade or"
                " purchase credits."
            )
            return _error(400, "invalid_request_error", said)
        if faults.strike("rate_limited"):
            said = "This request would exceed your organization's rate limit."
            return _error(429, "rate_limit_error", said, {"Retry-After": self._retry_after})
        if faults.strike("server_error"):
            return _error(529, "overloaded_error", "Overloaded")
        return None

    def _complaint_of_fields(self, body: dict[str, Any]) -> str | None:
        unknown = sorted(set(body) - FIELDS)
        if unknown:
            return f"{unknown[0]}: Extra inputs are not permitted"
        for name in ("model", "max_tokens", "messages"):
            if name not in body:
                return f"{name}: Field required"
        if not isinstance(body["max_tokens"], int) or body["max_tokens"] < 1:
            return "max_tokens: Input should be greater than or equal to 1"
        temperature = body.get("temperature")
        if temperature is not None:
            if not self._sampling:
                return "`temperature` is deprecated for this model."
            if not isinstance(temperature, int | float) or not 0 <= temperature <= 1:
                return "temperature: range: 0..1"
        return None

    def _complaint_of_format(self, body: dict[str, Any], asked: ChatRequest) -> str | None:
        if "output_config" not in body:
            return None
        if not self._structured or self._faults.strike("no_json_schema"):
            return "output_config: structured outputs are not supported by this model"
        config = body["output_config"]
        if not isinstance(config, dict) or set(config) - {"format", "effort", "task_budget"}:
            return "output_config: Extra inputs are not permitted"
        wanted = config.get("format")
        if wanted is None:
            return None
        if not isinstance(wanted, dict) or set(wanted) != {"type", "schema"} or wanted["type"] != "json_schema":
            return "output_config.format: Input should be {'type': 'json_schema', 'schema': {...}}"
        if not isinstance(wanted["schema"], dict):
            return "output_config.format.schema: Input should be an object"
        complaint = anthropic_complaint(wanted["schema"])
        asked.schema = wanted["schema"]
        return f"output_config.format.schema: {complaint}" if complaint else None


def _read(body: dict[str, Any], asked: ChatRequest) -> str | None:
    system, messages = body.get("system", ""), body["messages"]
    blocks = [{"type": "text", "text": system}] if isinstance(system, str) else system
    if not isinstance(blocks, list) or not all(isinstance(b, dict) and b.get("type") == "text" for b in blocks):
        return "system: Input should be a string or a list of text blocks"
    asked.texts += [block["text"] for block in blocks if block["text"]]
    if not isinstance(messages, list) or not messages:
        return "messages: at least one message is required"
    for index, message in enumerate(messages):
        where = f"messages.{index}"
        if not isinstance(message, dict) or message.get("role") not in ("user", "assistant"):
            return f"{where}.role: Input should be 'user' or 'assistant'"
        content = message.get("content")
        parts = [{"type": "text", "text": content}] if isinstance(content, str) else content
        if set(message) != {"role", "content"} or not isinstance(parts, list) or not parts:
            return f"{where}.content: Input should be a string or a list of blocks"
        for place, part in enumerate(parts):
            complaint = _read_block(part, message["role"], asked)
            if complaint is not None:
                return f"{where}.content.{place}.{complaint}"
    if messages[0]["role"] != "user":
        return "messages: first message must use the 'user' role"
    if messages[-1]["role"] == "assistant":
        return "This model does not support assistant message prefill. The conversation must end with a user message."
    if len(asked.pictures) > MAX_PICTURES:
        return f"messages: more than {MAX_PICTURES} images"
    side_px = MAX_SIDE_OF_MANY_PX if len(asked.pictures) > MANY_PICTURES else MAX_SIDE_PX
    return f"messages: an image is larger than {side_px} pixels" if asked.longest_side_px > side_px else None


def _read_block(part: Any, role: str, asked: ChatRequest) -> str | None:
    if not isinstance(part, dict):
        return "type: Input should be an object"
    if part.get("type") == "text":
        if not isinstance(part.get("text"), str) or not part["text"].strip():
            return "text: text content blocks must be non-empty"
        asked.texts.append(part["text"])
        return None
    source = part.get("source")
    if part.get("type") != "image" or role != "user" or not isinstance(source, dict):
        return "type: Input tag is not expected"
    if source.get("type") != "base64" or set(source) != {"type", "media_type", "data"}:
        return "image.source: this server reads base64 only"
    if len(source["data"]) > MAX_PICTURE_BYTES:
        return "image.source.base64: image exceeds 5 MB maximum"
    complaint = asked.picture(source["media_type"], source["data"])
    return f"image.source.base64.data: {complaint}" if complaint else None


def _error(status: int, kind: str, message: str, headers: dict[str, str] | None = None) -> Response:
    body = {"type": "error", "error": {"type": kind, "message": message}, "request_id": "req_rehearsal"}
    return Response(status, body, headers or {})
