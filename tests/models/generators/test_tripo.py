"""What is asked of Tripo, and what is made of its answers."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from generator_runs import KEY, config, photo_request, run, text_request
from manitwin.errors import AccessDenied, BadReply, ConfigError, RateLimited, Rejected
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.server import FakeServer, Request, Response
from manitwin.models.fakes.tripo import FakeTripo
from manitwin.models.generators.tripo import URL, TripoGenerator
from manitwin.models.services.refusal import NotFound, RequestRejected


@pytest.fixture(autouse=True)
def _key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TRIPO_API_KEY", KEY)


def test_photo_is_uploaded_and_then_asked_for(tmp_path: Path) -> None:
    fake, settings = FakeTripo(key=KEY, polls=1), config()
    with FakeServer(fake) as server:
        ran = run(TripoGenerator.from_spec(f"@{server.url}", settings), tmp_path, settings)
        paths = [request.path.removeprefix("/v2/openapi") for request in server.requests]
    (task,) = fake.tasks.values()
    assert task.input == {
        "type": "image_to_model",
        "file": {"type": "png", "file_token": "upload-0"},
        "model_version": "v2.5-20250123",
        "texture": True,
        "pbr": True,
        "model_seed": 7,
        "texture_seed": 7,
    }
    (image,) = fake.uploads.values()
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(image))), photo_request().rgba)
    assert ran.made is not None and not ran.made.metric
    assert paths[:2] == ["/upload", "/task"] and paths[-1] == "/files/task-0/model.glb"


def test_text_is_asked_for_with_every_seed(tmp_path: Path) -> None:
    fake, settings = FakeTripo(key=KEY, polls=1), config()
    with FakeServer(fake) as server:
        generator = TripoGenerator.from_spec(f"P1-20260311@{server.url}/v2/openapi", settings)
        run(generator, tmp_path, settings, request=text_request(2**31 + 3))
    (task,) = fake.tasks.values()
    assert task.input["type"] == "text_to_model" and task.input["prompt"] == "a capped bottle"
    assert task.input["model_version"] == "P1-20260311"
    assert {task.input[name] for name in ("model_seed", "texture_seed", "image_seed")} == {3}


def test_true_size_is_believed_where_it_was_asked_for(tmp_path: Path) -> None:
    fake, settings = FakeTripo(key=KEY, polls=1), config(options={"auto_size": True, "face_limit": 20_000})
    with FakeServer(fake) as server:
        ran = run(TripoGenerator.from_spec(f"@{server.url}", settings), tmp_path, settings)
    (task,) = fake.tasks.values()
    assert ran.made is not None and ran.made.metric and task.input["face_limit"] == 20_000


def test_upload_is_repeated_because_it_costs_nothing(tmp_path: Path) -> None:
    fake, settings = FakeTripo(Faults({"server_error": 1}), KEY, polls=1), config()
    waits: list[float] = []
    with FakeServer(fake) as server:
        generator = TripoGenerator("v2.5-20250123", f"{server.url}/v2/openapi", KEY, settings, sleep=waits.append)
        assert run(generator, tmp_path, settings).made is not None
    assert waits == [1] and len(fake.tasks) == 1


def test_option_that_the_vendor_refuses_is_named(tmp_path: Path) -> None:
    fake, settings = FakeTripo(key=KEY), config(options={"texture_quality": "superb"})
    with FakeServer(fake) as server:
        ran = run(TripoGenerator.from_spec(f"@{server.url}", settings), tmp_path, settings)
    assert type(ran.error) is RequestRejected and "error 1004" in str(ran.error) and "superb" in str(ran.error)
    assert not fake.tasks and ran.usd == 0


def test_input_against_the_vendors_policy_is_rejected_at_once(tmp_path: Path) -> None:
    fake, settings = FakeTripo(Faults({"refusal": 1}), KEY), config()
    with FakeServer(fake) as server:
        ran = run(TripoGenerator.from_spec(f"@{server.url}", settings), tmp_path, settings, request=text_request())
        assert isinstance(ran.error, Rejected) and ran.error.reason == "generator_failed" and len(server.requests) == 1
    assert "content policy" in ran.error.detail and ran.usd == 0


class Fixed:
    def __init__(self, status: int, body: Any):
        self.response = Response(status, body)

    def answer(self, request: Request, base_url: str) -> Response:
        return self.response


STATES = [
    ({"status": "queued"}, "queued", ""),
    ({"status": "running"}, "running", ""),
    ({"status": "success"}, "done", ""),
    ({"status": "failed", "error_code": 1001, "error_msg": "broke"}, "failed", "the task is failed: 1001: broke"),
    ({"status": "banned"}, "failed", "content policy"),
    ({"status": "cancelled"}, "failed", "cancelled"),
    ({"status": "unknown"}, "failed", "unknown"),
]


@pytest.mark.parametrize(("data", "state", "words"), STATES)
def test_states_of_a_task(data: dict[str, Any], state: str, words: str) -> None:
    with FakeServer(Fixed(200, {"code": 0, "data": data})) as server:
        job = TripoGenerator.from_spec(f"@{server.url}", config()).poll("task")
    assert job.state == state and words in job.message


def test_expired_task_is_gone() -> None:
    with FakeServer(Fixed(200, {"code": 0, "data": {"status": "expired"}})) as server, pytest.raises(NotFound):
        TripoGenerator.from_spec(f"@{server.url}", config()).poll("task")


OUTPUTS = [
    ({"pbr_model": "P://h", "model": "M://h", "base_model": "B://h"}, "p"),
    ({"model": "M://h", "base_model": "B://h"}, "m"),
    ({"base_model": "B://h", "rendered_image": "R://h"}, "b"),
]


@pytest.mark.parametrize(("output", "link"), OUTPUTS)
def test_textured_model_is_taken_before_others(output: dict[str, str], link: str) -> None:
    body = {"code": 0, "data": {"status": "success", "output": output}}
    with FakeServer(Fixed(200, body)) as server, pytest.raises(BadReply, match=f"is at a {link} address"):
        TripoGenerator.from_spec(f"@{server.url}", config()).fetch("task", Path())


def test_finished_task_without_a_model_is_a_bad_reply() -> None:
    body = {"code": 0, "data": {"status": "success", "output": {"rendered_image": "R"}}}
    with FakeServer(Fixed(200, body)) as server, pytest.raises(BadReply, match="contains no model"):
        TripoGenerator.from_spec(f"@{server.url}", config()).fetch("task", Path())


CODES = [
    (403, 2010, AccessDenied),
    (403, 1005, AccessDenied),
    (401, 1002, AccessDenied),
    (404, 2001, NotFound),
    (200, 2001, NotFound),
    (400, 2017, RequestRejected),
    (429, 2000, RateLimited),
]


@pytest.mark.parametrize(("status", "code", "kind"), CODES)
def test_error_codes(status: int, code: int, kind: type) -> None:
    body = {"code": code, "message": f"no {KEY}", "suggestion": "do this"}
    with FakeServer(Fixed(status, body)) as server, pytest.raises(kind) as caught:
        TripoGenerator.from_spec(f"@{server.url}", config(retries=0)).poll("task")
    assert type(caught.value) is kind and f"error {code}: no ***: do this" in str(caught.value)


def test_specs_that_cannot_be(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("quad", "compress", "generate_parts"):
        with pytest.raises(ConfigError, match=rf"generate\.options\.{name}"):
            TripoGenerator.from_spec("", config(options={name: "geometry" if name == "compress" else True}))
    assert URL in repr(TripoGenerator.from_spec("", config())) and KEY not in repr(
        TripoGenerator.from_spec("", config())
    )
    monkeypatch.delenv("TRIPO_API_KEY")
    with pytest.raises(ConfigError, match="TRIPO_API_KEY"):
        TripoGenerator.from_spec("", config())


def test_price_is_the_vendors_list_unless_the_settings_say_another() -> None:
    def usd(spec: str = "", **options: Any) -> float:
        return TripoGenerator.from_spec(spec, config(usd=None, options=options)).usd_per_job

    # docs.tripo3d.ai/get-started/pricing.html: 30 credits, P1 50, 10 more each for what follows; 100 credits are $1
    assert usd() == 0.3 and usd("v3.1-20260211") == 0.3 and usd("P1-20260311") == 0.5
    assert usd(texture_quality="detailed") == 0.4 and usd(texture_quality="detailed", smart_low_poly=True) == 0.5
    assert TripoGenerator.from_spec("", config(usd=0.2)).usd_per_job == 0.2
    for spec, options in (
        ("Turbo-v1.0-20250506", {}),
        ("", {"geometry_quality": "detailed"}),
        ("@https://proxy.org", {}),
    ):
        with pytest.raises(ConfigError, match=r"services\.usd_per_job"):
            usd(spec, **options)
