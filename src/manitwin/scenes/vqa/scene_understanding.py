"""Scene understanding questions: sides, gaps, neighbours, clearance, heights and occlusion."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, permutations

import numpy as np

from manitwin.scenes.vqa.context import Context, sentence
from manitwin.scenes.vqa.grasp_types import GRASP_WORDS, best_grasp
from manitwin.scenes.vqa.posed_objects import TwinShape
from manitwin.scenes.vqa.question import CHOICE, NUMBER, YES_NO, Draft
from manitwin.scenes.vqa.sweeps import LONGEST_M, SweptPath

SIDE_M, SIDE_PX = 0.06, 50
"""Least distance between two objects in a question about sides."""
NEARER_M, TALLER_M = 0.02, 0.015
STEEPEST_RAD = np.radians(60)
"""Steepest camera for comparing heights: a steeper one does not show which object is higher."""
FLATTEST_RAD = np.radians(45)
"""Flattest camera for gaps: a flatter one foreshortens gaps by more than 30 %."""
WHOLE_SHARE = 0.95
"""Least visible share of the object that gives the scale of a picture."""
LEAST_TOLERANCE_CM, TOLERANCE_SHARE = 1.0, 0.2
"""A gap is right within the larger of these."""
FARTHEST_GAP_M = 0.40
CLEARANCES_CM = (3, 5, 8, 12, 16)
MOST_OPTIONS = 4
HIDING_PX, HIDING_SHARE = 60, 0.8
"""An occluder hides at least this many pixels of an object, and this share of all its hidden pixels."""


def scene_understanding(asked: Context) -> Iterator[Draft]:
    """Ask about spatial relations between objects."""
    yield from _sides(asked)
    yield from _gaps(asked)
    yield from _neighbours(asked)
    yield from _clearances(asked)
    yield from _heights(asked)
    yield from _occluders(asked)


def _sides(asked: Context) -> Iterator[Draft]:
    robot = next((each.robot for each in asked.directions if each.frame == "robot"), None)
    least_px = SIDE_PX * asked.view.camera.width_px / 512
    for a, b in permutations(asked.named_objects, 2):
        slots = {"a": asked.words_of(a), "b": asked.words_of(b)}
        left_m = float(a.thing.center_m[1] - b.thing.center_m[1])
        spans_m = [(each.thing.placed_hulls.bounds[0][1], each.thing.placed_hulls.bounds[1][1]) for each in (a, b)]
        if robot is not None and abs(left_m) > SIDE_M and are_sides_unambiguous(spans_m[0], spans_m[1]):
            side = "left" if left_m > 0 else "right"
            yield Draft(
                "side_for_robot", asked.view.name, CHOICE, {**slots, "robot": robot}, side,
                sentence(f"as the robot sees them, {slots['a']} is to the {side} of {slots['b']}"),
                {"objects": asked.names(a, b), "frame": "robot", "left_m": round(left_m, 4)}, ("left", "right"),
            )  # fmt: skip
        left_px = b.column - a.column
        if abs(left_px) > least_px and are_sides_unambiguous(a.columns, b.columns):
            side = "left" if left_px > 0 else "right"
            yield Draft(
                "side_in_picture", asked.view.name, CHOICE, slots, side,
                sentence(f"in the picture, {slots['a']} is to the {side} of {slots['b']}"),
                {"objects": asked.names(a, b), "frame": "picture", "left_px": round(left_px, 1)}, ("left", "right"),
            )  # fmt: skip


def are_sides_unambiguous(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Return whether neither of two intervals contains the middle of the other; otherwise the side is ambiguous."""
    middles = sum(one) / 2, sum(other) / 2
    return not one[0] <= middles[1] <= one[1] and not other[0] <= middles[0] <= other[1]


def _gaps(asked: Context) -> Iterator[Draft]:
    if asked.looks_down_rad < FLATTEST_RAD:
        return
    for a, b in combinations(asked.named_objects, 2):
        if asked.rng.random() < 0.5:
            a, b = b, a
        measured = a if a.view.visible_share >= WHOLE_SHARE else b
        if measured.view.visible_share < WHOLE_SHARE:
            continue
        gap_m = asked.gap_m(a.thing, b.thing)
        if gap_m > FARTHEST_GAP_M or a.thing.name == b.thing.placed_as.supported_by or gap_m < 0.005:
            continue
        tolerance_cm = max(LEAST_TOLERANCE_CM, TOLERANCE_SHARE * 100 * gap_m)
        length_m = measured.thing.longest_m
        size = sentence(f"{asked.words_of(measured)} is {100 * length_m:.0f} cm between its two farthest points") + " "
        yield Draft(
            "gap", asked.view.name, NUMBER, {"a": asked.words_of(a), "b": asked.words_of(b), "size": size},
            f"{100 * gap_m:.1f} cm", sentence(f"about {100 * gap_m:.0f} cm" if gap_m >= 0.01 else "less than 1 cm"),
            {"objects": asked.names(a, b), "gap_m": round(gap_m, 4), "tolerance_cm": round(tolerance_cm, 2),
             "measured": measured.thing.name, "length_m": round(length_m, 4)},
        )  # fmt: skip


