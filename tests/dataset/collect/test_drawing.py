"""Prompts become pictures: each once, within a budget, resumed without paying twice, by any of three kinds of models."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from typer.testing import CliRunner

from json_documents import check_keys
from manitwin.cli.main import app
from manitwin.config import BuildConfig, GenerateConfig, ServicesConfig
from manitwin.dataset.collect.store import Catalogue
from manitwin.dataset.collect.text_to_image import STYLE, DrawingSummary, Prompt, draw_pictures, read_prompts
from manitwin.errors import BackendError, BadReply, ConfigError, ManiTwinError, UsageError
from manitwin.formats.image_file import read_image
from manitwin.models.fakes.fal import FakeFal
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.openai_images import BLOCKED, FakeOpenAiImages
from manitwin.models.fakes.pictures import picture_png
from manitwin.models.fakes.server import FakeServer, FakeService
from manitwin.models.generators.protocol import Generator
from manitwin.models.text_to_image.choose import choose_text_to_image
from manitwin.models.text_to_image.picture import picture_flaw
from manitwin.pipeline.manifest import Notes, iterate_items

KEY = "a-key-of-tests"
PROMPTS = [Prompt("a red mug", "mug"), Prompt("a blue spoon", "spoon"), Prompt("a hammer", "hammer")]


def settings(usd: float = 0.5, **services: object) -> BuildConfig:
    given = {"usd_per_job": usd, "retries": 1, "timeout_s": 30.0, **services}
    return BuildConfig(
        generate=GenerateConfig(max_wait_s=60, attempts=1), services=ServicesConfig.model_validate(given)
    )


@contextmanager
def painted(service: FakeService, spec: str, out: Path, config: BuildConfig) -> Iterator[Generator]:
    with FakeServer(service) as server:
        yield choose_text_to_image(f"{spec}@{server.url}", config, out / "answers")


@pytest.fixture(autouse=True)
def keys(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    monkeypatch.setenv("FAL_KEY", KEY)


def draw(service: FakeService, spec: str, out: Path, config: BuildConfig | None = None) -> DrawingSummary:
    config = config or settings()
    with painted(service, spec, out, config) as painter:
        return draw_pictures(PROMPTS, out, painter, config, sleep=lambda seconds: None)


def manifest(out: Path) -> list[dict[str, str]]:
    with (out / "manifest.csv").open() as stream:
        return list(csv.DictReader(stream))


SERVICES: dict[str, tuple[str, Callable[[], FakeService]]] = {
    "openai": ("openai:gpt-image-1", lambda: FakeOpenAiImages(key=KEY)),
    "openai by url": ("openai:gpt-image-1", lambda: FakeOpenAiImages(key=KEY, by_url=True)),
    "fal": ("fal:fal-ai/flux/dev", lambda: FakeFal(key=KEY)),
}


@pytest.mark.parametrize("name", SERVICES)
def test_each_prompt_is_drawn_once_and_the_manifest_is_one_that_a_build_reads(tmp_path: Path, name: str) -> None:
    spec, service = SERVICES[name]
    served = service()
    assert draw(served, spec, tmp_path) == DrawingSummary(made=3, usd=1.5)
    first = {path.name: path.read_bytes() for path in tmp_path.rglob("*.*") if path.is_file()}
    rows = manifest(tmp_path)
    assert [row["name"] for row in rows] == ["mug", "spoon", "hammer"]
    assert all(read_image(tmp_path / row["file"]).pixels.shape == (128, 128, 3) for row in rows)
    assert "a red mug" in rows[0]["attribution"] and spec.split(":")[1] in rows[0]["attribution"]
    assert draw(served, spec, tmp_path) == DrawingSummary(there=3), "nothing is asked again"
    assert {path.name: path.read_bytes() for path in tmp_path.rglob("*.*") if path.is_file()} == first
    items = list(iterate_items([tmp_path / "manifest.csv"], {}, Notes(), strict=True))
    assert len(items) == 3
    assert KEY not in "".join(path.read_text(errors="replace") for path in tmp_path.rglob("*") if path.is_file())


def test_the_sentence_is_asked_with_what_a_photo_needs(tmp_path: Path) -> None:
    served = FakeOpenAiImages(key=KEY)
    draw(served, "openai:m", tmp_path)
    assert served.drawn == [prompt.text + STYLE for prompt in PROMPTS]


def test_a_budget_stops_before_it_is_passed_and_another_run_goes_on(tmp_path: Path) -> None:
    served = FakeOpenAiImages(key=KEY)
    stopped = draw(served, "openai:m", tmp_path, settings(max_cost_usd=1.2))
    assert (stopped.made, stopped.usd, len(served.drawn)) == (2, 1.0, 2)
    assert stopped.stopped is not None and "of at most 1.2 USD" in stopped.stopped
    assert len(manifest(tmp_path)) == 2
    assert draw(served, "openai:m", tmp_path) == DrawingSummary(made=1, there=2, usd=0.5)


def test_what_the_model_refuses_is_kept_with_its_cause_and_not_asked_again(tmp_path: Path) -> None:
    prompts = [Prompt(f"a {BLOCKED} mug", "mug"), PROMPTS[1]]
    served, config = FakeFal(Faults({"job_fails": 1}), key=KEY), settings()
    for refused in (1, 1):
        with painted(served, "fal:fal-ai/flux/dev", tmp_path, config) as painter:
            done = draw_pictures(prompts, tmp_path, painter, config, sleep=lambda seconds: None)
        assert done.refused == refused and done.made + done.there == 1
    assert served.submitted == 2
    with (tmp_path / "refused.csv").open() as stream:
        (row,) = csv.DictReader(stream)
    assert row["text"] == prompts[0].text and "No object was found" in row["cause"]


def test_a_service_that_breaks_off_leaves_what_was_made_and_does_not_pay_again_unasked(tmp_path: Path) -> None:
    served = FakeOpenAiImages(Faults({"disconnects": 1}), key=KEY)
    with pytest.raises(BackendError):
        draw(served, "openai:m", tmp_path)
    assert (tmp_path / "manifest.csv").is_file()
    with pytest.raises(BadReply, match="submit_again"):
        draw(served, "openai:m", tmp_path)
    assert draw(served, "openai:m", tmp_path, settings(submit_again=True)).made == 3


def test_an_answer_that_was_kept_is_not_paid_for_again(tmp_path: Path) -> None:
    served, config = FakeOpenAiImages(key=KEY), settings()
    with painted(served, "openai:m", tmp_path, config) as painter:
        fetch, painter.fetch = painter.fetch, None  # type: ignore[assignment,method-assign]
        with pytest.raises(TypeError):  # a crash after the answer came
            draw_pictures(PROMPTS[:1], tmp_path, painter, config)
        painter.fetch = fetch  # type: ignore[method-assign]
        assert draw_pictures(PROMPTS[:1], tmp_path, painter, config).made == 1
    assert len(served.drawn) == 1


PROGRAM = "import sys, numpy as np; from PIL import Image; Image.fromarray(np.random.default_rng(len(sys.argv[1])).integers(0, 255, (64, 64, 3), dtype='uint8')).save(sys.argv[2])"  # fmt: skip  # noqa: E501


def test_a_program_draws_and_what_is_wrong_with_it_is_said(tmp_path: Path) -> None:
    program = tmp_path / "draws.py"
    program.write_text(PROGRAM.replace("; ", "\n", 2))
    out = tmp_path / "out"
    plan = tmp_path / "prompts.csv"
    plan.write_text("text,name\na red mug,mug\na tin,can\n")
    words = [
        "collect",
        "draw",
        str(plan),
        "--images",
        f"command:{sys.executable} {program} {{text}} {{out}}",
        "-o",
        str(out),
    ]
    done = CliRunner().invoke(app, [*words, "--json"])
    assert done.exit_code == 0, done.output
    document = json.loads(done.stdout)
    check_keys(document, "collect draw")
    assert (document["prompts"], document["made"], document["usd"]) == (2, 2, 0.0)
    again = CliRunner().invoke(app, words)
    assert "0 drawn, 2 there before" in " ".join(again.stdout.split())
    catalogue = tmp_path / "catalogue.sqlite"
    added = CliRunner().invoke(app, ["collect", "add", str(catalogue), str(out / "manifest.csv"), "--source", "drawn"])
    assert added.exit_code == 0, added.output
    with Catalogue(catalogue) as opened:
        assert {row.category for row in opened.ready()} == {"mug", "can"}


@pytest.mark.parametrize(
    ("spec", "error", "says"),
    [
        ("midjourney:v9", UsageError, "command, fal, openai"),
        ("command:draw {image} {out}", ConfigError, "leave out {image}"),
        ("command:draw {text}", ConfigError, "needs {out}"),
        ("openai:", ConfigError, "name the model"),
        ("openai:gpt-image-1", ConfigError, "usd_per_job"),
        ("fal:fal-ai/flux/dev", ConfigError, "usd_per_job"),
    ],
)
def test_a_wrong_model_says_what_to_give(tmp_path: Path, spec: str, error: type[ManiTwinError], says: str) -> None:
    with pytest.raises(error) as caught:
        choose_text_to_image(spec, BuildConfig(), tmp_path)
    assert says in str(caught.value)


def test_prompts_are_those_of_a_plan_and_wrong_ones_name_their_line(tmp_path: Path) -> None:
    (tmp_path / "prompts.csv").write_text("text,name\na mug,mug\na mug,mug\n")
    assert read_prompts(tmp_path) == [Prompt("a mug", "mug")]
    (tmp_path / "bad.csv").write_text("name\nmug\n")
    with pytest.raises(UsageError, match=r"bad\.csv:2: the text is missing"):
        read_prompts(tmp_path / "bad.csv")


def test_a_picture_shows_something(tmp_path: Path) -> None:
    path = tmp_path / "picture.png"
    for data, flaw in ((picture_png(3), None), (picture_png(3, blank=True), "one colour"), (b"<html>", "no picture")):
        path.write_bytes(data)
        found = picture_flaw(path)
        assert found is None if flaw is None else found is not None and flaw in found
