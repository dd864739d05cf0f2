"""Task planning questions: what an object hits when it is slid, and which of two objects is heavier."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from manitwin.scenes.vqa.context import Context, sentence
from manitwin.scenes.vqa.directions import Direction
from manitwin.scenes.vqa.posed_objects import ObjectInPicture
from manitwin.scenes.vqa.question import CHOICE, YES_NO, Draft
from manitwin.scenes.vqa.sweeps import LONGEST_M, Slide, SweptPath

LENGTHS_CM = (5, 10, 15)
"""The lengths of the straight slides."""
LEGS_CM = (5, 10)
"""The lengths of each leg of a slide of two legs."""
MOST_OPTIONS = 4
"""Maximal number of options of a question, including the right one."""


def task_planning(asked: Context) -> Iterator[Draft]:
    """Yield questions about slides (what is hit, which direction is blocked, two legs in a row) and about masses."""
    legs: list[_Legs] = []
    for seen in asked.slidable:
        frames = sorted({each.frame for each in asked.directions})
        frame = asked.rng.choice(frames)
        directions = [each for each in asked.directions if each.frame == frame]
        ways = [asked.swept_path(seen, each) for each in directions]
        for direction, way in zip(directions, ways, strict=True):
            yield from _slides(asked, seen, direction, way)
        yield from _blocked(asked, seen, directions, ways)
        legs += _first_legs(asked, seen, directions, ways)
    yield from _two_legs(asked, legs)
    yield from _weights(asked)


def _stays_supported(asked: Context, seen: ObjectInPicture, direction: Direction, way: SweptPath, cm: int) -> bool:
    """Return whether the object stays on its support and in the picture all the way."""
    length_m = cm / 100
    return length_m <= min(way.leaves_m, LONGEST_M) and asked.in_view(seen, np.array(direction.vector) * length_m)


def _slots(asked: Context, seen: ObjectInPicture, direction: Direction, cm: int) -> dict[str, str]:
    words = asked.words_of(seen)
    return {
        "a": words, "A": words[:1].upper() + words[1:], "cm": str(cm), "d": direction.words, "robot": direction.robot
    }  # fmt: skip


def _slide_evidence(direction: Direction, cm: int) -> dict[str, object]:
    return {
        "frame": direction.frame, "direction": direction.key, "cm": cm,
        "vector": [round(v, 6) for v in direction.vector],
    }  # fmt: skip


def _slides(asked: Context, seen: ObjectInPicture, direction: Direction, way: SweptPath) -> Iterator[Draft]:
    for cm in LENGTHS_CM:
        verdict = way.is_hit_within(cm / 100)
        if verdict is None or not _stays_supported(asked, seen, direction, way, cm):
            continue
        slots, evidence = _slots(asked, seen, direction, cm), _slide_evidence(direction, cm)
        if not verdict:
            yield Draft(
                "slide", asked.view.name, YES_NO, slots, "no", sentence("no, its way is free"),
                {"objects": asked.names(seen), **evidence, "met": None},
            )  # fmt: skip
            continue
        hit = way.first_hit(cm / 100)
        if hit is None or hit[0] not in asked.words:
            continue
        right, met = asked.words[hit[0]], asked.view.view_of_object(hit[0])
        evidence = {
            "objects": asked.names(seen, met), **evidence, "met": hit[0], "met_after_m": round(hit[1], 4)
        }  # fmt: skip
        yield Draft(
            "slide", asked.view.name, YES_NO, slots, "yes",
            sentence(f"yes, it hits {right} after about {max(100 * hit[1], 1):.0f} cm"), evidence,
        )  # fmt: skip
        others = [
            asked.words_of(each) for each in asked.named_objects if each.thing.name not in (seen.thing.name, hit[0])
        ]
        if way.is_order_certain() and len(others) >= 2:
            yield Draft(
                "slide_hits", asked.view.name, CHOICE, slots, right, sentence(f"it hits {right}"), evidence,
                (*asked.rng.sample(others, min(len(others), MOST_OPTIONS - 1)), right),
            )  # fmt: skip


def _blocked(
    asked: Context, seen: ObjectInPicture, directions: list[Direction], ways: list[SweptPath]
) -> Iterator[Draft]:
    for cm in LENGTHS_CM:
        verdicts = [way.is_hit_within(cm / 100) for way in ways]
        if sorted(map(str, verdicts)) != ["False", "False", "False", "True"]:
            continue
        if not all(_stays_supported(asked, seen, d, w, cm) for d, w in zip(directions, ways, strict=True)):
            continue
        place = verdicts.index(True)
        hit = ways[place].first_hit(cm / 100)
        if hit is None or hit[0] not in asked.words:
            continue
        slots = _slots(asked, seen, directions[place], cm)
        yield Draft(
            "blocked_direction", asked.view.name, CHOICE, {k: v for k, v in slots.items() if k != "d"},
            directions[place].words, sentence(f"{directions[place].words}: it would hit {asked.words[hit[0]]}"),
            {"objects": asked.names(seen, asked.view.view_of_object(hit[0])), **_slide_evidence(directions[place], cm),
             "met": hit[0],
             "free": [[round(v, 6) for v in each.vector] for i, each in enumerate(directions) if i != place]},
            tuple(each.words for each in directions),
        )  # fmt: skip


@dataclass(frozen=True)
class _Legs:
    """A slide of two legs, each a direction and a length; ``hit`` is name and distance (m) of the first leg's hit, or None."""

    seen: ObjectInPicture
    first: Direction
    first_cm: int
    second: Direction
    second_cm: int
    hit: tuple[str, float] | None

    @property
    def corner_m(self) -> tuple[float, float]:
        """The start of the second leg, in x and y from the object's place."""
        x, y = self.first.vector
        return x * self.first_cm / 100, y * self.first_cm / 100


