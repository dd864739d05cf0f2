"""Selection of drafts: answers are balanced over the whole set against prediction from words, and limited for each scene."""

from __future__ import annotations

import random
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import replace

from manitwin.scenes.vqa.logistic import WordModel
from manitwin.scenes.vqa.question import CHOICE, NUMBER, YES_NO, Draft
from manitwin.scenes.vqa.templates import FAMILIES

MOST_OF_ONE_ANSWER = 0.52
"""Maximal share of the commoner answer of a yes/no family."""
NUMBER_STEP_CM = 5
MOST_OF_A_FAMILY = 0.09
"""Maximal share of one family in a scene's questions, if others have enough."""
FIXED_CHOICES = frozenset(
    {"best_grasp_type", "region_of_object", "blocked_direction", "side_for_robot", "side_in_picture"}
)
"""Families with the same options in each question."""
IN_ORDER = frozenset({"count_objects", "taller", "heavier", "side_for_robot", "side_in_picture"})
"""Families whose options have a fixed order."""
LEAST_RIGHT = 0.1
"""Least share of a family's questions, with the same options, that an option must answer."""
MOST_ROUNDS, TOLD_MORE, LEAST_TOLD = 10, 0.01, 200
"""Choices are balanced at most ``MOST_ROUNDS`` times, while the likeliest options beat chance by more than ``TOLD_MORE``. With
fewer than ``LEAST_TOLD`` drafts an excess counts as chance.
"""
SPLITS, MOST_ASKED = 4, 4000
_KEPT_SURE = 0.7
"""In the first round a choice is kept with this times (chance / probability of its answer by words), at most 1."""


def words_of(draft: Draft, option: str = "") -> list[str]:
    """Return the features that a text-only reader sees of a draft, and of one of its options.

    An option that is a place in random order has no features.
    """
    if option.startswith("<") and draft.family not in IN_ORDER:
        return []
    if option:
        return [f"option {option}", *(f"noun {word}" for word in option.split()[-1:])]
    return [f"{name} {value}" for name, value in draft.slots.items() if name != "A"]


def chosen(drafts: Sequence[Sequence[Draft]], per_scene: int, rng: random.Random) -> list[list[Draft]]:
    """Return the selected drafts of each scene, at most ``per_scene``.

    In each closed family a draft is kept with a probability inverse to that of its answer given the words alone (a logistic
    regression fitted to all drafts), so that words do not predict the remaining answers. The balance holds for the whole set:
    balance within a scene would let a reader infer an answer from the others.
    """
    pool: dict[str, list[tuple[int, Draft]]] = defaultdict(list)
    for scene, of_scene in enumerate(drafts):
        for draft in of_scene:
            pool[draft.family].append((scene, draft))
    kept: list[dict[str, list[Draft]]] = [defaultdict(list) for _ in drafts]
    for family in FAMILIES:
        found = pool.get(family, [])
        if not found:
            continue
        kind = found[0][1].kind
        if kind == YES_NO:
            found = _balanced_yes_no(found, rng)
        elif kind == CHOICE:
            found = _equalized(found, rng) if family in FIXED_CHOICES else _balanced_choices(found, rng)
        elif kind == NUMBER:
            found = _balanced_numbers(found, rng)
        rng.shuffle(found)
        for scene, draft in found:
            kept[scene][family].append(draft)
    taken = [_round_robin(families, per_scene, rng) for families in kept]
    asked = _trimmed([first for first, _ in taken], rng)
    return [first + spare[: per_scene - len(first)] for first, (_, spare) in zip(asked, taken, strict=True)]


def _balanced_yes_no(found: list[tuple[int, Draft]], rng: random.Random) -> list[tuple[int, Draft]]:
    answers = [draft.answer == "yes" for _, draft in found]
    if len(set(answers)) < 2:
        return []
    model = WordModel.from_texts([words_of(draft) for _, draft in found], answers)
    sides: dict[bool, list[tuple[int, Draft]]] = {True: [], False: []}
    for each, answer in zip(found, answers, strict=True):
        yes = model.probability(words_of(each[1]))
        if rng.random() < min(yes, 1 - yes) / (yes if answer else 1 - yes):
            sides[answer].append(each)
    least = min(map(len, sides.values()))
    return [each for side in (True, False) for each in rng.sample(sides[side], least)]


def _balanced_choices(found: list[tuple[int, Draft]], rng: random.Random) -> list[tuple[int, Draft]]:
    """Keep drafts with a probability inverse to that of their answer by words, repeatedly while words predict many answers."""
    for number in range(MOST_ROUNDS):
        sure = _KEPT_SURE if number == 0 else 1.0
        model = _option_model(found)
        found = [
            (scene, draft)
            for scene, draft in found
            if rng.random() < sure / len(draft.options) / _option_probabilities(model, draft)[draft.answer]
        ]
        if len(found) < LEAST_TOLD or _excess_accuracy(found) <= TOLD_MORE:
            break
    return found


def _option_model(found: Sequence[tuple[int, Draft]]) -> WordModel:
    """Fit a model that predicts from the words of an option whether it is the answer."""
    pairs = [(draft, option) for _, draft in found for option in draft.options]
    return WordModel.from_texts(
        [words_of(*pair) for pair in pairs], [option == draft.answer for draft, option in pairs]
    )


