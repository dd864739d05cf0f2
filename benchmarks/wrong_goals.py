"""Negative controls: goals of skills with a deliberately wrong motion, judged against the original goal; none may be reached."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from unittest import mock

import numpy as np

from manitwin.episodes.courses.course import EpisodeStart
from manitwin.episodes.courses.push import PushCourse
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.planning.closed_hand import first_corner
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.episodes.skills.skill import SkillGoal
from manitwin.geometry.poses import transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.scenes.layouts.twin_frames import TwinFrame

FAR_M, RAISED_M, LOWERED_M = 0.15, 0.04, 0.12
BESIDE_M = {"hang": 0.06, "press": 0.03, "strike": 0.09}
"""Displacements (m) that differ from 15 cm, by skill: a peg, a button and a striking face are small."""
AT_PARTNERS = ("place_in", "place_on", "stack", "near")
SIDES = ("left_of", "right_of", "behind", "in_front_of")
CONTROLS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys((*AT_PARTNERS, "push", "hang", "insert", "press"), ("beside",)),
    **dict.fromkeys(SIDES, ("other side",)),
    **dict.fromkeys(("upright", "away_from"), ("lying",)),
    "lift": ("low",),
    "strike": ("beside", "turned"),
    "pour": ("beside", "empty"),
    "stir": ("beside", "empty"),
    "wipe": ("beside", "turned", "raised"),
    "cut_motion": ("beside", "turned", "raised"),
    "aim": ("beside", "turned"),
}
"""Kinds of errors by skill; those of a handover are in ``benchmarks/handover.py``."""


def wrong_goal(
    goal: SkillGoal, skill: str, kind: str, objects: Sequence[PlacedObject], rng: np.random.Generator
) -> SkillGoal:
    """Return a goal with an error of the given kind; the target is the first of ``objects`` and its partner the second.

    The kinds are:

    - beside: the whole motion shifted in a random direction: across a peg, away from a partner in, on or beside which the target
      is put, across the pointing direction, or to the fingertips of what is pressed; for a push the mark is shifted
      (``pushed_beside``);
    - other side: mirrored at the partner;
    - lying: in the start orientation;
    - low, raised: 12 cm lower, 4 cm higher;
    - turned: another side of the object, its frames rotated by 90 degrees about their X;
    - empty: no granules.
    """
    if kind == "empty":
        return replace(goal, granules=None)
    if goal.pushes:
        return goal
    off = transform(translation=_way_m(goal, skill, kind, objects, rng))
    if goal.path is None:
        at = objects[0].object_to_world
        return replace(goal, poses=(at,) if kind == "lying" else [off @ pose for pose in goal.poses])
    make = goal.path

    def another(scene: HeldScene) -> HeldTask:
        task = make(scene)
        if kind == "turned":
            return replace(task, watch=make(replace(scene, frames=_turned(scene.frames))).watch)

        def moved(path: HeldPath) -> HeldPath:
            way = off
            if (skill, kind) == ("aim", "beside"):
                way = _across(path.poses, off)
            elif (skill, kind) == ("press", "beside"):
                way = _hand_aside(path.poses, off, scene.fingertips_m)
            return replace(path, poses=way @ path.poses)

        return replace(task, paths=tuple(map(moved, task.paths)), otherwise=tuple(map(moved, task.otherwise)))

    return replace(goal, path=another)


def pushed_beside(skill: str, kind: str, rng: np.random.Generator) -> AbstractContextManager[object]:
    """Return a context in which a pushed object goes 15 cm beside its mark; it changes nothing for other controls."""
    if (skill, kind) != ("push", "beside"):
        return nullcontext()
    way, begin = _beside_m(FAR_M, rng), PushCourse.__init__

    def astray(course: PushCourse, start: EpisodeStart, facts: EpisodeFacts) -> None:
        begin(course, start, facts)
        course._place_m = course._place_m + way  # the guards too, or a stroke across the true mark would end there

    return mock.patch.object(PushCourse, "__init__", astray)


def _way_m(
    goal: SkillGoal, skill: str, kind: str, objects: Sequence[PlacedObject], rng: np.random.Generator
) -> np.ndarray:
    if kind == "other side":
        first, second = (_center_m(placed, pose) for placed, pose in ((objects[0], goal.poses[0]), (objects[1], None)))
        return np.array([*(2 * (second - first))[:2], 0.0])
    if kind == "beside":
        beside = _beside_m(BESIDE_M.get(skill, FAR_M), rng)
        if goal.fixtures and goal.fixtures[0].kind == "peg":
            return float(np.copysign(np.linalg.norm(beside), beside[0])) * goal.fixtures[0].frame_to_world[:3, 1]
        if skill in AT_PARTNERS:
            away = _center_m(objects[0], goal.poses[0]) - _center_m(objects[1], None)
            way = np.array([*away[:2], 0.0]) / max(float(np.linalg.norm(away[:2])), 1e-9)
            return (_far_out_m(objects[1], away, way) if skill == "place_in" else FAR_M) * way
        return beside
    return np.array([0.0, 0, {"raised": RAISED_M, "low": -LOWERED_M}.get(kind, 0.0)])


def _across(poses: np.ndarray, off: np.ndarray) -> np.ndarray:
    """Return a horizontal shift as long as ``off``, perpendicular to the direction of poses ``(K, 4, 4)``, on the side of
    ``off``.

    A nozzle shifted by 15 cm along its pointing direction would still point at the same place from farther away.
    """
    side = np.cross([0.0, 0, 1], poses[-1, :3, 3] - poses[0, :3, 3])
    way_m = np.linalg.norm(off[:3, 3]) * side / max(float(np.linalg.norm(side)), 1e-9)
    return transform(translation=np.copysign(1.0, float(way_m @ off[:3, 3])) * way_m)


def _hand_aside(poses: np.ndarray, off: np.ndarray, tips_m: np.ndarray) -> np.ndarray:
    """Return a horizontal shift as long as ``off`` for poses ``(K, 4, 4)`` of a hand, towards the side of its fingertips.

    Fingertips are 3 cm wide. With a shift to another side, another corner would press on the same place.
    """
    corner_m, _ = first_corner(tips_m, poses[-1, :3, :3], poses[-1, :3, 3] - poses[0, :3, 3])
    side = poses[-1, :3, :3] @ (tips_m.mean(0) - corner_m) * [1.0, 1.0, 0.0]
    return transform(translation=np.linalg.norm(off[:3, 3]) * side / np.linalg.norm(side))


def _far_out_m(vessel: PlacedObject, away_m: np.ndarray, way: np.ndarray) -> float:
    """Return the distance along a unit vector by which ``away_m`` (relative to a vessel's centre) moves to 15 cm beside the
    vessel.

    A shift by 15 cm from a place inside a pan may still end in the pan.
    """
    points = transform_points(vessel.object_to_world, np.concatenate(vessel.body.hulls)) - _center_m(vessel, None)
    return float((points @ way).max()) + FAR_M - float(away_m @ way)


def _beside_m(far_m: float, rng: np.random.Generator) -> np.ndarray:
    angle = rng.uniform(-np.pi, np.pi)
    return far_m * np.array([np.cos(angle), np.sin(angle), 0.0])


def _center_m(placed: PlacedObject, pose: np.ndarray | None) -> np.ndarray:
    at = placed.object_to_world if pose is None else pose
    return np.asarray(transform_points(at, placed.body.center_of_mass_m[None])[0])


def _turned(frames: Mapping[str, tuple[TwinFrame, ...]]) -> dict[str, tuple[TwinFrame, ...]]:
    aside = transform(np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]))
    return {
        name: tuple(replace(each, frame_to_object=each.frame_to_object @ aside) for each in of_it)
        for name, of_it in frames.items()
    }
