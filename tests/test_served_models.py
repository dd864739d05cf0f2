"""The whole pipeline on servers that keep the contracts of the paper's models, while everything that can fail does."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

import manitwin
from manitwin import load
from manitwin.cli.summary import print_summary
from manitwin.config import BuildConfig
from manitwin.models.fakes.anthropic_messages import FakeAnthropic
from manitwin.models.fakes.catalog import serving
from manitwin.models.fakes.faults import ALWAYS, Faults
from manitwin.models.fakes.grasp_servers import FakeGraspGen
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.rodin import FakeRodin
from manitwin.models.fakes.server import FakeServer
from manitwin.pipeline.settings import Flags, with_flags
from manitwin.render.card import RED
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import RUN

SAMPLE = Path(__file__).resolve().parent.parent / "samples" / "bottle.jpg"
KEYS = {"MANITWIN_VLM_KEY": "key-of-the-vlm-3141", "RODIN_API_KEY": "key-of-the-generator-2718"}
USD_PER_JOB = 0.5
SETTINGS = f"""
[services]
timeout_s = 60
usd_per_million_tokens = [2.0, 8.0]
usd_per_job = {USD_PER_JOB}
longest_wait_s = 5
[run]
cpu = 2
vlm = 1
generator = 1
patience_s = 60
[generate]
attempts = 3
[grasps]
simulated = 20
unfiltered = 0
least_per_point = 2
tries_per_point = 4
[second_opinion]
enabled = false
[robustness]
enabled = false
"""


@dataclass
class Servers:
    """The three servers, and what a build has to be told of them."""

    vlm: FakeServer
    generator: FakeServer
    flags: list[str]

    def jobs(self) -> int:
        """How many jobs the generator was asked for and took."""
        return sum(r.method == "POST" and r.path.endswith("/rodin") for r in self.generator.requests)

    def questions(self) -> int:
        """How often the model was asked."""
        return sum(r.method == "POST" for r in self.vlm.requests)


@contextmanager
def servers(
    vlm: Faults | None = None, generator: Faults | None = None, grasper: Faults | None = None
) -> Iterator[Servers]:
    """Serve all three with faults."""
    with ExitStack() as stack:
        chat = stack.enter_context(FakeServer(FakeOpenAi(vlm, key=KEYS["MANITWIN_VLM_KEY"])))
        jobs = stack.enter_context(FakeServer(FakeRodin(generator, key=KEYS["RODIN_API_KEY"])))
        grasps = stack.enter_context(FakeGraspGen(grasper))
        flags = [
            "--vlm", f"openai:rehearsal@{chat.url}/v1",
            "--generator", f"rodin@{jobs.url}/api/v2",
            "--grasper", f"graspgen@{grasps.url}",
        ]  # fmt: skip
        yield Servers(chat, jobs, flags)


def start(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    """Start a command as a user would, with caches of its own."""
    (folder / "settings.toml").write_text(SETTINGS)
    return subprocess.Popen(
        [sys.executable, "-m", "manitwin", *arguments, "--config", str(folder / "settings.toml")],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=folder, start_new_session=True,
        env={**os.environ, "COLUMNS": "200"},
    )  # fmt: skip


def finished(folder: Path, *arguments: str) -> tuple[int, str]:
    """Run a command to its end."""
    process = start(folder, *arguments)
    said, _ = process.communicate(timeout=300)
    return process.returncode, said


@pytest.fixture(autouse=True)
def keys_and_homes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Set the keys; afterwards none of them may be in any file."""
    for name, value in KEYS.items():
        monkeypatch.setenv(name, value)
    for kind in ("CACHE", "STATE"):
        monkeypatch.setenv(f"XDG_{kind}_HOME", str(tmp_path / kind.lower()))
    yield
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert files
    for key in KEYS.values():
        assert not [path for path in files if key.encode() in path.read_bytes()]


