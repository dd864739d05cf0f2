"""What the fake generation services refuse, and in whose words: asked by plain HTTP, without this package's clients."""

from __future__ import annotations

import base64
import io
import json
import urllib.error
import urllib.request
from typing import Any

import pytest
from PIL import Image

from manitwin.models.fakes.fal import FakeFal
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.hunyuan3d import FakeHunyuan3d
from manitwin.models.fakes.meshy import FakeMeshy
from manitwin.models.fakes.server import FakeServer

MESHY = {"Authorization": "Bearer rehearsal-key"}
FAL = {"Authorization": "Key rehearsal-key"}
IMAGE, TEXT = "/openapi/v1/image-to-3d", "/openapi/v2/text-to-3d"


def picture() -> str:
    stream = io.BytesIO()
    Image.new("RGBA", (4, 4), (255, 0, 0, 255)).save(stream, "PNG")
    return base64.b64encode(stream.getvalue()).decode()


URI = f"data:image/png;base64,{picture()}"


def ask(server: FakeServer, path: str, body: Any = None, headers: dict[str, str] | None = None) -> tuple[int, Any]:
    """Return the status and the body, as JSON where it is."""
    data = None if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
    url = path if "://" in path else server.url + path
    try:
        with urllib.request.urlopen(urllib.request.Request(url, data, headers or {}), timeout=10) as answer:
            status, content = answer.status, answer.read()
    except urllib.error.HTTPError as error:
        with error:
            status, content = error.code, error.read()
    try:
        return status, json.loads(content)
    except ValueError:
        return status, content


@pytest.mark.parametrize(
    ("path", "body", "status", "words"),
    [
        (IMAGE, {"image_url": URI}, 202, ""),
        (IMAGE, {}, 400, "image_url is required"),
        (IMAGE, b"{", 400, "not JSON"),
        (IMAGE, {"image_url": "data:image/png;base64,AAAA"}, 400, "base64 of a picture"),
        (IMAGE, {"image_url": "file:///etc/passwd"}, 400, "https URL or a data URI"),
        (IMAGE, {"image_url": URI, "ai_model": "meshy-99"}, 400, "meshy-6"),
        (IMAGE, {"image_url": URI, "target_polycount": 99}, 400, "100 to 300000"),
        (IMAGE, {"image_url": URI, "target_polycount": True}, 400, "integer"),
        (IMAGE, {"image_url": URI, "enable_pbr": "yes"}, 400, "true or false"),
        (IMAGE, {"image_url": URI, "colour": 1}, 400, "not a known field"),
        (IMAGE, {"image_url": URI, "target_formats": ["ply"]}, 400, "glb"),
        (TEXT, {"mode": "preview", "prompt": "a cup"}, 202, ""),
        (TEXT, {"mode": "preview", "prompt": "x" * 601}, 400, "600"),
        (TEXT, {"mode": "draft", "prompt": "a cup"}, 400, "mode"),
        (TEXT, {"prompt": "a cup"}, 400, "mode is required"),
        (TEXT, {"mode": "refine", "preview_task_id": "none"}, 404, "Preview task not found"),
    ],
)
def test_meshy_keeps_its_fields(path: str, body: Any, status: int, words: str) -> None:
    with FakeServer(FakeMeshy()) as server:
        got, answer = ask(server, path, body, MESHY)
    assert got == status and words in answer.get("message", "")


def test_meshy_refines_what_is_done_only_and_is_paid_for_each_task() -> None:
    meshy = FakeMeshy(balance=35)
    with FakeServer(meshy) as server:
        id = ask(server, TEXT, {"mode": "preview", "prompt": "a cup"}, MESHY)[1]["result"]
        refine = {"mode": "refine", "preview_task_id": id}
        assert ask(server, TEXT, refine, MESHY)[0] == 400
        states = [ask(server, f"{TEXT}/{id}", None, MESHY)[1]["status"] for _ in range(3)]
        assert states == ["IN_PROGRESS", "SUCCEEDED", "SUCCEEDED"]
        assert ask(server, TEXT, refine, MESHY)[0] == 202
        assert ask(server, TEXT, refine, MESHY) == (402, {"message": "Insufficient funds"})
        assert ask(server, "/openapi/v1/balance", None, MESHY)[1] == {"balance": 5}
        listed = ask(server, f"{TEXT}?page_size=50&sort_by=-created_at", None, MESHY)[1]
        assert [task["type"] for task in listed] == ["text-to-3d-refine", "text-to-3d-preview"]
        assert ask(server, f"{TEXT}?page_size=51", None, MESHY)[0] == 400
        assert ask(server, f"{TEXT}/none", None, MESHY) == (404, {"message": "Task not found"})
        link = ask(server, f"{TEXT}/{id}", None, MESHY)[1]["model_urls"]["glb"]
        assert ask(server, link)[1][:4] == b"glTF" and ask(server, link, None, MESHY)[0] == 400


