"""Natural-language instructions of pick-and-place episodes, from the twin's language record and the direction of motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manitwin.episodes.naming import Name, names_of
from manitwin.errors import UsageError
from manitwin.models.annotators.descriptions import article
from manitwin.twin.record import Language

TEMPLATES = (
    "pick up {the} and put {it} down {where}",
    "grasp {the} and place {it} {where}",
    "move {the} {where}",
    "take {the} and set {it} down {where}",
    "lift {the}, carry {it} over and put {it} down {where}",
    "grab {the} and bring {it} {where}",
    "{the} should be {where}: move {it} there",
    "find {the}, pick {it} up and place {it} {where}",
    "{there} in front of you; move {it} {where}",
    "please put {the} {where}",
)
"""Every template is used once before any is repeated."""

WITH_DISTANCE = "move {the} about {distance} cm {side}"
"""Additional template for displacements of 5 cm or more along one axis."""

_DISTANCE_STEP_M, _NOWHERE_M = 0.05, 0.01
_OCTANT = np.pi / 8
_FARTHER = ("farther away from the robot", "away from the robot")
_CLOSER = ("closer to the robot", "towards the robot")
_LEFT = ("further to the left", "to the left")
_RIGHT = ("further to the right", "to the right")


def episode_instructions(
    language: Language,
    start_m: np.ndarray,
    goal_m: np.ndarray,
    *,
    seed: int,
    count: int = 6,
    others: Sequence[Language] = (),
) -> tuple[str, ...]:
    """Return ``count`` different English instructions to move an object from start to goal ``(3,)``, world frame.

    Start and goal are positions of the centre of mass: the frame's origin of a lying bottle is at one end, and moves differently
    if the bottle is turned. Left and right are as seen by the robot, which looks along +X. Unknown attributes are not mentioned.
    A name that also fits one of the ``others`` in the scene is avoided if another name is unambiguous; otherwise the most
    specific one is used. Deterministic for equal arguments. Raises UsageError for a count below 1 or above the number of
    combinations.
    """
    names = names_of(language, others)
    way = np.asarray(goal_m, float)[:2] - np.asarray(start_m, float)[:2]
    where, along = _direction(way)
    distance_cm = round(100 * _DISTANCE_STEP_M * round(float(np.linalg.norm(way)) / _DISTANCE_STEP_M))
    templates = [*TEMPLATES, *([WITH_DISTANCE] if along is not None and distance_cm else [])]
    rng = np.random.default_rng(seed)
    templates = [templates[i] for i in rng.permutation(len(templates))]
    names = [names[i] for i in rng.permutation(len(names))]
    most = len(templates) * len(names)
    if not 1 <= count <= most:
        raise UsageError(f"{count} instructions of one episode; give 1 to {most}")
    said: dict[str, None] = {}
    for round_number in range(len(names)):
        for place, template in enumerate(templates):
            name = names[(place + round_number) % len(names)]
            said[_filled(template, name, where, along, distance_cm)] = None
            if len(said) == count:
                return tuple(said)
    raise AssertionError(f"{most} pairs of templates and names give only {len(said)} instructions")


def _filled(template: str, name: Name, where: str, along: str | None, distance_cm: int) -> str:
    if not name.plural:
        there = f"there is {article(name.words)} {name.words}"
    elif name.in_pairs:
        there = f"there is a pair of {name.words}"
    else:
        there = f"there are some {name.words}"
    it = "them" if name.plural else "it"
    return template.format(the=f"the {name.words}", it=it, there=there, where=where, side=along, distance=distance_cm)


def _direction(way: np.ndarray) -> tuple[str, str | None]:
    """Return the direction of a displacement ``(2,)`` in words, and its form with a distance; None for a diagonal one."""
    if np.linalg.norm(way) < _NOWHERE_M:
        return "in the same place", None
    angle = float(np.arctan2(way[1], way[0]))
    forward = None if abs(abs(angle) - np.pi / 2) < _OCTANT else _FARTHER if abs(angle) < np.pi / 2 else _CLOSER
    sideways = None if min(abs(angle), np.pi - abs(angle)) < _OCTANT else _LEFT if angle > 0 else _RIGHT
    if forward is None or sideways is None:
        only = forward or sideways
        assert only is not None  # an angle is within an octant of at most one axis
        return only
    return f"{sideways[0]} and {forward[0]}", None
