"""fal's client against a server that keeps the contract of fal's queue."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from rehearsed_jobs import KEY, TEXT, KeptJobs, asked, check_key_is_nowhere, finished, made, photo, refused, settings

from manitwin.config import BuildConfig
from manitwin.errors import AccessDenied, BadReply, ConfigError, RateLimited, Rejected, Unavailable, Unsupported
from manitwin.models.fakes.fal import FakeFal
from manitwin.models.fakes.faults import ALWAYS, Faults
from manitwin.models.fakes.server import FakeServer, Request, Response
from manitwin.models.generators.fal import FalGenerator, first_glb
from manitwin.models.generators.run import run_generator
from manitwin.models.services.refusal import AnswerLost, NotFound

TRELLIS, RODIN, HUNYUAN = "fal-ai/trellis", "fal-ai/hyper3d/rodin", "fal-ai/hunyuan3d-v3/text-to-3d"


@pytest.fixture
def queue() -> FakeFal:
    return FakeFal(key=KEY)


def client(
    server: FakeServer,
    endpoint: str = TRELLIS,
    config: BuildConfig | None = None,
    waits: list[float] | None = None,
    key: str = KEY,
) -> FalGenerator:
    return FalGenerator(endpoint, server.url, key, config or settings(), ([] if waits is None else waits).append)


def test_picture_goes_through_the_queue(queue: FakeFal, tmp_path: Path) -> None:
    with FakeServer(queue) as server:
        generator = client(server)
        got = made(generator, photo(), tmp_path)
    place = f"GET /{TRELLIS}/requests/ID"
    looks = [f"{place}/status", f"{place}/status", place, place]
    assert asked(server) == [f"POST /{TRELLIS}", *looks, "GET /files/ID/model.glb"]
    assert server.requests[0].json()["seed"] == 3 and got.path.stat().st_size > 10_000 and got.model == TRELLIS
    check_key_is_nowhere([generator, got, vars(generator)], tmp_path, [server], "/files/")


@pytest.mark.parametrize(("endpoint", "field"), [(RODIN, "input_image_urls"), (TRELLIS, "image_url")])
def test_endpoint_is_given_its_own_fields_and_asked_at_its_apps_address(
    queue: FakeFal, tmp_path: Path, endpoint: str, field: str
) -> None:
    with FakeServer(queue) as server:
        made(client(server, endpoint), photo(), tmp_path)
    assert field in server.requests[0].json()
    app = "/".join(endpoint.split("/")[:2])
    assert server.requests[0].path == f"/{endpoint}" and server.requests[1].path.startswith(f"/{app}/requests/")


@pytest.mark.parametrize("endpoint", [RODIN, HUNYUAN])
def test_text_endpoints_take_a_prompt(queue: FakeFal, tmp_path: Path, endpoint: str) -> None:
    with FakeServer(queue) as server:
        made(client(server, endpoint), TEXT, tmp_path)
    assert server.requests[0].json()["prompt"] == "a blue bottle"


@pytest.mark.parametrize(("endpoint", "request_"), [(TRELLIS, TEXT), (HUNYUAN, photo()), ("x/image-to-3d", TEXT)])
def test_what_an_endpoint_does_not_take_is_not_sent(queue: FakeFal, endpoint: str, request_: Any) -> None:
    with FakeServer(queue) as server:
        assert endpoint in refused(Unsupported, lambda: client(server, endpoint).submit(request_))
    assert not server.requests


@pytest.mark.parametrize("polls", [0, 1, 2])
def test_job_goes_on_in_another_process(queue: FakeFal, tmp_path: Path, polls: int) -> None:
    with FakeServer(queue) as server:
        first = client(server)
        job_id = first.submit(photo())
        for _ in range(polls):
            first.poll(job_id)
        finished(client(server), job_id, tmp_path)
    assert queue.submitted == 1 and KEY not in job_id


@pytest.mark.parametrize(
    ("fault", "error", "words", "requests"),
    [
        ("unauthorized", AccessDenied, "FAL_KEY", 1),
        ("out_of_credit", AccessDenied, "Exhausted balance", 1),
        ("rate_limited", RateLimited, "Too many requests", 3),
        ("server_error", Unavailable, "Internal server error", 1),
        ("disconnects", AnswerLost, "it is unknown whether", 1),
        ("hangs", AnswerLost, "it is unknown whether", 1),
        ("not_json", AnswerLost, "JSON object", 1),
        ("wrong_schema", AnswerLost, "no status_url", 1),
    ],
)
def test_trouble_at_a_submit(queue: FakeFal, fault: str, error: Any, words: str, requests: int) -> None:
    queue.faults = Faults({fault: ALWAYS})
    with FakeServer(queue) as server:
        assert words in refused(
            error, lambda: client(server, config=settings(timeout_s=1.0 if fault == "hangs" else 20.0)).submit(photo())
        )
    assert len(server.requests) == requests and queue.submitted <= 1


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
def test_trouble_at_a_poll(queue: FakeFal, tmp_path: Path, fault: str, error: Any, requests: int) -> None:
    with FakeServer(queue) as server:
        generator = client(server, config=settings(timeout_s=1.0 if fault == "hangs" else 20.0))
        job_id = generator.submit(photo())
        queue.faults = Faults({fault: ALWAYS})
        refused(error, lambda: generator.poll(job_id))
        assert len(server.requests) == 1 + requests
        queue.faults = Faults({fault: 1} if requests > 1 else {})
        generator.poll(job_id)
        finished(client(server), job_id, tmp_path)
    assert queue.submitted == 1


def test_what_the_model_refuses_is_a_failed_job_in_its_words(queue: FakeFal, tmp_path: Path) -> None:
    config = settings(options={"ss_sampling_steps": 999})
    with FakeServer(queue) as server:
        generator = client(server, config=config)
        told = refused(
            Rejected,
            lambda: run_generator(
                generator, photo(), tmp_path, settings=config.generate, jobs=KeptJobs(), sleep=lambda s: None
            ),
        )
        assert "must be an integer from 1 to 50" in told
        queue.faults = Faults({"job_fails": 1})
        job_id = client(server).submit(photo())
        generator.poll(job_id)
        state = generator.poll(job_id)
    assert state.state == "failed" and "No object was found" in state.message


def test_runner_that_was_lost_is_a_failed_job_and_not_an_outage() -> None:
    class Lost:
        def answer(self, request: Request, base_url: str) -> Response:
            if request.path.endswith("/status"):
                return Response(200, {"status": "COMPLETED"})
            return Response(503, {"detail": "Runner disconnected", "error_type": "runner_disconnected"})

    with FakeServer(Lost()) as server:
        state = client(server).poll(f"{server.url}/a/b/requests/1/status {server.url}/a/b/requests/1")
    assert state.state == "failed" and state.message == "Runner disconnected" and len(server.requests) == 2


def test_endless_job_stays_under_way_and_forgotten_one_is_gone(queue: FakeFal) -> None:
    queue.faults = Faults({"job_never_ends": 1})
    with FakeServer(queue) as server:
        job_id = client(server).submit(photo())
        assert {client(server).poll(job_id).state for _ in range(6)} == {"running"}
        queue._requests.clear()
        refused(NotFound, lambda: client(server).poll(job_id))


@pytest.mark.parametrize(("fault", "error"), [("expired_link", BadReply), ("empty_mesh", BadReply)])
def test_file_that_cannot_be_had(queue: FakeFal, tmp_path: Path, fault: str, error: Any) -> None:
    with FakeServer(queue) as server:
        generator = client(server)
        job_id = generator.submit(photo())
        while generator.poll(job_id).state != "done":
            pass
        queue.faults = Faults({fault: ALWAYS})
        refused(error, lambda: generator.fetch(job_id, tmp_path))
        assert not list(tmp_path.iterdir())
        queue.faults = Faults({fault: 1})
        generator.fetch(job_id, tmp_path)


@pytest.mark.parametrize("name", ["status_url", "response_url"])
def test_key_is_not_sent_where_a_reply_points(name: str, queue: FakeFal) -> None:
    class Thief:
        def answer(self, request: Request, base_url: str) -> Response:
            return Response(200, {"status": "COMPLETED"})

    with FakeServer(Thief()) as thief:
        queue.names = {name: f"{thief.url}/fal-ai/trellis/requests/1"}
        with FakeServer(queue) as server:
            assert "not its own host" in refused(BadReply, lambda: client(server).submit(photo()))
            job_id = f"{thief.url}/a/b/requests/1/status {server.url}/a/b/requests/1"
            refused(BadReply, lambda: client(server).poll(job_id))
    assert not thief.requests


@pytest.mark.parametrize(
    "address",
    [
        "file:///etc/passwd",
        "http://[::1",
        "http://127.0.0.1:99999/x",
        "http://127.0.0.1@evil.example/x",
        "//evil.example/x",
    ],
)
def test_address_that_is_no_address_of_the_queue_is_refused(queue: FakeFal, address: str) -> None:
    queue.names = {"status_url": address}
    with FakeServer(queue) as server:
        refused(BadReply, lambda: client(server).submit(photo()))
    assert len(server.requests) == 1


def test_address_of_no_address_is_an_answer_that_was_lost(queue: FakeFal) -> None:
    queue.names = {"status_url": "x" * 9000}
    with FakeServer(queue) as server:
        refused(AnswerLost, lambda: client(server).submit(photo()))
    assert len(server.requests) == 1  # it may be at work on it: nothing is paid for twice


def test_vendors_two_hosts_stand_for_each_other_and_for_no_third() -> None:
    vendor = FalGenerator(TRELLIS, "https://queue.fal.run", KEY, settings())
    assert vendor._service_of("https://queue.falrun.com/a").base_url == "https://queue.falrun.com"
    for address in ("https://fal.run/a", "http://queue.fal.run/a", "https://queue.fal.run:444/a"):
        refused(BadReply, lambda address=address: vendor._service_of(address))
    own = FalGenerator(TRELLIS, "https://proxy.example", KEY, settings(usd_per_job=0))
    refused(BadReply, lambda: own._service_of("https://queue.fal.run/a"))


def test_first_glb_is_found_wherever_it_is() -> None:
    glb = "https://v3.fal.media/files/a/b.glb?token=x"
    assert first_glb({"timings": {}, "model_mesh": {"url": glb}}) == glb
    assert (
        first_glb({"image": {"url": "https://x/a.png"}, "all": [{"m": [{"u": glb}]}, {"url": "https://x/2.glb"}]})
        == glb
    )
    assert first_glb({"model": {"url": "https://x/42", "content_type": "model/gltf-binary"}}) == "https://x/42"
    assert first_glb({"model": {"url": "https://x/42", "file_name": "a.GLB"}}) == "https://x/42"
    assert first_glb({"note": "see a.glb", "model": {"url": "https://x/a.obj"}}) is None
    deep: Any = glb
    for _ in range(50_000):
        deep = [deep]
    assert first_glb(deep) == glb


def test_probe_tells_a_good_key_from_a_bad_one_without_a_job(queue: FakeFal) -> None:
    with FakeServer(queue) as server:
        assert "takes the key" in client(server).probe()
        assert "FAL_KEY" in refused(AccessDenied, client(server, key="wrong").probe, key="wrong")
    assert queue.submitted == 0


def test_spec_needs_a_key_and_a_price_that_is_listed_or_given(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FAL_KEY", raising=False)
    with pytest.raises(ConfigError, match="FAL_KEY"):
        FalGenerator.from_spec("", settings())
    monkeypatch.setenv("FAL_KEY", KEY)
    listed = FalGenerator.from_spec("", settings())
    assert (listed.model, listed.usd_per_job) == (TRELLIS, 0.02) and KEY not in repr(listed)
    assert FalGenerator.from_spec("", settings(usd_per_job=0.05)).usd_per_job == 0.05
    with pytest.raises(ConfigError, match=r"services\.usd_per_job"):
        FalGenerator.from_spec("fal-ai/triposr", settings())
    with pytest.raises(ConfigError, match=r"services\.usd_per_job"):
        FalGenerator.from_spec(f"{TRELLIS}@https://proxy.example", settings())
    assert FalGenerator.from_spec("@http://localhost:9000", settings()).usd_per_job == 0.0
    with pytest.raises(ConfigError, match="not an endpoint"):
        FalGenerator.from_spec("trellis", settings())
