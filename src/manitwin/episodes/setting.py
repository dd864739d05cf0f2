"""Initial setting of an episode: objects on furniture, the target, and the goal; sampled on a table or chosen in a scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.episodes.fixtures import Fixture
from manitwin.episodes.goals.goal_instructions import is_fixture_unambiguous
from manitwin.episodes.pick_place_tasks import (
    PickPlaceTask,
    Placeable,
    PlacingArea,
    free_goal,
    sample_objects,
    sample_task,
)
from manitwin.episodes.skills.skill import Skill, SkillGoal, Surroundings
from manitwin.robots.robot import Workspace
from manitwin.scenes.layouts.placing import in_workspace
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose
from manitwin.scenes.layouts.surroundings import make_furniture, make_lights
from manitwin.scenes.loaded_scene import Scene, furniture_boxes
from manitwin.scenes.scene import Furniture, Light

# for a target that is to move away from its partner, a fifth of the starts are close enough
PARTNERS_TRIED, STARTS_TRIED = 40, 24
Begins = Callable[[Skill, PoolTwin], Sequence[StandingPose]]


@dataclass(frozen=True)
class Setting:
    """An episode before planning: the task on its furniture, its scene, and a skill's goal, if any."""

    task: PickPlaceTask
    furniture: Furniture
    ambient: tuple[float, float, float]
    lights: tuple[Light, ...]
    scene_id: str | None = None
    skill_goal: SkillGoal | None = None

    @property
    def fixtures(self) -> tuple[Fixture, ...]:
        """The skill's fixtures."""
        return () if self.skill_goal is None else self.skill_goal.fixtures


def table_setting(
    skill: Skill | None,
    target: PoolTwin,
    pool: Pool,
    placeable: Callable[[PoolTwin], Placeable],
    others: int,
    workspace: Workspace,
    rng: np.random.Generator,
    begins: Begins = lambda skill, target: skill.begins_in(target),
) -> Setting | None:
    """Sample a table with a target, the skill's partner, and ``others`` further objects; None without room or partner.

    ``begins`` returns the placements in which the target may start with a skill.
    """

    def other() -> Placeable:
        while True:
            twin = pool.twins[int(rng.integers(len(pool.twins)))]
            if twin.twin_id != target.twin_id or len(pool.twins) == 1:
                return placeable(twin)

    furniture, (ambient, lights) = make_furniture("table", rng), make_lights(rng)
    area = PlacingArea(workspace, furniture.supports[0])
    if skill is None:
        task = sample_task(placeable(target), other, others, area, rng)
        return None if task is None else Setting(task, furniture, ambient, lights)
    for _ in range(STARTS_TRIED):
        taking_part = _taking_part(skill, target, pool, placeable, begins(skill, target), rng)
        objects = None if taking_part is None else sample_objects(taking_part, other, others, area, rng)
        if objects is None:
            return None
        around = Surroundings(objects, pool, area, tuple(furniture_boxes(furniture)))
        if not _tells_fixture(skill, around, 0):
            continue
        found = skill.sample_goal(around, 0, 1 if skill.has_partner else None, rng)
        if found is not None:
            return Setting(PickPlaceTask(objects, 0, found.poses[0]), furniture, ambient, lights, None, found)
    return None


def scene_setting(
    skill: Skill | None,
    scene: Scene,
    pool: Callable[[], Pool],
    graspable: Callable[[str], bool],
    workspace: Workspace,
    rng: np.random.Generator,
) -> Setting | None:
    """Choose a reachable target, the skill's partner and a goal in a scene; None if there is none.

    ``pool`` is only called for a skill; it contains all twins, not only the scene's.
    """
    objects, record = tuple(scene.placed_objects()), scene.record
    supporting = {each.supported_by for each in record.objects}
    able = [
        number
        for number, each in enumerate(objects)
        if each.name not in supporting
        and in_workspace(each.center_of_mass_m[None, :2], workspace)[0]
        and graspable(each.twin_id)
    ]
    supports = {support.name: support for support in record.furniture.supports}
    boxes = tuple(furniture_boxes(record.furniture))
    for target in map(int, rng.permutation(able)):
        area = PlacingArea(workspace, supports[record.objects[target].surface])
        if skill is None:
            goal = free_goal(objects, target, area, rng)
            if goal is not None:
                task = PickPlaceTask(objects, target, goal)
                return Setting(task, record.furniture, record.ambient, record.lights, scene.record.scene_id)
            continue
        around = Surroundings(objects, pool(), area, boxes)
        if not _tells_fixture(skill, around, target):
            continue
        for partner in _partners(skill, around, target, rng):
            found = skill.sample_goal(around, target, partner, rng)
            if found is not None:
                task = PickPlaceTask(objects, target, found.poses[0])
                return Setting(task, record.furniture, record.ambient, record.lights, scene.record.scene_id, found)
    return None


def _taking_part(
    skill: Skill,
    target: PoolTwin,
    pool: Pool,
    placeable: Callable[[PoolTwin], Placeable],
    begins: Sequence[StandingPose],
    rng: np.random.Generator,
) -> list[Placeable] | None:
    if not begins or (not skill.has_partner and not skill.suits(pool, target, None)):
        return None
    first = Placeable.in_placement(pool, target, begins[int(rng.integers(len(begins)))])
    if not skill.has_partner:
        return [first]
    for number in rng.permutation(len(pool.twins))[:PARTNERS_TRIED]:
        partner = pool.twins[int(number)]
        if partner.twin_id != target.twin_id and skill.suits(pool, target, partner):
            return [first, placeable(partner)]
    return None


def _tells_fixture(skill: Skill, around: Surroundings, target: int) -> bool:
    others = (around.twin(number).category for number in range(len(around.objects)) if number != target)
    return is_fixture_unambiguous(skill.predicate, others)


def _partners(skill: Skill, around: Surroundings, target: int, rng: np.random.Generator) -> Sequence[int | None]:
    twins = [around.twin(number) for number in range(len(around.objects))]
    if not skill.has_partner:
        return [None] if skill.suits(around.pool, twins[target], None) else []
    return [
        int(number)
        for number in rng.permutation(len(twins))
        if number != target and skill.suits(around.pool, twins[target], twins[int(number)])
    ]
