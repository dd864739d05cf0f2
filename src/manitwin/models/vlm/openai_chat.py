"""Client of the chat completions API: OpenAI, vLLM, SGLang, Ollama, llama.cpp, LM Studio, and Gemini's compatible endpoint."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

from manitwin.config import ServicesConfig, VlmConfig
from manitwin.errors import ConfigError
from manitwin.models.services.http import HttpService
from manitwin.models.services.keys import bearer
from manitwin.models.services.refusal import NotFound, Refusal, RequestRejected, refusal_by_status
from manitwin.models.vlm.client import Completion, ServedChat, counted_tokens
from manitwin.models.vlm.openai_answer import NOT_THERE, is_reasoning_only, refusal_remedy, text_of
from manitwin.models.vlm.openai_dialect import Dialect, request_body
from manitwin.models.vlm.prices import estimated_usage
from manitwin.models.vlm.protocol import Question, Reply, Turn, Usage

OPENAI_URL = "https://api.openai.com/v1"
# variables of OpenAI's own client; a key with several organizations or projects needs them, and no other server gets them
_OF_OPENAI = {"OpenAI-Organization": "OPENAI_ORG_ID", "OpenAI-Project": "OPENAI_PROJECT_ID"}
# an account without credit gets a 429 whose type, and mostly code, is the first one, as in
# https://github.com/OpenHands/OpenHands/issues/998; the others are unverified
OUT_OF_CREDIT = ("insufficient_quota", "billing_hard_limit_reached", "billing_not_active")


class OpenAiChat(ServedChat):
    """Chat with one model at one server.

    A field that the server refuses is left out of all later requests (``dialect``). Raises AccessDenied; RateLimited after
    ``services.retries`` waits, or at once if the server asks for more than ``services.longest_wait_s``; Unavailable after as
    many retries; BadReply. Tokens are charged as the server counts them, also for an unusable answer; the cost of an answer
    that was lost in transit is unknown and not charged. The key is sent to ``base_url`` only, over https or on this machine,
    and never displayed.
    """

    name = "openai"
    endpoint = "/chat/completions"

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
        super().__init__(model, base_url, settings, services, key_name)
        self._service = HttpService(
            self._who,
            base_url,
            authorization=bearer(key) | (_headers_of_openai() if base_url == OPENAI_URL else {}),
            services=services,
            key=key,
            remedy=self._remedy,
            refusal=openai_refusal,
            sleep=sleep,
        )
        # reasoning models accept only the newer name, other vendors' servers may accept only the older one
        order = 1 if base_url == OPENAI_URL else -1
        self.dialect = Dialect(length_fields=("max_completion_tokens", "max_tokens")[::order])

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        """Answer a question, given the turns that followed it."""

        while True:
            try:
                answer = self._service.post_json(self.endpoint, self._body(question, turns))
            except RequestRejected as error:
                narrower = self.dialect.without(error.words)
                if narrower is None:
                    remedy = refusal_remedy(error.words)
                    raise error if remedy is None else RequestRejected(f"{error}; {remedy}", error.words) from None
                self.dialect = narrower
            except NotFound as error:
                raise NotFound(f"{error}; {NOT_THERE}") from None
            else:
                return self._completion(answer, question).paid(self.price, self._who)

    def _body(self, question: Question, turns: tuple[Turn, ...]) -> dict[str, Any]:
        return request_body(
            question,
            turns,
            self.dialect,
            model=self.model,
            max_tokens=self._settings.max_tokens,
            temperature=self._settings.temperature,
        )

    def _completion(self, answer: dict[str, Any], question: Question) -> Completion:
        """Parse an answer (https://platform.openai.com/docs/api-reference/chat/object).

        Tokens are estimated (``estimated_usage``) if the server does not count them. Raises BadReply for an answer of another
        form.
        """
        choices = answer.get("choices")
        choice = choices[0] if isinstance(choices, list) and choices else None
        message = choice.get("message") if isinstance(choice, dict) else None
        if not isinstance(choice, dict) or not isinstance(message, dict):
            raise self._service.unreadable("choices[0].message: it is no chat completion")
        text, refused = text_of(message.get("content")), message.get("refusal")
        if text is None:
            raise self._service.unreadable("text in choices[0].message.content: it is no chat completion")
        usage = _usage(answer.get("usage")) or estimated_usage(question, text)
        model = self._service.said(str(answer.get("model") or ""))
        fault = self._fault(choice.get("finish_reason"), refused)
        if fault is None and is_reasoning_only(message, text):
            fault = "it thought and gave no answer; serve it without thinking, or raise vlm.max_tokens"
        return Completion(text, usage, model, fault)

    def _fault(self, finish: Any, refused: Any) -> str | None:
        if refused:
            return f"it refuses to answer: {self._service.said(str(refused)).rstrip('.')}; choose another model"
        if finish == "length":
            return f"its answer was cut at {self._settings.max_tokens} tokens; raise vlm.max_tokens (a model's thinking counts)"
        if finish == "content_filter":
            return "its answer was withheld by a content filter"
        return None


def _headers_of_openai() -> dict[str, str]:
    given = {header: os.environ.get(name, "") for header, name in _OF_OPENAI.items()}
    for header, value in given.items():
        if not (value.isascii() and value.isprintable()):
            raise ConfigError(f"{_OF_OPENAI[header]} holds characters that no such id has; copy it again")
    return {header: value for header, value in given.items() if value}


def openai_refusal(status: int, body: Any) -> Refusal | None:
    """Parse an error body ``{"error": {"message", "type", "param", "code"}}``; None for 2xx."""
    refusal = refusal_by_status(status, body)
    error = body.get("error") if isinstance(body, dict) else None
    said = [error.get("code"), error.get("type")] if isinstance(error, dict) else []
    if refusal is not None and any(word in OUT_OF_CREDIT for word in said):
        return Refusal(refusal.message, "denied")
    return refusal


def _usage(counted: Any) -> Usage | None:
    if not isinstance(counted, dict):
        return None
    read, written = (counted_tokens(counted.get(f"{kind}_tokens")) for kind in ("prompt", "completion"))
    return None if read is None or written is None else Usage(read, written)
