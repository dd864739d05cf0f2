"""Meshy's client against a server that keeps Meshy's contract."""

from __future__ import annotations

import base64
import io
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from rehearsed_jobs import KEY, TEXT, KeptJobs, asked, check_key_is_nowhere, finished, made, photo, refused, settings

from manitwin.config import BuildConfig
from manitwin.engine.charges import record_charges
from manitwin.errors import AccessDenied, BadReply, ConfigError, RateLimited, Rejected, Unavailable
from manitwin.models.fakes.faults import ALWAYS, Faults
from manitwin.models.fakes.meshy import FakeMeshy
from manitwin.models.fakes.server import FakeServer, Request, Response
from manitwin.models.generators.meshy import MeshyGenerator
from manitwin.models.generators.run import run_generator
from manitwin.models.services.refusal import AnswerLost

IMAGE, TEXTS, FILE = "/openapi/v1/image-to-3d", "/openapi/v2/text-to-3d", "GET /files/ID/model.glb"


@pytest.fixture
def meshy() -> FakeMeshy:
    return FakeMeshy(key=KEY)


def client(
    server: FakeServer, config: BuildConfig | None = None, waits: list[float] | None = None, key: str = KEY
) -> MeshyGenerator:
    return MeshyGenerator("meshy-6", server.url, key, config or settings(), ([] if waits is None else waits).append)


def test_picture_becomes_a_textured_mesh(meshy: FakeMeshy, tmp_path: Path) -> None:
    with FakeServer(meshy) as server:
        generator = client(server)
        got = made(generator, photo(), tmp_path)
    look = f"GET {IMAGE}/ID"
    assert asked(server) == [f"POST {IMAGE}", look, look, look, FILE]
    body = server.requests[0].json()
    sent = Image.open(io.BytesIO(base64.b64decode(body["image_url"].removeprefix("data:image/png;base64,"))))
    assert np.array_equal(np.asarray(sent), photo().rgba) and body["ai_model"] == "meshy-6"
    assert len(trimesh.load_scene(got.path).to_mesh().faces) > 4000
    assert got.notes == {"consumed_credits": 30} and got.model == "meshy-6" and meshy.balance == 970
    check_key_is_nowhere([generator, got, vars(generator)], tmp_path, [server], "/files/")


def test_text_is_a_preview_and_a_refine_in_one_job(meshy: FakeMeshy, tmp_path: Path) -> None:
    with FakeServer(meshy) as server:
        got = made(client(server), TEXT, tmp_path)
    look = f"GET {TEXTS}/ID"
    assert asked(server) == [f"POST {TEXTS}", look, look, f"POST {TEXTS}", look, look, look, look, FILE]
    assert server.requests[3].json()["preview_task_id"] == server.requests[1].path.rpartition("/")[2]
    assert got.notes == {"consumed_credits": 30}


@pytest.mark.parametrize("polls", [0, 1, 2, 3, 4])
def test_job_goes_on_in_another_process_without_a_second_payment(meshy: FakeMeshy, tmp_path: Path, polls: int) -> None:
    with FakeServer(meshy) as server:
        first = client(server)
        job_id = first.submit(TEXT)
        for _ in range(polls):
            first.poll(job_id)
        finished(client(server), job_id, tmp_path)
    assert (meshy.submitted("text-to-3d-preview"), meshy.submitted("text-to-3d-refine")) == (1, 1)


def test_refine_of_an_earlier_job_of_the_same_text_is_not_taken_over(meshy: FakeMeshy, tmp_path: Path) -> None:
    with FakeServer(meshy) as server:
        made(client(server), TEXT, tmp_path)
        finished(client(server), client(server).submit(TEXT), tmp_path)
    assert meshy.submitted("text-to-3d-refine") == 2


@pytest.mark.parametrize("restarted", [False, True])
def test_refine_whose_answer_was_lost_is_found_and_not_paid_again(
    meshy: FakeMeshy, tmp_path: Path, restarted: bool
) -> None:
    with FakeServer(meshy) as server:
        generator = client(server)
        job_id = generator.submit(TEXT)
        while meshy.submitted("text-to-3d-refine") == 0:
            if meshy._tasks[job_id.partition(":")[2]].polls_left == 1:
                meshy.faults = _CutAt("POST", server)
            try:
                generator.poll(job_id)
            except AnswerLost:
                break
        meshy.faults = Faults()
        finished(client(server) if restarted else generator, job_id, tmp_path)
    assert meshy.submitted("text-to-3d-refine") == 1


class _CutAt(Faults):
    """Cuts the answers of requests of one method only."""

    def __init__(self, method: str, server: FakeServer):
        super().__init__()
        self.method, self.server = method, server

    def strike(self, name: str) -> bool:
        return name == "disconnects" and self.server.requests[-1].method == self.method


