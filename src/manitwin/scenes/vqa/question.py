"""Questions and answers about one picture, independent of the file format."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

LANGUAGE, FUNCTION, SCENE, TASK, DETECTION = (
    "Language Grounding",
    "Functional Planning",
    "Scene Understanding",
    "Task Planning",
    "Detection",
)
CATEGORIES = (LANGUAGE, FUNCTION, SCENE, TASK, DETECTION)
"""The five categories of the paper, by its names (section "VQA Data Generation")."""

YES_NO, CHOICE, POINT, BOX, NUMBER, LIST, TEXT = "yes/no", "choice", "point", "box", "number", "list", "text"
CLOSED = (YES_NO, CHOICE)
"""Kinds whose answer is one of a few options."""

Point = tuple[float, float]
Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class Draft:
    """A question before wording: ``slots`` fill a template of the family.

    ``answer`` is short, ``response`` is a sentence. Both, the slots and the ``options`` may contain ``<p0>``, ``<b0>`` ...,
    which stand for ``points`` (x, y) and ``boxes`` (x, y, width, height) as shares of the picture's width and height from its
    upper left corner. ``evidence`` contains the inputs of the answer: names of objects, measured values (SI), margins.
    """

    family: str
    camera: str
    kind: str
    slots: Mapping[str, str]
    answer: str
    response: str
    evidence: Mapping[str, Any]
    options: tuple[str, ...] = ()
    points: tuple[Point, ...] = ()
    boxes: tuple[Box, ...] = ()


@dataclass(frozen=True)
class Question:
    """A question with its words; ``template`` is the index of its paraphrase, ``held_out`` marks one that only ``val`` uses.

    ``rephrased``: a model wrote the wording; the answer is always computed.
    """

    question_id: str
    scene_id: str
    camera: str
    split: str
    category: str
    family: str
    kind: str
    template: int
    held_out: bool
    question: str
    answer: str
    response: str
    options: tuple[str, ...] = ()
    points: tuple[Point, ...] = ()
    boxes: tuple[Box, ...] = ()
    evidence: Mapping[str, Any] = field(default_factory=dict)
    rephrased: bool = False

    @property
    def picture(self) -> str:
        """The file name of its picture, without a folder."""
        return f"{self.scene_id}_{self.camera}.jpg"

    def to_json(self) -> dict[str, Any]:
        """Return the question as JSON values."""
        return {**asdict(self), "picture": self.picture}
