"""A run's answers, recorded by many processes, and given again without a server."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from many_askers import Echo, ask_recorded, asked, at_once
from mug_question import KEY, MUG, Mug, Scripted, Waits, answer_mug, question, services

from manitwin.config import VlmConfig
from manitwin.engine.charges import record_charges
from manitwin.errors import BadReply, ConfigError
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.server import FakeServer
from manitwin.models.vlm.openai_chat import OpenAiChat
from manitwin.models.vlm.replay import RecordedChat, Replay
from manitwin.models.vlm.structured import ask


def test_recorded_conversation_is_given_again(tmp_path: Path) -> None:
    path = tmp_path / "answers.jsonl"
    recorded = ask(RecordedChat(Scripted(["no", json.dumps(MUG)]), path), question(), Mug)
    replay = Replay(path)
    with record_charges() as bill:
        assert ask(replay, question(), Mug) == recorded
    assert (replay.name, replay.model, bill.usd) == ("replay", "scripted-1", 0.0)
    assert replay.ask(question()).model == "scripted-1-0711"


def test_what_was_not_recorded_is_said(tmp_path: Path) -> None:
    path = tmp_path / "answers.jsonl"
    RecordedChat(Scripted(["x"]), path).ask(question())
    with pytest.raises(BadReply, match=r"answers.jsonl: no answer to 'mug' \(vote 4\)"):
        Replay(path).ask(question(vote=4))


def test_same_answer_is_recorded_once_and_another_one_replaces_it(tmp_path: Path) -> None:
    path = tmp_path / "answers.jsonl"
    for text in ("a", "a", "b"):
        RecordedChat(Scripted([text]), path).ask(question())
    assert len(path.read_text().splitlines()) == 2
    assert Replay(path).ask(question()).text == "b"


def test_record_is_of_one_model(tmp_path: Path) -> None:
    path = tmp_path / "answers.jsonl"
    RecordedChat(Scripted(["a"]), path).ask(question())
    with pytest.raises(ConfigError, match="records scripted-1, not another"):
        RecordedChat(Scripted([], model="another"), path)
    path.write_text(path.read_text() + path.read_text().replace('"scripted-1"', '"another"'))
    with pytest.raises(ConfigError, match="another, scripted-1"):
        Replay(path)


@pytest.mark.parametrize(
    "content", ["", "not json\n", "{}\n", '{"key": 1, "model": 2, "text": 3, "tokens": [1, 2]}\n', "7\n"]
)
def test_file_that_is_no_record_is_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "answers.jsonl"
    path.write_text(content)
    with pytest.raises(ConfigError, match=r"answers\.jsonl"):
        Replay(path)


def test_record_of_nothing_says_why_nothing_was_asked(tmp_path: Path) -> None:
    (tmp_path / "empty.jsonl").touch()
    with pytest.raises(ConfigError, match=r"no answer is in it.*record into a new folder"):
        Replay(tmp_path / "empty.jsonl")


def test_missing_file_is_said(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"gone\.jsonl: cannot be opened"):
        Replay(tmp_path / "gone.jsonl")
    with pytest.raises(ConfigError, match="cannot be written"):
        RecordedChat(Scripted([]), tmp_path)


def test_line_that_a_crash_cut_is_written_over(tmp_path: Path) -> None:
    path = tmp_path / "answers.jsonl"
    RecordedChat(Scripted(["a"]), path).ask(question())
    whole = path.read_bytes()
    path.write_bytes(whole + whole[: len(whole) // 2])
    assert Replay(path).ask(question()).text == "a"
    RecordedChat(Scripted(["b"]), path).ask(question(vote=1))
    assert [json.loads(line)["text"] for line in path.read_text().splitlines()] == ["a", "b"]


def test_processes_record_to_one_file(tmp_path: Path) -> None:
    path = tmp_path / "answers.jsonl"
    # overlapping questions: what one has recorded the other does not add again
    assert at_once(ask_recorded, [(path, 0, 20), (path, 10, 20)]) == [0, 0]
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert len(lines) == len({line["key"] for line in lines}) == 30
    replay = Replay(path)
    assert [replay.ask(asked(vote)).text for vote in range(30)] == [
        Echo(100_000).ask(asked(vote)).text for vote in range(30)
    ]


def test_neither_key_nor_address_is_recorded(tmp_path: Path) -> None:
    path = tmp_path / "answers.jsonl"
    with FakeServer(FakeOpenAi(None, KEY, answer_mug)) as server:
        chat = OpenAiChat("tiny-vl", f"{server.url}/v1", KEY, VlmConfig(), services(), Waits())
        RecordedChat(chat, path).ask(question())
    content = path.read_text()
    assert KEY not in content and "127.0.0.1" not in content


def test_what_a_rehearsal_answered_is_one_when_it_is_replayed(tmp_path: Path) -> None:
    path = tmp_path / "answers.jsonl"
    with FakeServer(FakeOpenAi(None, KEY, answer_mug)) as server:
        chat = OpenAiChat("tiny-vl", f"{server.url}/v1", KEY, VlmConfig(), services(), Waits())
        RecordedChat(chat, path).ask(question())
    with record_charges() as replayed:
        Replay(path).ask(question())
    assert replayed.rehearsed
    RecordedChat(Scripted(["x"]), tmp_path / "models.jsonl").ask(question())
    with record_charges() as of_a_model:
        Replay(tmp_path / "models.jsonl").ask(question())
    assert not of_a_model.rehearsed
