"""What a model writes where its answer should be: read in a time that grows with its length, or refused in one line."""

from __future__ import annotations

import json
from typing import Any

import pytest
from mug_question import MUG, Mug, Scripted, Waits, question, services

from manitwin.config import VlmConfig
from manitwin.engine.charges import record_charges
from manitwin.errors import BadReply
from manitwin.models.fakes.server import FakeServer, Response
from manitwin.models.vlm.anthropic_messages import AnthropicMessages
from manitwin.models.vlm.client import MOST_CHARACTERS, MOST_TOKENS
from manitwin.models.vlm.openai_chat import OpenAiChat
from manitwin.models.vlm.structured import ask, json_object_in
from scripted_service import Script

N = 100_000
# each took minutes, or for ever, with expressions that go back (`<think>.*?</think>`), or ended by another error
TEXTS = {
    "thoughts that do not end": "<think>" * N,
    "thoughts that end before they begin": "</think>" * N + "<think>" * N,
    "fences and empty lines": "```" + "\n" * N,
    "fences that do not end": "```json\n" * N + "```",
    "fences of spaces": ("```" + " " * 100) * 1000,
    "ticks": "`" * N,
    "braces": "{" * N,
    "braces in lists": '{"a": [' * (N // 7),
    "lists that do not end": '{"a": [' + "0," * N,
    "texts that do not end": '{"a": "' * (N // 7),
    "depth": '{"a": ' * 90 + "[" * 200 + "]" * 200 + "}" * 90,
    "more depth": "[" * N,
    "digits": '{"mass_kg": ' + "9" * N + "}",
    "4,000 digits": '{"mass_kg": ' + "9" * 4000 + "}",
    "1e400": '{"reason": "", "material": "glass", "mass_kg": 1e400}',
    "NaN": '{"reason": "", "material": "glass", "mass_kg": NaN}',
    "nothing": " ",
    "many keys": json.dumps({f"k{i}\x1b\u202e": i for i in range(5000)}),
    "no letters": "\x00\x1b[2J\u202e\ud800",
}


@pytest.mark.parametrize("what", sorted(TEXTS))
def test_text_that_is_no_answer_is_asked_for_once_more_and_refused(what: str) -> None:
    chat = Scripted([TEXTS[what], TEXTS[what]])
    with pytest.raises(BadReply, match="no usable answer") as caught:
        ask(chat, question(), Mug)
    assert len(str(caught.value)) < 3000
    assert all(len(turn.text) < 4000 for turn in chat.asked[1][1] if turn.role == "user")


def test_fences_and_thoughts_are_read_as_before() -> None:
    mug = json.dumps(MUG)
    for text in (
        f"<think>{{</think>{mug}",
        f"<think>a</think>\n<think>{{}}</think>{mug}<think>never closed",
        f"Here:\n```json\n{mug}\n```\nas you asked",
        f"```\n{{}}\n```\nno:\n```JSON  \r\n\n{mug}\n```",
        f"````json\n{mug}\n````",
        f"```python x```\n```\n{mug}```",
        f"first {{}} then {mug} that is all",
    ):
        assert json_object_in(text) == MUG


def test_what_a_terminal_would_obey_is_not_kept() -> None:
    text = r'{"reas\u202eon": "a\u001b[31m\u202eb\ud800c\u2028d", "list": [{"k": "\u200f\ufeff"}], "hebrew": "\u05e9\u05dc"}'
    found = json_object_in(text)
    assert found == {"reas on": "a [31m b c d", "list": [{"k": " "}], "hebrew": "\u05e9\u05dc"}
    assert json.dumps(found, ensure_ascii=False).encode()


def completion(text: Any, **usage: Any) -> dict[str, Any]:
    said = {"message": {"content": text}, "finish_reason": "stop"}
    return {"choices": [said], "usage": {"prompt_tokens": 5, "completion_tokens": 5} | usage}


def message(text: Any, **usage: Any) -> dict[str, Any]:
    return {
        "content": [{"type": "text", "text": text}],
        "stop_reason": "end_turn",
        "usage": {"input_tokens": 5, "output_tokens": 5} | usage,
    }


CHATS: dict[str, tuple[Any, Any, tuple[str, ...]]] = {
    "openai": (OpenAiChat, completion, ("prompt_tokens", "completion_tokens")),
    "anthropic": (AnthropicMessages, message, ("input_tokens", "output_tokens")),
}
NO_COUNTS: list[Any] = [-1, -(10**400), 10**400, MOST_TOKENS + 1, "5", None, [], {}, True, 1.5]


@pytest.mark.parametrize("count", NO_COUNTS, ids=lambda count: str(count)[:12])
@pytest.mark.parametrize("name", sorted(CHATS))
def test_count_of_tokens_that_is_none_is_estimated_instead(name: str, count: Any) -> None:
    kind, answer, parts = CHATS[name]
    for part in parts:
        with (
            FakeServer(Script(Response(200, answer(json.dumps(MUG), **{part: count})))) as server,
            record_charges() as bill,
        ):
            reply = kind("m", server.url, None, VlmConfig(), services(), Waits()).ask(question())
        assert 0 < reply.usage.input_tokens < 2000 and 0 <= reply.usage.output_tokens < 100
        assert 0 < bill.usd < 0.01


@pytest.mark.parametrize("name", sorted(CHATS))
def test_answer_of_too_many_characters_is_refused_and_charged(name: str) -> None:
    kind, answer, _ = CHATS[name]
    with (
        FakeServer(Script(Response(200, answer("x" * (MOST_CHARACTERS + 1))))) as server,
        record_charges() as bill,
        pytest.raises(BadReply, match=f"more than {MOST_CHARACTERS} characters"),
    ):
        kind("m", server.url, None, VlmConfig(), services(), Waits()).ask(question())
    assert bill.usd > 0


@pytest.mark.parametrize("name", sorted(CHATS))
def test_key_in_a_good_answer_is_not_passed_on(name: str) -> None:
    kind, answer, _ = CHATS[name]
    key = "sk-very-secret-0123456789"
    text = json.dumps({"reason": f"{key} {key.upper()}"}).replace("sk-v", "\\u0073k-v", 1)
    with FakeServer(Script(Response(200, answer(text) | {"model": key}))) as server:
        reply = kind("m", server.url, key, VlmConfig(), services(), Waits()).ask(question())
    assert key not in repr(reply) and key not in str(json.loads(reply.text))