@pytest.mark.parametrize("path", [IMAGE, "/openapi/v1/balance", f"{TEXT}/x"])
@pytest.mark.parametrize("headers", [{}, {"Authorization": "Bearer other"}, FAL])
def test_meshy_asks_for_its_key_everywhere(path: str, headers: dict[str, str]) -> None:
    with FakeServer(FakeMeshy()) as server:
        assert ask(server, path, None, headers)[0] == 401


def test_fal_answers_202_until_complete_and_uses_the_apps_address() -> None:
    with FakeServer(FakeFal()) as server:
        assert ask(server, "/fal-ai/hyper3d/rodin", {"prompt": "a cup"})[0] == 401
        assert ask(server, "/fal-ai/nothing", {}, FAL)[0] == 404
        status, taken = ask(server, "/fal-ai/hyper3d/rodin", {"prompt": "a cup"}, FAL)
        assert status == 200 and taken["response_url"].startswith(f"{server.url}/fal-ai/hyper3d/requests/")
        assert ask(server, taken["response_url"], None, FAL)[0] == 400
        looks = [ask(server, taken["status_url"], None, FAL) for _ in range(3)]
        assert [status for status, _ in looks] == [202, 200, 200] and looks[0][1]["status"] == "IN_QUEUE"
        made = ask(server, taken["response_url"], None, FAL)[1]["model_mesh"]
        assert ask(server, made["url"])[1][:4] == b"glTF"


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({}, "image_url"),
        ({"image_url": URI, "mesh_simplify": 0.5}, "mesh_simplify"),
        ({"image_url": URI, "texture_size": 777}, "texture_size"),
        ({"image_url": URI, "steps": 3}, "steps"),
    ],
)
def test_fal_tells_of_a_bad_field_once_the_app_has_seen_it(body: Any, field: str) -> None:
    with FakeServer(FakeFal(polls=1)) as server:
        taken = ask(server, "/fal-ai/trellis", body, FAL)[1]
        assert ask(server, taken["status_url"], None, FAL)[1]["status"] == "COMPLETED"
        status, answer = ask(server, taken["response_url"], None, FAL)
    assert status == 422 and answer["detail"][0]["loc"] == ["body", field]


@pytest.mark.parametrize(
    ("version", "tex", "body", "status"),
    [
        ("2.0", False, {"image": picture()}, 200),
        ("2.0", False, {"image": picture(), "texture": True}, 404),
        ("2.0", True, {"image": picture(), "texture": True}, 200),
        ("2.0", True, {"text": "a cup"}, 404),
        ("2.0", True, {"image": URI}, 404),
        ("2.1", False, {"image": picture(), "texture": True}, 200),
        ("2.1", False, {"image": "no picture"}, 404),
        ("2.1", False, {"text": "a cup"}, 422),
        ("2.1", False, {"image": picture(), "seed": 2**32}, 422),
        ("2.1", False, {"image": picture(), "guidance_scale": 0.0}, 422),
        ("2.1", False, {"image": picture(), "unknown": 1}, 200),
    ],
)
def test_hunyuan_tells_of_a_failure_by_404_and_of_a_range_by_422(
    version: Any, tex: bool, body: Any, status: int
) -> None:
    with FakeServer(FakeHunyuan3d(version=version, enable_tex=tex)) as server:
        got, answer = ask(server, "/generate", body)
    assert got == status
    if status == 404:
        assert answer["error_code"] == 1 and "HIGH TRAFFIC" in answer["text"]
    if status == 422:
        assert answer["detail"][0]["loc"][0] == "body"
    if status == 200:
        assert answer[:4] == b"glTF"


@pytest.mark.parametrize(
    ("version", "body", "states"),
    [
        ("2.0", {"image": picture()}, ["processing", "completed", "completed"]),
        ("2.0", {"image": picture(), "type": "obj"}, ["processing"] * 3),
        ("2.0", {"image": picture(), "texture": True}, ["processing"] * 3),
        ("2.1", {"image": picture(), "texture": True}, ["processing", "texturing", "completed"]),
        ("2.1", {"image": picture()}, ["processing", "texturing", "texturing"]),
    ],
)
def test_hunyuan_never_says_that_a_sent_job_failed(version: Any, body: Any, states: list[str]) -> None:
    with FakeServer(FakeHunyuan3d(version=version)) as server:
        uid = ask(server, "/send", body)[1]["uid"]
        looks = [ask(server, f"/status/{uid}")[1] for _ in range(3)]
        assert ask(server, "/status/never-sent")[1] == {"status": "processing"}
        assert ask(server, "/health")[0] == (200 if version == "2.1" else 404)
    assert [look["status"] for look in looks] == states
    assert all(("model_base64" in look) == (look["status"] == "completed") for look in looks)


def test_outages_strike_as_often_as_they_are_told() -> None:
    meshy = FakeMeshy(faults=Faults({"rate_limited": 1, "server_error": 1}))
    with FakeServer(meshy) as server:
        answers = [ask(server, IMAGE, {"image_url": URI}, MESHY)[0] for _ in range(3)]
    assert answers == [429, 500, 202] and meshy.submitted("image-to-3d") == 1