def _option_probabilities(model: WordModel, draft: Draft) -> dict[str, float]:
    """Return the probability of each option from its words, normalized over the options."""
    odds = {option: _odds(model.probability(words_of(draft, option))) for option in draft.options}
    return {option: value / sum(odds.values()) for option, value in odds.items()}


def _excess_accuracy(found: Sequence[tuple[int, Draft]]) -> float:
    """Return the excess accuracy over chance of the likeliest options, with two-fold cross-validation over the scenes.

    This is the mean over ``SPLITS`` ways to halve the scenes, with at most ``MOST_ASKED`` drafts.
    """
    found = found[:: -(-len(found) // MOST_ASKED)]
    gained = asked = 0.0
    for bit in range(SPLITS):
        halves = [[each for each in found if each[0] >> bit & 1 == side] for side in (0, 1)]
        if not all(halves):
            continue
        for half, others in (halves, halves[::-1]):
            model = _option_model(others)
            for _, draft in half:
                told = _option_probabilities(model, draft)
                gained += (max(told, key=told.__getitem__) == draft.answer) - 1 / len(told)
        asked += len(found)
    return gained / asked if asked else 0.0


def _equalized(found: list[tuple[int, Draft]], rng: random.Random) -> list[tuple[int, Draft]]:
    """Keep equally many drafts of each answer for each set of options, and remove options that are rarely right."""
    groups: dict[frozenset[str], list[tuple[int, Draft]]] = defaultdict(list)
    for each in found:
        groups[frozenset(each[1].options)].append(each)
    kept = []
    for options in sorted(groups, key=sorted):
        group = groups[options]
        counts = Counter(draft.answer for _, draft in group)
        offered = {answer for answer, count in counts.items() if count >= LEAST_RIGHT * len(group)}
        if len(offered) < 2:
            continue
        least = min(counts[answer] for answer in offered)
        for answer in sorted(offered):
            right = [(scene, draft) for scene, draft in group if draft.answer == answer]
            for scene, draft in rng.sample(right, least):
                kept.append((scene, replace(draft, options=tuple(each for each in draft.options if each in offered))))
    return kept


def _odds(probability: float) -> float:
    return probability / max(1 - probability, 1e-9)


def _balanced_numbers(found: list[tuple[int, Draft]], rng: random.Random) -> list[tuple[int, Draft]]:
    """Keep in each bin of numbers at most twice the count of the bin at the first tertile."""
    steps: dict[int, list[tuple[int, Draft]]] = defaultdict(list)
    for each in found:
        steps[int(float(each[1].answer.split()[0]) // NUMBER_STEP_CM)].append(each)
    counts = sorted(map(len, steps.values()))
    most = max(1, 2 * counts[len(counts) // 3])
    return [each for _, step in sorted(steps.items()) for each in rng.sample(step, min(most, len(step)))]


def _round_robin(
    families: dict[str, list[Draft]], per_scene: int, rng: random.Random
) -> tuple[list[Draft], list[Draft]]:
    """Take drafts from the categories in turn, and in each from the family with the fewest taken drafts.

    So families with few questions in a scene precede more questions of common families. Returns the taken drafts, and those
    that may fill gaps; these contain no yes/no questions, whose selection was balanced over the whole set.
    """
    most = max(1, round(MOST_OF_A_FAMILY * per_scene))
    by_category: dict[str, list[list[Draft]]] = defaultdict(list)
    counts: Counter[str] = Counter()
    late: list[Draft] = []
    for family, drafts in families.items():
        by_category[FAMILIES[family].category].append(list(drafts[:most]))
        if drafts and drafts[0].kind != YES_NO:
            late += drafts[most:]
    taken: list[Draft] = []
    while len(taken) < per_scene and any(map(any, by_category.values())):
        for of_category in by_category.values():
            open_ones = [drafts for drafts in of_category if drafts]
            if open_ones and len(taken) < per_scene:
                least = min(counts[drafts[0].family] for drafts in open_ones)
                draft = rng.choice([drafts for drafts in open_ones if counts[drafts[0].family] == least]).pop()
                counts[draft.family] += 1
                taken.append(draft)
    rng.shuffle(late)
    return taken, late


def _trimmed(scenes: list[list[Draft]], rng: random.Random) -> list[list[Draft]]:
    """Drop questions of yes/no families until no answer exceeds its maximal share; a family with one answer is dropped."""
    families = sorted({draft.family for of_scene in scenes for draft in of_scene if draft.kind == YES_NO})
    dropped: set[int] = set()
    for family in families:
        of_family = [draft for of_scene in scenes for draft in of_scene if draft.family == family]
        counts = Counter(draft.answer for draft in of_family)
        answer, most = counts.most_common(1)[0]
        rest = len(of_family) - most
        allowed = int(rest * MOST_OF_ONE_ANSWER / (1 - MOST_OF_ONE_ANSWER))
        surplus = [draft for draft in of_family if draft.answer == answer]
        dropped |= {id(draft) for draft in rng.sample(surplus, max(0, most - allowed))}
    return [[draft for draft in of_scene if id(draft) not in dropped] for of_scene in scenes]
