"""The chat completions client against a local server that keeps the contract, and fails as real ones do."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime
from typing import Any, Literal

import pytest
from mug_question import KEY, MUG, PRICE, Mug, Waits, answer_mug, question, services
from pydantic import BaseModel

from manitwin.config import VlmConfig
from manitwin.engine.charges import record_charges
from manitwin.errors import AccessDenied, BadReply, ConfigError, RateLimited, Unavailable
from manitwin.models.fakes.faults import ALWAYS, Faults
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.server import FakeServer, Response
from manitwin.models.services.keys import redacted
from manitwin.models.vlm.openai_chat import OpenAiChat
from manitwin.models.vlm.protocol import Turn
from manitwin.models.vlm.structured import ask, probe
from scripted_service import Script


def chat(server: FakeServer, key: str | None = KEY, waits: Waits | None = None, **changes: Any) -> OpenAiChat:
    return OpenAiChat("tiny-vl", f"{server.url}/v1", key, VlmConfig(), services(**changes), waits or Waits())


@contextmanager
def fake(faults: dict[str, int] | None = None, **options: Any) -> Iterator[FakeServer]:
    with FakeServer(FakeOpenAi(Faults(faults or {}), KEY, answer_mug, **options)) as server:
        yield server


def test_question_is_answered_and_charged_by_the_tokens_that_the_server_counts() -> None:
    with fake() as server, record_charges() as bill:
        reply = chat(server).ask(question())
    assert json.loads(reply.text) == MUG
    assert reply.model == "tiny-vl"
    # the fake counts 4 tokens for the picture of 2 x 2 patches, and one for 4 characters
    texts = server.requests[0].json()["messages"]
    characters = [texts[0]["content"], texts[1]["content"][1]["text"]]
    assert reply.usage.input_tokens == 4 + sum(-(-len(text) // 4) for text in characters)
    expected = (reply.usage.input_tokens * PRICE[0] + reply.usage.output_tokens * PRICE[1]) / 1e6
    assert bill.usd == pytest.approx(expected, rel=1e-12)


def test_request_holds_schema_pictures_turns_and_the_vote_as_seed() -> None:
    turns = (Turn("assistant", "{}"), Turn("user", "Again."))
    with fake() as server:
        chat(server).ask(question(vote=2), turns)
    body = server.requests[0].json()
    assert body["response_format"]["json_schema"]["strict"] is True
    assert body["response_format"]["json_schema"]["name"] == "mug"
    assert (body["seed"], body["temperature"], body["max_tokens"]) == (2, 0.0, 4096)
    assert [message["role"] for message in body["messages"]] == ["system", "user", "assistant", "user"]
    assert [part["type"] for part in body["messages"][1]["content"]] == ["image_url", "text"]
    # a server that only constrains the answer does not show the model what the schema says
    assert "mass_kg" in body["messages"][0]["content"]


@pytest.mark.parametrize(
    ("fault", "error", "says"),
    [
        ("unauthorized", AccessDenied, "OPENAI_API_KEY"),
        ("out_of_credit", AccessDenied, "exceeded your current quota"),
        ("refusal", BadReply, "refuses to answer: I'm sorry"),
        ("cut_answer", BadReply, "raise vlm.max_tokens"),
        ("empty_answer", BadReply, "empty"),
    ],
)
def test_what_waiting_cannot_help_is_asked_once(fault: str, error: type[Exception], says: str) -> None:
    waits = Waits()
    with fake({fault: ALWAYS}) as server, pytest.raises(error, match=says):
        chat(server, waits=waits).ask(question())
    assert len(server.requests) == 1
    assert waits.seconds == []


@pytest.mark.parametrize("fault", ["refusal", "cut_answer", "empty_answer"])
def test_answer_that_cannot_be_used_is_charged_all_the_same(fault: str) -> None:
    with fake({fault: 1}) as server, record_charges() as bill, pytest.raises(BadReply):
        chat(server).ask(question())
    assert bill.usd > 0


@pytest.mark.parametrize("fault", ["unauthorized", "out_of_credit", "server_error", "rate_limited"])
def test_refused_request_is_not_charged(fault: str) -> None:
    with (
        fake({fault: ALWAYS}) as server,
        record_charges() as bill,
        pytest.raises((AccessDenied, Unavailable, RateLimited)),
    ):
        chat(server).ask(question())
    assert bill.usd == 0


def test_server_error_once_is_tried_again() -> None:
    waits = Waits()
    with fake({"server_error": 1}) as server, record_charges() as bill:
        reply = chat(server, waits=waits).ask(question())
    assert json.loads(reply.text) == MUG
    assert len(server.requests) == 2
    assert waits.seconds == [1.0]
    tokens = reply.usage
    assert bill.usd == pytest.approx((tokens.input_tokens * PRICE[0] + tokens.output_tokens * PRICE[1]) / 1e6)


@pytest.mark.parametrize("fault", ["server_error", "disconnects"])
def test_server_that_stays_down_is_unavailable_after_doubling_waits(fault: str) -> None:
    waits = Waits()
    with fake({fault: ALWAYS}) as server, pytest.raises(Unavailable, match="run again later"):
        chat(server, waits=waits, retries=3).ask(question())
    assert len(server.requests) == 4
    assert waits.seconds == [1.0, 2.0, 4.0]


def test_connection_cut_once_is_tried_again() -> None:
    with fake({"disconnects": 1}) as server:
        assert json.loads(chat(server).ask(question()).text) == MUG
    assert len(server.requests) == 2


def test_server_that_hangs_is_unavailable() -> None:
    with fake({"hangs": ALWAYS}, hang_s=3.0) as server, pytest.raises(Unavailable, match="does not answer"):
        chat(server, timeout_s=0.2, retries=1).ask(question())
    assert len(server.requests) == 2


def test_server_that_is_not_there_is_unavailable() -> None:
    with fake() as server:
        gone = chat(server, retries=1)
    with pytest.raises(Unavailable, match="does not answer"):
        gone.ask(question())


def test_rate_limit_is_waited_out_as_long_as_the_server_says() -> None:
    waits = Waits()
    with fake({"rate_limited": 2}, retry_after="7") as server:
        assert json.loads(chat(server, waits=waits).ask(question()).text) == MUG
    assert waits.seconds == [7.0, 7.0]
    assert len(server.requests) == 3


def test_rate_limit_until_a_date_is_waited_out() -> None:
    waits = Waits()
    until = format_datetime(datetime.now(UTC) + timedelta(seconds=20), usegmt=True)
    with fake({"rate_limited": 1}, retry_after=until) as server:
        chat(server, waits=waits).ask(question())
    assert waits.seconds == [pytest.approx(19, abs=1.5)]


def test_rate_limit_that_stays_is_said_with_the_time_to_wait() -> None:
    waits = Waits()
    with fake({"rate_limited": ALWAYS}, retry_after="3") as server, pytest.raises(RateLimited) as caught:
        chat(server, waits=waits, retries=1).ask(question())
    assert caught.value.retry_after_s == 3.0
    assert (len(server.requests), waits.seconds) == (2, [3.0])


def test_rate_limit_longer_than_the_longest_wait_is_not_waited_for() -> None:
    waits = Waits()
    with fake({"rate_limited": ALWAYS}, retry_after="3600") as server, pytest.raises(RateLimited) as caught:
        chat(server, waits=waits, longest_wait_s=30.0).ask(question())
    assert caught.value.retry_after_s == 3600.0
    assert (len(server.requests), waits.seconds) == (1, [])


@pytest.mark.parametrize(
    ("formats", "tried"),
    [(("json_object",), ["json_schema", "json_object"]), ((), ["json_schema", "json_object", None])],
)
def test_structured_output_is_done_without_where_there_is_none(
    formats: tuple[str, ...], tried: list[str | None]
) -> None:
    with fake(formats=formats) as server:
        asker = chat(server)
        assert ask(asker, question(), Mug).value.mass_kg == 0.4
        assert [r.json().get("response_format", {}).get("type") for r in server.requests] == tried
        ask(asker, question(vote=1), Mug)
    assert len(server.requests) == len(tried) + 1  # remembered


def test_question_keeps_its_name_without_structured_output() -> None:
    names: list[str] = []

    def answer(name: str, *asked: Any) -> dict[str, Any]:
        names.append(name)
        return MUG

    with FakeServer(FakeOpenAi(None, KEY, answer, formats=())) as server:
        chat(server).ask(question())
    assert names == ["mug"]


def test_json_schema_refused_once_is_not_asked_for_again() -> None:
    with fake({"no_json_schema": 1}) as server:
        asker = chat(server)
        asker.ask(question())
        asker.ask(question(vote=1))
    kinds = [r.json()["response_format"]["type"] for r in server.requests]
    assert kinds == ["json_schema", "json_object", "json_object"]


def test_model_that_reasons_is_asked_in_its_own_words() -> None:
    with fake(reasoning=True) as server:
        asker = chat(server)
        asker.ask(question())
        asker.ask(question(vote=1))
    assert len(server.requests) == 4  # two refusals, once
    last = server.requests[-1].json()
    assert "temperature" not in last and "max_tokens" not in last
    assert last["max_completion_tokens"] == 4096


def test_invalid_schema_is_no_lack_of_structured_output() -> None:
    broken = question()
    broken.schema["properties"]["mass_kg"]["minLength"] = 3
    with fake() as server, pytest.raises(BadReply, match="Invalid schema"):
        chat(server).ask(broken)
    assert len(server.requests) == 1


def test_unknown_model_is_named() -> None:
    with (
        fake(models=["another"]) as server,
        pytest.raises(BadReply, match=r"'tiny-vl' does not exist.*check the model's name"),
    ):
        chat(server).ask(question())


@pytest.mark.parametrize(
    ("status", "body", "told"),
    [
        (
            404,
            b"<html>Not Found</html>",
            r": HTTP 404; check the model's name, and the address: that of most servers ends in /v1$",
        ),
        (
            400,
            {"error": {"message": "image_url is only supported by certain models"}},
            r"choose a model that sees pictures$",
        ),
        (
            400,
            {"error": {"message": "Model is not a multimodal model"}},
            r"\(HTTP 400\); choose a model that sees pictures$",
        ),
        (
            400,
            {"error": {"message": "This model's maximum context length is 8192 tokens"}},
            r"serve it with a longer context",
        ),
    ],
)
def test_what_a_server_cannot_do_is_told_with_its_remedy(status: int, body: Any, told: str) -> None:
    with FakeServer(Script(Response(status, body))) as server, pytest.raises(BadReply, match=told):
        chat(server).ask(question())


def _answer(**message: Any) -> Script:
    return Script(Response(200, {"choices": [{"message": message, "finish_reason": "stop"}]}))


def test_an_answer_in_parts_is_read_and_thinking_alone_is_none() -> None:
    parts = [{"type": "thinking", "thinking": []}, {"type": "text", "text": json.dumps(MUG)}]
    with FakeServer(_answer(content=parts)) as server:
        assert json.loads(chat(server).ask(question()).text) == MUG
    for name in ("reasoning_content", "reasoning"):
        thought = {"content": None, name: "It is a mug."}
        with (
            FakeServer(_answer(**thought)) as server,
            pytest.raises(BadReply, match="thought and gave no answer; serve it"),
        ):
            chat(server).ask(question())


def test_a_person_is_not_shown_all_that_could_have_been_said() -> None:
    class Word(BaseModel):
        word: Literal[tuple(f"thing number {number}" for number in range(100))]  # type: ignore[valid-type]

    said = {"choices": [{"message": {"content": '{"word": "Tasse"}'}, "finish_reason": "stop"}]}
    with FakeServer(Script(Response(200, said), Response(200, said))) as server, pytest.raises(BadReply) as failed:
        ask(chat(server), question(), Word)
    told = str(failed.value)
    assert len(told) < 400 and "word: Input should be 'thing number 0'" in told and told.endswith("not 'Tasse'")
    assert "thing number 57" in server.requests[1].json()["messages"][-1]["content"]


def test_words_instead_of_json_are_shown() -> None:
    words = "I'm sorry, but I can't help with identifying this image."
    answers = Response(200, {"choices": [{"message": {"content": words}, "finish_reason": "stop"}]})
    with (
        FakeServer(Script(answers, answers)) as server,
        pytest.raises(BadReply, match=r"begins \"I'm sorry, but I can't help"),
    ):
        ask(chat(server), question(), Mug)


@pytest.mark.parametrize(
    "body",
    [
        b"<html>Back soon</html>",
        b"",
        b"[]",
        b'{"choices": []}',
        b'{"choices": [{"message": {"content": 7}}]}',
        b'{"choices": [null]}',
        b"[" * 100_000,
    ],
)
def test_body_of_another_form_is_a_bad_reply(body: bytes) -> None:
    with (
        FakeServer(Script(Response(200, body))) as server,
        pytest.raises(BadReply, match=r"no chat completion|no JSON object"),
    ):
        chat(server).ask(question())


def test_tokens_are_estimated_where_the_server_counts_none() -> None:
    said = {"choices": [{"message": {"content": json.dumps(MUG)}, "finish_reason": "stop"}]}
    with FakeServer(Script(Response(200, said))) as server, record_charges() as bill:
        reply = chat(server).ask(question())
    assert reply.usage.output_tokens == -(-len(reply.text) // 4)
    assert bill.usd > 0


def test_redirect_is_not_followed_with_the_key() -> None:
    with FakeServer(Script(Response(200, {}))) as elsewhere:
        moved = Response(307, b"", {"Location": f"{elsewhere.url}/v1/chat/completions"})
        with FakeServer(Script(moved)) as server, pytest.raises(BadReply, match="redirects"):
            chat(server).ask(question())
    assert elsewhere.requests == []


def test_settings_of_the_openai_sdk_are_not_sent_to_other_servers(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("OPENAI_API_KEY", "OPENAI_ADMIN_KEY", "OPENAI_ORG_ID", "OPENAI_PROJECT_ID"):
        monkeypatch.setenv(name, f"of-{name}")
    monkeypatch.setenv("OPENAI_CUSTOM_HEADERS", "X-Team: of-custom\nAuthorization: Bearer of-custom")
    with fake() as server:
        chat(server).ask(question())
        with pytest.raises(AccessDenied):
            chat(server, key=None).ask(question())
    assert [request.headers.get("authorization") for request in server.requests] == [f"Bearer {KEY}", None]
    assert "of-" not in str([request.headers for request in server.requests])


@pytest.mark.parametrize("status", [400, 401, 404, 429, 500])
def test_key_that_a_server_repeats_is_not_passed_on(
    status: int, caplog: pytest.LogCaptureFixture, capsys: pytest.CaptureFixture[str]
) -> None:
    secret = "sk-very-secret-0123456789"
    echo = Response(status, {"error": {"message": f"not with {secret}", "code": secret}})
    with FakeServer(Script(echo)) as server, caplog.at_level(logging.DEBUG):
        asker = chat(server, key=secret, retries=0)
        with pytest.raises((AccessDenied, BadReply, RateLimited, Unavailable)) as caught:
            asker.ask(question())
    error: BaseException | None = caught.value
    while error is not None:
        assert secret not in f"{error!r} {error} {vars(error)}"
        error = error.__cause__ or error.__context__
    assert secret not in repr(asker) + str(dict(asker.decides)) + caplog.text + "".join(capsys.readouterr())


def test_key_is_not_passed_on_by_half() -> None:
    secret = "sk-very-secret-0123456789"
    for before in range(150, 320):
        assert "sk-very" not in redacted("x" * before + secret, secret)


def test_price_of_a_server_elsewhere_has_to_be_known() -> None:
    with pytest.raises(ConfigError, match=r"services\.usd_per_million_tokens"):
        OpenAiChat("m", "https://gpu.example/v1", KEY, VlmConfig(), services(usd_per_million_tokens=None))


def test_probe_says_what_works() -> None:
    with FakeServer(FakeOpenAi(None, KEY, lambda *asked: {"color": "red"})) as server:
        assert probe(chat(server)) == "tiny-vl answers JSON about a picture"
    with FakeServer(FakeOpenAi(None, KEY, lambda *asked: {"color": "blue"})) as server:
        assert "sees blue where red is" in probe(chat(server))
