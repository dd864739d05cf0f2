"""Both fakes as users start them answer a question with a picture."""

from __future__ import annotations

import pytest

from manitwin.config import ServicesConfig, VlmConfig
from manitwin.models.fakes.anthropic_messages import FakeAnthropic
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.server import FakeServer
from manitwin.models.vlm.anthropic_messages import AnthropicMessages
from manitwin.models.vlm.openai_chat import OpenAiChat
from manitwin.models.vlm.structured import probe


@pytest.mark.parametrize("formats", [("json_schema",), ("json_object",), ()])
def test_openai(formats: tuple[str, ...]) -> None:
    with FakeServer(FakeOpenAi(formats=formats)) as server:
        chat = OpenAiChat("rehearsal", f"{server.url}/v1", "rehearsal-key", VlmConfig(), ServicesConfig())
        assert probe(chat) == "rehearsal answers JSON about a picture"


@pytest.mark.parametrize("structured", [True, False])
def test_anthropic(structured: bool) -> None:
    with FakeServer(FakeAnthropic(structured=structured)) as server:
        chat = AnthropicMessages("rehearsal", server.url, "rehearsal-key", VlmConfig(), ServicesConfig())
        assert probe(chat) == "rehearsal answers JSON about a picture"
