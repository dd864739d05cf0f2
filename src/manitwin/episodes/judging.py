"""Judging of an episode: the world state for its goal, and the outcome."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manitwin.episodes.courses.course import EpisodeStart
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.execution import REST_ROWS, Execution
from manitwin.episodes.goals.evaluation import evaluate
from manitwin.episodes.goals.world_state import Event, Granules, ObjectState, WorldState
from manitwin.episodes.outcome import is_at_rest, is_disturbed, moved_m, placement_errors, placement_outcome
from manitwin.episodes.skills.held_skill import tip_of
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.world import RobotWorld

SWINGS_S = 16.0
"""Longest wait for hanging objects and objects in bowls, which swing for a long time and are momentarily still at turning
points.
"""


def is_reached_already(start: EpisodeStart, world: RobotWorld) -> bool:
    """Tell whether any literal of the goal is true at the start."""
    if start.skill_goal is None:
        return False
    touching = frozenset(world.contacts.pressing_pairs(world.contacts.read()))
    state = state_of(start, world, [each.object_to_world for each in start.objects], touching)
    return bool(evaluate(state, start.skill_goal.goal).true_already)


def state_of(
    start: EpisodeStart,
    world: RobotWorld,
    object_to_world: Sequence[np.ndarray],
    touching: frozenset[frozenset[str]],
    at_rest: Sequence[bool] | None = None,
    events: tuple[Event, ...] = (),
) -> WorldState:
    """Return the world state for judging a goal, given the objects' poses ``(4, 4)`` in the world's order."""
    goal = start.skill_goal
    assert goal is not None
    rests = at_rest if at_rest is not None else [True] * len(start.objects)
    objects = {
        begun.name: ObjectState(
            begun.body,
            pose,
            begun.object_to_world,
            still,
            goal.openings.get(begun.name),
            goal.holes.get(begun.name),
            tip_of(goal.frames.get(begun.name, ()), begun.body.hulls),
        )
        for begun, pose, still in zip(start.objects, object_to_world, rests, strict=True)
    }
    furniture = {box.name for box in start.problem.static_boxes}
    furniture |= {name for fixture in goal.fixtures for name in fixture.bearing}
    pegs = {fixture.name: peg for fixture in goal.fixtures if (peg := fixture.peg) is not None}
    holders = {fixture.name: into for fixture in goal.fixtures if (into := fixture.holder) is not None}
    made = world.granules
    granules = None if made is None else Granules(made.positions_m(), made.radius_m)
    return WorldState(
        objects, touching, frozenset(furniture), events, goal.places_m, pegs, granules, start.granules_in, holders,
        tuple(each.robot.name for each in world.robots) if len(world.robots) > 1 else (),
    )  # fmt: skip


def judge(
    start: EpisodeStart, goal_object_to_world: np.ndarray, facts: EpisodeFacts, world: RobotWorld, execution: Execution
) -> None:
    """Wait until everything is at rest, and set the outcome."""
    settings, target = start.settings, start.objects[world.target]
    if start.skill_goal is not None and max(execution.touches.finger_forces_n) == 0:
        last = execution.wait_for_rest(round(max(settings.max_rest_s, SWINGS_S) / settings.timestep_s), REST_ROWS)
    else:
        last = execution.wait_for_rest(round(settings.max_rest_s / settings.timestep_s), REST_ROWS)
    errors = placement_errors(execution.target_to_world(), goal_object_to_world, target.body.center_of_mass_m)
    at_rest = [
        is_at_rest([row[number] for row in last], placed.body.center_of_mass_m, settings)
        for number, placed in enumerate(world.placed)
    ]
    if start.skill_goal is None or not start.skill_goal.has_path:
        facts.errors = errors
    if start.skill_goal is None:
        released = max(execution.touches.finger_forces_n) == 0
        failure = placement_outcome(errors, at_rest=at_rest[world.target], released=released, settings=settings)
    else:
        state = state_of(start, world, last[-1], execution.pressing, at_rest, execution.events)
        facts.evaluation = evaluate(state, start.skill_goal.goal)
        failure = None if facts.evaluation.reached else "goal_missed"
    if failure is None and any(
        _is_disturbed(start, placed, last[-1][number])
        for number, placed in enumerate(start.objects)
        if number != world.target and placed.name not in start.moved
    ):
        failure = "disturbed"
    if failure in (None, "disturbed") and execution.unplanned:
        failure = "unplanned_contact"
    facts.outcome = failure or "kept"


def _is_disturbed(start: EpisodeStart, placed: PlacedObject, after: np.ndarray) -> bool:
    """Tell whether an uninvolved object moved; a partner, which the target is placed on or into, has a larger tolerance."""
    settings, center = start.settings, placed.body.center_of_mass_m
    goal = start.skill_goal
    if goal is not None and (placed.name == goal.partner or placed.name in start.partners):
        return moved_m(placed.object_to_world, after, center) > settings.max_partner_moved_m
    return is_disturbed(placed.object_to_world, after, center, settings)
