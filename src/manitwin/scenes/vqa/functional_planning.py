"""Functional planning: parts, interaction points, grasp types and what objects are for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from manitwin.geometry.poses import inverse, transform_points
from manitwin.render.raycast import cast_pixels
from manitwin.scenes.vqa.context import LEAST_INNER_PX, Context, sentence
from manitwin.scenes.vqa.grasp_types import GRASP_WORDS, best_grasp
from manitwin.scenes.vqa.question import CHOICE, POINT, YES_NO, Draft, Point
from manitwin.scenes.vqa.references import region
from manitwin.scenes.vqa.things import Seen, Thing, inner_point, part_alone_px

PART_SEEN_SHARE, PART_PX, PART_GONE_PX = 0.20, 100, 2
"""A part is seen with so much of the pixels that it alone would cover, and so many; it is not seen with so few."""
AROUND_M, AROUND_SHARE = 0.010, 0.10
"""All of the surface within so far of an interaction point, and such a share of its object's length, is seen, or is hidden."""
ALL_ROUND = frozenset(
    {
        "rim", "body", "barrel", "base", "side", "sides", "middle", "sole", "surface", "headband", "neck", "shaft", "top",
        "wall", "end", "far end", "end flap", "edge", "ear cup",
    }
)  # fmt: skip
"""Labels of what goes around a thing or along it, or is there twice: which place is meant, a picture does not tell."""
COVERED_SHARE = 0.02
"""An object of which another hides less is not covered."""
POINT_DEPTH_M, IN_FRONT_M = 0.006, 0.015
"""A point is seen where the picture's depth is its own; it is hidden by what is so much nearer."""
MOST_OPTIONS = 4


def functional_planning(asked: Context) -> Iterator[Draft]:
    """Ask where and how to touch objects, and what they serve for."""
    for seen in asked.named:
        yield from _parts(asked, seen)
        yield from _interaction_points(asked, seen)
    yield from _functions(asked)
    yield from _grasp_types(asked)


def _parts(asked: Context, seen: Seen) -> Iterator[Draft]:
    scale, words = seen.scale, asked.words_of(seen)
    names = [part.name for part in seen.thing.parts]
    for part in seen.thing.parts:
        if names.count(part.name) > 1:
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
        elif visible_px <= PART_GONE_PX * scale and alone_px >= PART_PX * scale:
            yield Draft(
                "part_visible", asked.view.name, YES_NO, slots, "no",
                sentence(f"no, the {part.name} of {words} cannot be seen from this camera"), evidence,
            )  # fmt: skip


def _interaction_points(asked: Context, seen: Seen) -> Iterator[Draft]:
    points = seen.thing.shape.twin.record.points
    words, camera = asked.words_of(seen), asked.view.camera
    labels = [point.label for point in points.functional] if points else []
    for point in points.functional if points else ():
        world_m = transform_points(seen.thing.pose, np.array([point.position_m]))[0]
        column, row, depth_m = asked.view.pixel(world_m)
        edge_px = LEAST_INNER_PX * camera.width_px / 512
        if (
            labels.count(point.label) > 1
            or point.label in ALL_ROUND
            or not (edge_px <= column < camera.width_px - edge_px and edge_px <= row < camera.height_px - edge_px)
        ):
            continue
        share: Point = (column / camera.width_px, row / camera.height_px)
        around_px = None if not _faces_camera(asked, seen, world_m) else _around(asked, seen, world_m)
        if around_px is None:
            continue
        place = (int(row), int(column))
        around = asked.view.picture.ids[around_px[:, 0], around_px[:, 1]]
        at_depth_m = float(asked.view.picture.depth_m[place])
        evidence = {
            "objects": asked.names(seen), "point": point.id, "label": point.label, "point_depth_m": round(depth_m, 4),
            "picture_depth_m": round(at_depth_m, 4),
        }  # fmt: skip
        slots = {"part": point.label, "a": words}
        where = region(*share)
        at = "at <p0>" if where is None else f"at <p0>, in the {where} of the picture"
        whole = seen.view.amodal_in_frame_px - seen.view.visible_px <= COVERED_SHARE * seen.view.amodal_in_frame_px
        if whole and (around == seen.thing.number).all() and abs(at_depth_m - depth_m) < POINT_DEPTH_M:
            yield Draft(
                "interaction_point_occluded", asked.view.name, YES_NO, slots, "no",
                sentence(f"no, it is {at}, and no other object is in front of it"), evidence, points=(share,),
            )  # fmt: skip
        front = [each for each in asked.named if each is not seen and (around == each.thing.number).all()]
        if front and at_depth_m < depth_m - IN_FRONT_M and not _shows_part(asked, seen, point.label):
            yield Draft(
                "interaction_point_occluded", asked.view.name, YES_NO, slots, "yes",
                sentence(f"yes, {asked.words_of(front[0])} hides it; it is behind <p0>"),
                {**evidence, "objects": asked.names(seen, front[0]), "hidden_by": front[0].thing.name}, points=(share,),
            )  # fmt: skip


