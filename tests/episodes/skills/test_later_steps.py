"""Goals of several literals: what is taken for a second time goes where the first literal stays true."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from placing_skills import GRASPS, around, placed

from manitwin.episodes.goals.evaluation import evaluate
from manitwin.episodes.goals.goal import Goal
from manitwin.episodes.goals.world_state import WorldState
from manitwin.episodes.sequence import GoalStep, goal_of_later_step
from manitwin.episodes.skills.registry import SKILLS
from manitwin.episodes.skills.skill import SkillGoal, Surroundings, state_at_rest


def room(*moved: tuple[float, float]) -> Surroundings:
    """A dice, a box on the right and a can on the left of where the dice may go."""
    x_m, y_m = moved[0] if moved else (0.4, -0.3)
    return around(placed(0, "dice", x_m, y_m), placed(1, "box", 0.5, -0.1), placed(2, "can", 0.5, 0.2))


def step(skill: str, target: str, partner: str) -> GoalStep:
    """A step with its goal as set beforehand, without poses."""
    objects = {each.name: each for each in room().objects}
    goal = SKILLS[skill].goal(objects[target], objects[partner])
    return GoalStep(SKILLS[skill], target, partner, (GRASPS["dice"],), SkillGoal(goal, (), partner, {}))


def test_a_second_place_keeps_the_first_literal_true() -> None:
    here = room((0.5, 0.03))  # it has been put left of the box
    first, second = step("left_of", "object_00", "object_01"), step("near", "object_00", "object_02")
    both = Goal(tuple(each.goal.goal.literals[0] for each in (first, second)))

    def kept(steps: list[GoalStep], seed: int) -> list[bool]:
        found = goal_of_later_step(steps, 1, here, seed)
        return [] if found is None else [evaluate(_moved(here, pose), both).reached for pose in found.poses]

    of_another = step("near", "object_01", "object_02")
    assert not all(each for seed in range(3) for each in kept([of_another, second], seed))
    together = [each for seed in range(3) for each in kept([first, second], seed)]
    assert len(together) >= 3 and all(together)


def test_where_both_cannot_be_there_is_no_goal() -> None:
    first, second = step("right_of", "object_00", "object_01"), step("left_of", "object_00", "object_02")
    assert goal_of_later_step([first, second], 1, room((0.5, -0.22)), 1) is None


def _moved(here: Surroundings, pose: np.ndarray) -> WorldState:
    first, *others = here.objects
    return state_at_rest(replace(here, objects=(replace(first, object_to_world=pose), *others)))
