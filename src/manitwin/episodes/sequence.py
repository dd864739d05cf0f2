"""Goals of several literals: skills in sequence, each planned from where the previous one left the objects."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice

import numpy as np

from manitwin.episodes.courses.course import Course, EpisodeEnded, EpisodeStart
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
from manitwin.episodes.planning.two_arms import TwoArmPlanner, single_arm_planner
from manitwin.episodes.skills.skill import LazyPoses, Skill, SkillGoal, Surroundings, state_at_rest
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.contacts import NONE_MEANT
from manitwin.physics.sapien.world import RobotWorld

DRAWS = 12  # draws of a later step's poses: the intersection of two sides is a small area


@dataclass(frozen=True)
class GoalStep:
    """One literal: the skill that achieves it, the names of target and partner, and the grasps.

    ``goal`` is set before execution, for the expected poses: its fixtures are in the world from the beginning, its poses are
    sampled again when the step starts.
    """

    skill: Skill
    target: str
    partner: str | None
    grasps: tuple[Grasp, ...]
    goal: SkillGoal


@dataclass(frozen=True)
class GoalSequence:
    """The steps of a goal in order, and the initial surroundings of their objects."""

    steps: tuple[GoalStep, ...]
    around: tuple[Surroundings, ...]

    @property
    def goal(self) -> SkillGoal:
        """The combined goal, by which the episode is judged."""
        return conjunction([step.goal for step in self.steps])

    @property
    def moved(self) -> frozenset[str]:
        """Names of the objects that are taken."""
        return frozenset(step.target for step in self.steps)

    @property
    def partners(self) -> frozenset[str]:
        """Names of the steps' partners."""
        return frozenset(step.partner for step in self.steps if step.partner is not None)


def conjunction(goals: Sequence[SkillGoal]) -> SkillGoal:
    """Return the conjunction of goals: literals in order, unique ``stays`` literals, and all data for judging them."""
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


def create_course(start: EpisodeStart, facts: EpisodeFacts) -> Course:
    """Return the course of a start's goal; for two arms, single-arm tasks are done by the first."""
    if start.skill_goal is not None and start.skill_goal.hands_over:
        return HandoverCourse(start, facts)
    if isinstance(start.planner, TwoArmPlanner):
        start = replace(start, planner=start.planner.giver_planner)
    if start.skill_goal is not None and start.skill_goal.pushes:
        return PushCourse(start, facts)
    if start.skill_goal is not None and start.skill_goal.has_path:
        return HeldCourse(start, facts)
    regrasps = start.skill_goal is not None and start.skill_goal.ways is not None
    return (RegraspCourse if regrasps else PickPlaceCourse)(start, facts)


def later_courses(
    sequence: GoalSequence, start: EpisodeStart, world: RobotWorld, execution: Execution, facts: EpisodeFacts
) -> Iterator[Course]:
    """Yield the courses of the steps after the first, each planned once the previous one has been executed."""
    for number in range(1, len(sequence.steps)):
        yield _next_course(sequence, number, start, world, execution, facts)


def _next_course(
    sequence: GoalSequence,
    number: int,
    start: EpisodeStart,
    world: RobotWorld,
    execution: Execution,
    facts: EpisodeFacts,
) -> Course:
    """Let everything settle, bring the arm home, and plan a later step from the current poses; raises Ended if that fails."""
    settings, planner, step, around = start.settings, start.planner, sequence.steps[number], sequence.around[number]
    execution.wait_for_rest(round(settings.max_rest_s / settings.timestep_s))
    objects = tuple(
        replace(placed, object_to_world=world.object_to_world(place)) for place, placed in enumerate(world.placed)
    )
    target = [each.name for each in objects].index(step.target)
    problem = problem_of(start.problem, objects, target, step.grasps)
    execution.meant = NONE_MEANT
    execution.open_hand()
    assert isinstance(planner, PickPlacePlanner), "sequences are planned with the models of this planner"
    home = single_arm_planner(planner).with_opening_of(facts.grasp).plan_return_home(problem, execution.commanded_rad)
    if home is None:
        raise EpisodeEnded("replan_failed")
    execution.follow(home)
    world.set_target(target)
    execution.literal = number
    goal = goal_of_later_step(sequence.steps, number, replace(around, objects=objects), problem.seed)
    if goal is None:
        raise EpisodeEnded("replan_failed")
    later = EpisodeStart(problem, objects, planner, settings, goal, start.granules_in)
    course = create_course(later, facts)
    if not course.plan():
        raise EpisodeEnded("replan_failed")
    return course


def problem_of(
    before: PickPlaceProblem, objects: Sequence[PlacedObject], target: int, grasps: tuple[Grasp, ...]
) -> PickPlaceProblem:
    """Return a problem with another target, and everything at its current pose."""
    return replace(
        before,
        target=objects[target],
        goal_object_to_world=objects[target].object_to_world,
        grasps=grasps,
        obstacles=tuple(each for number, each in enumerate(objects) if number != target),
    )


def goal_of_later_step(steps: Sequence[GoalStep], number: int, around: Surroundings, seed: int) -> SkillGoal | None:
    """Return a later step's goal with poses from the current state; None if there is no pose.

    A target that is moved a second time only gets poses at which its earlier literals remain true, for example an object that
    was put left of one object and is now put behind another one. A goal with a path is built from the current state anyway.
    """
    step, names = steps[number], [each.name for each in around.objects]
    target = names.index(step.target)
    if step.goal.has_path:
        return replace(step.goal, poses=(around.objects[target].object_to_world,))
    partner = None if step.partner is None else names.index(step.partner)
    kept = [each for before in steps[:number] if before.target == step.target for each in before.goal.goal.literals]
    goals = (
        step.skill.sample_goal(around, target, partner, np.random.default_rng((seed, 4, *([draw] if draw else []))))
        for draw in range(DRAWS if kept else 1)
    )
    first = next(goals)
    if first is None:
        return None
    every = (pose for goal in chain([first], goals) if goal is not None for pose in goal.poses)
    poses = LazyPoses(islice((pose for pose in every if _stays(kept, around, target, pose)), step.skill.most_poses))
    return None if next(iter(poses), None) is None else replace(first, goal=step.goal.goal, poses=poses)


def _stays(literals: Sequence[Literal], around: Surroundings, target: int, pose: np.ndarray) -> bool:
    """Tell whether literals hold with the target at a pose, as far as poses determine it."""
    if not literals:
        return True
    objects = tuple(
        replace(each, object_to_world=pose) if number == target else each for number, each in enumerate(around.objects)
    )
    names = {each.name for each in objects}
    if any(literal.second is not None and literal.second not in names for literal in literals):
        return False  # it is no longer on the peg or at the mark
    return evaluate(state_at_rest(replace(around, objects=objects)), Goal(tuple(literals))).reached