def _neighbours(asked: Context) -> Iterator[Draft]:
    if not asked.view.shows_all or len(asked.things) < 4:
        return
    for seen in asked.named_objects:
        gaps = sorted(
            (asked.gap_m(seen.thing, other.thing), other.thing.name)
            for other in asked.view.clear_objects if other is not seen
        )  # fmt: skip
        if gaps[1][0] - gaps[0][0] <= NEARER_M or any(name not in asked.words for _, name in gaps[:1]):
            continue
        right = asked.words[gaps[0][1]]
        others = [asked.words[name] for _, name in gaps[1:] if name in asked.words]
        if len(others) < 2:
            continue
        yield Draft(
            "nearest_object", asked.view.name, CHOICE, {"a": asked.words_of(seen)}, right,
            sentence(f"{right} is nearest to {asked.words_of(seen)}"),
            {"objects": asked.names(seen, asked.view.view_of_object(gaps[0][1])), "answer": gaps[0][1],
             "gaps_m": {name: round(gap, 4) for gap, name in gaps}},
            (*asked.rng.sample(others, min(len(others), MOST_OPTIONS - 1)), right),
        )  # fmt: skip


def _clearances(asked: Context) -> Iterator[Draft]:
    grasps = {each.thing.name: best_grasp(each.thing) for each in asked.view.clear_objects}
    for seen in asked.slidable:
        directions = asked.rng.sample(asked.directions, min(2, len(asked.directions)))
        for direction in directions:
            way = asked.swept_path(seen, direction)
            lengths = [
                cm for cm in CLEARANCES_CM
                if cm / 100 < min(way.leaves_m, LONGEST_M) and way.is_hit_within(cm / 100) is not None
                and asked.in_view(seen, np.array(direction.vector) * cm / 100)
            ]  # fmt: skip
            for cm in lengths:
                free = not way.is_hit_within(cm / 100)
                in_the_way, told = _clearance_evidence(asked, way, cm)
                if not free and in_the_way is None:
                    continue
                evidence = {
                    "objects": asked.names(seen), "frame": direction.frame, "direction": direction.key, "cm": cm,
                    "vector": [round(v, 6) for v in direction.vector], **told,
                }  # fmt: skip
                slots = {"a": asked.words_of(seen), "cm": str(cm), "d": direction.words, "robot": direction.robot}
                answer = "yes" if free else "no"
                reason = "nothing stands there" if free else f"{in_the_way} is in the way"
                yield Draft(
                    "clearance", asked.view.name, YES_NO, slots, answer, sentence(f"{answer}, {reason}"), evidence
                )
                grasp = grasps[seen.thing.name]
                kinds = [None if each is None else each[0] for each in grasps.values()]
                if grasp is not None and None not in kinds and kinds.count(grasp[0]) == 1:
                    words = GRASP_WORDS[grasp[0]]
                    yield Draft(
                        "grasp_and_clearance", asked.view.name, YES_NO,
                        {**{name: value for name, value in slots.items() if name != "a"}, "grasp": words}, answer,
                        sentence(f"it is {asked.words_of(seen)}; {answer}, {reason}"),
                        {**evidence, "grasp_type": grasp[0]},
                    )  # fmt: skip


def _clearance_evidence(asked: Context, way: SweptPath, cm: int) -> tuple[str | None, dict[str, object]]:
    hit = way.first_hit(cm / 100)
    if hit is None or hit[0] not in asked.words:
        return None, {}
    return asked.words[hit[0]], {"met": hit[0], "met_after_m": round(hit[1], 4)}


def _heights(asked: Context) -> Iterator[Draft]:
    if asked.looks_down_rad > STEEPEST_RAD:
        return
    for (a, p), (b, q) in permutations(asked.pointable_objects, 2):
        top_m = float(a.thing.placed_hulls.bounds[1][2]), float(b.thing.placed_hulls.bounds[1][2])
        if abs(top_m[0] - top_m[1]) < TALLER_M:
            continue
        taller = a if top_m[0] > top_m[1] else b
        yield Draft(
            "taller", asked.view.name, CHOICE, {"p": "<p0>", "q": "<p1>", "surface": asked.surface},
            "<p0>" if taller is a else "<p1>",
            sentence(f"the one at {'<p0>' if taller is a else '<p1>'}: {asked.reference_or_category(taller)}"),
            {"objects": asked.names(a, b), "answer": taller.thing.name,
             "top_m": {each.thing.name: round(top, 4) for each, top in zip((a, b), top_m, strict=True)}},
            ("<p0>", "<p1>"), (p, q),
        )  # fmt: skip


def _occluders(asked: Context) -> Iterator[Draft]:
    from manitwin.scenes.perception.object_views import RaycastShape, silhouette_of

    for seen in asked.named_objects:
        view = seen.view
        if view.amodal_in_frame_px - view.visible_px < HIDING_PX * seen.scale or len(asked.named_objects) < 4:
            continue
        shape = seen.thing.shape
        alone = RaycastShape(shape.caster, _corners(shape), np.zeros(0, np.uint8), ())
        hidden = silhouette_of(alone, seen.thing.pose, asked.view.camera).amodal & ~seen.mask
        counts = {each.thing.name: int((each.mask & hidden).sum()) for each in asked.view.seen if each is not seen}
        name, most = max(counts.items(), key=lambda item: item[1])
        if most < HIDING_PX * seen.scale or most < HIDING_SHARE * hidden.sum() or name not in asked.words:
            continue
        right = asked.words[name]
        others = [asked.words_of(each) for each in asked.named_objects if each is not seen and each.thing.name != name]
        if any(counts[each.thing.name] for each in asked.named_objects if each is not seen and each.thing.name != name):
            continue
        yield Draft(
            "occluder", asked.view.name, CHOICE, {"a": asked.words_of(seen)}, right,
            sentence(f"{right} hides some of {asked.words_of(seen)}"),
            {"objects": asked.names(seen, asked.view.view_of_object(name)), "answer": name, "hidden_px": most},
            (*asked.rng.sample(others, min(len(others), MOST_OPTIONS - 1)), right),
        )  # fmt: skip


def _corners(shape: TwinShape) -> np.ndarray:
    return np.concatenate([mesh.vertices for mesh in shape.twin.visual])
