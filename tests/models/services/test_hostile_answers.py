"""Every served backend against a server that lies in a good answer's place: wrong types, keys, links to elsewhere."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from hostile_services import KEYLESS, LINKED, SECRET, SERVICES, leaves, replaced, twisted, used
from manitwin.errors import AccessDenied, BadReply, RateLimited, Unavailable
from manitwin.models.fakes.server import FakeServer, Response
from scripted_service import Script

# what stands in a good answer's place; an integer of 400 digits is one that JSON allows and no float holds
WRONG: dict[str, Any] = {
    "null": None,
    "text": "\x1b[31m\u202e <b>text</b> \ud800",
    "list": [[[]]],
    "object": {"code": {}, "status": []},
    "negative": -1,
    "huge": 10**400,
    "true": True,
    "key": f"the key is {SECRET}",
}


@pytest.fixture(params=sorted(SERVICES))
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def good_answers(name: str, folder: Path) -> dict[str, Any]:
    """The last answer of each kind in a use that goes well."""
    with twisted(name, lambda place, answer: answer) as (service, server):
        assert used(name, server.url, folder) is None
    return {place: answer.body for place, answer in service.seen.items() if not isinstance(answer.body, bytes)}


QUICK = ("huge", "null", "object", "text")
"""The kinds that differ most; all others are tried by the slow tests."""


@pytest.mark.parametrize(
    "kind", [kind if kind in QUICK else pytest.param(kind, marks=pytest.mark.slow) for kind in sorted(WRONG)]
)
def test_each_part_of_each_good_answer_replaced_by_another_kind(name: str, kind: str, tmp_path: Path) -> None:
    good, wrong = good_answers(name, tmp_path), WRONG[kind]
    assert good
    places = [(place, path) for place, body in good.items() for path in leaves(body) if "model_base64" not in path]
    for place, path in places:

        def change(at: str, answer: Response, place: str = place, path: tuple[Any, ...] = path) -> Response:
            if at != place or isinstance(answer.body, bytes):
                return answer
            try:
                return replace(answer, body=replaced(answer.body, path, wrong))
            except (LookupError, TypeError):  # an earlier answer of this kind has no such place
                return answer

        with twisted(name, change) as (_, server):
            used(name, server.url, tmp_path)
    written = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert not [path for path in written if SECRET.encode() in path.read_bytes()]
    assert {path.suffix for path in written} <= {".glb"} and not list(tmp_path.rglob("*.part"))


@pytest.mark.parametrize("link", ["http://127.0.0.1:{port}/x", "http://localhost:{port}/x", "http://[::1]:{port}/x"])
@pytest.mark.parametrize("name", LINKED)
def test_link_of_a_mesh_to_another_port_of_this_machine_is_not_followed(name: str, link: str, tmp_path: Path) -> None:
    with FakeServer(Script(Response(200, b"glTF internal"))) as internal:
        address = link.format(port=internal.url.rpartition(":")[2])
        moved = Response(302, b"", {"Location": address})
        with twisted(name, lambda place, answer: moved if place == "FILE" else answer) as (_, server):
            error = used(name, server.url, tmp_path)
    assert type(error) is BadReply and "neither a public address" in str(error)
    assert not internal.requests and not list(tmp_path.iterdir())


REFUSALS = {401: AccessDenied, 429: RateLimited, 500: Unavailable}


@pytest.mark.parametrize(
    "echo", [SECRET, SECRET.upper(), "".join(f"%{ord(c):02X}" for c in SECRET), "sk-0123456789%2dthat-nobody-may-see"]
)
@pytest.mark.parametrize("status", sorted(REFUSALS))
def test_key_that_is_echoed_is_shown_by_no_service(name: str, status: int, echo: str, tmp_path: Path) -> None:
    body = {"error": {"message": f"\x1b]0;no {echo}\x07", "type": echo}, "message": echo, "detail": [echo]}
    headers = {"Retry-After": "NaN", "WWW-Authenticate": echo, "Location": f"http://127.0.0.1/{echo}"}
    with FakeServer(Script(Response(status, body, headers))) as server:
        error = used(name, server.url, tmp_path)
    assert isinstance(error, REFUSALS[status])
    if name not in KEYLESS and "%2d" not in echo:
        assert echo not in str(error) and "***" in str(error)
