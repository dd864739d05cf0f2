"""Judges of tool use (stirred, wiped, cut motion, aimed), from values that watches measured during the motion."""

from __future__ import annotations

from manitwin.episodes.goals.goal import Literal
from manitwin.episodes.goals.spatial import Judgement, judgement_from_conditions
from manitwin.episodes.goals.world_state import Event, WorldState

LEAST_STIRRED = 0.3  # share of the granules moved by more than their own diameter
LEAST_BY_FACE, LEAST_IN_BAND = 0.5, 0.7  # shares of the time in which the tool touches the wiped surface
AIMED_M = (0.03, 0.30)
AIMED_S = 0.25


def stirred(state: WorldState, literal: Literal) -> Judgement:
    """Judge that a tool's end passed through the value's share of a vessel's sectors and moved 30 % of its granules."""
    assert literal.value is not None and literal.second is not None
    if not state.granules_at_start.get(literal.second, 0):
        return Judgement(False, "nothing_to_stir", {"granules": 0.0})
    values = _last(state, "stirred", literal)
    if values is None:
        return Judgement(False, "missed", {})
    return judgement_from_conditions(
        {"not_all_around": values["sectors"] >= literal.value, "content_still": values["moved"] >= LEAST_STIRRED},
        values,
    )


def wiped(state: WorldState, literal: Literal) -> Judgement:
    """Judge that the value's share of a patch was swept by a tool's face pressing with 1 to 5 N."""
    assert literal.value is not None
    values = _last(state, "wiped", literal)
    if values is None:
        return Judgement(False, "not_touched", {})
    return judgement_from_conditions(
        {
            "wrong_face": values["by_face"] >= LEAST_BY_FACE,
            "force_off": values["in_band"] >= LEAST_IN_BAND,
            "not_all_swept": values["share"] >= literal.value,
        },
        values,
    )


def cut_motion(state: WorldState, literal: Literal) -> Judgement:
    """Judge that an edge moved along the value's share of a line, within 5 mm and 10 degrees, and was drawn as far.

    Nothing is divided.
    """
    assert literal.value is not None
    values = _last(state, "cut_motion", literal)
    if values is None:
        return Judgement(False, "missed", {})
    return judgement_from_conditions(
        {"not_along": values["share"] >= literal.value, "not_drawn": values["drawn"] >= literal.value}, values
    )


def aimed(state: WorldState, literal: Literal) -> Judgement:
    """Judge that a nozzle pointed at an object for at least 0.25 s, from 3 to 30 cm away, within the value (rad)."""
    assert literal.value is not None
    values = _last(state, "aimed", literal)
    if values is None:
        return Judgement(False, "missed", {})
    return judgement_from_conditions(
        {
            "too_near": values["distance_m"] >= AIMED_M[0],
            "too_far": values["distance_m"] <= AIMED_M[1],
            "askew": values["angle_rad"] <= literal.value,
            "too_short": values["held_s"] >= AIMED_S,
        },
        values,
    )


def _last(state: WorldState, kind: str, literal: Literal) -> dict[str, float] | None:
    """Return the values of the last event of this kind for the literal's objects; a watch emits at most one."""
    found: list[Event] = [
        event
        for event in state.events
        if (event.kind, event.subject, event.second) == (kind, literal.subject, literal.second)
    ]
    return dict(found[-1].values) if found else None
