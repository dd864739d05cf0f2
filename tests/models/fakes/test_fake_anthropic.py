"""The fake refuses what Anthropic refuses; asked without this package's client."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from typing import Any

import httpx2
import pytest
from PIL import Image

from manitwin.models.fakes.anthropic_messages import FakeAnthropic
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.server import FakeServer

SCHEMA = {
    "type": "object",
    "properties": {"color": {"type": "string"}},
    "required": ["color"],
    "additionalProperties": False,
}
HEADERS = {"x-api-key": "rehearsal-key", "anthropic-version": "2023-06-01"}


def image(**changes: Any) -> dict[str, Any]:
    stream = io.BytesIO()
    Image.new("RGB", (30, 60)).save(stream, "PNG")
    data = base64.b64encode(stream.getvalue()).decode()
    return {"type": "image", "source": {"type": "base64", "media_type": "image/png", "data": data} | changes}


def body(**changes: Any) -> dict[str, Any]:
    return {
        "model": "claude-x",
        "max_tokens": 100,
        "system": "Look.",
        "messages": [{"role": "user", "content": [image(), {"type": "text", "text": "Which color?"}]}],
        "output_config": {"format": {"type": "json_schema", "schema": SCHEMA}},
    } | changes


def post(
    server: FakeServer, sent: Any, headers: dict[str, str] = HEADERS, path: str = "/v1/messages"
) -> httpx2.Response:
    return httpx2.post(server.url + path, json=sent, headers=headers, timeout=10, trust_env=False)


@pytest.fixture
def server() -> Iterator[FakeServer]:
    with FakeServer(
        FakeAnthropic(answer=lambda name, schema, text, pngs: {"color": f"{name}{text} {len(pngs)}"})
    ) as server:
        yield server


def test_answer_is_given_schema_text_and_pictures(server: FakeServer) -> None:
    message = post(server, body()).json()
    assert message["content"] == [{"type": "text", "text": '{"color": "Look.\\nWhich color? 1"}'}]
    assert (message["stop_reason"], message["role"], message["type"]) == ("end_turn", "assistant", "message")
    # 2 and 3 tokens of text, and 2 x 3 of a picture of 30 x 60 pixels
    assert message["usage"]["input_tokens"] == 11


@pytest.mark.parametrize(
    ("headers", "status", "kind"),
    [
        ({"anthropic-version": "2023-06-01"}, 401, "authentication_error"),
        ({"x-api-key": "another", "anthropic-version": "2023-06-01"}, 401, "authentication_error"),
        ({"Authorization": "Bearer rehearsal-key", "anthropic-version": "2023-06-01"}, 401, "authentication_error"),
        ({"x-api-key": "rehearsal-key"}, 400, "invalid_request_error"),
        ({"x-api-key": "rehearsal-key", "anthropic-version": "2024-01-01"}, 400, "invalid_request_error"),
    ],
)
def test_headers_are_checked(server: FakeServer, headers: dict[str, str], status: int, kind: str) -> None:
    response = post(server, body(), headers)
    assert (response.status_code, response.json()["error"]["type"], response.json()["type"]) == (status, kind, "error")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"seed": 1}, "seed: Extra inputs are not permitted"),
        ({"response_format": {}}, "response_format: Extra inputs"),
        ({"max_tokens": 0}, "max_tokens"),
        ({"temperature": 1.5}, "temperature: range"),
        ({"messages": []}, "messages"),
        ({"messages": [{"role": "system", "content": "x"}]}, "role"),
        ({"messages": [{"role": "assistant", "content": "x"}]}, "first message"),
        ({"messages": [{"role": "user", "content": "x"}, {"role": "assistant", "content": "{"}]}, "prefill"),
        ({"messages": [{"role": "user", "content": " "}]}, "non-empty"),
        ({"messages": [{"role": "user", "content": [{"type": "image_url"}]}]}, "tag is not expected"),
        ({"messages": [{"role": "user", "content": [image(data="AAAA")]}]}, "cannot be decoded"),
        ({"messages": [{"role": "user", "content": [image(media_type="image/jpeg")]}]}, "PNG, not image/jpeg"),
        ({"output_config": {"format": {"type": "json_object"}}}, "output_config.format"),
        (
            {"output_config": {"format": {"type": "json_schema", "schema": {**SCHEMA, "minProperties": 1}}}},
            "minProperties",
        ),
        ({"output_config": {"form": {}}}, "output_config: Extra inputs"),
    ],
)
def test_what_is_not_of_the_contract_is_refused(server: FakeServer, changes: dict[str, Any], words: str) -> None:
    response = post(server, body(**changes))
    assert (response.status_code, response.json()["error"]["type"]) == (400, "invalid_request_error")
    assert words in response.json()["error"]["message"]


def test_required_fields_are_named(server: FakeServer) -> None:
    sent = body()
    del sent["max_tokens"]
    assert post(server, sent).json()["error"]["message"] == "max_tokens: Field required"


def test_many_pictures_have_to_be_smaller(server: FakeServer) -> None:
    stream = io.BytesIO()
    Image.new("RGB", (2001, 8)).save(stream, "PNG")
    large = image(data=base64.b64encode(stream.getvalue()).decode())
    assert post(server, body(messages=[{"role": "user", "content": [large] * 20}])).status_code == 200
    refused = post(server, body(messages=[{"role": "user", "content": [large] * 21}]))
    assert (refused.status_code, "2000 pixels" in refused.json()["error"]["message"]) == (400, True)


def test_other_paths_are_not_there(server: FakeServer) -> None:
    assert post(server, body(), path="/v1/complete").status_code == 404


@pytest.mark.parametrize(
    ("fault", "status", "words"),
    [
        ("unauthorized", 401, "invalid x-api-key"),
        ("out_of_credit", 400, "credit balance is too low"),
        ("rate_limited", 429, "rate limit"),
        ("server_error", 529, "Overloaded"),
        ("no_json_schema", 400, "not supported"),
    ],
)
def test_fault_strikes_as_often_as_told(fault: str, status: int, words: str) -> None:
    with FakeServer(FakeAnthropic(Faults({fault: 1}), answer=lambda *asked: {})) as server:
        first = post(server, body())
        assert first.status_code == status
        assert words in first.json()["error"]["message"]
        assert post(server, body()).status_code == 200
