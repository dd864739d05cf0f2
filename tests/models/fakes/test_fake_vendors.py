"""The fakes of Rodin and Tripo keep their vendors' contracts, asked by a plain HTTP client."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import httpx2
import pytest
from PIL import Image

from manitwin.models.fakes.faults import FAULTS, Faults
from manitwin.models.fakes.meshes import bottle, glb
from manitwin.models.fakes.rodin import FakeRodin
from manitwin.models.fakes.server import FakeServer
from manitwin.models.fakes.tripo import FakeTripo

KEY = {"Authorization": "Bearer rehearsal-key"}


def _png() -> bytes:
    stream = io.BytesIO()
    Image.new("RGBA", (32, 32), (9, 8, 7, 255)).save(stream, "PNG")
    return stream.getvalue()


@pytest.fixture
def rodin() -> Iterator[tuple[FakeRodin, httpx2.Client]]:
    fake = FakeRodin(credits=1.0)
    with FakeServer(fake) as server, httpx2.Client(base_url=server.url, headers=KEY) as client:
        yield fake, client


@pytest.fixture
def tripo() -> Iterator[tuple[FakeTripo, httpx2.Client]]:
    fake = FakeTripo(credits=60)
    with FakeServer(fake) as server, httpx2.Client(base_url=server.url, headers=KEY) as client:
        yield fake, client


def _form(client: httpx2.Client, images: int = 0, **fields: str) -> httpx2.Response:
    parts: list[Any] = [(name, (None, value)) for name, value in fields.items()]
    parts += [("images", (f"{n}.png", _png(), "image/png")) for n in range(images)]
    return client.post("/api/v2/rodin", files=parts)


def test_rodin_from_form_to_file(rodin: tuple[FakeRodin, httpx2.Client]) -> None:
    fake, client = rodin
    taken = _form(client, images=2, tier="Gen-2", seed="3")
    body = taken.json()
    assert taken.status_code == 201 and body["error"] is None and set(body["jobs"]) == {"uuids", "subscription_key"}
    assert [len(task.images) for task in fake.tasks.values()] == [2]
    asked = {"subscription_key": body["jobs"]["subscription_key"]}
    states = [[job["status"] for job in client.post("/api/v2/status", json=asked).json()["jobs"]] for _ in range(3)]
    assert states == [["Waiting"] * 2, ["Done", "Generating"], ["Done"] * 2]
    files = client.post("/api/v2/download", json={"task_uuid": body["uuid"]}).json()["list"]
    assert [file["name"] for file in files] == ["preview.webp", "model.glb"]
    assert httpx2.get(files[1]["url"]).content == glb([bottle(3)])
    assert client.get(files[1]["url"]).status_code == 400  # a key has no business there
    assert client.get("/api/v2/check_balance").json() == {"balance": 0.5}


BAD_FORMS = [
    ({"tier": "Gen-3", "prompt": "x"}, "tier is 'Gen-3'"),
    ({"prompt": "x", "colour": "red"}, "unknown field colour"),
    ({"prompt": "x", "seed": "65536"}, "seed"),
    ({"prompt": "x", "seed": "-1"}, "seed"),
    ({"prompt": "x", "use_original_alpha": "True"}, "use_original_alpha"),
    ({"prompt": "x", "hd_texture": "true"}, "hd_texture is not for tier Regular"),
    ({"prompt": "x", "tier": "Sketch", "geometry_file_format": "usdz"}, "Sketch"),
    ({"prompt": "x", "bbox_condition": "[1, 2]"}, "bbox_condition"),
    ({"tier": "Regular"}, "images or a prompt"),
]


@pytest.mark.parametrize(("fields", "words"), BAD_FORMS)
def test_rodin_refuses_bad_forms(rodin: tuple[FakeRodin, httpx2.Client], fields: dict[str, str], words: str) -> None:
    fake, client = rodin
    answer = _form(client, **fields)
    assert answer.status_code == 400 and answer.json()["error"] == "INVALID_REQUEST"
    assert words in answer.json()["message"] and not fake.tasks and fake.credits == 1.0


def test_rodin_refuses_keys_bodies_and_empty_accounts(rodin: tuple[FakeRodin, httpx2.Client]) -> None:
    fake, client = rodin
    for key in ("", "Bearer other", "rehearsal-key"):
        answer = client.post("/api/v2/status", json={}, headers={"Authorization": key})
        assert answer.status_code == 401 and answer.json()["error"] == "UNAUTHORIZED"
    assert _form(client, images=6).status_code == 400
    assert client.post("/api/v2/rodin", json={"prompt": "x"}).status_code == 400  # only multipart is taken
    assert client.post("/api/v2/status", json={"subscription_key": "other"}).status_code == 404
    assert [_form(client, prompt="x").status_code for _ in range(3)] == [201, 201, 400]
    assert _form(client, prompt="x").json()["error"] == "INSUFFICIENT_FUND" and len(fake.tasks) == 2


def test_rodin_lists_no_files_before_the_end(rodin: tuple[FakeRodin, httpx2.Client]) -> None:
    _, client = rodin
    task = _form(client, prompt="x").json()["uuid"]
    assert client.post("/api/v2/download", json={"task_uuid": task}).json()["list"] == []


def _task(client: httpx2.Client, **fields: Any) -> httpx2.Response:
    return client.post("/v2/openapi/task", json=fields)


def test_tripo_from_upload_to_file(tripo: tuple[FakeTripo, httpx2.Client]) -> None:
    fake, client = tripo
    for path in ("/v2/openapi/upload", "/v2/openapi/upload/sts"):
        answer = client.post(path, files={"file": ("a.png", _png(), "image/png")})
        assert answer.json()["code"] == 0
    token = answer.json()["data"]["image_token"]
    assert fake.uploads[token] == _png()
    file = {"type": "png", "file_token": token}
    taken = _task(client, type="image_to_model", file=file, pbr=True, model_seed=4).json()
    name = taken["data"]["task_id"]
    tasks = [client.get(f"/v2/openapi/task/{name}").json()["data"] for _ in range(4)]
    assert [task["status"] for task in tasks] == ["queued", "running", "success", "success"]
    first, second = (task["output"]["pbr_model"] for task in tasks[2:])
    assert first != second and httpx2.get(second).content == glb([bottle(4)])
    assert client.get(second).status_code == 400
    assert client.get("/v2/openapi/user/balance").json()["data"] == {"balance": 30, "frozen": 0}


BAD_TASKS = [
    ({"type": "make_coffee"}, 400, 2002),
    ({"type": "text_to_model"}, 400, 1004),
    ({"type": "text_to_model", "prompt": "x" * 1025}, 400, 1004),
    ({"type": "text_to_model", "prompt": "x", "colour": "red"}, 400, 1004),
    ({"type": "text_to_model", "prompt": "x", "pbr": "yes"}, 400, 1004),
    ({"type": "text_to_model", "prompt": "x", "model_seed": True}, 400, 1004),
    ({"type": "text_to_model", "prompt": "x", "model_version": "v9"}, 400, 2017),
    ({"type": "image_to_model", "file": {"type": "png", "file_token": "other"}}, 404, 2019),
]


@pytest.mark.parametrize(("fields", "status", "code"), BAD_TASKS)
def test_tripo_refuses_bad_tasks(
    tripo: tuple[FakeTripo, httpx2.Client], fields: dict[str, Any], status: int, code: int
) -> None:
    fake, client = tripo
    answer = _task(client, **fields)
    assert (answer.status_code, answer.json()["code"]) == (status, code) and not fake.tasks


def test_tripo_refuses_keys_files_and_empty_accounts(tripo: tuple[FakeTripo, httpx2.Client]) -> None:
    _, client = tripo
    answer = client.get("/v2/openapi/user/balance", headers={"Authorization": "Bearer other"})
    assert (answer.status_code, answer.json()["code"]) == (401, 1002)
    gif = client.post("/v2/openapi/upload", files={"file": ("a.gif", b"GIF89a", "image/gif")})
    assert gif.json()["code"] == 2004
    assert client.get("/v2/openapi/task/other").json()["code"] == 2001
    assert [_task(client, type="text_to_model", prompt="x").json()["code"] for _ in range(3)] == [0, 0, 2010]


def test_every_fault_of_http_can_be_had() -> None:
    expected = {"unauthorized": 401, "rate_limited": 429, "server_error": 500, "not_json": 200, "wrong_schema": 200}
    assert set(expected) < set(FAULTS)
    for fault, status in expected.items():
        for fake, path in ((FakeRodin, "/api/v2/check_balance"), (FakeTripo, "/v2/openapi/user/balance")):
            with FakeServer(fake(Faults({fault: 1}))) as server:
                answers = [httpx2.get(server.url + path, headers=KEY) for _ in range(2)]
            assert [answer.status_code for answer in answers] == [status, 200]
            assert "balance" in answers[1].text and "balance" not in answers[0].text
            assert ("retry-after" in answers[0].headers) == (fault == "rate_limited")
