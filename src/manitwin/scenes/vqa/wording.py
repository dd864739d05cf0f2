"""Notation of points, boxes and choices: the conventions of models that answer with places."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from manitwin.scenes.vqa.question import BOX, CHOICE, POINT, YES_NO, Box, Point, Question


@dataclass(frozen=True)
class Convention:
    """A notation of places; ``ask_point`` and ``ask_box`` follow a question that asks for one."""

    point: Callable[[Point, int, int], str]
    box: Callable[[Box, int, int], str]
    ask_point: str
    ask_box: str


def _unit(point: Point, width: int, height: int) -> str:
    return f"({point[0]:.3f}, {point[1]:.3f})"


def _unit_box(box: Box, width: int, height: int) -> str:
    return f"({box[0]:.3f}, {box[1]:.3f}, {box[0] + box[2]:.3f}, {box[1] + box[3]:.3f})"


def _pixel(point: Point, width: int, height: int) -> str:
    return f"({int(point[0] * width)}, {int(point[1] * height)})"


def _pixel_box(box: Box, width: int, height: int) -> str:
    left, top = round(box[0] * width), round(box[1] * height)
    return f"({left}, {top}, {left + round(box[2] * width)}, {top + round(box[3] * height)})"


def _thousand(point: Point, width: int, height: int) -> str:
    return f"({round(1000 * point[0])}, {round(1000 * point[1])})"


def _thousand_box(box: Box, width: int, height: int) -> str:
    return f"({', '.join(str(round(1000 * v)) for v in (box[0], box[1], box[0] + box[2], box[1] + box[3]))})"


def _tuples(point: Point, width: int, height: int) -> str:
    return f"[{_unit(point, width, height)}]"


_TUPLES = (
    "Your answer should be formatted as a list of tuples, i.e. [(x1, y1)], where each tuple contains the x and y coordinates of a"
    " point satisfying the conditions above. The coordinates should be between 0 and 1, indicating the normalized pixel locations"
    " of the points in the image."
)
_SHARES = "of the picture's width and height, from its upper left corner"

CONVENTIONS: Mapping[str, Convention] = {
    "unit": Convention(
        _unit, _unit_box, f"Answer with one point (x, y) in shares {_SHARES}.",
        f"Answer with (left, top, right, bottom) in shares {_SHARES}.",
    ),
    "robopoint": Convention(_tuples, _unit_box, _TUPLES, f"Answer with (left, top, right, bottom) in shares {_SHARES}."),
    "roborefer": Convention(_tuples, _unit_box, _TUPLES, f"Answer with (left, top, right, bottom) in shares {_SHARES}."),
    "pixel": Convention(
        _pixel, _pixel_box, "Answer with one point (x, y) in pixels.", "Answer with (left, top, right, bottom) in pixels."
    ),
    "thousand": Convention(
        _thousand, _thousand_box, f"Answer with one point (x, y) in thousandths {_SHARES}.",
        f"Answer with (left, top, right, bottom) in thousandths {_SHARES}.",
    ),
}  # fmt: skip
"""The conventions by name; those of RoboPoint and RoboRefer give what their evaluations read."""


@dataclass(frozen=True)
class WordedQuestion:
    """A worded question: ``prompt`` with options and answer format, ``answer`` short, ``response`` a sentence."""

    question: str
    prompt: str
    answer: str
    response: str
    options: tuple[str, ...]


def word_question(question: Question, convention: str, width_px: int, height_px: int) -> WordedQuestion:
    """Write the places of a question in a convention."""
    rules = CONVENTIONS[convention]

    def written(text: str) -> str:
        # a place in a sentence is a plain pair; only an answer is a list of tuples
        place = rules.point if question.kind == POINT else CONVENTIONS[_PLAIN.get(convention, convention)].point
        for number, point in enumerate(question.points):
            text = text.replace(f"<p{number}>", place(point, width_px, height_px))
        for number, box in enumerate(question.boxes):
            text = text.replace(f"<b{number}>", rules.box(box, width_px, height_px))
        return text

    asked, options = written(question.question), tuple(written(option) for option in question.options)
    behind = {
        YES_NO: "Answer yes or no.", CHOICE: f"Choose one: {'; '.join(options)}.", POINT: rules.ask_point, BOX: rules.ask_box
    }.get(question.kind, "")  # fmt: skip
    return WordedQuestion(
        asked, f"{asked} {behind}".strip(), written(question.answer), written(question.response), options
    )


_PLAIN = {"robopoint": "unit", "roborefer": "unit"}
