"""The fake refuses what OpenAI refuses; asked without this package's client."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from typing import Any

import httpx2
import pytest
from PIL import Image

from manitwin.models.fakes.faults import ALWAYS, Faults
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.server import FakeServer

SCHEMA = {
    "type": "object",
    "properties": {"color": {"type": "string", "enum": ["red", "blue"]}},
    "required": ["color"],
    "additionalProperties": False,
}


def picture(kind: str = "PNG") -> str:
    stream = io.BytesIO()
    Image.new("RGB", (30, 60)).save(stream, kind)
    return f"data:image/{kind.lower()};base64,{base64.b64encode(stream.getvalue()).decode()}"


def body(**changes: Any) -> dict[str, Any]:
    parts = [{"type": "text", "text": "Which color?"}, {"type": "image_url", "image_url": {"url": picture()}}]
    described = {"name": "color", "strict": True, "schema": SCHEMA}
    return {
        "model": "gpt-x",
        "messages": [{"role": "user", "content": parts}],
        "response_format": {"type": "json_schema", "json_schema": described},
    } | changes


def post(
    server: FakeServer, sent: Any, path: str = "/v1/chat/completions", key: str = "rehearsal-key"
) -> httpx2.Response:
    headers = {"Authorization": f"Bearer {key}"}
    return httpx2.post(server.url + path, json=sent, headers=headers, timeout=10, trust_env=False)


def said(response: httpx2.Response) -> str:
    return response.json()["error"]["message"]


@pytest.fixture
def server() -> Iterator[FakeServer]:
    with FakeServer(
        FakeOpenAi(answer=lambda name, schema, text, pngs: {"color": f"{name} {text} {len(pngs)}"})
    ) as server:
        yield server


def test_answer_is_given_name_schema_text_and_pictures(server: FakeServer) -> None:
    completion = post(server, body()).json()
    assert completion["choices"][0]["message"]["content"] == '{"color": "color Which color? 1"}'
    assert completion["choices"][0]["finish_reason"] == "stop"
    # 3 tokens of text, and 2 x 3 of a picture of 30 x 60 pixels
    assert completion["usage"]["prompt_tokens"] == 9
    assert completion["usage"]["total_tokens"] == 9 + completion["usage"]["completion_tokens"]


def test_key_is_checked(server: FakeServer) -> None:
    response = post(server, body(), key="another")
    assert (response.status_code, response.json()["error"]["code"]) == (401, "invalid_api_key")
    assert httpx2.post(f"{server.url}/v1/chat/completions", json=body(), trust_env=False).status_code == 401


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"tempature": 0}, "Unrecognized request argument supplied: tempature"),
        ({"temperature": 2.5}, "temperature"),
        ({"max_tokens": 0}, "max_tokens"),
        ({"seed": "one"}, "seed"),
        ({"messages": []}, "messages"),
        ({"messages": [{"role": "robot", "content": "x"}]}, "role"),
        ({"messages": [{"role": "user", "content": [{"type": "image"}]}]}, "content part"),
        ({"response_format": {"type": "yaml"}}, "response_format"),
        ({"response_format": {"type": "json_object"}, "messages": [{"role": "user", "content": "Go."}]}, "word 'json'"),
    ],
)
def test_what_is_not_of_the_contract_is_refused(server: FakeServer, changes: dict[str, Any], words: str) -> None:
    response = post(server, body(**changes))
    assert response.status_code == 400
    assert words in said(response)


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("https://example.org/x.png", "data URLs only"),
        ("data:image/png;base64,AAAA", "cannot be decoded"),
        ("data:image/png;base64,???", "cannot be decoded"),
        (picture("JPEG").replace("image/jpeg", "image/png"), "JPEG, not image/png"),
        (picture("BMP"), "BMP, not image/bmp"),
        (picture()[:-40], "cannot be decoded"),
    ],
)
def test_picture_that_cannot_be_read_is_refused(server: FakeServer, url: str, words: str) -> None:
    parts = [{"type": "image_url", "image_url": {"url": url}}]
    response = post(server, body(messages=[{"role": "user", "content": parts}]))
    assert response.status_code == 400
    assert words in said(response)


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP", "GIF"])
def test_picture_of_each_documented_kind_is_read(server: FakeServer, kind: str) -> None:
    parts = [{"type": "image_url", "image_url": {"url": picture(kind), "detail": "low"}}]
    assert post(server, body(messages=[{"role": "user", "content": parts}])).status_code == 200


def test_strict_schema_is_checked(server: FakeServer) -> None:
    loose = {**SCHEMA, "required": []}
    wanted = {"type": "json_schema", "json_schema": {"name": "color", "strict": True, "schema": loose}}
    response = post(server, body(response_format=wanted))
    assert (response.status_code, response.json()["error"]["code"]) == (400, "invalid_json_schema")
    wanted["json_schema"] = {"name": "color", "schema": loose}  # not strict: a hint
    assert post(server, body(response_format=wanted)).status_code == 200
    wanted["json_schema"] = {"name": "no spaces", "schema": SCHEMA}
    assert post(server, body(response_format=wanted)).status_code == 400


def test_other_paths_are_not_there(server: FakeServer) -> None:
    assert post(server, body(), path="/v1/responses").status_code == 404


def test_body_that_is_no_json_is_refused(server: FakeServer) -> None:
    headers = {"Authorization": "Bearer rehearsal-key"}
    url = f"{server.url}/v1/chat/completions"
    for content in (b"{", b"[]"):
        assert httpx2.post(url, content=content, headers=headers, trust_env=False).status_code == 400


def test_schema_in_the_text_is_answered_where_there_is_no_other() -> None:
    with FakeServer(
        FakeOpenAi(answer=lambda name, schema, text, pngs: {"asked": list(schema["properties"])})
    ) as server:
        told = f'Answer like {{"this": 1}} but by {str(SCHEMA).replace(chr(39), chr(34)).replace("False", "false")}.'
        sent = body(messages=[{"role": "system", "content": told}])
        del sent["response_format"]
        assert post(server, sent).json()["choices"][0]["message"]["content"] == '{"asked": ["color"]}'


@pytest.mark.parametrize(
    ("fault", "status", "code"),
    [
        ("unauthorized", 401, "invalid_api_key"),
        ("out_of_credit", 429, "insufficient_quota"),
        ("rate_limited", 429, "rate_limit_exceeded"),
        ("server_error", 500, None),
        ("no_json_schema", 400, None),
    ],
)
def test_fault_strikes_as_often_as_told(fault: str, status: int, code: str | None) -> None:
    with FakeServer(FakeOpenAi(Faults({fault: 1}), answer=lambda *asked: {})) as server:
        first = post(server, body())
        assert (first.status_code, first.json()["error"]["code"]) == (status, code)
        assert ("retry-after" in first.headers) == (fault == "rate_limited")
        assert post(server, body()).status_code == 200


def test_implausible_answer_is_a_thousand_times_as_heavy() -> None:
    said = {"mass_kg": {"low": 0.4}, "length_m": 0.2, "id": 3}
    with FakeServer(FakeOpenAi(Faults({"implausible": ALWAYS}), answer=lambda *a: said)) as server:
        assert post(server, body()).json()["choices"][0]["message"]["content"] == (
            '{"mass_kg": {"low": 400.0}, "length_m": 0.2, "id": 3}'
        )
