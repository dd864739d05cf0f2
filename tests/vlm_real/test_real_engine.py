"""The chat clients against a real engine: protocol, schema, pictures, faults, cache and record; not judgement.

The model is random: nothing here depends on what it says, only on that it was asked and answered as it should be.
"""

from __future__ import annotations

import json
import re
import time
from dataclasses import replace
from pathlib import Path
from typing import Literal

import pytest
from flaky_proxy import FlakyProxy
from picture_questions import SETTINGS, Judgement, Overheard, Protocol, chat_at, picture_question
from pydantic import BaseModel, create_model
from tiny_engine import MODEL, MOST_PICTURES, TinyEngine

from manitwin.config import BuildConfig, ServicesConfig, VlmConfig
from manitwin.engine.charges import record_charges
from manitwin.errors import BadReply, RateLimited, Unavailable
from manitwin.models.vlm.chat_from_spec import anthropic_from_spec, openai_from_spec, replay_from_spec
from manitwin.models.vlm.openai_chat import OpenAiChat
from manitwin.models.vlm.openai_dialect import Dialect
from manitwin.models.vlm.protocol import Picture
from manitwin.models.vlm.structured import ask, json_object_in, probe

pytestmark = [pytest.mark.slow, pytest.mark.vlm_real]

both_protocols = pytest.mark.parametrize("protocol", ["openai", "anthropic"])
FROM_SPEC = {"openai": openai_from_spec, "anthropic": anthropic_from_spec}
LONG = create_model("Long", **{f"does_part_{number}_show_in_the_pictures": (bool, ...) for number in range(30)})
"""An answer that cannot be given in 64 tokens: its names alone have more."""


@both_protocols
@pytest.mark.parametrize("pictures", [1, 8, 16])
def test_answer_to_pictures_follows_the_schema(
    engine: TinyEngine, figures: list[str], protocol: Protocol, pictures: int
) -> None:
    question = picture_question(pictures, side_px=768)
    chat = Overheard(chat_at(engine.url, protocol))
    began = time.monotonic()
    answered = ask(chat, question, Judgement)
    took_s = time.monotonic() - began
    assert len(chat.replies) == 1  # the engine holds the schema: nothing had to be repaired
    reply = chat.replies[0]
    assert json.loads(reply.text) == answered.value.model_dump()
    assert list(json.loads(reply.text)) == list(Judgement.model_fields)
    assert reply.model == MODEL
    figures.append(
        f"{protocol}, {pictures} pictures of 768 px: {took_s:.1f} s, {reply.usage.input_tokens} tokens read,"
        f" {reply.usage.output_tokens} written"
    )


