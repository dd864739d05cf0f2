"""``manitwin prompts``: what is written is what was asked."""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from manitwin.api import build
from manitwin.cli.annotator_questions import AskedQuestions, list_annotator_questions, write_questions
from manitwin.config import BuildConfig, ServicesConfig
from manitwin.errors import TwinError, UsageError
from manitwin.formats.isolated import Limits
from manitwin.models.annotators.vlm.prompt_files import load_prompts
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.server import FakeServer
from manitwin.models.vlm.protocol import Picture

SAMPLES = Path(__file__).resolve().parents[2] / "samples"

pytestmark = pytest.mark.slow  # a whole build


@pytest.fixture(scope="module")
def asked_and_built(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[dict[str, Any]], AskedQuestions, Path]:
    """The requests that came to the server while a mug was built, and the questions made from the finished twin."""
    out = tmp_path_factory.mktemp("built")
    with FakeServer(FakeOpenAi(key="rehearsal-key")) as server:
        config = BuildConfig(annotator=f"openai:eyes@{server.url}/v1", services=ServicesConfig(cache=False))
        with pytest.MonkeyPatch.context() as environment:
            environment.setenv("MANITWIN_VLM_KEY", "rehearsal-key")
            report = build(SAMPLES / "mug.glb", out, name="mug", jobs=1, quick=True, config=config)
    folder = report.results[0].folder
    assert folder is not None and report.results[0].status == "accepted"
    bodies = [request.json() for request in server.requests]
    return bodies, list_annotator_questions(folder, config, config.annotator), folder


def asked_at_first(bodies: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The requests without those that ask for something again."""
    return [body for body in bodies if len(body["messages"]) == 2]


def in_order(bodies: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The requests with the votes, which are sent at the same time, in the order of their wordings."""
    wordings = [load_prompts(None)["grasp_points"].question, *load_prompts(None)["grasp_points"].otherwise]
    ends = [wording.strip().splitlines()[-1] for wording in wordings]

    def place(body: dict[str, Any]) -> int:
        last = str(body["messages"][1]["content"][-1].get("text", "")).splitlines()[-1]
        return ends.index(last) if last in ends else -1

    return sorted(bodies, key=place)


def test_text_and_schema_are_exactly_what_was_asked(
    asked_and_built: tuple[list[dict[str, Any]], AskedQuestions, Path],
) -> None:
    bodies, questions, _ = asked_and_built
    sent = asked_at_first(bodies)
    assert len(sent) == 8 and len(questions.questions) == 11
    for body, one in zip(in_order(sent), questions.questions, strict=False):
        system, user = body["messages"]
        assert system["content"] == one.system
        texts = [part["text"] for part in user["content"] if part["type"] == "text"]
        assert texts == [part for part in one.question.parts if isinstance(part, str)]
        assert body["response_format"]["json_schema"]["schema"] == one.question.schema


def test_pictures_agree_with_those_that_were_asked_with(
    asked_and_built: tuple[list[dict[str, Any]], AskedQuestions, Path],
) -> None:
    bodies, questions, _ = asked_and_built
    for body, one in zip(in_order(asked_at_first(bodies)), questions.questions, strict=False):
        urls = [part["image_url"]["url"] for part in body["messages"][1]["content"] if part["type"] == "image_url"]
        sent = [base64.b64decode(url.partition(",")[2]) for url in urls]
        made = [part.png for part in one.question.parts if isinstance(part, Picture)]
        assert len(sent) == len(made)
        for a, b in zip(sent, made, strict=True):
            first, second = (np.asarray(Image.open(io.BytesIO(png)), dtype=int) for png in (a, b))
            assert first.shape == second.shape
            # where the drawn extent leaves its picture, that grows
            drawn = one.question.name == "physical" and a is sent[-1]
            assert drawn or first.size == pytest.approx(3 * 768**2, rel=0.02)
            assert np.abs(first - second).mean() < 0.2, "of 255: the same picture but for the coding of its texture"


def test_folders_hold_text_with_picture_names_and_a_bill(
    asked_and_built: tuple[list[dict[str, Any]], AskedQuestions, Path], tmp_path: Path
) -> None:
    _, questions, folder = asked_and_built
    write_questions(questions, tmp_path / "asked")
    names = sorted(path.name for path in (tmp_path / "asked").iterdir())
    grasps = ["6_grasp_points_1", "7_grasp_points_2", "8_grasp_points_3"]
    asked = ["1_quality", "2_physical", "3_captions", "4_functional_points", "5_closer_look", *grasps]
    assert names == ["10_template_measures", "11_template_likeness", *asked, "9_template", "README.md"]
    for one in questions.questions:
        made = tmp_path / "asked" / one.folder
        lines = (made / "question.txt").read_text().splitlines()
        pictures = [line.strip("[]") for line in lines if line.startswith("[picture_")]
        assert pictures == sorted(path.name for path in made.glob("*.png"))
        assert json.loads((made / "schema.json").read_text()) == one.question.schema
    template = json.loads((tmp_path / "asked" / "9_template" / "schema.json").read_text())
    assert "mug" in template["properties"]["category"]["enum"]
    likeness = (tmp_path / "asked" / "11_template_likeness" / "question.txt").read_text()
    assert "built from the template: mug" in likeness and "The photo:" in likeness
    readme = (tmp_path / "asked" / "README.md").read_text()
    assert "8_grasp_points_3" in readme and "usd_per_million_tokens" in readme
    priced = BuildConfig(services=ServicesConfig(usd_per_million_tokens=(1.0, 10.0)))
    write_questions(list_annotator_questions(folder, priced, "openai:MODEL"), tmp_path / "priced")
    assert "usd_per_million" not in (tmp_path / "priced" / "README.md").read_text()
    with pytest.raises(UsageError, match="not empty"):
        write_questions(questions, tmp_path / "asked")


def test_folder_that_is_no_twin_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TwinError):
        list_annotator_questions(tmp_path, BuildConfig(), "openai:MODEL")


def test_twin_is_read_in_a_process_with_limits_of_its_own(
    asked_and_built: tuple[list[dict[str, Any]], AskedQuestions, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """This process would fail if it read one."""

    def refused(*_: object, **__: object) -> None:
        raise AssertionError("read in the main process")

    monkeypatch.setattr("manitwin.cli.annotator_questions.Twin", refused)
    monkeypatch.setattr("manitwin.cli.annotator_questions.read_questions", refused)
    assert len(list_annotator_questions(asked_and_built[2], BuildConfig(), "openai:MODEL").questions) == 11
    monkeypatch.setattr("manitwin.cli.annotator_questions.LIMITS", Limits(seconds=0.05))
    with pytest.raises(TwinError, match=r"within 0\.05 s"):
        list_annotator_questions(asked_and_built[2], BuildConfig(), "openai:MODEL")
