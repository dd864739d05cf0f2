"""Functional planning questions: parts, interaction points, grasp types and functions of objects."""

from __future__ import annotations

from collections.abc import Iterator

from manitwin.scenes.vqa.context import LEAST_INNER_PX, Context, sentence
from manitwin.scenes.vqa.grasp_types import GRASP_WORDS, best_grasp
from manitwin.scenes.vqa.interaction_points import interaction_points
from manitwin.scenes.vqa.part_words import PART_GONE_PX, WIDE, is_locatable
from manitwin.scenes.vqa.posed_objects import ObjectInPicture, PosedObject, inner_point, part_alone_px
from manitwin.scenes.vqa.question import CHOICE, POINT, YES_NO, Draft

PART_SEEN_SHARE, PART_PX = 0.20, 100
"""A part is visible if this share of the pixels that it alone would cover is visible, and this number of pixels."""
MOST_OPTIONS = 4


def functional_planning(asked: Context) -> Iterator[Draft]:
    """Ask where and how to touch objects, and about their functions."""
    for seen in asked.named_objects:
        yield from _parts(asked, seen)
        yield from interaction_points(asked, seen)
    yield from _functions(asked)
    yield from _grasp_types(asked)


def _parts(asked: Context, seen: ObjectInPicture) -> Iterator[Draft]:
    scale, words = seen.scale, asked.words_of(seen)
    names = [part.name for part in seen.thing.parts]
    for part in seen.thing.parts:
        if names.count(part.name) > 1 or not is_locatable(part.name, seen.thing):
            continue
        number = next(
            number for number, each in asked.scene.parts.items()
            if each.object == seen.thing.name and each.part_id == part.id
        )  # fmt: skip
        mask = asked.view.picture.parts == number
        visible_px = int(mask.sum())
        alone_px = part_alone_px(seen.thing, part, asked.view.camera)
        evidence = {
            "objects": asked.names(seen), "part": part.name, "part_number": number, "visible_px": visible_px,
            "alone_px": int(alone_px),
        }  # fmt: skip
        slots = {"part": part.name, "a": words}
        if visible_px >= max(PART_PX * scale, PART_SEEN_SHARE * alone_px):
            point, deep_px = inner_point(mask)
            if deep_px >= LEAST_INNER_PX * asked.view.camera.width_px / 512:
                yield Draft(
                    "part_visible", asked.view.name, YES_NO, slots, "yes",
                    sentence(f"yes, the {part.name} of {words} can be seen at <p0>"), evidence, points=(point,),
                )  # fmt: skip
                yield Draft(
                    "touch_point", asked.view.name, POINT, slots, "<p0>", "<p0>",
                    {**evidence, "inside_px": round(deep_px, 1)}, points=(point,),
                )  # fmt: skip
        elif visible_px <= PART_GONE_PX * scale and alone_px >= PART_PX * scale and part.name not in WIDE:
            yield Draft(
                "part_visible", asked.view.name, YES_NO, slots, "no",
                sentence(f"no, the {part.name} of {words} cannot be seen from this camera"), evidence,
            )  # fmt: skip


def _functions(asked: Context) -> Iterator[Draft]:
    """Ask for the object with a function; none of its content words may occur in the function of another pointed object."""
    told = [(seen, point, _function(seen.thing)) for seen, point in asked.pointable_objects]
    for seen, _, function in told:
        others = [each for each in told if not _content(each[2]) & _content(function)]
        if function is None or len(others) < len(told) - 1 or len(others) < 2:
            continue
        chosen = asked.rng.sample(others, min(len(others), MOST_OPTIONS - 1))
        chosen.append(next(each for each in told if each[0] is seen))
        last = f"<p{len(chosen) - 1}>"
        yield Draft(
            "object_for_function", asked.view.name, CHOICE, {"function": function}, last,
            sentence(f"the one at {last}: {asked.reference_or_category(seen)}"),
            {"objects": asked.names(*(each[0] for each in chosen)), "answer": seen.thing.name,
             "functions": {each[0].thing.name: each[2] for each in chosen}},
            tuple(f"<p{place}>" for place in range(len(chosen))), tuple(each[1] for each in chosen),
        )  # fmt: skip


_LITTLE = frozenset(
    {"and", "or", "such", "as", "of", "on", "to", "a", "the", "with", "for", "from", "it", "up", "things"}
)


_SAME = {
    **dict.fromkeys(("drinks", "drinking", "tea", "coffee", "wine", "water", "soda", "beer", "juice", "milk"), "drink"),
    **dict.fromkeys(("eating", "meals", "soup", "cereal", "snacks"), "food"),
}  # fmt: skip
"""Words that count as one: a mug for hot drinks also serves for tea."""


def _content(function: str | None) -> set[str]:
    found = set((function or "").replace(",", " ").split()) - _LITTLE
    return {_SAME.get(word, word) for word in found}


def _function(thing: PosedObject) -> str | None:
    language = thing.shape.twin.record.language
    return language.function if language else None


def _grasp_types(asked: Context) -> Iterator[Draft]:
    for seen, point in asked.pointable_objects:
        grasp = best_grasp(seen.thing)
        if grasp is None:
            continue
        right = GRASP_WORDS[grasp[0]]
        yield Draft(
            "best_grasp_type", asked.view.name, CHOICE, {"p": "<p0>"}, right,
            sentence(f"{right}; it is {asked.reference_or_category(seen)}"),
            {"objects": asked.names(seen), "grasp_type": grasp[0], "confidence": grasp[1], "lead": grasp[2]},
            tuple(GRASP_WORDS.values()), (point,),
        )  # fmt: skip
