"""Templates chosen and filled in by a model: forms that only measures and looks fit into, and what is left out."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from scripted_chat import ScriptedChat, annotator, changed

from manitwin.errors import BadReply
from manitwin.models.annotators.vlm.template_choice import NONE_OF_THESE, TemplateInput, choice_answer
from manitwin.models.annotators.vlm.template_likeness import FIRST_LOOK, Likeness, likeness_answer
from manitwin.models.annotators.vlm.template_measures import filled_answer
from manitwin.models.annotators.vlm.template_reader import TemplateReader
from manitwin.models.fakes.chat import anthropic_complaint, openai_complaint
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.vlm.prices import TokenPrice
from manitwin.models.vlm.protocol import Picture
from manitwin.models.vlm.strict_schema import strict_schema

SQUAT = TemplateInput(None, "a squat blue espresso mug with a thick handle", None)
MUG: dict[str, Any] = {
    "shown": "Squat, blue.",
    "measures": {"height_m": 0.08, "width": 1.0, "wall_m": None, "taper": None, "handle": 0.4},
    "looks": [{"part": "body", "color": "dark blue", "material": "unsaid"}],
}
LIKE: dict[str, Any] = {
    "shown": "Both are mugs.",
    "differences": [],
    "right": "yes",
    "corrected": dict.fromkeys(MUG["measures"]),
    "looks": [],
}
SEVERE = {"aspect": "proportions", "evidence": "half as tall again", "severity": "severe"}


def reader(chat: ScriptedChat) -> TemplateReader:
    return annotator(chat, picture_px=256).template_reader


def photo() -> np.ndarray:
    rgba = np.zeros((60, 80, 4), np.uint8)
    rgba[10:50, 30:60] = (200, 30, 30, 255)
    return rgba


def choice(category: Any) -> dict[str, Any]:
    return {"shown": "A thing.", "category": category}


def test_forms_are_taken_by_both_vendors_and_the_categories_are_the_templates() -> None:
    for form in (choice_answer(), filled_answer("mug"), likeness_answer("wine glass")):
        assert openai_complaint(strict_schema(form)) is None and anthropic_complaint(strict_schema(form)) is None
    one_of = strict_schema(choice_answer())["properties"]["category"]["enum"]
    assert one_of == [*load_templates(), NONE_OF_THESE]


def test_photo_is_shown_cut_out_and_the_sentence_is_quoted() -> None:
    chat = ScriptedChat(choice("mug"))
    assert reader(chat).choose(TemplateInput(photo(), None, "cup")).category == "mug"
    assert reader(chat).choose(SQUAT).category == "mug"
    (seen, _), *_, (read, _) = chat.asked
    assert "The user calls it: cup." in str(seen.parts[0]) and sum(isinstance(p, Picture) for p in seen.parts) == 1
    assert "'a squat blue espresso mug" in str(read.parts[0]) and not any(isinstance(p, Picture) for p in read.parts)


def test_none_of_these_is_an_answer_and_a_template_against_the_name_is_asked_again() -> None:
    chat = ScriptedChat(choice(NONE_OF_THESE))
    assert reader(chat).choose(SQUAT) == reader(chat).choose(SQUAT)
    assert reader(chat).choose(SQUAT).category is None and all(not turns for _, turns in chat.asked)
    chat = ScriptedChat(choice("spoon"))
    chosen = reader(chat).choose(TemplateInput(photo(), None, "mug"))
    assert chosen.category == "spoon" and "the user calls it 'mug'" in chosen.findings[0] and len(chat.asked) == 2


@pytest.mark.parametrize("category", ["unicorn", "", None, 7, ["mug"], "__import__('os').system('true')"])
def test_category_that_there_is_no_template_of_is_asked_again_and_then_no_answer(category: Any) -> None:
    chat = ScriptedChat(choice(category))
    with pytest.raises(BadReply, match="no usable answer to 'template' when asked again: category"):
        reader(chat).choose(SQUAT)
    assert len(chat.asked) == 2


@pytest.mark.parametrize(
    "change",
    [
        {"measures": MUG["measures"] | {"width": "__import__('os')"}},
        {"measures": MUG["measures"] | {"width": "0.9"}},
        {"measures": MUG["measures"] | {"width": True}},
        {"measures": MUG["measures"] | {"width": -0.9}},
        {"measures": MUG["measures"] | {"width": float("nan")}},
        {"measures": MUG["measures"] | {"width": float("inf")}},
        {"measures": MUG["measures"] | {"lid": 1.0}},
        {"measures": {"width": 0.9}},
        {"measures": [0.9]},
        {"looks": [{"part": "body", "color": "url(evil)", "material": "unsaid"}]},
        {"looks": [{"part": "body", "color": "blue", "material": "uranium"}]},
        {"looks": [{"part": "engine", "color": "blue", "material": "unsaid"}]},
        {"looks": 9 * MUG["looks"]},
        {"code": "print(1)"},
    ],
)
def test_answer_of_another_form_is_asked_again_and_then_no_answer(change: dict[str, Any]) -> None:
    chat = ScriptedChat(changed(MUG, **change))
    with pytest.raises(BadReply, match="no usable answer to 'template_measures' when asked again"):
        reader(chat).fill(SQUAT, "mug")
    assert len(chat.asked) == 2


@pytest.mark.parametrize("width", [1e308, 2.0, 0.1])
def test_measure_of_no_such_thing_is_asked_again_and_left_out_with_words(width: float) -> None:
    chat = ScriptedChat(changed(MUG, measures=MUG["measures"] | {"width": width}))
    filled, findings = reader(chat).fill(SQUAT, "mug")
    assert dict(filled.measures) == {"height_m": 0.08, "handle": 0.4} and len(chat.asked) == 2
    assert len(findings) == 1 and "but nearly every mug has a ratio, 0.8 to 1" in findings[0]


def test_measures_and_looks_are_what_was_said() -> None:
    looks = [
        {"part": "body", "color": "dark blue", "material": "unsaid"},
        {"part": "handle", "color": "#0A141e", "material": "cork"},
    ]
    filled, findings = reader(ScriptedChat(changed(MUG, looks=looks))).fill(SQUAT, "mug")
    assert findings == () and filled.measures == {"height_m": 0.08, "width": 1.0, "handle": 0.4}
    body, handle = filled.wishes["body"], filled.wishes["handle"]
    assert body.material is None and body.rgb is not None and body.rgb[2] > 2 * body.rgb[0]
    assert handle.rgb == pytest.approx((10 / 255, 20 / 255, 30 / 255))
    assert handle.material is not None and handle.material.material == "cork"


def compared(*answers: dict[str, Any]) -> tuple[ScriptedChat, Likeness]:
    chat, measures = ScriptedChat(*answers), load_templates()["mug"].typical_measures()
    return chat, reader(chat).compare(SQUAT, "mug", measures, [], FIRST_LOOK)


def test_what_is_not_clearly_right_is_wrong() -> None:
    chat, likeness = compared(LIKE)
    assert likeness.right and len(chat.asked) == 1
    chat, likeness = compared(changed(LIKE, right="no", differences=[SEVERE]))
    assert not likeness.right and likeness.detail == "proportions: half as tall again" and len(chat.asked) == 1
    for doubtful in ({"right": "unsure"}, {"right": "no"}, {"differences": [SEVERE]}):
        chat, likeness = compared(changed(LIKE, **doubtful))
        assert not likeness.right and len(chat.asked) == 2 and likeness.findings


def test_everything_that_is_asked_with_decides_and_has_a_price() -> None:
    chat = ScriptedChat({})
    own = reader(chat)
    assert own.model.startswith("eyes-1, prompt template v1 and template_measures v1 and template_likeness v1 ")
    assert own.model != annotator(chat, picture_px=512).template_reader.model and own.expected_usd == 0
    chat.price = TokenPrice(1.0, 0.0)  # type: ignore[attr-defined]
    pictures = 6 * 10 * 10 / 1e6
    assert pictures < reader(chat).expected_usd < pictures + 1e-2
    json.dumps(own.model)
