"""Second grasp: an object that was left behind, or set down again, is taken by another grasp from its current pose."""

from __future__ import annotations

from dataclasses import replace

from manitwin.episodes.courses.course import ANOTHER_GRASP, Course, GraspFailed, TurnedInHand
from manitwin.episodes.execution import Execution
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.two_arms import single_arm_planner
from manitwin.episodes.planning.withdrawal import plan_withdrawal
from manitwin.episodes.sequence import create_course, problem_of
from manitwin.physics.sapien.contacts import NONE_MEANT
from manitwin.physics.sapien.world import RobotWorld


def execute_with_retry(course: Course, world: RobotWorld, execution: Execution) -> Course:
    """Execute a planned course with its watches, and once more with other grasps if its own does not hold the target.

    Returns the course executed last. Raises Ended if it cannot be completed; the outcome is that of the first grasp if
    nothing can be planned with another one.
    """
    before = list(execution.watches)
    execution.watches = [*before, *course.watches(world)]
    try:
        course.execute(execution)
    except GraspFailed as end:
        again = _plan_retry(course, world, execution, with_same=isinstance(end, TurnedInHand))
        if again is None:
            raise
    else:
        return course
    execution.watches = [*before, *again.watches(world)]
    again.execute(execution)
    return again


def _plan_retry(course: Course, world: RobotWorld, execution: Execution, *, with_same: bool) -> Course | None:
    """Bring the open hand home and plan from the current poses with the untried grasps; None if there is no plan.

    ``with_same``: if there is no plan with those, all grasps are tried.
    """
    start, facts = course.start, course.facts
    if facts.grasp is None or not isinstance(start.planner, PickPlacePlanner):
        return None
    planner, settings, missed = (
        single_arm_planner(start.planner).with_opening_of(facts.grasp),
        start.settings,
        facts.grasp.grasp_id,
    )
    execution.meant = NONE_MEANT
    execution.open_hand()
    away = plan_withdrawal(
        planner.parts, start.problem, execution.target_to_world(), execution.commanded_rad, blind=False
    )
    if away is not None:
        execution.follow(away)
    execution.wait_for_rest(round(settings.max_rest_s / settings.timestep_s))
    objects = tuple(
        replace(placed, object_to_world=world.object_to_world(number)) for number, placed in enumerate(world.placed)
    )
    others = tuple(each for each in start.problem.grasps if each.grasp_id != missed)
    problem = replace(
        problem_of(start.problem, objects, world.target, others),
        goal_object_to_world=start.problem.goal_object_to_world,
    )
    home = planner.plan_return_home(problem, execution.commanded_rad)
    if home is None:
        return None
    execution.follow(home)
    for grasps in (others, start.problem.grasps) if with_same else (others,):
        again = create_course(replace(start, problem=replace(problem, grasps=grasps), objects=objects), facts)
        if again.plan():
            facts.replans[ANOTHER_GRASP] += 1
            return again
    return None
