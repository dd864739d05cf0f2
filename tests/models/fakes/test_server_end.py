"""A local server ends at once: it does not wait until it would look again whether it is to end."""

from __future__ import annotations

import threading

import httpx2
import pytest

from manitwin.models.fakes import server
from manitwin.models.fakes.openai_chat import FakeOpenAi


def test_a_server_ends_while_it_waits_for_a_request(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "LONGEST_WAIT_S", 3600.0)

    def serve() -> None:
        with server.FakeServer(FakeOpenAi()) as served:
            asked.append(httpx2.get(f"{served.url}/v1/models", trust_env=False).status_code)

    asked: list[int] = []
    serving = threading.Thread(target=serve, daemon=True)
    serving.start()
    serving.join(60)
    assert asked and not serving.is_alive()
