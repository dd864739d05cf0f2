"""What is asked of Rodin, and what is made of its answers."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from generator_runs import KEY, config, photo_request, run, text_request
from manitwin.errors import AccessDenied, ConfigError, RateLimited, Rejected, Unavailable
from manitwin.formats.meshes.read import read_mesh
from manitwin.models.fakes.faults import ALWAYS, Faults
from manitwin.models.fakes.rodin import FakeRodin
from manitwin.models.fakes.server import FakeServer, Request, Response
from manitwin.models.generators.generated_mesh import convert_to_glb
from manitwin.models.generators.rodin import URL, RodinGenerator


@pytest.fixture(autouse=True)
def _key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RODIN_API_KEY", KEY)


def test_photo_is_asked_for_with_its_own_alpha(tmp_path: Path) -> None:
    fake, settings = FakeRodin(key=KEY, polls=1), config()
    with FakeServer(fake) as server:
        ran = run(
            RodinGenerator.from_spec(f"@{server.url}", settings), tmp_path, settings, request=photo_request(65_543)
        )
    (task,) = fake.tasks.values()
    assert task.form == {
        "tier": "Regular",
        "geometry_file_format": "glb",
        "material": "PBR",
        "mesh_mode": "Raw",
        "seed": "7",  # 65543 mod 65536
        "use_original_alpha": "true",
    }
    (image,) = task.images
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(image))), photo_request().rgba)
    assert ran.made is not None and ran.made.model == "Regular" and not ran.made.metric and not ran.made.rests


def test_text_is_asked_for_without_images(tmp_path: Path) -> None:
    fake, settings = FakeRodin(key=KEY, polls=1), config()
    with FakeServer(fake) as server:
        run(
            RodinGenerator.from_spec(f"Gen-2@{server.url}/api/v2", settings), tmp_path, settings, request=text_request()
        )
    (task,) = fake.tasks.values()
    assert task.images == [] and task.form["prompt"] == "a capped bottle" and task.form["tier"] == "Gen-2"
    assert "use_original_alpha" not in task.form


def test_options_go_into_the_form(tmp_path: Path) -> None:
    options = {"tier": "Gen-2.5-High", "quality_override": 60_000, "hd_texture": True, "material": "All"}
    fake, settings = FakeRodin(key=KEY, polls=1), config(options=options)
    with FakeServer(fake) as server:
        ran = run(RodinGenerator.from_spec(f"@{server.url}", settings), tmp_path, settings)
    (task,) = fake.tasks.values()
    assert ran.error is None and task.form["quality_override"] == "60000" and task.form["hd_texture"] == "true"
    assert task.form["tier"] == "Gen-2.5-High" and ran.made is not None and ran.made.model == "Gen-2.5-High"


def test_option_that_the_vendor_refuses_is_named(tmp_path: Path) -> None:
    fake, settings = FakeRodin(key=KEY), config(options={"texture_mode": "high"})
    with FakeServer(fake) as server:
        ran = run(RodinGenerator.from_spec(f"@{server.url}", settings), tmp_path, settings)
    assert "INVALID_REQUEST: texture_mode is not for tier Regular" in str(ran.error) and not fake.tasks
    assert len(server.requests) == 1 and ran.usd == 0


def test_usdz_with_two_meshes_is_the_papers_format(tmp_path: Path) -> None:
    fake = FakeRodin(Faults({"two_meshes": ALWAYS}), KEY, polls=1)
    settings = config(options={"geometry_file_format": "usdz"})
    with FakeServer(fake) as server:
        ran = run(RodinGenerator.from_spec(f"@{server.url}", settings), tmp_path, settings)
    assert ran.made is not None and ran.made.path.suffix == ".usdz"
    (tmp_path / "generated.glb").write_bytes(convert_to_glb(ran.made.path))
    assert len(read_mesh(tmp_path / "generated.glb").parts) == 2


def test_preview_in_the_list_of_files_is_passed_over(tmp_path: Path) -> None:
    fake, settings = FakeRodin(key=KEY, polls=1), config()
    with FakeServer(fake) as server:
        run(RodinGenerator.from_spec(f"@{server.url}", settings), tmp_path, settings)
        assert [r.path.rsplit("/", 1)[1] for r in server.requests] == [
            *("rodin", "status", "status", "download", "model.glb")
        ]


def test_job_id_holds_what_another_process_needs(tmp_path: Path) -> None:
    fake, settings = FakeRodin(key=KEY, polls=1), config()
    with FakeServer(fake) as server:
        job_id = RodinGenerator.from_spec(f"@{server.url}", settings).submit(text_request())
        assert json.loads(job_id) == [next(iter(fake.tasks)), "subscription-0"]
        other = RodinGenerator.from_spec(f"@{server.url}", settings)
        fake.tasks[next(iter(fake.tasks))].polls = 1
        assert other.poll(job_id).state == "done" and other.fetch(job_id, tmp_path).path.is_file()


STATES = [
    ([], "queued"),
    (["Waiting", "Waiting"], "queued"),
    (["Done", "Waiting"], "running"),
    (["Done", "Generating"], "running"),
    (["Done", "Done"], "done"),
    (["Failed", "Generating"], "failed"),
    (["SomethingNew"], "running"),
]


class Fixed:
    def __init__(self, status: int, body: Any):
        self.response = Response(status, body)

    def answer(self, request: Request, base_url: str) -> Response:
        return self.response


@pytest.mark.parametrize(("jobs", "state"), STATES)
def test_task_is_done_once_all_its_jobs_are(jobs: list[str], state: str) -> None:
    body = {"error": "OK", "jobs": [{"uuid": str(n), "status": status} for n, status in enumerate(jobs)]}
    with FakeServer(Fixed(201, body)) as server:
        assert RodinGenerator.from_spec(f"@{server.url}", config()).poll('["a", "b"]').state == state


REFUSALS = [
    (200, "NO_ACTIVE_SUBSCRIPTION", AccessDenied),
    (201, "INSUFFICIENT_FUND", AccessDenied),
    (400, "API_SUBSCRIPTION_PLAN_TOO_LOW", AccessDenied),
    (500, "PERMISSION_DENIED", AccessDenied),
    (400, "IMAGE_CONTENT_VIOLATION", Rejected),
    (200, "UNKNOWN", Unavailable),
]


@pytest.mark.parametrize(("status", "code", "kind"), REFUSALS)
def test_error_code_counts_more_than_the_status(status: int, code: str, kind: type, tmp_path: Path) -> None:
    settings = config()
    with FakeServer(Fixed(status, {"error": code, "message": f"because {KEY}"})) as server:
        ran = run(RodinGenerator.from_spec(f"@{server.url}", settings), tmp_path, settings)
        assert type(ran.error) is kind and f"{code}: because ***" in str(ran.error) and len(server.requests) == 1


def test_too_many_tasks_at_once_is_a_matter_of_waiting(tmp_path: Path) -> None:
    settings = config(retries=0)
    with FakeServer(Fixed(200, {"error": "API_PARALLELISM_LIMIT_REACHED"})) as server:
        ran = run(RodinGenerator.from_spec(f"@{server.url}", settings), tmp_path, settings)
    assert type(ran.error) is RateLimited


def test_specs_that_cannot_be(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ConfigError, match="did you mean 'Gen-2'"):
        RodinGenerator.from_spec("Gen2", config())
    with pytest.raises(ConfigError, match="glb, usdz"):
        RodinGenerator.from_spec("", config(options={"geometry_file_format": "fbx"}))
    with pytest.raises(ConfigError, match=r"Sketch and generate\.options\.tier says Detail"):
        RodinGenerator.from_spec("Sketch", config(options={"tier": "Detail"}))
    with pytest.raises(ConfigError, match=r"services\.usd_per_job"):
        RodinGenerator.from_spec("", config(usd=None))
    monkeypatch.delenv("RODIN_API_KEY")
    with pytest.raises(ConfigError, match="RODIN_API_KEY or HYPER3D_API_KEY"):
        RodinGenerator.from_spec("", config())
    monkeypatch.setenv("HYPER3D_API_KEY", KEY)
    generator = RodinGenerator.from_spec("Sketch", config())
    assert f"'Sketch', '{URL}'" in repr(generator) and KEY not in repr(generator)
