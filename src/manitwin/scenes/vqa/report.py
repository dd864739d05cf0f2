"""Report page of questions: samples with their pictures, the balance of answers, the text-only baseline, and counts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

import cv2
import numpy as np

from manitwin.dataset.report_page import Picture, Section, Table, page
from manitwin.formats.image_file import png_of
from manitwin.scenes.vqa.blind import blind_scores
from manitwin.scenes.vqa.question import CATEGORIES, CLOSED, Question
from manitwin.scenes.vqa.templates import FAMILIES
from manitwin.scenes.vqa.wording import word_question

SAMPLE_PX = 256
MOST_ANSWERS = 4
_MARK_BGR, _RIM_BGR = (60, 60, 240), (255, 255, 255)


def vqa_page(
    questions: Sequence[Question], rgb_of: Callable[[Question], np.ndarray], convention: str, scenes: int
) -> bytes:
    """Return the page; ``rgb_of`` returns a question's picture ``(H, W, 3) uint8``."""
    categories = Counter(question.category for question in questions)
    lead = [
        f"{len(questions):,} questions about {len({each.picture for each in questions}):,} pictures of {scenes:,} scenes,"
        f" {len({each.family for each in questions})} families. "
        + ", ".join(f"{name}: {categories[name]:,}" for name in CATEGORIES)
        + "."
    ]
    return page(
        "Questions and answers",
        lead,
        [
            Section("Samples", [_sample(each, rgb_of(each), convention) for each in _samples(questions)]),
            Section("Balance", [_counts(questions), _blind(questions)]),
        ],
    )


def _samples(questions: Sequence[Question]) -> list[Question]:
    """Return the first question of each family."""
    first: dict[str, Question] = {}
    for question in questions:
        first.setdefault(question.family, question)
    return [first[family] for family in FAMILIES if family in first]


def marked(rgb: np.ndarray, question: Question) -> np.ndarray:
    """Draw a question's points (numbered if there are several) and boxes into a copy of its picture."""
    drawn = np.ascontiguousarray(rgb[..., ::-1])
    height, width = drawn.shape[:2]
    scale = max(1, width // 256)
    for number, (x, y) in enumerate(question.points):
        at = (int(x * width), int(y * height))
        cv2.circle(drawn, at, 5 * scale, _RIM_BGR, -1)
        cv2.circle(drawn, at, 4 * scale, _MARK_BGR, -1)
        if len(question.points) > 1:
            cv2.putText(
                drawn, str(number + 1), (at[0] + 6 * scale, at[1]), cv2.FONT_HERSHEY_SIMPLEX, 0.5 * scale, _MARK_BGR, scale
            )  # fmt: skip
    for x, y, box_width, box_height in question.boxes:
        low = (int(x * width), int(y * height))
        cv2.rectangle(drawn, low, (int((x + box_width) * width), int((y + box_height) * height)), _MARK_BGR, scale)
    return drawn[..., ::-1]


def _sample(question: Question, rgb: np.ndarray, convention: str) -> Picture:
    words = word_question(question, convention, rgb.shape[1], rgb.shape[0])
    small = cv2.resize(
        marked(rgb, question), (SAMPLE_PX, SAMPLE_PX * rgb.shape[0] // rgb.shape[1]), interpolation=cv2.INTER_AREA
    )
    return Picture(png_of(small), f"{question.category}, {question.family}. {words.prompt} — {words.response}")


def _counts(questions: Sequence[Question]) -> Table:
    rows: list[list[str | int]] = []
    for family, about in FAMILIES.items():
        of_family = [each for each in questions if each.family == family]
        if not of_family:
            rows.append([family, about.category, 0, "", ""])
            continue
        answers = Counter(each.answer for each in of_family if each.kind in CLOSED)
        places = any(answer.startswith("<") for answer in answers)
        common = "" if places else ", ".join(f"{name} {count:,}" for name, count in answers.most_common(MOST_ANSWERS))
        rows.append([family, about.category, len(of_family), of_family[0].kind, common])
    return Table("Questions by family.", ("family", "category", "questions", "kind", "commonest answers"), rows)


def _blind(questions: Sequence[Question]) -> Table:
    """Return the table of the text-only baseline, with two-fold cross-validation over the scenes."""
    scenes = sorted({question.scene_id for question in questions})
    halves = ([q for q in questions if q.scene_id in set(scenes[side::2])] for side in (0, 1))
    first, second = halves
    tables = [blind_scores(first, second), blind_scores(second, first)]
    rows: list[list[str | int | float]] = []
    for family in (*FAMILIES, "all"):
        found = [table[family] for table in tables if family in table]
        count = sum(each.questions for each in found)
        if count:
            chance = sum(each.questions * each.chance for each in found) / count
            blind = sum(each.questions * each.blind for each in found) / count
            rows.append([family, count, round(chance, 3), round(blind, 3)])
    caption = "What words alone answer: a classifier trained on the questions of half of the scenes, asked those of the other."
    return Table(caption, ("family", "questions", "chance", "blind"), rows)
