"""Language grounding questions: from words to places in the picture and back."""

from __future__ import annotations

from collections.abc import Iterator

from manitwin.models.annotators.surface_color import are_similar_colors
from manitwin.scenes.vqa.context import Context, sentence
from manitwin.scenes.vqa.grasp_types import GRASP_WORDS, best_grasp
from manitwin.scenes.vqa.posed_objects import ObjectInPicture
from manitwin.scenes.vqa.question import CHOICE, POINT, TEXT, Draft, Point
from manitwin.scenes.vqa.references import REGION_MARGIN, region

MOST_OPTIONS = 4
QUARTERS = ("top left", "top right", "bottom left", "bottom right")


def language_grounding(asked: Context) -> Iterator[Draft]:
    """Ask for the places of objects, and for the objects at places."""
    yield from _points(asked)
    yield from _objects_at_points(asked)
    yield from _by_color(asked)
    yield from _regions(asked)
    yield from _locate_and_grasp(asked)


def _points(asked: Context) -> Iterator[Draft]:
    for seen, point in asked.pointable_objects:
        if seen.thing.name in asked.words:
            yield Draft(
                "point_at_object", asked.view.name, POINT, {"a": asked.words_of(seen)}, "<p0>", "<p0>",
                {"objects": asked.names(seen), "inside_px": round(seen.inner[1], 1)}, points=(point,),
            )  # fmt: skip


def _objects_at_points(asked: Context) -> Iterator[Draft]:
    words = [asked.words_of(each) for each in asked.named_objects]
    for seen, point in asked.pointable_objects:
        if seen.thing.name not in asked.words or len(words) < 3:
            continue
        right = asked.words_of(seen)
        others = [each for each in words if each != right]
        options = (*asked.rng.sample(others, min(len(others), MOST_OPTIONS - 1)), right)
        yield Draft(
            "object_at_point", asked.view.name, CHOICE, {"p": "<p0>"}, right, sentence(f"it is {right}"),
            {"objects": asked.names(seen), "inside_px": round(seen.inner[1], 1)}, options, (point,),
        )  # fmt: skip


def _by_color(asked: Context) -> Iterator[Draft]:
    marked = [(seen, point) for seen, point in asked.pointable_objects if seen.color]
    for seen, _ in marked:
        color = seen.color or ""
        others = [each for each in marked if not are_similar_colors(each[0].color or "", color)]
        if len(others) < 2:
            continue
        chosen = asked.rng.sample(others, min(len(others), MOST_OPTIONS - 1))
        chosen.append(next(each for each in marked if each[0] is seen))
        yield Draft(
            "object_by_color", asked.view.name, CHOICE, {"color": color}, f"<p{len(chosen) - 1}>",
            sentence(f"the one at <p{len(chosen) - 1}>: {asked.reference_or_category(seen)}"),
            {"objects": asked.names(*(each for each, _ in chosen)), "answer": seen.thing.name,
             "colors": {each.thing.name: each.color for each, _ in chosen}},
            tuple(f"<p{place}>" for place in range(len(chosen))), tuple(point for _, point in chosen),
        )  # fmt: skip


def _regions(asked: Context) -> Iterator[Draft]:
    for seen, point in asked.pointable_objects:
        box = seen.view.visible_box
        if seen.thing.name not in asked.words or box is None:
            continue
        width, height = asked.view.camera.width_px, asked.view.camera.height_px
        left, right = box[0] / width, (box[0] + box[2]) / width
        top, bottom = box[1] / height, (box[1] + box[3]) / height
        if left < 0.5 + REGION_MARGIN and right > 0.5 - REGION_MARGIN:
            continue
        if top < 0.5 + REGION_MARGIN and bottom > 0.5 - REGION_MARGIN:
            continue
        answer = f"{'top' if bottom < 0.5 else 'bottom'} {'left' if right < 0.5 else 'right'}"
        yield Draft(
            "region_of_object", asked.view.name, CHOICE, {"a": asked.words_of(seen)}, answer,
            sentence(f"{asked.words_of(seen)} is in the {answer} quarter of the picture, at <p0>"),
            {"objects": asked.names(seen), "box_share": [round(v, 4) for v in (left, top, right, bottom)]},
            QUARTERS, (point,),
        )  # fmt: skip


def _place(asked: Context, seen: ObjectInPicture, point: Point) -> str | None:
    """Return the ninth of the picture that contains an object's point and the centre of its box; None if they differ."""
    box, camera = seen.view.visible_box, asked.view.camera
    if box is None:
        return None
    middle = region((box[0] + box[2] / 2) / camera.width_px, (box[1] + box[3] / 2) / camera.height_px)
    return middle if middle == region(*point) else None


def _locate_and_grasp(asked: Context) -> Iterator[Draft]:
    for seen, point in asked.pointable_objects:
        grasp = best_grasp(seen.thing)
        where = _place(asked, seen, point)
        if seen.thing.name not in asked.words or grasp is None or where is None:
            continue
        words = asked.words_of(seen)
        place = f"{'in' if where == 'center' else 'at'} the {where} of the picture"
        yield Draft(
            "locate_and_grasp", asked.view.name, TEXT, {"a": words}, f"{where}; {GRASP_WORDS[grasp[0]]}; <p0>",
            sentence(f"{words} is {place}, at <p0>; it is best taken with {GRASP_WORDS[grasp[0]]}"),
            {"objects": asked.names(seen), "grasp_type": grasp[0], "confidence": grasp[1], "lead": grasp[2]},
            points=(point,),
        )  # fmt: skip
