"""Run of one episode: settle, plan, execute in physics by the skill's course, judge (docs/trajectories.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from manitwin.episodes.courses.course import Course, EpisodeEnded, EpisodeStart, Planner
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.execution import FRAME_S, Execution
from manitwin.episodes.goals.world_state import Granules
from manitwin.episodes.granule_counts import count_granules, with_granule_counts
from manitwin.episodes.grasp_retry import execute_with_retry
from manitwin.episodes.judging import is_reached_already, judge
from manitwin.episodes.outcome import moved_m, turned_rad
from manitwin.episodes.planning.problem import PickPlaceProblem
from manitwin.episodes.planning.two_arms import TwoArmPlanner
from manitwin.episodes.recording import Recording
from manitwin.episodes.sequence import GoalSequence, create_course, later_courses
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.skill import SkillGoal
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.trial import TrialSettings
from manitwin.robots.robot import Robot


def run_episode(
    problem: PickPlaceProblem,
    planner: Planner,
    robot: Robot,
    settings: EpisodeSettings,
    skill_goal: SkillGoal | None = None,
    sequence: GoalSequence | None = None,
) -> tuple[EpisodeFacts, Recording | None]:
    """Run one episode; return its facts, and its recording if it was executed.

    The objects settle first, and planning starts from their resting poses. Without ``skill_goal`` the target's pose is
    compared with the problem's goal pose. With one, its goal is judged; a placing skill uses the first pose that can be
    planned, a held path the first grasp and path. A ``sequence`` has a goal of several literals: ``skill_goal`` is then the
    combined goal, the problem that of the first step, and the grasp is not reported. Deterministic to the byte for equal
    arguments.
    """
    facts, recording, closing = EpisodeFacts(), None, closing_of(robot, settings)
    with create_world(problem, robot, settings, closing.force_n) as world:
        start = settle_start(problem, planner, settings, skill_goal, world)
        if start is None:
            facts.outcome = "unsettled"
        elif is_reached_already(start, world):
            facts.outcome = "reached_already"
        elif (course := _first_course(start, facts, sequence)).plan():
            execution = Execution(world, robot, closing, *tip_poses_of(planner))
            execution.literal = None if sequence is None else 0
            if sequence is not None:
                world.set_held_objects(sequence.moved)
            try:
                course = execute_with_retry(course, world, execution)
                for later in () if sequence is None else later_courses(sequence, start, world, execution, facts):
                    course = execute_with_retry(later, world, execution)
                judge(start, course.goal_object_to_world, facts, world, execution)
            except EpisodeEnded as end:
                facts.outcome = str(end)
            facts.length_s = execution.length_s
            facts.unplanned = tuple(sorted(execution.unplanned))
            facts.events = execution.events
            if sequence is not None:
                facts.grasp = None
            recording = execution.recording()
            if world.granules is not None and skill_goal is not None:
                recording = with_granule_counts(recording, start.objects, skill_goal.openings, world.granules.radius_m)
            del execution, course
    return facts, recording


def tip_poses_of(planner: Planner) -> tuple[Callable[[np.ndarray], np.ndarray], ...]:
    """Return the forward kinematics of each arm of a planner."""
    taker = (planner.taker.tip_pose,) if isinstance(planner, TwoArmPlanner) else ()
    return (planner.tip_pose, *taker)


def create_world(
    problem: PickPlaceProblem, robot: Robot, settings: EpisodeSettings, closing_force_n: float
) -> RobotWorld:
    """Create the physics world of a problem."""
    return RobotWorld(
        robot,
        problem.target,
        problem.obstacles,
        problem.static_boxes,
        problem.fixtures,
        closing_force_n=closing_force_n,
        timestep_s=settings.timestep_s,
        contact_offset_m=settings.contact_offset_m,
        solver_iterations=settings.solver_iterations,
        solver_iterations_held=settings.solver_iterations_held,
        max_contact_force_n=settings.max_contact_force_n,
        furniture_friction=settings.furniture_friction,
    )


def _first_course(start: EpisodeStart, facts: EpisodeFacts, sequence: GoalSequence | None) -> Course:
    if sequence is None:
        return create_course(start, facts)
    start.moved, start.partners = sequence.moved, sequence.partners
    return create_course(replace(start, skill_goal=sequence.steps[0].goal), facts)


def settle_start(
    problem: PickPlaceProblem,
    planner: Planner,
    settings: EpisodeSettings,
    skill_goal: SkillGoal | None,
    world: RobotWorld,
) -> EpisodeStart | None:
    """Let the objects settle and return the start at their resting poses; None if an object does not stay in place."""
    if skill_goal is not None and skill_goal.granules is not None:
        world.add_granules(skill_goal.granules)
    world.settle(settings.max_settle_s)
    rested = tuple(
        replace(placed, object_to_world=world.object_to_world(number)) for number, placed in enumerate(world.placed)
    )
    for before, after in zip(world.placed, rested, strict=True):
        moved = moved_m(before.object_to_world, after.object_to_world, before.body.center_of_mass_m)
        turned = turned_rad(before.object_to_world, after.object_to_world)
        if moved > settings.max_start_m or turned > np.radians(settings.max_start_deg):
            return None
    settled = replace(
        problem,
        target=rested[world.target],
        obstacles=tuple(placed for number, placed in enumerate(rested) if number != world.target),
    )
    start = EpisodeStart(settled, rested, planner, settings, skill_goal)
    if skill_goal is not None and world.granules is not None:
        granules = Granules(world.granules.positions_m(), world.granules.radius_m)
        start.granules_in = count_granules(
            rested, [each.object_to_world for each in rested], skill_goal.openings, granules
        )
    return start


def closing_of(robot: Robot, settings: EpisodeSettings) -> TrialSettings:
    """Return the settings of closing hands: the closing force and friction with the episode's time step."""
    gripper = robot.gripper
    force_n = gripper.force_n if settings.closing_force_n is None else settings.closing_force_n
    return TrialSettings(
        force_n,
        gripper.finger_friction,
        timestep_s=settings.timestep_s,
        steps_per_frame=max(1, round(FRAME_S / settings.timestep_s)),
    )
