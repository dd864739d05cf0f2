"""Answers that are paid for once, also by several processes at once."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from many_askers import Echo, ask_cached, asked, at_once
from mug_question import KEY, MUG, Mug, Scripted, Waits, answer_mug, question, services

from manitwin.config import VlmConfig
from manitwin.engine.charges import record_charges
from manitwin.errors import BadReply, Unavailable
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.server import FakeServer
from manitwin.models.vlm.answer_cache import CachedChat, default_folder
from manitwin.models.vlm.openai_chat import OpenAiChat
from manitwin.models.vlm.protocol import Turn
from manitwin.models.vlm.structured import ask


def cached_chat(url: str, folder: Path, **changes: object) -> CachedChat:
    return CachedChat(OpenAiChat("tiny-vl", f"{url}/v1", KEY, VlmConfig(**changes), services(), Waits()), folder)


def test_same_question_is_asked_and_charged_once(tmp_path: Path) -> None:
    with FakeServer(FakeOpenAi(None, KEY, answer_mug)) as server:
        with record_charges() as first:
            reply = cached_chat(server.url, tmp_path).ask(question())
        with record_charges() as second:
            assert cached_chat(server.url, tmp_path).ask(question()) == reply
    assert len(server.requests) == 1
    assert (first.usd > 0, second.usd) == (True, 0.0)


def test_every_difference_is_another_question(tmp_path: Path) -> None:
    with (
        FakeServer(FakeOpenAi(None, KEY, answer_mug)) as server,
        FakeServer(FakeOpenAi(None, KEY, answer_mug)) as other,
    ):
        cached_chat(server.url, tmp_path).ask(question())
        cached_chat(server.url, tmp_path).ask(question(vote=1))
        cached_chat(server.url, tmp_path).ask(question(text="And now?"))
        cached_chat(server.url, tmp_path).ask(question(), (Turn("assistant", "a"), Turn("user", "b")))
        cached_chat(server.url, tmp_path, temperature=0.5).ask(question())
        cached_chat(server.url, tmp_path, max_tokens=100).ask(question())
        cached_chat(other.url, tmp_path).ask(question())
    assert (len(server.requests), len(other.requests)) == (6, 1)


def test_failure_is_not_kept(tmp_path: Path) -> None:
    with FakeServer(FakeOpenAi(Faults({"cut_answer": 1}), KEY, answer_mug)) as server:
        chat = cached_chat(server.url, tmp_path)
        with pytest.raises(BadReply):
            chat.ask(question())
        assert json.loads(chat.ask(question()).text) == MUG


def test_conversation_that_led_nowhere_is_forgotten(tmp_path: Path) -> None:
    inner = Scripted(["no", "no again", "no", json.dumps(MUG)])
    chat = CachedChat(inner, tmp_path)
    with pytest.raises(BadReply):
        ask(chat, question(), Mug)
    assert ask(chat, question(), Mug).value.material == "glass"  # asked anew, and repaired
    assert len(inner.asked) == 4
    assert ask(chat, question(), Mug).value.material == "glass"  # now kept, with its repair
    assert len(inner.asked) == 4


@pytest.mark.parametrize(
    "content", ["", "{", "[]", '{"text": "x"}', '{"text": "x", "model": "m", "tokens": 3}', "null"]
)
def test_file_that_cannot_be_read_is_replaced(tmp_path: Path, content: str) -> None:
    inner = Scripted(["one", "two"])
    chat = CachedChat(inner, tmp_path)
    chat.ask(question())
    (path,) = tmp_path.rglob("*.json")
    path.write_text(content)
    assert chat.ask(question()).text == "two"
    assert chat.ask(question()).text == "two"


def test_kept_answer_needs_no_server(tmp_path: Path) -> None:
    with FakeServer(FakeOpenAi(None, KEY, answer_mug)) as server:
        cached_chat(server.url, tmp_path).ask(question())
    assert json.loads(cached_chat(server.url, tmp_path).ask(question()).text) == MUG
    with pytest.raises(Unavailable):
        cached_chat(server.url, tmp_path).ask(question(vote=5))


def test_key_is_in_no_file(tmp_path: Path) -> None:
    with FakeServer(FakeOpenAi(None, KEY, answer_mug)) as server:
        for vote in range(3):
            cached_chat(server.url, tmp_path).ask(question(vote))
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert len(files) == 3
    assert not [path for path in files if KEY.encode() in path.read_bytes() or KEY in str(path)]


def test_processes_share_a_folder(tmp_path: Path) -> None:
    assert at_once(ask_cached, [(tmp_path, 0, 20), (tmp_path, 0, 20)]) == [0, 0]
    assert len(list(tmp_path.rglob("*.json"))) == 20
    assert not list(tmp_path.rglob("*.part"))
    silent = CachedChat(Echo(), tmp_path)
    assert [silent.ask(asked(vote)).text for vote in range(20)] == [f"answer to {vote}" for vote in range(20)]


def test_folder_is_where_caches_of_the_user_are(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert default_folder() == tmp_path / "manitwin" / "vlm"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")  # the specification ignores those
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert default_folder() == tmp_path / "home" / ".cache" / "manitwin" / "vlm"


def test_a_kept_answer_of_a_rehearsal_stays_one(tmp_path: Path) -> None:
    with FakeServer(FakeOpenAi(None, KEY, answer_mug)) as server, record_charges() as asked_of_it:
        cached_chat(server.url, tmp_path).ask(question())
    with record_charges() as kept:
        cached_chat(server.url, tmp_path).ask(question())
    assert asked_of_it.rehearsed and kept.rehearsed


def test_a_models_answer_is_no_rehearsal(tmp_path: Path) -> None:
    for _ in range(2):
        with record_charges() as bill:
            CachedChat(Scripted(["a"]), tmp_path).ask(question())
        assert not bill.rehearsed


def test_an_answer_that_cannot_be_kept_is_given_all_the_same(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with FakeServer(FakeOpenAi(Faults({}), KEY, answer_mug)) as server:
        chat = cached_chat(server.url, tmp_path)
        chat.ask(question())
        (kept,) = tmp_path.rglob("*.json")
        kept.unlink()
        kept.mkdir()
        assert chat.ask(question()).text
    assert "the answer is not kept" in caplog.text
    assert list(kept.parent.iterdir()) == [kept]
