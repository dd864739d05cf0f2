"""Feasibility check of task candidates by planning with the courses of episodes; later actions start where earlier ones end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from manitwin.episodes.courses.course import EpisodeStart
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.goals.evaluation import judge
from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.pick_place_tasks import MIN_GAP_M
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.sequence import GoalSequence, GoalStep, create_course, goal_of_later_step, problem_of
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.registry import SKILLS
from manitwin.episodes.skills.skill import SkillGoal
from manitwin.episodes.tasks.candidates import Candidate, SkillAction
from manitwin.episodes.tasks.task_scene import TaskScene
from manitwin.geometry.boxes import separation_m
from manitwin.geometry.rigid_body import PlacedObject, StaticBox


@dataclass(frozen=True)
class PlannedTask:
    """A feasible candidate: its steps, the goal of all steps, and the number of grasps tried."""

    candidate: Candidate
    sequence: GoalSequence
    goal: Goal
    grasps_tried: int


class InfeasibleTask(Exception):
    """A candidate is not feasible; the message is the reason."""


def check_candidate(
    scene: TaskScene, candidate: Candidate, planner: PickPlacePlanner, settings: EpisodeSettings, seed: int
) -> PlannedTask:
    """Plan a candidate; raises NoTask with the reason."""
    sequence = sequence_of(scene, candidate.actions, seed)
    goal = complete_goal(scene, sequence)
    objects, tried = scene.objects, 0
    problem = replace(scene.problem, seed=seed, fixtures=_boxes(sequence))
    for number, (step, action) in enumerate(zip(sequence.steps, candidate.actions, strict=True)):
        here = problem_of(problem, objects, action.target, step.grasps)
        found = _goal_there(scene, sequence.steps, action, objects, number, seed)
        facts = EpisodeFacts()
        course = create_course(EpisodeStart(here, objects, planner, settings, found), facts)
        if not course.plan():
            failure = facts.plan_failures.most_common(1)
            raise InfeasibleTask(f"no_plan_{failure[0][0]}" if failure else "no_plan")
        tried += facts.grasps_tried
        last = number == len(sequence.steps) - 1
        end = course.planned_end_pose
        if end is None and not last:
            raise InfeasibleTask("keeps_it_in_hand")
        if end is None and action.target in {before.target for before in candidate.actions[:number]}:
            raise InfeasibleTask("undoes_first")  # an object that was placed ends in the hand
        if end is not None:
            objects = tuple(
                replace(each, object_to_world=end) if place == action.target else each
                for place, each in enumerate(objects)
            )
    _check_still_true(scene, candidate, [each.object_to_world for each in objects])
    return PlannedTask(candidate, sequence, goal, tried)


def sequence_of(scene: TaskScene, actions: Sequence[SkillAction], seed: int) -> GoalSequence:
    """Return the steps of actions with their goals before execution; raises NoTask if one has none or they are incompatible."""
    steps = []
    for number, action in enumerate(actions):
        step = scene.step(SKILLS[action.skill], action.target, action.partner, seed, number)
        if step is None:
            raise InfeasibleTask("no_place")
        steps.append(step)
    fixtures = [fixture for step in steps for fixture in step.goal.fixtures]
    if len({fixture.name for fixture in fixtures}) < len(fixtures) or any(
        separation_m(first.footprint_m, second.footprint_m) < MIN_GAP_M
        for place, first in enumerate(fixtures)
        for second in fixtures[:place]
    ):
        raise InfeasibleTask("fixtures_meet")
    marks = [name for step in steps for name in step.goal.places_m]
    if len(set(marks)) < len(marks):
        raise InfeasibleTask("fixtures_meet")
    filled = [(place, step.goal.granules.name) for place, step in enumerate(steps) if step.goal.granules is not None]
    if len(filled) > 1 or any(name in {step.target for step in steps[:place]} for place, name in filled):
        raise InfeasibleTask("content_would_move")
    return GoalSequence(tuple(steps), tuple(scene.surroundings(action.target) for action in actions))


def complete_goal(scene: TaskScene, sequence: GoalSequence) -> Goal:
    """Return the goal of all literals, with the skills' ``stays`` literals, and ``undisturbed`` for all uninvolved objects."""
    said = sequence.goal.goal
    taking_part = sequence.moved | sequence.partners
    apart = tuple(Literal("undisturbed", name) for name in scene.names if name not in taking_part)
    kept = tuple(each for each in said.stays if each.subject not in sequence.moved or len(sequence.steps) == 1)
    return Goal(said.literals, tuple(dict.fromkeys((*kept, *apart))))


def _goal_there(
    scene: TaskScene,
    steps: Sequence[GoalStep],
    action: SkillAction,
    objects: tuple[PlacedObject, ...],
    number: int,
    seed: int,
) -> SkillGoal:
    if number == 0:
        return steps[0].goal
    found = goal_of_later_step(steps, number, replace(scene.surroundings(action.target), objects=objects), seed)
    if found is None:
        raise InfeasibleTask("no_place")
    return found


def _check_still_true(scene: TaskScene, candidate: Candidate, object_to_world: Sequence[np.ndarray]) -> None:
    """Raise NoTask if an object that is moved twice is no longer where the first action put it."""
    moved = [action.target for action in candidate.actions]
    state = scene.state_of(object_to_world)
    for place, action in enumerate(candidate.actions):
        if action.target not in moved[place + 1 :]:
            continue
        second = action.literal.second  # after it was taken again, it is no longer on a peg or at a mark
        if (second is not None and second not in scene.names) or not judge(state, action.literal).holds:
            raise InfeasibleTask("undoes_first")


def _boxes(sequence: GoalSequence) -> tuple[StaticBox, ...]:
    return tuple(box for step in sequence.steps for fixture in step.goal.fixtures for box in fixture.boxes)
