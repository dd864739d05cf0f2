"""The Messages API client against a local server that keeps the contract, and fails as the real one does."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from mug_question import KEY, MUG, PRICE, Mug, Waits, answer_mug, question, services

from manitwin.config import VlmConfig
from manitwin.engine.charges import record_charges
from manitwin.errors import AccessDenied, BadReply, ConfigError, RateLimited, Unavailable
from manitwin.models.fakes.anthropic_messages import FakeAnthropic
from manitwin.models.fakes.faults import ALWAYS, Faults
from manitwin.models.fakes.server import FakeServer, Response
from manitwin.models.vlm.anthropic_messages import AnthropicMessages
from manitwin.models.vlm.protocol import Turn
from manitwin.models.vlm.structured import ask
from scripted_service import Script


def chat(server: FakeServer, key: str | None = KEY, waits: Waits | None = None, **changes: Any) -> AnthropicMessages:
    return AnthropicMessages("claude-x", server.url, key, VlmConfig(), services(**changes), waits or Waits())


@contextmanager
def fake(faults: dict[str, int] | None = None, **options: Any) -> Iterator[FakeServer]:
    with FakeServer(FakeAnthropic(Faults(faults or {}), KEY, answer_mug, **options)) as server:
        yield server


def test_question_is_answered_and_charged() -> None:
    with fake() as server, record_charges() as bill:
        reply = chat(server).ask(question())
    assert (json.loads(reply.text), reply.model) == (MUG, "claude-x")
    used = reply.usage
    assert bill.usd == pytest.approx((used.input_tokens * PRICE[0] + used.output_tokens * PRICE[1]) / 1e6, rel=1e-12)


def test_request_holds_schema_pictures_and_turns() -> None:
    turns = (Turn("assistant", "{}"), Turn("user", "Again."))
    with fake() as server:
        chat(server).ask(question(), turns)
    request = server.requests[0]
    body = request.json()
    assert (request.path, request.headers["anthropic-version"]) == ("/v1/messages", "2023-06-01")
    assert body["output_config"]["format"]["type"] == "json_schema"
    assert body["output_config"]["format"]["schema"] == {"title": "mug"} | question().schema
    assert [block["type"] for block in body["messages"][0]["content"]] == ["image", "text"]
    assert [message["role"] for message in body["messages"]] == ["user", "assistant", "user"]
    assert body["system"] == "You judge objects."


@pytest.mark.parametrize(
    ("fault", "error", "says"),
    [
        ("unauthorized", AccessDenied, "ANTHROPIC_API_KEY"),
        ("out_of_credit", AccessDenied, "credit balance is too low"),
        ("refusal", BadReply, "refuses to answer"),
        ("cut_answer", BadReply, "raise vlm.max_tokens"),
        ("empty_answer", BadReply, "empty"),
    ],
)
def test_what_waiting_cannot_help_is_asked_once(fault: str, error: type[Exception], says: str) -> None:
    with fake({fault: ALWAYS}) as server, pytest.raises(error, match=says):
        chat(server).ask(question())
    assert len(server.requests) == 1


@pytest.mark.parametrize("fault", ["refusal", "cut_answer"])
def test_answer_that_cannot_be_used_is_charged_all_the_same(fault: str) -> None:
    with fake({fault: 1}) as server, record_charges() as bill, pytest.raises(BadReply):
        chat(server).ask(question())
    assert bill.usd > 0


@pytest.mark.parametrize("fault", ["server_error", "disconnects"])
def test_fault_once_is_tried_again_and_charged_once(fault: str) -> None:
    with fake({fault: 1}) as server, record_charges() as bill:
        reply = chat(server).ask(question())
    assert len(server.requests) == 2
    used = reply.usage
    assert bill.usd == pytest.approx((used.input_tokens * PRICE[0] + used.output_tokens * PRICE[1]) / 1e6)


@pytest.mark.parametrize("fault", ["server_error", "disconnects"])
def test_fault_that_stays_is_unavailable(fault: str) -> None:
    with fake({fault: ALWAYS}) as server, record_charges() as bill, pytest.raises(Unavailable):
        chat(server, retries=2).ask(question())
    assert (len(server.requests), bill.usd) == (3, 0.0)


def test_server_that_hangs_is_unavailable() -> None:
    with fake({"hangs": ALWAYS}, hang_s=3.0) as server, pytest.raises(Unavailable, match="does not answer"):
        chat(server, timeout_s=0.2, retries=1).ask(question())
    assert len(server.requests) == 2


def test_rate_limit_is_waited_out_then_said() -> None:
    waits = Waits()
    with fake({"rate_limited": 3}, retry_after="4") as server:
        with pytest.raises(RateLimited) as caught:
            chat(server, waits=waits, retries=2).ask(question())
        assert caught.value.retry_after_s == 4.0
        chat(server, waits=waits).ask(question())
    assert waits.seconds == [4.0, 4.0]


def test_schema_is_told_in_words_where_there_is_no_structured_output() -> None:
    with fake(structured=False) as server:
        asker = chat(server)
        assert ask(asker, question(), Mug).value.material == "glass"
        ask(asker, question(vote=1), Mug)
    assert ["output_config" in request.json() for request in server.requests] == [True, False, False]
    assert "mass_kg" in server.requests[-1].json()["system"]


def test_model_without_temperature_is_asked_without_it() -> None:
    with fake(sampling=False) as server:
        asker = chat(server)
        asker.ask(question())
        asker.ask(question(vote=1))
    assert ["temperature" in request.json() for request in server.requests] == [True, False, False]


def test_invalid_schema_is_no_lack_of_structured_output() -> None:
    broken = question()
    broken.schema["properties"]["mass_kg"]["minimum"] = 0
    with fake() as server, pytest.raises(BadReply, match="'minimum' is not supported"):
        chat(server).ask(broken)
    assert len(server.requests) == 1


@pytest.mark.parametrize(
    "body", [b"<html>", b"[]", b"{}", b'{"content": [{"type": "text"}], "stop_reason": "end_turn"}']
)
def test_body_of_another_form_is_a_bad_reply(body: bytes) -> None:
    with FakeServer(Script(Response(200, body))) as server, pytest.raises(BadReply):
        chat(server).ask(question())


def test_context_that_ends_is_no_answer() -> None:
    said = {"content": [{"type": "text", "text": "{"}], "stop_reason": "model_context_window_exceeded", "usage": {}}
    with FakeServer(Script(Response(200, said))) as server, pytest.raises(BadReply, match=r"vlm\.picture_px"):
        chat(server).ask(question())


def test_tokens_of_a_prompt_cache_count_as_read() -> None:
    usage = {"input_tokens": 5, "cache_creation_input_tokens": 7, "cache_read_input_tokens": 11, "output_tokens": 3}
    said = {
        "content": [{"type": "thinking", "thinking": "hm"}, {"type": "text", "text": json.dumps(MUG)}],
        "stop_reason": "end_turn",
        "model": "claude-x-1",
        "usage": usage,
    }
    with FakeServer(Script(Response(200, said))) as server:
        reply = chat(server).ask(question())
    assert (reply.usage.input_tokens, reply.usage.output_tokens, json.loads(reply.text)) == (23, 3, MUG)


@pytest.mark.parametrize("status", [400, 401, 429, 500])
def test_key_that_a_server_repeats_is_not_passed_on(status: int) -> None:
    secret = "sk-ant-very-secret-0123456789"
    echo = Response(status, {"type": "error", "error": {"type": secret, "message": f"not with {secret}"}})
    with FakeServer(Script(echo)) as server:
        asker = chat(server, key=secret, retries=0)
        with pytest.raises((AccessDenied, BadReply, RateLimited, Unavailable)) as caught:
            asker.ask(question())
    error: BaseException | None = caught.value
    while error is not None:
        assert secret not in f"{error!r} {error} {vars(error)}"
        error = error.__cause__ or error.__context__
    assert secret not in repr(asker) + str(dict(asker.decides))


def test_temperature_above_one_cannot_be_asked_for() -> None:
    with pytest.raises(ConfigError, match="0 to 1"):
        AnthropicMessages("m", "http://localhost:1", None, VlmConfig(temperature=1.5), services())


@pytest.mark.parametrize("structured", [True, False])
def test_server_is_told_the_name_of_the_question(structured: bool) -> None:
    names: list[str] = []

    def answer(name: str, *asked: Any) -> dict[str, Any]:
        names.append(name)
        return MUG

    with FakeServer(FakeAnthropic(None, KEY, answer, structured=structured)) as server:
        chat(server).ask(question())
    assert names == ["mug"]


def test_address_may_end_in_v1() -> None:
    with fake() as server:
        asker = AnthropicMessages("m", f"{server.url}/v1", KEY, VlmConfig(), services(), Waits())
        asker.ask(question())
    assert server.requests[0].path == "/v1/messages"
