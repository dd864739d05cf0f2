"""Scene view for tasks: graspable objects, surroundings of each object, names and grasps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manitwin.episodes.goals.world_state import ObjectState, WorldState
from manitwin.episodes.pick_place_tasks import PlacingArea
from manitwin.episodes.planning.problem import Grasp, PickPlaceProblem
from manitwin.episodes.sealing_surface import with_surface
from manitwin.episodes.sequence import GoalStep
from manitwin.episodes.skills.skill import Skill, SkillGoal, Surroundings, openings_of
from manitwin.episodes.target_grasps import TargetGrasp, shuffled
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.robots.robot import Robot
from manitwin.scenes.layouts.placing import in_workspace
from manitwin.scenes.layouts.pool import Pool
from manitwin.scenes.loaded_scene import Scene, furniture_boxes
from manitwin.twin.record import Language


@dataclass(frozen=True)
class TaskScene:
    """A scene in front of a robot; ``grasps`` returns a twin's grasps usable by the robot's gripper, by twin id."""

    scene: Scene
    pool: Pool
    robot: Robot
    grasps: Callable[[str], Sequence[TargetGrasp]]

    @cached_property
    def objects(self) -> tuple[PlacedObject, ...]:
        """The objects sorted by name, as in an episode's world, with their sealing surface if the gripper is a suction cup."""
        placed = sorted(self.scene.placed_objects(), key=lambda each: each.name)
        return tuple(with_surface(each, self.scene.twin(each.twin_id), self.robot.gripper) for each in placed)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The objects' names."""
        return tuple(each.name for each in self.objects)

    @cached_property
    def words(self) -> dict[str, Language]:
        """The language records of the objects, by name; missing for undescribed twins."""
        said = {each.name: self.scene.twin(each.twin_id).record.language for each in self.objects}
        return {name: language for name, language in said.items() if language is not None}

    @cached_property
    def problem(self) -> PickPlaceProblem:
        """A problem with everything at its pose; the target is the first object and its goal its current pose."""
        first, *others = self.objects
        boxes = tuple(furniture_boxes(self.scene.record.furniture))
        return PickPlaceProblem(first, first.object_to_world, (), tuple(others), boxes)

    @cached_property
    def state(self) -> WorldState:
        """The initial world state, as far as poses determine it."""
        return self.state_of([each.object_to_world for each in self.objects])

    def state_of(self, object_to_world: Sequence[np.ndarray]) -> WorldState:
        """Return the world state with the objects at the given poses ``(4, 4)``, at rest and without contacts."""
        objects = {
            each.name: ObjectState(each.body, pose, each.object_to_world, True, self.pool.body(each.twin_id).opening)
            for each, pose in zip(self.objects, object_to_world, strict=True)
        }
        return WorldState(objects, frozenset())

    def grasp_rejection(self, number: int) -> str | None:
        """Return why an object cannot be grasped: ``carries_another``, ``out_of_reach`` or ``no_grasp``; None if it can."""
        placed = self.objects[number]
        if placed.name in {each.supported_by for each in self.scene.record.objects}:
            return "carries_another"
        if not in_workspace(placed.center_of_mass_m[None, :2], self.robot.workspace)[0]:
            return "out_of_reach"
        return None if self.grasps(placed.twin_id) else "no_grasp"

    def surroundings(self, number: int) -> Surroundings:
        """Return the surroundings for moving one object, which stays on its support surface."""
        record = self.scene.record
        surface = next(each.surface for each in record.objects if each.name == self.names[number])
        support = next(each for each in record.furniture.supports if each.name == surface)
        return Surroundings(
            self.objects,
            self.pool,
            PlacingArea(self.robot.workspace, support),
            tuple(furniture_boxes(record.furniture)),
        )

    def grasps_of(self, number: int, seed: int) -> tuple[Grasp, ...]:
        """Return an object's grasps in the order in which they are tried."""
        found = self.grasps(self.objects[number].twin_id)
        return tuple(each.grasp for each in shuffled(found, np.random.default_rng([seed, 1])))

    def goal_before_execution(
        self, skill: Skill, target: int, partner: int | None, seed: int, number: int
    ) -> SkillGoal | None:
        """Return a skill's goal before anything has moved; for a later step without poses, which are sampled when it starts.

        ``number`` is the number of the step. None if there is no goal or no room for its fixtures.
        """
        around, rng = self.surroundings(target), np.random.default_rng((seed, 2, number))
        if number == 0 or type(skill).sample_goal is not Skill.sample_goal:
            return skill.sample_goal(around, target, partner, rng)
        second = None if partner is None else self.objects[partner]
        numbers = (target, *([] if partner is None else [partner]))
        goal = skill.goal(self.objects[target], second)
        return SkillGoal(goal, (), None if second is None else second.name, openings_of(around, numbers))

    def step(self, skill: Skill, target: int, partner: int | None, seed: int, number: int) -> GoalStep | None:
        """Return a step with its goal before execution; None if there is none."""
        goal = self.goal_before_execution(skill, target, partner, seed, number)
        if goal is None:
            return None
        second = None if partner is None else self.names[partner]
        return GoalStep(skill, self.names[target], second, self.grasps_of(target, seed), goal)