def test_charged_once_over_a_crash(meshy: FakeMeshy, tmp_path: Path) -> None:
    jobs, config = KeptJobs(), settings(usd_per_job=0.5)
    with FakeServer(meshy) as server, record_charges() as bill:
        meshy.faults = Faults({"job_never_ends": 1})
        with pytest.raises(Unavailable):
            run_generator(client(server, config), TEXT, tmp_path, settings=config.generate, jobs=jobs, sleep=_no_wait)
        for task in meshy._tasks.values():
            task.never_ends = False
        run_generator(client(server, config), TEXT, tmp_path, settings=config.generate, jobs=jobs, sleep=_no_wait)
    assert bill.usd == 0.5 and meshy.submitted("text-to-3d-preview") == 1
    assert KEY not in str(jobs.notes)


def _no_wait(seconds: float) -> None:
    pass


@pytest.mark.parametrize(
    ("fault", "error", "words", "requests", "waits"),
    [
        ("unauthorized", AccessDenied, "MESHY_API_KEY", 1, []),
        ("out_of_credit", AccessDenied, "Insufficient funds", 1, []),
        ("rate_limited", RateLimited, "Too many requests", 3, [1, 1]),
        ("server_error", Unavailable, "Internal server error", 1, []),
        ("disconnects", AnswerLost, "it is unknown whether", 1, []),
        ("hangs", AnswerLost, "it is unknown whether", 1, []),
        ("not_json", AnswerLost, "JSON object", 1, []),
        ("wrong_schema", AnswerLost, "no result", 1, []),
    ],
)
def test_trouble_at_a_submit(
    meshy: FakeMeshy, fault: str, error: Any, words: str, requests: int, waits: list[float]
) -> None:
    meshy.faults, waited = Faults({fault: ALWAYS}), list[float]()
    with FakeServer(meshy) as server:
        generator = client(server, settings(timeout_s=1.0 if fault == "hangs" else 20.0), waited)
        assert words in refused(error, lambda: generator.submit(TEXT))
    assert len(server.requests) == requests and waited == waits and meshy.submitted("text-to-3d-preview") <= 1


@pytest.mark.parametrize(
    ("fault", "error", "requests"),
    [
        ("unauthorized", AccessDenied, 1),
        ("rate_limited", RateLimited, 3),
        ("server_error", Unavailable, 3),
        ("disconnects", Unavailable, 3),
        ("hangs", Unavailable, 3),
        ("not_json", BadReply, 1),
        ("wrong_schema", BadReply, 1),
    ],
)
def test_trouble_at_a_poll_is_retried_where_that_may_help(
    meshy: FakeMeshy, tmp_path: Path, fault: str, error: Any, requests: int
) -> None:
    with FakeServer(meshy) as server:
        generator = client(server, settings(timeout_s=1.0 if fault == "hangs" else 20.0))
        job_id = generator.submit(photo())
        meshy.faults = Faults({fault: ALWAYS})
        refused(error, lambda: generator.poll(job_id))
        assert len(server.requests) == 1 + requests
        meshy.faults = Faults({fault: 1} if requests > 1 else {})
        generator.poll(job_id)
        finished(client(server), job_id, tmp_path)
    assert meshy.submitted("image-to-3d") == 1


def test_retry_after_once_is_waited_for(meshy: FakeMeshy) -> None:
    meshy.faults, waited = Faults({"rate_limited": 1}), list[float]()
    with FakeServer(meshy) as server:
        assert client(server, waits=waited).submit(TEXT).startswith("text:")
    assert waited == [1] and meshy.submitted("text-to-3d-preview") == 1


def test_failed_job_says_why_and_endless_one_stays_under_way(meshy: FakeMeshy) -> None:
    meshy.faults = Faults({"job_fails": 1})
    with FakeServer(meshy) as server:
        generator = client(server)
        job_id = generator.submit(photo())
        states = [generator.poll(job_id) for _ in range(2)]
        assert [s.state for s in states] == ["running", "failed"] and states[1].message == "The mesh could not be made"
        meshy.faults = Faults({"job_never_ends": 1})
        endless = generator.submit(photo())
        assert {generator.poll(endless).state for _ in range(9)} == {"running"}


@pytest.mark.parametrize(("times", "downloads"), [(1, 2), (ALWAYS, 2)])
def test_expired_link_is_replaced_once(meshy: FakeMeshy, tmp_path: Path, times: int, downloads: int) -> None:
    with FakeServer(meshy) as server:
        generator = client(server)
        job_id = generator.submit(photo())
        while generator.poll(job_id).state != "done":
            pass
        meshy.faults = Faults({"expired_link": times})
        if times == 1:
            assert generator.fetch(job_id, tmp_path).path.stat().st_size > 10_000
        else:
            assert "no longer valid" in refused(BadReply, lambda: generator.fetch(job_id, tmp_path))
    links = [r.query["Expires"] for r in server.requests if r.path.startswith("/files/")]
    assert len(links) == len(set(links)) == downloads


@pytest.mark.parametrize(("fault", "error"), [("empty_mesh", BadReply), ("truncated_mesh", Rejected)])
def test_broken_file_is_never_taken(meshy: FakeMeshy, tmp_path: Path, fault: str, error: Any) -> None:
    meshy.faults, config = Faults({fault: ALWAYS}), settings()
    with FakeServer(meshy) as server:
        generator = client(server)
        refused(
            error,
            lambda: run_generator(
                generator, photo(), tmp_path, settings=config.generate, jobs=KeptJobs(), sleep=_no_wait
            ),
        )
    assert not list(tmp_path.iterdir()) and meshy.submitted("image-to-3d") == 1


