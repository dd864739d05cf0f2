"""Text-only baseline: the accuracy of a classifier that reads questions without their pictures."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from manitwin.scenes.vqa.logistic import WordModel
from manitwin.scenes.vqa.question import CLOSED, Question
from manitwin.scenes.vqa.wording import word_question

_WORD = re.compile(r"<p\d+>|\w+")
_PICTURE_PX = 1000


@dataclass(frozen=True)
class BlindScore:
    """The accuracy on a number of closed questions, by ``chance`` and by a text-only classifier (``blind``)."""

    questions: int
    chance: float
    blind: float


def blind_scores(training: Sequence[Question], asked: Sequence[Question]) -> dict[str, BlindScore]:
    """Train a text-only classifier on closed questions and score it on others, by family and overall (``all``).

    The classifier is a logistic regression over words, word bigrams, the words and the position of each option, and each word
    with each option; it answers with the likeliest option. Source of the method: bag of n-grams as in the question-only
    baselines of VQA (Goyal et al. 2017, "Making the V in VQA matter").
    """
    by_family: dict[str, list[Question]] = defaultdict(list)
    for question in training:
        if question.kind in CLOSED:
            by_family[question.family].append(question)
    right: dict[str, list[tuple[float, bool]]] = defaultdict(list)
    models = {family: _model(of_family) for family, of_family in by_family.items()}
    for question in asked:
        if question.kind in CLOSED and question.family in models:
            options = _options(question)
            scores = [models[question.family].probability(_features(question, each)) for each in range(len(options))]
            best = scores.index(max(scores))
            right[question.family].append((1 / len(options), options[best] == question.answer))
    found = {family: _score(each) for family, each in sorted(right.items())}
    everything = [one for each in right.values() for one in each]
    return {**found, "all": _score(everything)} if everything else {}


def _score(answers: Sequence[tuple[float, bool]]) -> BlindScore:
    count = len(answers)
    return BlindScore(
        count, sum(chance for chance, _ in answers) / count, sum(is_right for _, is_right in answers) / count
    )


def _model(questions: Sequence[Question]) -> WordModel:
    texts, answers = [], []
    for question in questions:
        for place, option in enumerate(_options(question)):
            texts.append(_features(question, place))
            answers.append(option == question.answer)
    return WordModel.from_texts(texts, answers)


def _options(question: Question) -> tuple[str, ...]:
    return question.options


def _features(question: Question, place: int) -> list[str]:
    shown = word_question(question, "thousand", _PICTURE_PX, _PICTURE_PX)
    words = _WORD.findall(re.sub(r"\(\d+, \d+\)", "", shown.question).lower())
    option = re.sub(r"\(\d+, \d+\)", "point", shown.options[place]).lower()
    pairs = [f"{a} {b}" for a, b in pairwise(words)]
    return [
        f"place {place}", f"is {option}", *(f"has {word}" for word in option.split()),
        *(f"{word} > {option}" for word in (*words, *pairs)),
    ]  # fmt: skip