def _first_legs(
    asked: Context, seen: ObjectInPicture, directions: list[Direction], ways: list[SweptPath]
) -> Iterator[_Legs]:
    """Yield up to two slides of two legs with random directions, roughly perpendicular to each other.

    Slides are skipped if the first leg leaves the support or the picture, or passes an object so closely that a hit is
    uncertain.
    """
    pairs = [(a, b) for a, b in permutations(range(len(directions)), 2)
             if abs(np.dot(directions[a].vector, directions[b].vector)) < 0.5]  # fmt: skip
    for first, second in asked.rng.sample(pairs, min(2, len(pairs))):
        cm, cm2 = asked.rng.choice(LEGS_CM), asked.rng.choice(LEGS_CM)
        verdict = ways[first].is_hit_within(cm / 100)
        if verdict is not None and _stays_supported(asked, seen, directions[first], ways[first], cm):
            hit = ways[first].first_hit(cm / 100) if verdict else None
            yield _Legs(seen, directions[first], cm, directions[second], cm2, hit)


def _two_legs(asked: Context, legs: list[_Legs]) -> Iterator[Draft]:
    free = [each for each in legs if each.hit is None]
    ways = asked.swept_paths([Slide(each.seen.thing, each.corner_m, each.second.vector) for each in free])
    way_of = {id(each): way for each, way in zip(free, ways, strict=True)}
    for each in legs:
        hit, leg = each.hit, "first"
        if hit is None:
            way, length_m, leg = way_of[id(each)], each.second_cm / 100, "second"
            end_m = np.array(each.corner_m) + np.array(each.second.vector) * length_m
            verdict = way.is_hit_within(length_m)
            if verdict is None or length_m > way.leaves_m or not asked.in_view(each.seen, end_m):
                continue
            hit = way.first_hit(length_m)
        if hit is None or hit[0] in asked.words:
            yield _two_legs_draft(asked, each, hit, leg)


def _two_legs_draft(asked: Context, legs: _Legs, hit: tuple[str, float] | None, leg: str) -> Draft:
    slots = {
        **_slots(asked, legs.seen, legs.first, legs.first_cm), "cm2": str(legs.second_cm), "d2": legs.second.words
    }  # fmt: skip
    evidence = {**_slide_evidence(legs.first, legs.first_cm), "cm2": legs.second_cm, "direction2": legs.second.key,
                "vector2": [round(v, 6) for v in legs.second.vector]}  # fmt: skip
    if hit is None:
        return Draft(
            "slide_two_legs", asked.view.name, YES_NO, slots, "no",
            sentence("no, there is no risk of collision: both legs are free"),
            {"objects": asked.names(legs.seen), **evidence, "met": None},
        )  # fmt: skip
    return Draft(
        "slide_two_legs", asked.view.name, YES_NO, slots, "yes",
        sentence(f"yes, there is a collision with {asked.words[hit[0]]} on the {leg} leg"),
        {"objects": asked.names(legs.seen, asked.view.view_of_object(hit[0])), **evidence, "met": hit[0], "leg": leg,
         "met_after_m": round(hit[1], 4)},
    )  # fmt: skip


def _weights(asked: Context) -> Iterator[Draft]:
    """Yield comparisons of two pointed objects whose mass intervals do not overlap."""
    for (a, p), (b, q) in permutations(asked.pointable_objects, 2):
        of_a, of_b = (each.thing.shape.twin.physical.mass_kg for each in (a, b))
        if of_a.low <= of_b.high and of_b.low <= of_a.high:
            continue
        heavier = a if of_a.low > of_b.high else b
        right = "<p0>" if heavier is a else "<p1>"
        yield Draft(
            "heavier", asked.view.name, CHOICE, {"p": "<p0>", "q": "<p1>"}, right,
            sentence(f"the one at {right}: {asked.reference_or_category(heavier)}"),
            {"objects": asked.names(a, b), "answer": heavier.thing.name,
             "mass_kg": {each.thing.name: [mass.low, mass.high] for each, mass in ((a, of_a), (b, of_b))}},
            ("<p0>", "<p1>"), (p, q),
        )  # fmt: skip
