"""The best grasp type of an object, and the words for grasp types."""

from __future__ import annotations

from manitwin.scenes.vqa.posed_objects import PosedObject

GRASP_WORDS = {
    "parallel_jaw": "a parallel-jaw grasp",
    "pinch": "a precision pinch grasp",
    "power": "a power grasp",
    "three_finger": "a three-finger grasp",
    "enveloping": "an enveloping grasp",
}
"""The five grasp types of the paper."""
LEAST_LEAD = 0.02
"""Least lead of the best grasp type's confidence over that of the next one."""


def best_grasp(thing: PosedObject) -> tuple[str, float, float] | None:
    """Return the type with the most confident grasp point, its confidence and its lead over other types; None if none leads."""
    best: dict[str, float] = {}
    points = thing.shape.twin.record.points
    for point in points.grasp if points else ():
        best[point.type] = max(best.get(point.type, 0.0), point.confidence)
    ranked = sorted(((confidence, kind) for kind, confidence in best.items()), reverse=True)
    if not ranked:
        return None
    lead = ranked[0][0] - (ranked[1][0] if len(ranked) > 1 else 0.0)
    return None if lead < LEAST_LEAD else (ranked[0][1], ranked[0][0], round(lead, 4))
