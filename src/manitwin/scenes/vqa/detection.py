"""Detection questions: boxes, counts and lists of objects."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from manitwin.scenes.vqa.context import Context, join_words, sentence
from manitwin.scenes.vqa.posed_objects import ObjectInPicture
from manitwin.scenes.vqa.question import BOX, CHOICE, LIST, YES_NO, Draft
from manitwin.scenes.vqa.references import CONTAINERS, a_or_an, could_be_asked_for, is_container, one_of

APART_SHARE = 0.02
"""Least horizontal distance of consecutive objects in a list (share of the picture's width), for both centres."""
ABSENT = 4
"""Number of absent categories that each picture is asked about."""


def detection(asked: Context) -> Iterator[Draft]:
    """Ask for boxes, and about presence in pictures without doubtful objects.

    Objects on the surface are counted and listed only if none stands on or lies in another, since counting those is ambiguous.
    """
    yield from _boxes(asked)
    if asked.view.is_sure and len(asked.view.clear_objects) >= 2:
        yield from _existence(asked)
        if all(each.thing.placed_as.supported_by is None for each in asked.view.clear_objects):
            yield from _counts(asked)
            yield from _lists(asked)


def _boxes(asked: Context) -> Iterator[Draft]:
    width, height = asked.view.camera.width_px, asked.view.camera.height_px
    for seen in asked.named_objects:
        box = seen.view.visible_box
        if box is None:
            continue
        share = (box[0] / width, box[1] / height, box[2] / width, box[3] / height)
        yield Draft(
            "box_of_object", asked.view.name, BOX, {"a": asked.words_of(seen)}, "<b0>", "<b0>",
            {"objects": asked.names(seen), "box_px": list(box)}, boxes=(share,),
        )  # fmt: skip


def _counts(asked: Context) -> Iterator[Draft]:
    count = len(asked.view.clear_objects)
    first = max(1, count - asked.rng.randrange(4))
    yield Draft(
        "count_objects", asked.view.name, CHOICE, {"surface": asked.surface}, str(count),
        sentence(f"there are {count} objects"), {"objects": asked.names(*asked.view.clear_objects)},
        tuple(str(first + each) for each in range(4)),
    )  # fmt: skip


def _existence(asked: Context) -> Iterator[Draft]:
    """Ask whether categories are present; no absent category shares a noun with a present one."""
    there = {each.thing.category for each in asked.view.clear_objects}
    absent = [category for category in asked.categories if not could_be_asked_for(category, there)]
    for category in sorted(there):
        count = sum(each.thing.category == category for each in asked.view.clear_objects)
        said = f"there is {a_or_an(one_of(category))}" if count == 1 else f"there are {count}"
        yield Draft(
            "is_there", asked.view.name, YES_NO, {"c": a_or_an(one_of(category))}, "yes", sentence(f"yes, {said}"),
            {"objects": asked.names(*asked.view.clear_objects), "asked": category},
        )  # fmt: skip
    for category in asked.rng.sample(absent, min(ABSENT, len(absent))):
        yield Draft(
            "is_there", asked.view.name, YES_NO, {"c": a_or_an(one_of(category))}, "no",
            sentence(f"no, there is no {one_of(category)}"),
            {"objects": asked.names(*asked.view.clear_objects), "asked": category},
        )  # fmt: skip


def _lists(asked: Context) -> Iterator[Draft]:
    in_order = sorted(asked.view.clear_objects, key=lambda each: each.column)
    middles_px = np.array([(each.column, sum(each.columns) / 2) for each in in_order])
    if is_order_unambiguous(middles_px, APART_SHARE * asked.view.camera.width_px):
        yield Draft(
            "list_objects", asked.view.name, LIST, {"surface": asked.surface},
            ", ".join(each.thing.category for each in in_order),
            sentence(f"from left to right: {join_words([_described(each) for each in in_order])}"),
            {"objects": asked.names(*in_order)},
        )  # fmt: skip
    told = [is_container(each.thing.category) for each in in_order]
    containers = [each for each, is_one in zip(in_order, told, strict=True) if is_one]
    if None in told or not containers:
        return
    kinds = join_words([f"{noun}s" for noun in CONTAINERS])
    number = {1: "one container", 2: "two containers", 3: "three containers"}.get(
        len(containers), f"{len(containers)} containers"
    )
    verb = "is" if len(containers) == 1 else "are"
    yield Draft(
        "list_containers", asked.view.name, LIST, {"surface": asked.surface, "kinds": kinds},
        ", ".join(each.thing.category for each in containers),
        sentence(f"there {verb} {number}: {join_words([_described(each) for each in containers])}"),
        {"objects": asked.names(*containers), "counts": dict(Counter(each.thing.head for each in containers))},
    )  # fmt: skip


def is_order_unambiguous(middles_px: np.ndarray, least_px: float) -> bool:
    """Return whether each object is at least ``least_px`` to the right of the previous one, by both centres ``(things, 2)`` px.

    These are the mean of its pixels and the middle of its box; for a pan with a long handle they differ much, and a reader may
    use either.
    """
    return bool((np.diff(middles_px, axis=0) >= least_px).all())


def _described(seen: ObjectInPicture) -> str:
    return a_or_an(one_of(seen.thing.category, seen.color))