@dataclass
class Hostile:
    """A server whose finished task names what it is told to."""

    task: dict[str, Any]
    seen: list[Request] = field(default_factory=list)

    def answer(self, request: Request, base_url: str) -> Response:
        self.seen.append(request)
        return Response(200, self.task)


@pytest.mark.parametrize(
    "urls",
    [
        {"glb": "file:///etc/passwd"},
        {"glb": "http://[::1/model.glb"},
        {"glb": "http://127.0.0.1:99999/model.glb"},
        {"glb": "ftp://127.0.0.1/model.glb"},
        {"glb": "http://x/" + "a" * 10_000},
        {"glb": "http://x/a\nb"},
        {"glb": 7},
        {},
        "https://x/model.glb",
    ],
)
def test_link_that_is_no_web_address_is_refused(tmp_path: Path, urls: Any) -> None:
    hostile = Hostile({"status": "SUCCEEDED", "model_urls": urls})
    with FakeServer(hostile) as server:
        refused(BadReply, lambda: client(server).fetch("image:x", tmp_path))
    assert not list(tmp_path.iterdir())


def test_link_to_another_port_of_this_machine_is_not_followed(tmp_path: Path) -> None:
    glb = b"glTF" + bytes(20)

    class Elsewhere:
        def answer(self, request: Request, base_url: str) -> Response:
            return Response(200, glb)

    with FakeServer(Elsewhere()) as elsewhere:
        hostile = Hostile({"status": "SUCCEEDED", "model_urls": {"glb": f"{elsewhere.url}/model.glb"}})
        with FakeServer(hostile) as server:
            assert "neither a public address" in refused(BadReply, lambda: client(server).fetch("image:x", tmp_path))
    assert not elsewhere.requests and not list(tmp_path.iterdir())


def test_job_id_cannot_lead_to_another_place_of_the_api() -> None:
    hostile = Hostile({"status": "PENDING"})
    with FakeServer(hostile) as server:
        client(server).poll("image:../../v1/balance?x=")
    assert server.requests[0].path == f"{IMAGE}/..%2F..%2Fv1%2Fbalance%3Fx%3D"


def test_error_that_repeats_the_key_does_not_show_it() -> None:
    class Echo:
        def answer(self, request: Request, base_url: str) -> Response:
            return Response(401, {"message": f"bad key {request.headers['authorization']}"})

    with FakeServer(Echo()) as server:
        assert "***" in refused(AccessDenied, lambda: client(server).submit(TEXT))


def test_text_that_is_too_long_is_rejected_before_it_is_sent(meshy: FakeMeshy) -> None:
    with FakeServer(meshy) as server:
        request = type(TEXT)(None, "x" * 601, None, 0)
        assert "601" in refused(Rejected, lambda: client(server).submit(request))
    assert not server.requests


def test_options_go_to_the_step_that_takes_them(meshy: FakeMeshy, tmp_path: Path) -> None:
    options = {"target_polycount": 5000, "hd_texture": True, "moderation": True}
    with FakeServer(meshy) as server:
        made(client(server, settings(options=options)), TEXT, tmp_path)
    preview, refine = (json.loads(r.body) for r in server.requests if r.method == "POST")
    assert preview["target_polycount"] == 5000 and "hd_texture" not in preview and preview["moderation"]
    assert refine["hd_texture"] and "target_polycount" not in refine and refine["moderation"]


def test_vendors_words_reach_the_person(meshy: FakeMeshy) -> None:
    with FakeServer(meshy) as server:
        generator = client(server, settings(options={"topology": "hexagon"}))
        assert "topology must be one of quad, triangle" in refused(BadReply, lambda: generator.submit(photo()))


def test_probe_says_what_is_left(meshy: FakeMeshy) -> None:
    with FakeServer(meshy) as server:
        assert client(server).probe() == "1000 credits left"
        assert "MESHY_API_KEY" in refused(AccessDenied, client(server, key="wrong").probe, key="wrong")
    assert len(server.requests) == 2


def test_spec_needs_a_key_and_a_price(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MESHY_API_KEY", raising=False)
    with pytest.raises(ConfigError, match="MESHY_API_KEY"):
        MeshyGenerator.from_spec("", settings())
    monkeypatch.setenv("MESHY_API_KEY", KEY)
    assert "services.usd_per_job" in refused(ConfigError, lambda: MeshyGenerator.from_spec("", settings()))
    paid = MeshyGenerator.from_spec("meshy-5", settings(usd_per_job=0.4))
    assert (paid.model, paid.usd_per_job) == ("meshy-5", 0.4) and "api.meshy.ai" in repr(paid) and KEY not in repr(paid)
    local = MeshyGenerator.from_spec("@http://127.0.0.1:9000", settings())
    assert (local.model, local.usd_per_job) == ("meshy-6", 0.0)
