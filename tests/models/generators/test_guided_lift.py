"""The built-in generator guided by a model: photos and texts, two rounds at most, and a record that gives the same bytes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from manitwin.config import BuildConfig, ServicesConfig, VlmConfig
from manitwin.errors import BadReply, Rejected, Unsupported
from manitwin.models.annotators.vlm.prompt_files import load_prompts
from manitwin.models.annotators.vlm.template_likeness import FIRST_LOOK, Likeness
from manitwin.models.annotators.vlm.template_reader import TemplateReader
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.server import FakeServer
from manitwin.models.generators.lift import LiftGenerator
from manitwin.models.generators.lift.review_rounds import review_twice
from manitwin.models.generators.protocol import Generated, GenerationRequest
from manitwin.models.generators.templates.filled_template import FilledTemplate
from manitwin.models.registry import create
from manitwin.models.vlm.protocol import Picture, Question, Reply, Turn, Usage
from manitwin.pipeline.generator_input import chosen_generator
from manitwin.pipeline.recipe import stages_for

KEY = "key-of-this-test"
SQUAT = "a squat blue espresso mug with a thick handle"
SEVERE = {"aspect": "proportions", "evidence": "far too slender", "severity": "severe"}


class Eyes:
    """Answers by the name of the question, ``likeness`` in order; any other measure or look is unsaid."""

    name, model = "scripted", "eyes-1"

    def __init__(self, category: str, measures: dict[str, float], *likeness: dict[str, Any], looks: Any = ()):
        self.category, self.measures, self.likeness, self.looks = category, measures, list(likeness), list(looks)
        self.asked: list[Question] = []

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        self.asked.append(question)
        return Reply(json.dumps(self.answer(question.name, question.schema)), Usage(1, 1), self.model)

    def answer(self, name: str, schema: dict[str, Any], *_: Any) -> dict[str, Any]:
        if name == "template":
            return {"shown": "A thing.", "category": self.category}
        if name == "template_measures":
            unsaid = dict.fromkeys(schema["properties"]["measures"]["properties"])
            return {"shown": "", "measures": unsaid | self.measures, "looks": self.looks}
        said = self.likeness.pop(0) if len(self.likeness) > 1 else self.likeness[0]
        unsaid = dict.fromkeys(schema["properties"]["corrected"]["properties"])
        return {
            "shown": "A thing.", "differences": [], "right": "yes", "looks": [], **said,
            "corrected": unsaid | said.get("corrected", {}),
        }  # fmt: skip

    @property
    def names(self) -> list[str]:
        return [question.name for question in self.asked]


YES: dict[str, Any] = {}


def no(**corrected: float) -> dict[str, Any]:
    return {"right": "no", "differences": [SEVERE], "corrected": corrected}


def guided(eyes: Eyes) -> LiftGenerator:
    return LiftGenerator().guided_by(TemplateReader(eyes, VlmConfig(picture_px=256), load_prompts(None)))


def made(
    generator: LiftGenerator, folder: Path, *, rgba: Any = None, text: str | None = None, name: str | None = None
) -> Generated:
    return generator.fetch(generator.submit(GenerationRequest(rgba, text, name, seed=0)), folder)


@pytest.fixture(scope="module")
def boxed() -> np.ndarray:
    """A box half as wide as it is high, seen at the front from a little above."""
    rgba = np.zeros((240, 240, 4), np.uint8)
    front, top = [[85, 60], [155, 60], [155, 210], [85, 210]], [[85, 60], [92, 50], [148, 50], [155, 60]]
    for outline, grey in ((front, 150), (top, 210)):
        cv2.fillPoly(rgba, [np.array(outline)], (grey, grey // 2, 60, 255))
    return rgba


def test_right_at_first_sight_is_one_round(boxed: np.ndarray, tmp_path: Path) -> None:
    eyes = Eyes("box", {"width": 0.5}, YES)
    result = made(guided(eyes), tmp_path, rgba=boxed)
    assert eyes.names == ["template", "template_measures", "template_likeness"]
    assert [isinstance(part, Picture) for part in eyes.asked[-1].parts].count(True) == 4
    assert result.notes["primitive"] == "template:box" and result.known is not None and result.known.name == "box"
    assert result.notes["residual"]["iou"] > 0.95
    filled = result.notes["filled"]
    assert (filled["source"], filled["measures"], filled["right"]) == ("vlm:eyes-1", {"width": 0.5}, True)
    assert filled["findings"] == []


def test_wrong_twice_is_rejected_with_its_words_and_never_asked_a_third_time(boxed: np.ndarray, tmp_path: Path) -> None:
    eyes = Eyes("box", {}, no())
    with pytest.raises(
        Rejected, match=r"eyes-1 says in both rounds .* far too slender; then: .* far too slender"
    ) as caught:
        made(guided(eyes), tmp_path, rgba=boxed)
    assert (caught.value.reason, caught.value.stage) == ("generator_failed", "generate")
    assert eyes.names.count("template_likeness") == 2


@pytest.mark.slow
def test_name_that_explains_the_outline_better_than_the_model_s_template_wins_and_is_said(
    boxed: np.ndarray, tmp_path: Path
) -> None:
    result = made(guided(Eyes("spoon", {}, YES)), tmp_path, rgba=boxed, name="box")
    assert result.notes["primitive"] == "template:box"
    assert result.notes["filled"]["findings"][0].startswith("the user calls it 'box'")
    assert "a box explains the outline clearly better" in result.notes["filled"]["findings"][1]


@pytest.mark.slow
def test_correction_of_a_photo_is_fitted_and_the_better_fit_stays(boxed: np.ndarray, tmp_path: Path) -> None:
    once = made(guided(Eyes("box", {"width": 0.9}, YES)), tmp_path, rgba=boxed).notes
    eyes = Eyes("box", {"width": 0.9}, no(width=0.5), YES)
    twice = made(guided(eyes), tmp_path, rgba=boxed).notes
    assert twice["filled"]["right"] and len(twice["filled"]["rounds"]) == 2
    assert twice["residual"]["outline"] <= once["residual"]["outline"] + 1e-4
    better = twice["measures"] != once["measures"]
    told = "explains the outline in the photo better" if better else "in the photo no better: its shape is as before"
    assert told in str(eyes.asked[-1].parts[0]) and (twice["filled"]["measures"] == {"width": 0.5}) == better


def test_none_of_the_templates_falls_back_to_the_name_and_says_so(boxed: np.ndarray, tmp_path: Path) -> None:
    eyes = Eyes("none of these", {})
    result = made(guided(eyes), tmp_path, rgba=boxed, name="first aid kit")
    assert eyes.names == ["template"] and "none of the templates" in result.notes["filled"]["findings"][0]
    assert result.notes["filled"]["category"] is None


def test_text_gets_what_the_plain_reader_does_not_know(tmp_path: Path) -> None:
    eyes = Eyes("mug", {"height_m": 0.08, "width": 1.0, "handle": 0.4}, YES)
    result = made(guided(eyes), tmp_path, text=SQUAT)
    measures = result.notes["measures"]
    assert (measures["height_m"], measures["width"], measures["handle"]) == (0.08, 1.0, 0.4)
    assert result.metric and result.known is not None and result.known.source == "template:mug, filled in by vlm:eyes-1"
    assert result.known.has_part_masses and result.known.inertia_kg_m2 is not None
    assert len(eyes.asked) == 3
    again = made(guided(Eyes("mug", eyes.measures, YES)), tmp_path, text=f"{SQUAT}, 9 cm tall")
    assert again.notes["measures"]["height_m"] == pytest.approx(0.09, rel=0.02), "a stated length comes first"


def test_text_that_is_understood_is_asked_nothing_and_unchanged(tmp_path: Path) -> None:
    eyes = Eyes("spoon", {}, YES)
    result = made(guided(eyes), tmp_path, text="a red ceramic mug, 10 cm tall").path.read_bytes()
    assert eyes.asked == []
    assert result == made(LiftGenerator(), tmp_path, text="a red ceramic mug, 10 cm tall").path.read_bytes()


def test_text_of_no_template_lists_the_nearest_ones(tmp_path: Path) -> None:
    eyes = Eyes("none of these", {})
    assert guided(eyes).why_not("a gnarled spon") is None, "the model is asked first"
    with pytest.raises(Unsupported, match=r"vlm:eyes-1 says .*none of the templates.*did you mean spoon"):
        made(guided(eyes), tmp_path, text="a gnarled spon")
    assert guided(eyes).why_not("a mug " + 400 * "x") is not None
    with pytest.raises(Unsupported, match="at most 400"):
        made(guided(eyes), tmp_path, text="a mug " + 400 * "x")
    plain = made(guided(eyes), tmp_path, text="a bulbous mug")
    assert plain.notes["category"] == "mug" and "none of the templates" in plain.notes["filled"]["findings"][0]


def test_text_is_corrected_once(tmp_path: Path) -> None:
    eyes = Eyes("mug", {"width": 0.8}, no(width=1.0), YES)
    result = made(guided(eyes), tmp_path, text=SQUAT)
    assert result.notes["measures"]["width"] == 1.0 and eyes.names.count("template_likeness") == 2
    assert "This is how it is with your corrections." in str(eyes.asked[-1].parts[0])
    with pytest.raises(Rejected, match="says in both rounds"):
        made(guided(Eyes("mug", {}, no(width=1.0))), tmp_path, text=SQUAT)


def test_measures_that_stay_out_of_range_are_findings_and_bad_forms_are_no_answer(tmp_path: Path) -> None:
    result = made(guided(Eyes("mug", {"width": 1e30}, YES)), tmp_path, text=SQUAT)
    assert result.notes["measures"]["width"] <= 1.0 and "1e+30" in result.notes["filled"]["findings"][0]
    with pytest.raises(BadReply, match="when asked again"):
        made(guided(Eyes("mug", {"width": "os.system('x')"}, YES)), tmp_path, text=SQUAT)  # type: ignore[dict-item]


@pytest.mark.parametrize(("right", "looks"), [((True,), 1), ((False, True), 2), ((False, False, True), 2)])
def test_there_are_two_rounds_at_most(right: tuple[bool, ...], looks: int) -> None:
    answers, seen = iter(right), []

    def compare(thing: str, before: str) -> Likeness:
        seen.append((thing, before))
        return Likeness(next(answers), "words", FilledTemplate("mug"))

    agreed = review_twice("first", compare, lambda thing, _: (f"{thing}, corrected", "It was changed."))
    assert len(seen) == looks == len(agreed.rounds) and agreed.accepted == right[looks - 1]
    assert seen[0] == ("first", FIRST_LOOK) and (agreed.final == "first") == (looks == 1)
    assert looks == 1 or "said: 'words'. It was changed. This is the last look." in seen[1][1]


def served(eyes: Eyes, spec: Callable[[str], str], record: Path | None) -> LiftGenerator:
    config = BuildConfig(
        annotator=spec("eyes"),
        vlm=VlmConfig(picture_px=256),
        services=ServicesConfig(record=record, cache=False),
    )
    stages = stages_for("text", config)
    generator = stages[0].generator  # type: ignore[attr-defined]
    assert stages[0].needs == "vlm" and "prompt template v1" in str(stages[0].model)
    assert isinstance(generator, LiftGenerator)
    return generator


def test_replayed_answers_give_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MANITWIN_VLM_KEY", KEY)
    eyes, record = Eyes("mug", {"width": 0.8}, no(width=1.0), YES), tmp_path / "answers.jsonl"
    with FakeServer(FakeOpenAi(key=KEY, answer=eyes.answer)) as server:
        first = made(served(eyes, lambda name: f"openai:{name}@{server.url}/v1", record), tmp_path, text=SQUAT)
    glb = first.path.read_bytes()
    assert len(record.read_text().splitlines()) == 4
    again = made(served(eyes, lambda _: f"replay:{record}", None), tmp_path, text=SQUAT)
    assert again.path.read_bytes() == glb and again.notes == first.notes


def test_only_a_model_guides_and_only_what_has_templates() -> None:
    plain = BuildConfig()
    assert chosen_generator(plain, create("annotator", "rules", plain)).needs == "cpu"
    command = BuildConfig(generator="command:true {image} {out}")
    assert not hasattr(chosen_generator(command, create("annotator", "rules", command)), "guided_by")
