"""Goals of several literals: skills one after the other, each planned from where the one before has left things."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice

import numpy as np

from manitwin.episodes.courses.course import Course, Ended, Start
from manitwin.episodes.courses.handover import HandoverCourse
from manitwin.episodes.courses.held import HeldCourse
from manitwin.episodes.courses.pick_place import PickPlaceCourse
from manitwin.episodes.courses.push import PushCourse
from manitwin.episodes.courses.regrasp import RegraspCourse
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.execution import Execution
from manitwin.episodes.goals.evaluation import evaluate
from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Grasp, PickPlaceProblem
from manitwin.episodes.planning.two_arms import TwoArmPlanner, alone
from manitwin.episodes.skills.skill import FoundPoses, Skill, SkillGoal, Surroundings, state_at_rest
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.contacts import NONE_MEANT
from manitwin.physics.sapien.world import RobotWorld

DRAWS = 12  # of a later step's poses: two sides at once are a small place


@dataclass(frozen=True)
class Step:
    """One literal: the skill that makes it true, of which object (by name), with which partner, held by which grasps.

    ``goal`` is set beforehand, from where everything is expected to be by then: its fixtures stand in the world from the
    beginning, its poses are drawn anew when its turn comes.
    """

    skill: Skill
    target: str
    partner: str | None
    grasps: tuple[Grasp, ...]
    goal: SkillGoal


@dataclass(frozen=True)
class GoalSequence:
    """The steps of a goal in their order, and the surroundings of their objects at the beginning."""

    steps: tuple[Step, ...]
    around: tuple[Surroundings, ...]

    @property
    def goal(self) -> SkillGoal:
        """All of it: what the end is judged by."""
        return merged([step.goal for step in self.steps])

    @property
    def moved(self) -> frozenset[str]:
        """The names of the objects that are taken."""
        return frozenset(step.target for step in self.steps)

    @property
    def partners(self) -> frozenset[str]:
        """The names of the objects that the goal is about beside those."""
        return frozenset(step.partner for step in self.steps if step.partner is not None)


def merged(goals: Sequence[SkillGoal]) -> SkillGoal:
    """Return the conjunction of goals: literals in their order, what stays (said once), and all that they are measured by."""
    literals = tuple(literal for each in goals for literal in each.goal.literals)
    stays = tuple(dict.fromkeys(stay for each in goals for stay in each.goal.stays))
    first = goals[0]
    return replace(
        first,
        goal=Goal(literals, stays),
        openings={name: found for each in goals for name, found in each.openings.items()},
        holes={name: found for each in goals for name, found in each.holes.items()},
        frames={name: found for each in goals for name, found in each.frames.items()},
        fixtures=tuple(fixture for each in goals for fixture in each.fixtures),
        path=next((each.path for each in goals if each.path is not None), None),
        granules=next((each.granules for each in goals if each.granules is not None), None),
        places_m={name: place for each in goals for name, place in each.places_m.items()},
    )


def course_of(start: Start, facts: EpisodeFacts) -> Course:
    """Return the course of a start's goal; what one arm does alone is done by the first of two."""
    if start.skill_goal is not None and start.skill_goal.hands_over:
        return HandoverCourse(start, facts)
    if isinstance(start.planner, TwoArmPlanner):
        start = replace(start, planner=start.planner.alone)
    if start.skill_goal is not None and start.skill_goal.pushes:
        return PushCourse(start, facts)
    if start.skill_goal is not None and start.skill_goal.is_of_a_path:
        return HeldCourse(start, facts)
    regrasps = start.skill_goal is not None and start.skill_goal.ways is not None
    return (RegraspCourse if regrasps else PickPlaceCourse)(start, facts)


def later_courses(
    sequence: GoalSequence, start: Start, world: RobotWorld, execution: Execution, facts: EpisodeFacts
) -> Iterator[Course]:
    """Yield the courses of the steps after the first, each planned once the one before has been carried out."""
    for number in range(1, len(sequence.steps)):
        yield _next_course(sequence, number, start, world, execution, facts)


def _next_course(
    sequence: GoalSequence, number: int, start: Start, world: RobotWorld, execution: Execution, facts: EpisodeFacts
) -> Course:
    """Let all come to rest, bring the arm home, and plan a later step from what is there; raises Ended where there is no way."""
    settings, planner, step, around = start.settings, start.planner, sequence.steps[number], sequence.around[number]
    execution.rest(round(settings.max_rest_s / settings.timestep_s))
    objects = tuple(
        replace(placed, object_to_world=world.object_to_world(place)) for place, placed in enumerate(world.placed)
    )
    target = [each.name for each in objects].index(step.target)
    problem = problem_of(start.problem, objects, target, step.grasps)
    execution.meant = NONE_MEANT
    execution.open()
    assert isinstance(planner, PickPlacePlanner), "sequences are planned with the models of this planner"
    home = alone(planner).of(facts.grasp).plan_way_home(problem, execution.commanded_rad)
    if home is None:
        raise Ended("replan_failed")
    execution.follow(home)
    world.take(target)
    execution.literal = number
    goal = goal_of_later_step(sequence.steps, number, replace(around, objects=objects), problem.seed)
    if goal is None:
        raise Ended("replan_failed")
    later = Start(problem, objects, planner, settings, goal, start.granules_in)
    course = course_of(later, facts)
    if not course.plan():
        raise Ended("replan_failed")
    return course


def problem_of(
    before: PickPlaceProblem, objects: Sequence[PlacedObject], target: int, grasps: tuple[Grasp, ...]
) -> PickPlaceProblem:
    """Return a problem with another target, and everything where it is now."""
    return replace(
        before,
        target=objects[target],
        goal_object_to_world=objects[target].object_to_world,
        grasps=grasps,
        obstacles=tuple(each for number, each in enumerate(objects) if number != target),
    )


def goal_of_later_step(steps: Sequence[Step], number: int, around: Surroundings, seed: int) -> SkillGoal | None:
    """Return a later step's goal with poses from where things are; one of a path is made from there anyway. None: no pose.

    What is taken for a second time goes only where the literals that came true of it stay so: an object that was put left of
    one thing, and is now put behind another one.
    """
    step, names = steps[number], [each.name for each in around.objects]
    target = names.index(step.target)
    if step.goal.is_of_a_path:
        return replace(step.goal, poses=(around.objects[target].object_to_world,))
    partner = None if step.partner is None else names.index(step.partner)
    kept = [each for before in steps[:number] if before.target == step.target for each in before.goal.goal.literals]
    goals = (
        step.skill.set_goal(around, target, partner, np.random.default_rng((seed, 4, *([draw] if draw else []))))
        for draw in range(DRAWS if kept else 1)
    )
    first = next(goals)
    if first is None:
        return None
    every = (pose for goal in chain([first], goals) if goal is not None for pose in goal.poses)
    poses = FoundPoses(islice((pose for pose in every if _stays(kept, around, target, pose)), step.skill.most_poses))
    return None if next(iter(poses), None) is None else replace(first, goal=step.goal.goal, poses=poses)


def _stays(literals: Sequence[Literal], around: Surroundings, target: int, pose: np.ndarray) -> bool:
    """Tell whether literals hold with the target at a pose, as far as poses tell."""
    if not literals:
        return True
    objects = tuple(
        replace(each, object_to_world=pose) if number == target else each for number, each in enumerate(around.objects)
    )
    names = {each.name for each in objects}
    if any(literal.second is not None and literal.second not in names for literal in literals):
        return False  # on a peg or at a mark it is no more
    return evaluate(state_at_rest(replace(around, objects=objects)), Goal(tuple(literals))).reached