@both_protocols
@pytest.mark.parametrize("side_px", [112, 224])
def test_engine_reads_every_picture_in_its_size(engine: TinyEngine, protocol: Protocol, side_px: int) -> None:
    chat = chat_at(engine.url, protocol)
    read = [chat.ask(picture_question(n, side_px=side_px)).usage.input_tokens for n in (0, 1, 5)]
    a_picture = (side_px // 28) ** 2 + 2  # one token for 28 x 28 pixels, and its start and end
    assert [read[1] - read[0], read[2] - read[1]] == [a_picture, 4 * a_picture]


@both_protocols
def test_other_pictures_get_other_answers(engine: TinyEngine, protocol: Protocol) -> None:
    chat = chat_at(engine.url, protocol)
    assert len({chat.ask(picture_question(8, side_px=224, seed=seed)).text for seed in range(6)}) > 1


def test_vote_is_the_seed_of_an_answer(engine: TinyEngine) -> None:
    chat = chat_at(engine.url, "openai")
    once, again = ([chat.ask(picture_question(1, vote=vote)).text for vote in range(4)] for _ in range(2))
    assert once == again
    assert len(set(once)) > 1


@both_protocols
def test_probe_says_what_works(engine: TinyEngine, protocol: Protocol) -> None:
    assert probe(chat_at(engine.url, protocol)).startswith(f"{MODEL} answers JSON about a picture")


def test_json_of_any_form_is_held_to_the_schema_by_the_client(engine: TinyEngine) -> None:
    chat = chat_at(engine.url, "openai", settings=SETTINGS.model_copy(update={"max_tokens": 1024}))
    assert isinstance(chat, OpenAiChat)
    chat.dialect = Dialect(format="json_object")
    heard = Overheard(chat)
    for vote in range(6):
        with pytest.raises(BadReply, match=r"single_object: Field required|cut at 1024 tokens"):
            ask(heard, picture_question(1, vote=vote), Judgement)
    assert heard.replies  # random weights may write on for ever, but not always
    assert all(isinstance(json_object_in(reply.text), dict) for reply in heard.replies)


def test_free_text_that_is_no_json_is_repaired_once_and_then_refused(engine: TinyEngine) -> None:
    chat = chat_at(engine.url, "openai")
    assert isinstance(chat, OpenAiChat)
    chat.dialect = Dialect(format="prompt")
    repaired = 0
    for vote in range(6):
        heard, before = Overheard(chat), engine.requests()
        with pytest.raises(BadReply) as caught:
            ask(heard, picture_question(1, vote=vote), Judgement)
        assert engine.requests() - before == len(heard.asked)
        if "no usable answer to 'judgement' when asked again" in str(caught.value):
            repaired += 1
            (_, none), (_, turns) = heard.asked
            assert (none, turns[0].text) == ((), heard.replies[0].text)
            assert "Your answer cannot be used" in turns[1].text
        else:  # random weights may say nothing, or write on for ever
            assert re.search("its answer (is empty|was cut)", str(caught.value))
    assert repaired


@both_protocols
def test_unknown_model_is_one_clear_error(engine: TinyEngine, protocol: Protocol) -> None:
    before = engine.requests()
    with pytest.raises(BadReply, match=r"nope at http://127\.0\.0\.1.*`nope` does not exist.*HTTP 404") as caught:
        chat_at(engine.url, protocol, model="nope").ask(picture_question(1))
    assert engine.requests() - before == 1
    assert "\n" not in str(caught.value)


@both_protocols
def test_answer_cut_by_max_tokens_is_no_answer(engine: TinyEngine, protocol: Protocol) -> None:
    chat, before = chat_at(engine.url, protocol, settings=VlmConfig(max_tokens=64)), engine.requests()
    with pytest.raises(BadReply, match=r"cut at 64 tokens; raise vlm\.max_tokens"):
        ask(chat, picture_question(1, answer=LONG), LONG)
    assert engine.requests() - before == 1


@both_protocols
def test_more_pictures_than_the_engine_takes_are_its_own_error(engine: TinyEngine, protocol: Protocol) -> None:
    with pytest.raises(BadReply, match=rf"At most {MOST_PICTURES} image\(s\)"):
        chat_at(engine.url, protocol).ask(picture_question(MOST_PICTURES + 1))


@both_protocols
def test_question_longer_than_the_context_is_an_error(engine: TinyEngine, protocol: Protocol) -> None:
    question = replace(picture_question(0), parts=("zq" * 40_000,))
    with pytest.raises(BadReply, match="maximum context length"):
        chat_at(engine.url, protocol).ask(question)


@both_protocols
def test_picture_that_is_cut_is_an_error(engine: TinyEngine, protocol: Protocol) -> None:
    question = picture_question(1)
    assert isinstance(question.parts[0], Picture)
    broken = replace(question, parts=(Picture(question.parts[0].png[:200]), "What is it?"))
    with pytest.raises(BadReply, match=r"(?i)image"):
        chat_at(engine.url, protocol).ask(broken)


@both_protocols
def test_schema_that_the_engine_refuses_is_seen_and_not_worked_around(engine: TinyEngine, protocol: Protocol) -> None:
    question, before = replace(picture_question(0), schema={"type": "nonsense"}), engine.requests()
    with pytest.raises(BadReply, match="nonsense"):
        chat_at(engine.url, protocol).ask(question)
    assert engine.requests() - before == 1


@both_protocols
def test_broken_connections_and_a_busy_server_are_waited_for(engine: TinyEngine, protocol: Protocol) -> None:
    waits: list[float] = []
    with FlakyProxy(engine.port, ["refused", "busy", "cut"]) as proxy:
        chat, before = chat_at(proxy.url, protocol, waits=waits), engine.requests()
        assert ask(chat, picture_question(8), Judgement).value
        assert proxy.connections == 4
    assert engine.requests() - before == 2  # the one whose answer was cut, and the last
    assert waits[1] == 7.0  # the server's Retry-After
    assert waits[0] < waits[2]


@both_protocols
@pytest.mark.parametrize(("fault", "error"), [("refused", Unavailable), ("cut", Unavailable), ("busy", RateLimited)])
def test_fault_that_stays_is_an_outage_after_the_retries(
    engine: TinyEngine, protocol: Protocol, fault: str, error: type[Exception]
) -> None:
    with FlakyProxy(engine.port, [fault] * 9) as proxy:
        with pytest.raises(error):
            chat_at(proxy.url, protocol, services=ServicesConfig(retries=2)).ask(picture_question(1))
        assert proxy.connections == 3


def paid_config(tmp_path: Path) -> BuildConfig:
    """Three dollars a million tokens read, fifteen written; answers recorded."""
    services = ServicesConfig(usd_per_million_tokens=(3.0, 15.0), record=tmp_path / "answers.jsonl")
    return BuildConfig(vlm=SETTINGS, services=services)


@both_protocols
def test_second_time_the_cache_answers_without_a_request_or_a_charge(
    engine: TinyEngine, protocol: Protocol, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    url = f"{engine.url}/v1" if protocol == "openai" else engine.url
    question, before, bills, replies = picture_question(2), engine.requests(), [], []
    for _ in range(2):
        chat = FROM_SPEC[protocol](f"{MODEL}@{url}", paid_config(tmp_path))
        with record_charges() as bill:
            replies.append(chat.ask(question))
        bills.append(bill.usd)
    assert engine.requests() - before == 1
    assert replies[0] == replies[1]
    usage = replies[0].usage
    assert bills == [pytest.approx((3 * usage.input_tokens + 15 * usage.output_tokens) / 1e6), 0.0]
    FROM_SPEC[protocol](f"{MODEL}@{url}", paid_config(tmp_path)).ask(replace(question, vote=1))
    assert engine.requests() - before == 2  # another vote is another question


@both_protocols
def test_recorded_answers_are_replayed_without_the_engine(
    engine: TinyEngine, protocol: Protocol, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    url = f"{engine.url}/v1" if protocol == "openai" else engine.url
    chat = FROM_SPEC[protocol](f"{MODEL}@{url}", paid_config(tmp_path))
    questions = [picture_question(1, seed=seed) for seed in range(3)]
    answers = [ask(chat, question, Judgement) for question in questions]
    before, record = engine.requests(), tmp_path / "answers.jsonl"
    replayed = replay_from_spec(str(record), BuildConfig())
    with record_charges() as bill:
        assert [ask(replayed, question, Judgement) for question in questions] == answers
    assert (engine.requests() - before, bill.usd) == (0, 0.0)
    assert replayed.model == MODEL
    assert str(engine.port) not in record.read_text()
    with pytest.raises(BadReply, match="record it again"):
        replayed.ask(picture_question(1, seed=3))


@both_protocols
def test_equal_questions_get_equal_answers_at_temperature_0(engine: TinyEngine, protocol: Protocol) -> None:
    class Small(BaseModel):
        good: bool
        view: Literal["front", "back", "left", "right"]

    settings = SETTINGS.model_copy(update={"temperature": 0.0})
    texts = {chat_at(engine.url, protocol, settings=settings).ask(picture_question(1, answer=Small)).text for _ in "12"}
    assert len(texts) == 1
