"""Fake of OpenAI's chat completions API, including the variants of compatible servers.

Contract: https://platform.openai.com/docs/api-reference/chat/create, fields as of the ``openai`` package 3.52 (2026); error codes
as in https://platform.openai.com/docs/guides/error-codes. Unverified: the error messages for unknown fields and invalid pictures.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from manitwin.models.fakes.chat import Answer, ChatRequest, WrittenAnswer, hang, openai_complaint, write
from manitwin.models.fakes.embeddings import embeddings_response
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.server import Request, Response
from manitwin.models.fakes.vlm_answers import rehearsal_answer

FIELDS = frozenset({
    "audio", "frequency_penalty", "function_call", "functions", "logit_bias", "logprobs", "max_completion_tokens",
    "max_tokens", "messages", "metadata", "modalities", "model", "moderation", "n", "parallel_tool_calls",
    "prediction", "presence_penalty", "prompt_cache_key", "prompt_cache_options", "prompt_cache_retention",
    "reasoning_effort", "response_format", "safety_identifier", "seed", "service_tier", "stop", "store", "stream",
    "stream_options", "temperature", "tool_choice", "tools", "top_logprobs", "top_p", "user", "verbosity",
    "web_search_options",
})  # fmt: skip
RANGES = {
    "temperature": (0, 2),
    "max_tokens": (1, 1 << 20),
    "max_completion_tokens": (1, 1 << 20),
    "seed": (-(1 << 63), 1 << 63),
}
_DATA_URL = re.compile(r"data:(image/[a-z]+);base64,(.*)", re.DOTALL)
_DETAILS = ("auto", "low", "high", "original")


class FakeOpenAi:
    """Chat completions and embeddings at ``/v1``.

    ``models`` lists the available models (default: any); ``formats`` are the supported kinds of ``response_format``;
    ``reasoning`` refuses what reasoning models refuse: ``max_tokens``, and any temperature but 1. ``retry_after`` is the header
    value of the fault ``rate_limited``; ``hang_s`` is the duration of the fault ``hangs``.
    """

    def __init__(
        self,
        faults: Faults | None = None,
        key: str = "rehearsal-key",
        answer: Answer = rehearsal_answer,
        *,
        models: Sequence[str] | None = None,
        formats: Sequence[str] = ("text", "json_object", "json_schema"),
        reasoning: bool = False,
        retry_after: str = "1",
        hang_s: float = 3600.0,
    ):
        self._faults, self._key, self._answer = faults or Faults(), key, answer
        self._models, self._formats, self._reasoning = models, formats, reasoning
        self._retry_after, self._hang_s = retry_after, hang_s

    def answer(self, request: Request, base_url: str) -> Response:
        """Answer a request."""
        refused = self._refused(request)
        if refused is not None:
            return refused
        if (request.method, request.path) == ("POST", "/v1/embeddings"):
            return embeddings_response(request)
        if (request.method, request.path) != ("POST", "/v1/chat/completions"):
            return _error(404, f"Invalid URL ({request.method} {request.path})")
        try:
            body = request.json()
        except ValueError:
            return _error(400, "We could not parse the JSON body of your request.")
        if not isinstance(body, dict):
            return _error(400, "We could not parse the JSON body of your request.")
        asked = ChatRequest()
        problem = self._problem_of_fields(body) or self._problem_of_format(body, asked) or _read_messages(body, asked)
        if problem is not None:
            return problem
        written = write(asked, self._answer, self._faults)
        response = _completion(body["model"], asked, written)
        return Response(body=response, cut_after=20) if self._faults.strike("disconnects") else Response(body=response)

    def _refused(self, request: Request) -> Response | None:
        faults = self._faults
        if request.headers.get("authorization") != f"Bearer {self._key}" or faults.strike("unauthorized"):
            return _error(401, "Incorrect API key provided.", code="invalid_api_key")
        if faults.strike("hangs"):
            hang(self._hang_s)
        if faults.strike("out_of_credit"):
            said = "You exceeded your current quota, please check your plan and billing details."
            return _error(429, said, kind="insufficient_quota", code="insufficient_quota")
        if faults.strike("rate_limited"):
            headers = {"Retry-After": self._retry_after}
            return _error(429, "Rate limit reached.", kind="requests", code="rate_limit_exceeded", headers=headers)
        if faults.strike("server_error"):
            return _error(500, "The server had an error while processing your request.", kind="server_error")
        return None

    def _problem_of_fields(self, body: dict[str, Any]) -> Response | None:
        unknown = sorted(set(body) - FIELDS)
        if unknown:
            return _error(400, f"Unrecognized request argument supplied: {unknown[0]}")
        for name in ("model", "messages"):
            if name not in body:
                return _error(
                    400, f"Missing required parameter: '{name}'.", param=name, code="missing_required_parameter"
                )
        if self._models is not None and body["model"] not in self._models:
            return _error(404, f"The model '{body['model']}' does not exist.", code="model_not_found")
        if self._reasoning and "max_tokens" in body:
            said = "Unsupported parameter: 'max_tokens' is not supported with this model. Use 'max_completion_tokens' instead."
            return _error(400, said, param="max_tokens", code="unsupported_parameter")
        if self._reasoning and body.get("temperature", 1) != 1:
            said = (
                f"Unsupported value: 'temperature' does not support {body['temperature']} with this model. Only the default"
                " (1) value is supported."
            )
            return _error(400, said, param="temperature", code="unsupported_value")
        for name, (low, high) in RANGES.items():
            value = body.get(name)
            number = isinstance(value, int) or (name == "temperature" and isinstance(value, float))
            if value is not None and not (number and low <= value <= high):
                return _error(400, f"Invalid value for '{name}'.", param=name, code="invalid_value")
        return None

    def _problem_of_format(self, body: dict[str, Any], asked: ChatRequest) -> Response | None:
        wanted = body.get("response_format")
        if wanted is None:
            return None
        kind = wanted.get("type") if isinstance(wanted, dict) else None
        if kind not in ("text", "json_object", "json_schema"):
            return _error(400, "Invalid value for 'response_format.type'.", param="response_format.type")
        if kind not in self._formats or (kind == "json_schema" and self._faults.strike("no_json_schema")):
            said = f"Invalid parameter: 'response_format' of type '{kind}' is not supported with this model."
            return _error(400, said, param="response_format")
        if kind == "json_object" and "json" not in str(body["messages"]).lower():
            said = (
                "'messages' must contain the word 'json' in some form, to use 'response_format' of type 'json_object'."
            )
            return _error(400, said, param="messages")
        return _read_schema(wanted["json_schema"], asked) if kind == "json_schema" else None


def _read_schema(described: Any, asked: ChatRequest) -> Response | None:
    param = "response_format.json_schema"
    if not isinstance(described, dict) or not re.fullmatch(r"[a-zA-Z0-9_-]{1,64}", str(described.get("name", ""))):
        return _error(400, f"Invalid value for '{param}.name'.", param=f"{param}.name")
    unknown = sorted(set(described) - {"name", "description", "schema", "strict"})
    if unknown:
        return _error(400, f"Unknown parameter: '{param}.{unknown[0]}'.", param=param, code="unknown_parameter")
    schema = described.get("schema")
    complaint = openai_complaint(schema) if isinstance(schema, dict) else "it is no object."
    if described.get("strict") and complaint:
        said = f"Invalid schema for response_format '{described['name']}': {complaint}"
        return _error(400, said, param="response_format", code="invalid_json_schema")
    asked.name, asked.schema = described["name"], schema
    return None


def _read_messages(body: dict[str, Any], asked: ChatRequest) -> Response | None:
    messages = body["messages"]
    if not isinstance(messages, list) or not messages:
        return _error(400, "Invalid 'messages': empty array.", param="messages")
    for index, message in enumerate(messages):
        where = f"messages[{index}]"
        role = message.get("role") if isinstance(message, dict) else None
        if role not in ("system", "developer", "user", "assistant"):
            return _error(400, f"Invalid value for '{where}.role'.", param=f"{where}.role")
        content = message.get("content")
        parts = [{"type": "text", "text": content}] if isinstance(content, str) else content
        if not isinstance(parts, list) or not parts or set(message) - {"role", "content", "name"}:
            return _error(400, f"Invalid value for '{where}.content'.", param=f"{where}.content")
        for part in parts:
            complaint = _read_part(part, role, asked)
            if complaint is not None:
                return _error(400, f"{where}: {complaint}", param=f"{where}.content", code="invalid_value")
    return None


def _read_part(part: Any, role: str, asked: ChatRequest) -> str | None:
    if not isinstance(part, dict):
        return "a content part is no object"
    if part.get("type") == "text" and isinstance(part.get("text"), str):
        asked.texts.append(part["text"])
        return None
    image = part.get("image_url")
    if (
        part.get("type") != "image_url"
        or role != "user"
        or not isinstance(image, dict)
        or set(image) - {"url", "detail"}
    ):
        return "Invalid content part."
    if image.get("detail", "auto") not in _DETAILS:
        return f"Invalid value for 'detail'. Supported values are: {', '.join(_DETAILS)}."
    found = _DATA_URL.fullmatch(str(image.get("url")))
    if found is None:
        return "Invalid image: this server reads data URLs only."
    return asked.picture(found.group(1), found.group(2))


def _completion(model: str, asked: ChatRequest, written: WrittenAnswer) -> dict[str, Any]:
    refused = written.stopped == "refusal"
    read = asked.tokens()
    return {
        "id": "chatcmpl-rehearsal",
        "object": "chat.completion",
        "created": 0,
        "model": model,
        "choices": [
            {
                "index": 0,
                "message": {
                    "role": "assistant",
                    "content": None if refused else written.text,
                    "refusal": written.text if refused else None,
                },
                "logprobs": None,
                "finish_reason": "length" if written.stopped == "length" else "stop",
            }
        ],
        "usage": {
            "prompt_tokens": read,
            "completion_tokens": written.tokens,
            "total_tokens": read + written.tokens,
        },
    }


def _error(
    status: int,
    message: str,
    *,
    kind: str = "invalid_request_error",
    param: str | None = None,
    code: str | None = None,
    headers: dict[str, str] | None = None,
) -> Response:
    return Response(status, {"error": {"message": message, "type": kind, "param": param, "code": code}}, headers or {})
