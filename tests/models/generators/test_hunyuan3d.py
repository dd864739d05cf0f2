"""The client of Hunyuan3D's own server against one that keeps its contract and its traps."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import pytest
from rehearsed_jobs import TEXT, KeptJobs, asked, finished, made, photo, refused, settings

from manitwin.config import BuildConfig
from manitwin.errors import BadReply, ConfigError, Rejected, Unavailable, Unsupported
from manitwin.formats.image_file import png_of
from manitwin.models.fakes.faults import ALWAYS, Faults
from manitwin.models.fakes.hunyuan3d import FakeHunyuan3d
from manitwin.models.fakes.server import FakeServer, Request, Response
from manitwin.models.generators.hunyuan3d import Hunyuan3dGenerator
from manitwin.models.generators.run import run_generator
from manitwin.models.services.refusal import AnswerLost, NotFound

PLAIN: dict[str, str | int | float | bool] = {"texture": False}


def client(
    server: FakeServer,
    version: str = "2.1",
    options: dict[str, str | int | float | bool] | None = None,
    waits: list[float] | None = None,
    **services: object,
) -> Hunyuan3dGenerator:
    config = settings(options=options, **services)
    return Hunyuan3dGenerator(version, server.url, config, ([] if waits is None else waits).append)


def driven(generator: Hunyuan3dGenerator, folder: Path, jobs: KeptJobs, config: BuildConfig | None = None) -> Any:
    given = (config or settings()).generate
    return run_generator(generator, photo(), folder, settings=given, jobs=jobs, sleep=lambda s: None)


@pytest.mark.parametrize(
    ("version", "texture", "requests"),
    [
        ("2.0", True, ["POST /generate"]),
        ("2.0", False, ["POST /send", *["GET /status/ID"] * 2]),
        ("2.1", True, ["POST /send", *["GET /status/ID"] * 3]),
        ("2.1", False, ["POST /generate"]),
    ],
)
def test_each_job_goes_the_way_that_can_be_told_done(
    tmp_path: Path, version: Any, texture: bool, requests: list[str]
) -> None:
    hunyuan = FakeHunyuan3d(version=version, enable_tex=True)
    with FakeServer(hunyuan) as server:
        got = made(client(server, version, {"texture": texture}), photo(), tmp_path)
    assert asked(server) == requests and got.path.read_bytes()[:4] == b"glTF"
    body = server.requests[0].json()
    assert base64.b64decode(body["image"], validate=True).startswith(b"\x89PNG")
    assert body["seed"] == 3 and body["texture"] is texture and got.model == f"Hunyuan3D {version}"
    assert got.notes == {"textured": texture}


def test_untextured_job_sent_to_2_1_would_never_be_told_done() -> None:
    """The trap that ``/generate`` goes round."""
    with FakeServer(FakeHunyuan3d()) as server:
        generator = client(server)
        generator._options["texture"] = False
        job_id = generator._send({"image": base64.b64encode(_png()).decode()})
        assert {generator.poll(job_id).state for _ in range(9)} == {"running"}


def _png() -> bytes:
    rgba = photo().rgba
    assert rgba is not None
    return png_of(rgba)


def test_texture_without_the_servers_flag_fails_at_once_and_says_what_to_do() -> None:
    hunyuan = FakeHunyuan3d(version="2.0", enable_tex=False)
    with FakeServer(hunyuan) as server:
        told = refused(BadReply, lambda: client(server, "2.0").submit(photo()))
    assert "--enable_tex" in told and "generate.options.texture = false" in told and len(server.requests) == 1


def test_sent_job_goes_on_in_another_process(tmp_path: Path) -> None:
    hunyuan = FakeHunyuan3d()
    with FakeServer(hunyuan) as server:
        job_id = client(server).submit(photo())
        finished(client(server), job_id, tmp_path)
        (tmp_path / "generated.glb").unlink()
        client(server).fetch(job_id, tmp_path)
    assert hunyuan.sent == 1 and (tmp_path / "generated.glb").stat().st_size > 10_000


def test_generated_job_of_another_process_is_gone_and_asked_again(tmp_path: Path) -> None:
    jobs, hunyuan = KeptJobs(), FakeHunyuan3d()
    with FakeServer(hunyuan) as server:
        driven(client(server, options=PLAIN), tmp_path, jobs, settings(options=PLAIN))
        (note,) = jobs.notes.values()
        assert "generate:" in note
        driven(client(server, options=PLAIN), tmp_path, jobs, settings(options=PLAIN))
        refused(NotFound, lambda: client(server, options=PLAIN).poll("generate:0123"))
    assert hunyuan.sent == 2


def test_failure_that_is_never_told_of_ends_at_the_limit_and_stays_remembered(tmp_path: Path) -> None:
    jobs, hunyuan = KeptJobs(), FakeHunyuan3d(faults=Faults({"job_fails": 1}))
    with FakeServer(hunyuan) as server:
        assert "max_wait_s" in refused(Unavailable, lambda: driven(client(server), tmp_path, jobs))
    assert hunyuan.sent == 1 and len(jobs.notes) == 1


@pytest.mark.parametrize("version", ["2.0", "2.1"])
def test_text_is_not_sent(version: str) -> None:
    with FakeServer(FakeHunyuan3d(version=version)) as server:  # type: ignore[arg-type]
        assert "no text model" in refused(Unsupported, lambda: client(server, version).submit(TEXT))
    assert not server.requests


def test_value_out_of_range_is_told_in_the_servers_words() -> None:
    with FakeServer(FakeHunyuan3d()) as server:
        generator = client(server, options={"octree_resolution": 4096})
        assert "from 64 to 512" in refused(BadReply, lambda: generator.submit(photo()))


def test_seed_stays_in_the_servers_range(tmp_path: Path) -> None:
    with FakeServer(FakeHunyuan3d()) as server:
        client(server).submit(type(photo())(photo().rgba, None, None, seed=2**32 + 7))
    assert server.requests[0].json()["seed"] == 7


@pytest.mark.parametrize(
    ("fault", "error", "requests"),
    [
        ("server_error", Unavailable, 1),
        ("disconnects", AnswerLost, 1),
        ("hangs", AnswerLost, 1),
        ("not_json", AnswerLost, 1),
        ("wrong_schema", AnswerLost, 1),
    ],
)
def test_trouble_at_a_submit(fault: str, error: Any, requests: int) -> None:
    with FakeServer(FakeHunyuan3d(faults=Faults({fault: ALWAYS}))) as server:
        refused(error, lambda: client(server, timeout_s=1.0 if fault == "hangs" else 20.0).submit(photo()))
    assert len(server.requests) == requests


@pytest.mark.parametrize(
    ("fault", "error", "requests"),
    [
        ("server_error", Unavailable, 3),
        ("disconnects", Unavailable, 3),
        ("hangs", Unavailable, 3),
        ("not_json", BadReply, 1),
        ("wrong_schema", BadReply, 1),
    ],
)
def test_trouble_at_a_poll(tmp_path: Path, fault: str, error: Any, requests: int) -> None:
    hunyuan = FakeHunyuan3d()
    with FakeServer(hunyuan) as server:
        generator = client(server, timeout_s=1.0 if fault == "hangs" else 20.0)
        job_id = generator.submit(photo())
        hunyuan.faults = Faults({fault: ALWAYS})
        refused(error, lambda: generator.poll(job_id))
        assert len(server.requests) == 1 + requests
        hunyuan.faults = Faults({fault: 1} if requests > 1 else {})
        generator.poll(job_id)
        finished(client(server), job_id, tmp_path)
    assert hunyuan.sent == 1


@pytest.mark.parametrize("fault", ["truncated_mesh", "empty_mesh"])
@pytest.mark.parametrize("texture", [False, True])
def test_broken_mesh_is_never_taken(tmp_path: Path, fault: str, texture: bool) -> None:
    config = settings(options={"texture": texture})
    with FakeServer(FakeHunyuan3d(faults=Faults({fault: ALWAYS}))) as server:
        error = BadReply if fault == "empty_mesh" else Rejected
        generator = client(server, options={"texture": texture})
        said = refused(error, lambda: driven(generator, tmp_path, KeptJobs(), config))
    assert ("empty" in said or "no mesh" in said) if fault == "empty_mesh" else "generator_failed" in said
    assert not list(tmp_path.rglob("*.glb")), "nothing is left that could be taken for a mesh"


def test_answer_that_is_no_base64_is_a_bad_reply() -> None:
    class Odd:
        def answer(self, request: Request, base_url: str) -> Response:
            return Response(200, {"status": "completed", "model_base64": "no base64!"})

    with FakeServer(Odd()) as server:
        assert "no base64" in refused(BadReply, lambda: client(server).poll("send:1"))


def test_probe_knows_both_servers_and_tells_them_apart_from_none() -> None:
    with FakeServer(FakeHunyuan3d()) as server:
        assert client(server).probe() == "the server is healthy"
    with FakeServer(FakeHunyuan3d(version="2.0")) as server:
        assert client(server, "2.0").probe() == "the server answers"
        assert "the version that was named" in refused(BadReply, client(server, "2.1").probe)
    assert "does not answer" in refused(Unavailable, client(server).probe)


def test_spec_needs_nothing_and_knows_its_versions() -> None:
    first = Hunyuan3dGenerator.from_spec("", settings())
    assert (first.version, first.usd_per_job) == ("2.1", 0.0) and "localhost:8081" in repr(first)
    other = Hunyuan3dGenerator.from_spec("2.0@http://gpu-box:8080", settings())
    assert (other.version, other.usd_per_job) == ("2.0", 0.0) and "gpu-box" in repr(other)
    with pytest.raises(ConfigError, match=r"2\.0, 2\.1"):
        Hunyuan3dGenerator.from_spec("3", settings())
    with pytest.raises(ConfigError, match="octree_resolution"):
        Hunyuan3dGenerator.from_spec("", settings(options={"octree": 3}))
