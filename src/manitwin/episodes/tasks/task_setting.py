"""Setting of an episode for a task: scene, steps with their goals, and the combined goal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path

from manitwin.episodes.pick_place_tasks import PickPlaceTask
from manitwin.episodes.planning.problem import PickPlaceProblem
from manitwin.episodes.sequence import GoalSequence
from manitwin.episodes.setting import Setting
from manitwin.episodes.skills.registry import load_skill
from manitwin.episodes.skills.skill import SkillGoal
from manitwin.episodes.target_grasps import TargetGrasp
from manitwin.episodes.tasks.candidates import SkillAction
from manitwin.episodes.tasks.feasibility_check import InfeasibleTask, sequence_of
from manitwin.episodes.tasks.task_record import TaskRecord
from manitwin.episodes.tasks.task_scene import TaskScene
from manitwin.errors import UsageError
from manitwin.robots.robot import Robot
from manitwin.scenes.layouts.pool import Pool
from manitwin.scenes.loaded_scene import Scene
from manitwin.scenes.scene_files import read_scene, scene_bytes, scene_name
from manitwin.twin.loaded_twin import TwinSource

Grasps = Callable[[str], Sequence[TargetGrasp]]


@dataclass(frozen=True)
class TaskSetting:
    """A task ready for execution; the fixtures and granules of its ``goal`` belong to the world of ``problem``."""

    task: TaskRecord
    scene: TaskScene
    problem: PickPlaceProblem
    goal: SkillGoal
    sequence: GoalSequence

    @property
    def multi_step_sequence(self) -> GoalSequence | None:
        """The sequence, or None if it has a single step."""
        return self.sequence if len(self.sequence.steps) > 1 else None

    @property
    def as_setting(self) -> Setting:
        """The setting of an episode."""
        target, record = self.scene.names.index(self.task.steps[0].target), self.scene.scene.record
        moved = PickPlaceTask(self.scene.objects, target, self.problem.goal_object_to_world)
        return Setting(moved, record.furniture, record.ambient, record.lights, record.scene_id, self.goal)


def task_setting(
    task: TaskRecord, scenes: str | Path, dataset: str | Path, pool: Pool, robot: Robot, grasps: Grasps, *, seed: int
) -> TaskSetting | None:
    """Set up a task; None if the robot cannot start it. ``seed`` is that of planning.

    Raises UsageError for a missing scene, a scene other than the one the task was made for, and an unknown skill.
    """
    path = Path(scenes) / scene_name(task.scene_id)
    record = read_scene(path)
    if sha256(scene_bytes(record)).hexdigest() != task.scene_sha256:
        raise UsageError(f"{path}: not the scene that task {task.task_id} was made for; make the tasks again")
    scene = TaskScene(Scene(record, TwinSource(dataset)), pool, robot, grasps)
    try:
        sequence = sequence_of(scene, [_action(scene, task, number) for number in range(len(task.steps))], task.seed)
    except InfeasibleTask:
        return None
    goal = replace(sequence.goal, goal=task.parsed_goal)
    first = sequence.steps[0]
    problem = replace(
        scene.problem,
        target=scene.objects[scene.names.index(first.target)],
        goal_object_to_world=first.goal.poses[0],
        grasps=first.grasps,
        obstacles=tuple(each for each in scene.objects if each.name != first.target),
        fixtures=tuple(box for fixture in goal.fixtures for box in fixture.boxes),
        seed=seed,
    )
    return TaskSetting(task, scene, problem, goal, sequence)


def _action(scene: TaskScene, task: TaskRecord, number: int) -> SkillAction:
    step = task.steps[number]
    skill = load_skill(step.skill)
    if skill is None:
        raise UsageError(f"task {task.task_id}: {step.skill} has no goal in words; make the tasks again")
    target = scene.names.index(step.target)
    partner = None if step.partner is None else scene.names.index(step.partner)
    second = None if partner is None else scene.objects[partner]
    return SkillAction(skill.name, target, partner, skill.goal(scene.objects[target], second))