def run_here(folder: Path, served: Servers, *texts: str, **services: Any) -> manitwin.BuildReport:
    """Work through a data set in this process, by the very driver and worker of a run."""
    vlm, generator, grasper = served.flags[1::2]
    flags: Flags = {"vlm": vlm, "generator": generator, "grasper": grasper}
    settings = with_flags(BuildConfig.model_validate(tomllib.loads(SETTINGS)), flags)
    update = {
        # no server is silent in these runs: only a loaded machine would answer late
        "services": settings.services.model_copy(update={"timeout_s": 60.0, **services}),
        "run": settings.run.model_copy(update={"patience_s": 0}),
    }
    settings = settings.model_copy(update=update)
    return manitwin.build([], folder / "data", config=settings, texts=texts, name="bottle", executor="inline")


def twins(folder: Path) -> list[Path]:
    """The finished twins of a data set."""
    return sorted(path.parent for path in (folder / "data").glob("twins/*/*/twin.json"))


def cost_usd(twin: Path, stage: str | None = None) -> float:
    """What a twin cost, or one stage of it, as it says itself."""
    stages: dict[str, Any] = json.loads((twin / RUN).read_text())["stages"]
    return float(sum(cost["cost_usd"] for name, cost in stages.items() if stage in (None, name)))


def wait_until(condition: Callable[[], bool], process: subprocess.Popen[str], seconds: float = 120.0) -> None:
    """Wait for a condition while a process runs."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None and time.monotonic() < deadline, "the process ended before"
        time.sleep(0.05)


def assert_shown_as_a_rehearsal(twin: Twin, stages: set[str]) -> None:
    """Provenance, the findings, the card and ``show`` all say which stages a rehearsal server answered for."""
    record = twin.record
    assert {name for name, stage in record.provenance.stages.items() if stage.rehearsal} == stages
    (check,) = [check for check in record.quality.checks if check.name == "rehearsal"]
    assert check.passed is False and all(stage in check.message for stage in stages)
    card = np.asarray(Image.open(twin.folder / "card.png").convert("RGB"))
    assert (card == RED).all(2).sum() > 2000, "REHEARSAL is stamped on the pictures"
    page = io.StringIO()
    print_summary(twin, Console(width=200, file=page))
    assert page.getvalue().splitlines()[1].startswith("REHEARSAL: a rehearsal server (manitwin fake), not a model")


@pytest.mark.slow
def test_a_photo_and_a_text_become_twins_while_every_server_fails(tmp_path: Path) -> None:
    vlm = Faults(dict.fromkeys(("rate_limited", "server_error", "disconnects", "not_json", "wrong_schema"), 1))
    faults = ("rate_limited", "server_error", "truncated_mesh", "expired_link", "job_fails")
    generator, grasper = Faults(dict.fromkeys(faults, 1)), Faults({"disconnects": 1})
    with servers(vlm, generator, grasper) as served:
        inputs = [str(SAMPLE), "--text", "a bottle", "--license", "CC0-1.0"]
        status, said = finished(tmp_path, "build", *inputs, "-o", "data", *served.flags, "--jobs", "2")
        assert status == 0, said
        assert not any(key in said for key in KEYS.values())
        assert "approximate charges of services per twin" in said
        made = [load(twin) for twin in twins(tmp_path)]
        assert {twin.record.source.kind for twin in made} == {"image", "text"}
        again, _ = finished(tmp_path, "build", "-o", "data", *served.flags)
        jobs, questions = served.jobs(), served.questions()
        assert again == 0 and (served.jobs(), served.questions()) == (jobs, questions), "nothing is asked twice"
    assert said.count("grasps verified; a rehearsal") == 2
    for twin in made:
        assert_shown_as_a_rehearsal(twin, {"generate", "gate", "physical", "caption", "points", "grasps"})
        stages = twin.record.provenance.stages
        assert stages["generate"].backend == "rodin" and stages["grasps"].backend == "graspgen"
        assert {stages[name].backend for name in ("gate", "physical", "caption", "points")} == {"openai"}
        assert twin.record.physical is not None and twin.record.grasps is not None
        assert twin.record.physical.mass_kg.source == "vlm:rehearsal" and twin.record.grasps.verified >= 10
        checks = {check.name: check.passed for check in twin.record.quality.checks}
        assert checks["one_coherent_object"] is True and checks["visual_quality"] is True
    # one job failed and one mesh was cut: each was asked for again, and all that was asked for is in the twins' costs
    paid = sum(cost_usd(twin, "generate") for twin in twins(tmp_path))
    taken = jobs - 2  # a 429 and a 500 took no job
    assert taken in (3, 4) and paid == pytest.approx(USD_PER_JOB * taken)
    assert all(cost_usd(twin) > cost_usd(twin, "generate") for twin in twins(tmp_path)), "tokens cost as well"


@pytest.mark.slow
def test_a_model_that_is_down_leaves_the_twin_waiting_and_nothing_is_paid_twice(tmp_path: Path) -> None:
    down = Faults({"server_error": ALWAYS})
    with servers(vlm=down) as served:
        report = run_here(tmp_path, served, "a bottle", retries=1)
        assert (report.exit_code, report.run.left) == (4, 1)
        assert twins(tmp_path) == [] and served.jobs() == 1
        down.stop("server_error")
        report = run_here(tmp_path, served)
        assert (report.exit_code, served.jobs()) == (0, 1)
    (twin,) = twins(tmp_path)
    assert cost_usd(twin, "generate") == pytest.approx(USD_PER_JOB)


@pytest.mark.slow
def test_a_build_killed_at_the_generator_finds_its_job_again(tmp_path: Path) -> None:
    slow = Faults({"job_never_ends": ALWAYS})
    with servers(generator=slow) as served:
        arguments = ("build", "--text", "a bottle", "-o", "made", *served.flags)
        process = start(tmp_path, *arguments)
        polled = lambda: any(r.path.endswith("/status") for r in served.generator.requests)  # noqa: E731
        wait_until(polled, process)
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        slow.stop("job_never_ends")
        status, said = finished(tmp_path, *arguments)
        assert (status, served.jobs()) == (0, 1), said
    (twin,) = (path.parent for path in (tmp_path / "made").glob("twins/*/*/twin.json"))
    assert cost_usd(twin, "generate") == pytest.approx(USD_PER_JOB), "paid before the crash, and part of its cost"
    assert load(twin).record.provenance.stages["generate"].rehearsal, "also a job that an earlier process submitted"


@pytest.mark.parametrize("fault", ["unauthorized", "out_of_credit"])
def test_a_refused_key_stops_the_run_with_its_reason(tmp_path: Path, fault: str) -> None:
    with servers(generator=Faults({fault: ALWAYS})) as served:
        report = run_here(tmp_path, served, "a bottle")
    assert report.exit_code == 4 and report.run.stopped is not None and "RODIN_API_KEY" in report.run.stopped
    assert not any(key in report.run.stopped for key in KEYS.values()) and twins(tmp_path) == []


@pytest.mark.parametrize(
    "fault",
    [
        pytest.param("refusal", marks=pytest.mark.slow),
        pytest.param("cut_answer", marks=pytest.mark.slow),
        "wrong_schema",
        pytest.param("implausible", marks=pytest.mark.slow),
    ],
)
def test_an_answer_that_cannot_be_used_is_never_accepted(tmp_path: Path, fault: str) -> None:
    with servers(vlm=Faults({fault: ALWAYS})) as served:
        report = run_here(tmp_path, served, "a bottle", retries=0)
        assert served.jobs() == 1, "the mesh is there, and not asked for again"
    assert report.run.counts.get("accepted", 0) == 0
    ended = {"implausible": "rejected"}.get(fault, "failed")
    assert report.run.counts.get(ended) == 1
    for twin in twins(tmp_path):
        record = load(twin).record
        assert {"generate", "gate", "physical"} <= set(record.provenance.rehearsed)
        assert [check.passed for check in record.quality.checks if check.name == "rehearsal"] == [False]


@pytest.mark.slow
def test_recorded_answers_repeat_a_run_without_a_server(tmp_path: Path) -> None:
    with servers() as served:
        assert run_here(tmp_path / "first", served, "a bottle", record=tmp_path / "answers.jsonl").exit_code == 0
        questions = served.questions()
        served.flags[1] = f"replay:{tmp_path}/answers.jsonl"
        assert run_here(tmp_path / "second", served, "a bottle").exit_code == 0
        assert served.questions() == questions
    one, two = twins(tmp_path / "first")[0], twins(tmp_path / "second")[0]
    before, after = load(one).record, load(two).record
    assert before.provenance.rehearsed == after.provenance.rehearsed, "a replayed answer of a rehearsal stays one"
    differs = {"revision", "provenance", "files"}
    assert before.model_dump(exclude=differs) == after.model_dump(exclude=differs)
    assert before.files["grasps.parquet"] == after.files["grasps.parquet"]
    assert cost_usd(two) == cost_usd(two, "generate") < cost_usd(one)


@pytest.mark.slow
def test_anthropics_protocol_serves_as_well(tmp_path: Path) -> None:
    with servers() as served, FakeServer(FakeAnthropic(key=KEYS["MANITWIN_VLM_KEY"])) as messages:
        served.flags[1] = f"anthropic:rehearsal@{messages.url}"
        assert run_here(tmp_path, served, "a bottle").exit_code == 0
    assert {load(twin).record.provenance.stages["points"].backend for twin in twins(tmp_path)} == {"anthropic"}


@pytest.mark.slow
def test_the_limit_of_money_leaves_what_would_cost_more(tmp_path: Path) -> None:
    with servers() as served:
        report = run_here(tmp_path, served, "a bottle", "a tall bottle", max_cost_usd=0.9)
        assert report.exit_code == 4 and report.run.stopped is not None and "at most 0.9 USD" in report.run.stopped
        assert served.jobs() == 1


GENERATORS = ("rodin", "tripo", "meshy", "hunyuan3d", "fal")


@pytest.mark.slow
@pytest.mark.parametrize("name", GENERATORS)
@pytest.mark.parametrize("grasper", ["graspgen", "graspgenx"])
def test_every_generator_and_grasper_ends_in_a_twin_while_it_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, grasper: str
) -> None:
    # what a server can recover from by itself: Hunyuan3D's has no failed state, and its errors all say the same
    faults = {"server_error": 1, "truncated_mesh": 1} if name == "hunyuan3d" else {"server_error": 1, "job_fails": 1}
    with serving("openai") as chat, serving(name, faults=Faults(faults)) as jobs, serving(grasper) as grasps:
        for server in (chat, jobs):
            if server.key_variable is not None and server.key is not None:
                monkeypatch.setenv(server.key_variable, server.key)
        spec = jobs.spec.replace("fal@", "fal:fal-ai/hyper3d/rodin@")  # of fal's, one that takes a text too
        settings = with_flags(
            BuildConfig.model_validate(tomllib.loads(SETTINGS)),
            {"vlm": chat.spec, "generator": spec, "grasper": grasps.spec},
        )
        report = manitwin.build(
            [SAMPLE], tmp_path / "data", config=settings, texts=[] if name == "hunyuan3d" else ["a bottle"], name="bottle",
            executor="inline",
        )  # fmt: skip
    assert report.exit_code == 0, report
    for twin in twins(tmp_path):
        record = load(twin).record
        assert record.provenance.stages["generate"].backend == name
        assert record.provenance.stages["grasps"].backend == grasper
        assert record.grasps is not None and record.grasps.verified >= 10
