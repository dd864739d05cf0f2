"""A chat model behind the chat completions API: OpenAI, vLLM, SGLang, Ollama, llama.cpp, LM Studio, Gemini's own of it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

import httpx2
import openai

from manitwin.config import ServicesConfig, VlmConfig
from manitwin.errors import BadReply, ConfigError, RateLimited
from manitwin.models.services.http import http_client
from manitwin.models.services.keys import redacted
from manitwin.models.services.refusal import (
    FailedRequest,
    Refusal,
    error_for,
    refusal_by_status,
    retry_after_s,
    until_answered,
)
from manitwin.models.vlm.client import Completion, ServedChat
from manitwin.models.vlm.openai_dialect import Dialect, request_body
from manitwin.models.vlm.prices import estimated_usage
from manitwin.models.vlm.protocol import Question, Reply, Turn, Usage

OPENAI_URL = "https://api.openai.com/v1"
# all that a request is sent with: the SDK would add what OPENAI_CUSTOM_HEADERS says, to whatever server, and even let that
# replace the key; its x-stainless header tells itself that the plain response is wanted
_HEADERS = frozenset(
    {"host", "accept", "accept-encoding", "connection", "content-type", "content-length", "user-agent"}
    | {"x-stainless-raw-response"}
)
_HEADERS_OF_OPENAI = _HEADERS | {"openai-organization", "openai-project"}
# an account without credit: a 429 whose type, and mostly code, is the first one, as in
# https://github.com/OpenHands/OpenHands/issues/998; the others are unverified
OUT_OF_CREDIT = ("insufficient_quota", "billing_hard_limit_reached", "billing_not_active")


class OpenAiChat(ServedChat):
    """Ask one model at one server.

    A field that the server refuses is left out from then on (``dialect``). Raises AccessDenied; RateLimited after
    ``services.retries`` waits, or at once where it asks for more than ``services.longest_wait_s``; Unavailable after as many
    tries again; BadReply. Tokens are charged as the server counts them, also for an answer that cannot be used; what an
    answer cost that was lost on the way is not known, and not charged. The key goes to ``base_url`` only, and shows nowhere.
    """

    name = "openai"

    def __init__(
        self,
        model: str,
        base_url: str,
        key: str | None,
        settings: VlmConfig,
        services: ServicesConfig,
        sleep: Callable[[float], None] = time.sleep,
        *,
        key_name: str = "OPENAI_API_KEY",
    ):
        if key is not None and not (key.isascii() and key.isprintable() and " " not in key):
            raise ConfigError(f"{key_name} holds spaces or characters that no key has; copy it again")
        super().__init__(model, base_url, settings, services, key_name)
        self._key, self._sleep = key, sleep
        # models that reason know the newer name only, servers of others may know the older one only
        order = 1 if base_url == OPENAI_URL else -1
        self.dialect = Dialect(length_fields=("max_completion_tokens", "max_tokens")[::order])

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        """Answer a question, given the turns that followed it."""

        def attempt() -> Completion | FailedRequest:
            while True:
                outcome = self._once(question, turns)
                narrower = self.dialect.without(outcome.words) if isinstance(outcome, FailedRequest) else None
                if narrower is None:
                    return outcome
                self.dialect = narrower

        return until_answered(attempt, self._services, self._sleep).paid(self.price, self._who)

    def _once(self, question: Question, turns: tuple[Turn, ...]) -> Completion | FailedRequest:
        # errors are made here and raised outside of the handlers: those of the SDK hold the request, and with it the key
        body = request_body(
            question,
            turns,
            self.dialect,
            model=self.model,
            max_tokens=self._settings.max_tokens,
            temperature=self._settings.temperature,
        )
        try:
            with self._http() as http, self._client(http) as client:
                response = client.chat.completions.with_raw_response.create(**body).http_response
        except openai.APIStatusError as error:
            return self._refused(error.response)
        except openai.APIConnectionError as error:
            cause = redacted(str(error.__cause__ or error), self._key)
            refusal = Refusal(f"{self.base_url} does not answer ({cause or type(error.__cause__).__name__})", "down")
            return FailedRequest(error_for(self._who, refusal, None, "", None), again=True)
        return completion(response.content, question, self._who, self._key, self._settings.max_tokens)

    def _refused(self, response: httpx2.Response) -> FailedRequest:
        status = response.status_code
        try:
            body = response.json()
        except ValueError:
            body = None
        # a redirect is not followed: the key would go along
        refusal = openai_refusal(status, body) or Refusal("it redirects; give the new address after @", "bad")
        words, refusal = refusal.message, Refusal(redacted(refusal.message, self._key), refusal.kind)
        error = error_for(self._who, refusal, status, self._remedy, retry_after_s(response.headers.get("Retry-After")))
        return FailedRequest(
            error,
            again=refusal.kind in ("busy", "down"),
            wait_s=error.retry_after_s if isinstance(error, RateLimited) else None,
            words=words if status in (400, 422) else "",
        )

    def _client(self, http: httpx2.Client) -> openai.OpenAI:
        # without a key the SDK would look for one in the environment: that of OpenAI, which is not this server's
        return openai.OpenAI(api_key=self._key or "none", base_url=self.base_url, max_retries=0, http_client=http)

    def _http(self) -> httpx2.Client:
        sent = _HEADERS_OF_OPENAI if self.base_url == OPENAI_URL else _HEADERS

        def only_ours(request: httpx2.Request) -> None:
            for name in set(request.headers) - sent:
                del request.headers[name]
            if self._key:
                request.headers["Authorization"] = f"Bearer {self._key}"

        return http_client(self.base_url, self._services, only_ours)


def openai_refusal(status: int, body: Any) -> Refusal | None:
    """Read an error body ``{"error": {"message", "type", "param", "code"}}``; None for 2xx."""
    refusal = refusal_by_status(status, body)
    error = body.get("error") if isinstance(body, dict) else None
    if refusal is not None and isinstance(error, dict) and {error.get("code"), error.get("type")} & {*OUT_OF_CREDIT}:
        return Refusal(refusal.message, "denied")
    return refusal


def completion(content: bytes, question: Question, who: str, key: str | None, max_tokens: int) -> Completion:
    """Read the body of an answer (https://platform.openai.com/docs/api-reference/chat/object).

    Tokens are estimated where the server counts none (``estimated_usage``). Raises BadReply for a body of another form.
    """
    try:
        body = json.loads(content)
        choice = body["choices"][0]
        message, finish = choice["message"], choice.get("finish_reason")
        text, refused = message.get("content") or "", message.get("refusal")
        if not isinstance(text, str):
            raise TypeError("its content is no text")
    except (ValueError, RecursionError, LookupError, TypeError, AttributeError) as error:
        said = redacted(content[:10_000].decode(errors="replace"), key)
        cause = f"{type(error).__name__}: {redacted(str(error), key)}"
    else:
        counted = _usage(body.get("usage")) or estimated_usage(question, text)
        model = redacted(str(body.get("model") or ""), key)
        return Completion(text, counted, model, _fault(finish, refused, key, max_tokens))
    raise BadReply(f"{who}: its answer is no chat completion ({cause}): {said!r}")


def _fault(finish: Any, refused: Any, key: str | None, max_tokens: int) -> str | None:
    if refused:
        return f"it refuses to answer: {redacted(str(refused), key)}"
    if finish == "length":
        return f"its answer was cut at {max_tokens} tokens; raise vlm.max_tokens (a model's thinking counts)"
    if finish == "content_filter":
        return "its answer was withheld by a content filter"
    return None


def _usage(counted: Any) -> Usage | None:
    if not isinstance(counted, dict):
        return None
    read, written = counted.get("prompt_tokens"), counted.get("completion_tokens")
    return Usage(read, written) if isinstance(read, int) and isinstance(written, int) else None
