"""From what a user writes to a chat model."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from mug_question import KEY, MUG, answer_mug, question

from manitwin.config import BuildConfig
from manitwin.errors import AccessDenied, ConfigError
from manitwin.models.fakes.anthropic_messages import FakeAnthropic
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.server import FakeServer
from manitwin.models.vlm.chat_from_spec import anthropic_from_spec, openai_from_spec, replay_from_spec

NAMES = ("OPENAI_API_KEY", "ANTHROPIC_API_KEY", "GEMINI_API_KEY", "MANITWIN_VLM_KEY")


@pytest.fixture(autouse=True)
def environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in NAMES:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def config(**services: object) -> BuildConfig:
    return BuildConfig.model_validate({"services": services})


def test_rehearsal_is_cached_recorded_and_replayed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("MANITWIN_VLM_KEY", KEY)
    record = tmp_path / "answers.jsonl"
    with FakeServer(FakeOpenAi(None, KEY, answer_mug)) as server:
        spec = f"tiny-vl@{server.url}/v1"
        for _ in range(2):
            chat = openai_from_spec(spec, config(record=record))
            assert json.loads(chat.ask(question()).text) == MUG
    assert len(server.requests) == 1
    assert (chat.name, chat.model, chat.price.usd(chat.ask(question()).usage)) == ("openai", "tiny-vl", 0.0)
    assert replay_from_spec(str(record), config()).ask(question()) == chat.ask(question())
    written = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert len(written) == 2 and not [path for path in written if KEY.encode() in path.read_bytes()]


def test_cache_can_be_left_out(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("MANITWIN_VLM_KEY", KEY)
    with FakeServer(FakeAnthropic(None, KEY, answer_mug)) as server:
        chat = anthropic_from_spec(f"claude-x@{server.url}", config(cache=False))
        chat.ask(question())
        chat.ask(question())
    assert len(server.requests) == 2
    assert not (tmp_path / "cache").exists()


def test_key_of_a_vendor_goes_to_the_vendor_only(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in NAMES[:3]:
        monkeypatch.setenv(name, KEY)
    with FakeServer(FakeOpenAi(None, KEY, answer_mug)) as server:
        with pytest.raises(AccessDenied, match="MANITWIN_VLM_KEY"):
            openai_from_spec(f"tiny-vl@{server.url}/v1", config()).ask(question())
        with pytest.raises(ConfigError, match="MANITWIN_VLM_KEY"):
            openai_from_spec("tiny-vl@https://gpu.example/v1", config())
    assert not [request for request in server.requests if "authorization" in request.headers]


@pytest.mark.parametrize(
    ("make", "argument", "names"),
    [
        (openai_from_spec, "gpt-x", "OPENAI_API_KEY"),
        (anthropic_from_spec, "claude-x", "ANTHROPIC_API_KEY"),
        (
            openai_from_spec,
            "gemini-x@https://generativelanguage.googleapis.com/v1beta/openai/",
            "GEMINI_API_KEY",
        ),
    ],
)
def test_missing_key_and_price_are_named(
    make: type, argument: str, names: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(ConfigError, match=names):
        make(argument, config())
    monkeypatch.setenv(names, KEY)
    with pytest.raises(ConfigError, match="usd_per_million_tokens"):
        make(argument, config())
    chat = make(argument, config(usd_per_million_tokens=[1, 2]))
    assert KEY not in repr(chat)


@pytest.mark.parametrize("argument", ["", "@http://localhost:8000/v1"])
def test_model_has_to_be_named(argument: str) -> None:
    with pytest.raises(ConfigError, match="needs a model"):
        openai_from_spec(argument, config())


def test_replay_needs_a_file() -> None:
    with pytest.raises(ConfigError, match=r"answers\.jsonl"):
        replay_from_spec("", config())


def test_key_with_a_line_break_is_refused_without_being_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "sk-secret\nX")
    monkeypatch.setenv("ANTHROPIC_API_KEY", "sk-secret\nX")
    for make in (openai_from_spec, anthropic_from_spec):
        with pytest.raises(ConfigError, match="spaces") as caught:
            make("m", config(usd_per_million_tokens=[1, 2]))
        assert "sk-secret" not in str(caught.value)


def test_an_address_may_be_that_of_the_endpoint_itself() -> None:
    for name, url in (("openai", "http://localhost:8000/v1"), ("anthropic", "http://localhost:8000")):
        whole = f"{url}/chat/completions/" if name == "openai" else f"{url}/v1/messages"
        made = {"openai": openai_from_spec, "anthropic": anthropic_from_spec}[name](f"m@{whole}", BuildConfig())
        assert made.decides["server"] == url


@pytest.mark.parametrize("place", ["localhost:8000/v1", "localhost", "127.0.0.1:11434/v1", "gpu-box:8000/v1"])
def test_an_address_without_its_scheme_is_no_part_of_a_model(place: str) -> None:
    with pytest.raises(ConfigError, match=f"give its scheme too, such as http://{place}"):
        openai_from_spec(f"qwen3-vl@{place}", BuildConfig())