def _around(asked: Context, seen: Seen, world_m: np.ndarray) -> np.ndarray | None:
    """Return the pixels ``(N, 2)`` (row, column) that would show the object's surface near a point of it, were it alone.

    None where the frame cuts them off.
    """
    camera, thing = asked.view.camera, seen.thing
    radius_m = max(AROUND_M, AROUND_SHARE * thing.longest_m)
    column, row, depth_m = asked.view.pixel(world_m)
    reach = radius_m * camera.focal_px / depth_m
    down, across = np.mgrid[-1:1:9j, -1:1:9j].reshape(2, -1) * reach
    pixels = np.column_stack([row + down, column + across]).astype(int)
    inside = (pixels >= 0).all(1) & (pixels < [camera.height_px, camera.width_px]).all(1)
    if not inside.all():
        return None
    pixels = np.unique(pixels, axis=0)
    to_thing = inverse(thing.pose)
    of_thing = replace(camera, camera_to_object=to_thing @ camera.camera_to_object)
    met_m, _, faces = cast_pixels(thing.shape.caster, of_thing, pixels)
    point_m = transform_points(to_thing, world_m[None])[0]
    near = (faces >= 0) & (np.linalg.norm(met_m - point_m, axis=1) <= radius_m)
    return np.vstack([pixels[near], [[int(row), int(column)]]])


def _shows_part(asked: Context, seen: Seen, label: str) -> bool:
    """Whether the picture shows some of a part that is called as an interaction point is: where on it that is, it does not."""
    numbers = [
        number for number, each in asked.scene.parts.items()
        if each.object == seen.thing.name
        and any(part.id == each.part_id and part.name == label for part in seen.thing.parts)
    ]  # fmt: skip
    return bool(np.isin(asked.view.picture.parts, numbers).sum() > PART_GONE_PX * seen.scale)


def _faces_camera(asked: Context, seen: Seen, world_m: np.ndarray) -> bool:
    """Whether the object alone would let the camera see a point of it."""
    eye = asked.view.camera.position
    length = float(np.linalg.norm(world_m - eye))
    to_thing = inverse(seen.thing.pose)
    origin = transform_points(to_thing, eye[None])
    direction = ((world_m - eye) / length) @ to_thing[:3, :3].T
    met_m = float(seen.thing.shape.caster.first_hits(origin, direction[None])[0][0])
    return abs(met_m - length) < POINT_DEPTH_M


def _functions(asked: Context) -> Iterator[Draft]:
    """Functions are told apart by all of their words: ``serving food`` is not asked where another serves food too."""
    told = [(seen, point, _function(seen.thing)) for seen, point in asked.pointed]
    for seen, _, function in told:
        others = [each for each in told if not _content(each[2]) & _content(function)]
        if function is None or len(others) < len(told) - 1 or len(others) < 2:
            continue
        chosen = asked.rng.sample(others, min(len(others), MOST_OPTIONS - 1))
        chosen.append(next(each for each in told if each[0] is seen))
        last = f"<p{len(chosen) - 1}>"
        yield Draft(
            "object_for_function", asked.view.name, CHOICE, {"function": function}, last,
            sentence(f"the one at {last}: {asked.called(seen)}"),
            {"objects": asked.names(*(each[0] for each in chosen)), "answer": seen.thing.name,
             "functions": {each[0].thing.name: each[2] for each in chosen}},
            tuple(f"<p{place}>" for place in range(len(chosen))), tuple(each[1] for each in chosen),
        )  # fmt: skip


_LITTLE = frozenset(
    {"and", "or", "such", "as", "of", "on", "to", "a", "the", "with", "for", "from", "it", "up", "things"}
)


def _content(function: str | None) -> set[str]:
    return set((function or "").replace(",", " ").split()) - _LITTLE


def _function(thing: Thing) -> str | None:
    language = thing.shape.twin.record.language
    return language.function if language else None


def _grasp_types(asked: Context) -> Iterator[Draft]:
    for seen, point in asked.pointed:
        grasp = best_grasp(seen.thing)
        if grasp is None:
            continue
        right = GRASP_WORDS[grasp[0]]
        yield Draft(
            "best_grasp_type", asked.view.name, CHOICE, {"p": "<p0>"}, right,
            sentence(f"{right}; it is {asked.called(seen)}"),
            {"objects": asked.names(seen), "grasp_type": grasp[0], "confidence": grasp[1], "lead": grasp[2]},
            tuple(GRASP_WORDS.values()), (point,),
        )  # fmt: skip
