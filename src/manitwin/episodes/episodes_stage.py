"""Stage that makes a batch: sets up, plans and executes its episodes, and writes the results."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.config import Resource
from manitwin.engine.stage import Draft, report_progress
from manitwin.episodes.attempt_row import attempt_row
from manitwin.episodes.attempts import ATTEMPTS, Attempt, write_attempts
from manitwin.episodes.batch import Batch
from manitwin.episodes.carry_tilt import carry_tilts_rad
from manitwin.episodes.episode import run_episode
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.fixtures import to_json
from manitwin.episodes.goals.goal_instructions import goal_instructions
from manitwin.episodes.hdf5_file import write_episodes
from manitwin.episodes.instructions import episode_instructions
from manitwin.episodes.pick_place_tasks import Placeable
from manitwin.episodes.planning.level_space import must_stay_level
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import PickPlaceProblem
from manitwin.episodes.planning.two_arms import planner_of
from manitwin.episodes.room_for_hand import feasible_start_placements, placement_with_room
from manitwin.episodes.sealing_surface import with_surface
from manitwin.episodes.setting import Setting, scene_setting, table_setting
from manitwin.episodes.settings import TrajectoriesConfig
from manitwin.episodes.skills.registry import load_skill
from manitwin.episodes.skills.skill import Skill
from manitwin.episodes.stored_episode import RecordedObject, StoredEpisode, recorded_robot
from manitwin.episodes.target_grasps import TargetGrasp, shuffled, usable_grasps
from manitwin.episodes.tasks.task_files import read_tasks
from manitwin.episodes.tasks.task_record import TaskRecord
from manitwin.episodes.tasks.task_setting import TaskSetting, task_setting
from manitwin.errors import UsageError
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.load import load_robot
from manitwin.robots.robot import Robot
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose, cached_pool
from manitwin.scenes.loaded_scene import Scene, furniture_boxes
from manitwin.scenes.scene_files import scene_name
from manitwin.twin.loaded_twin import Twin, TwinSource

EPISODES = "episodes.h5"
KEPT_TWINS = 256


class EpisodesStage:
    """Makes the episodes of a batch; each has its own generator, seeded by the run's seed and the episode's number."""

    name = "episodes"
    version = "19"
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = (EPISODES, ATTEMPTS, "batch")
    needs: Resource = "cpu"
    backend = "sapien"

    def __init__(self, settings: TrajectoriesConfig, dataset: str, scenes: str | None, tasks: str | None = None):
        """Take the configuration, and the locations of twins, scenes and tasks."""
        self.settings, self.dataset, self.scenes, self.tasks = settings, dataset, scenes, tasks
        self._placeable = lru_cache(KEPT_TWINS)(self._read_placeable)
        self._twin = lru_cache(KEPT_TWINS)(self._read_twin)
        self._grasps = lru_cache(KEPT_TWINS)(self._read_grasps)

    @property
    def model(self) -> str:
        """Name and shortened digest of the robot."""
        return f"{self._robot.name}:{self._robot.sha256[:12]}"

    @cached_property
    def _robot(self) -> Robot:
        return load_robot(self.settings.robot)

    @cached_property
    def _planner(self) -> PickPlacePlanner:
        return planner_of(self._robot, self.settings.episode.timestep_s)

    @cached_property
    def _source(self) -> TwinSource:
        return TwinSource(self.dataset)

    @property
    def _pool(self) -> Pool:
        return cached_pool(self.dataset)

    def _read_placeable(self, twin_id: str) -> Placeable:
        twin, gripper = self._pool.twin(twin_id), self._robot.gripper
        if not isinstance(gripper, MultiFingerGripper):
            return Placeable.in_likeliest_placement(self._pool, twin)
        grasps = [each.grasp for each in self._grasps(twin_id).values()]
        placement = placement_with_room(twin.poses, grasps, gripper)
        return (
            Placeable.in_likeliest_placement(self._pool, twin)
            if placement is None
            else Placeable.in_placement(self._pool, twin, placement)
        )

    def _read_twin(self, twin_id: str) -> Twin:
        return self._source.twin(twin_id)

    def _read_grasps(self, twin_id: str) -> dict[str, TargetGrasp]:
        return {each.grasp.grasp_id: each for each in usable_grasps(self._twin(twin_id), self._robot.gripper)}

    def run(self, draft: Draft[Batch], folder: Path) -> dict[str, Any]:
        """Make the batch."""
        batch = draft.payload
        attempts: list[Attempt] = []
        twins: dict[str, str] = {}
        write_episodes(folder / EPISODES, self._episodes(draft, batch, attempts, twins))
        write_attempts(folder / ATTEMPTS, attempts)
        counts = {
            "attempted": len(attempts),
            "planned": sum(attempt.planned for attempt in attempts),
            "succeeded": sum(attempt.succeeded for attempt in attempts),
            "kept": sum(attempt.outcome == "kept" for attempt in attempts),
        }
        return {"batch": {"twins": dict(sorted(twins.items())), **counts}}

    def _episodes(
        self, draft: Draft[Batch], batch: Batch, attempts: list[Attempt], twins: dict[str, str]
    ) -> Iterator[StoredEpisode]:
        """Yield the kept episodes, one at a time; append all attempts to ``attempts``."""
        for number in batch.numbers:
            words = np.random.SeedSequence([draft.seed, number]).generate_state(2)
            seed, task = int(words[0]), self._task_setting(batch, int(words[0]))
            if batch.task_id is not None:
                setting = None if task is None else task.as_setting
            else:
                setting = self._setting(batch, np.random.default_rng(words))
            stored = self._attempt(batch, number, seed, setting, task)
            attempts.append(stored.attempt if isinstance(stored, StoredEpisode) else stored)
            report_progress(len(attempts), batch.count, "episodes")
            if setting is not None:
                twins.update({o.twin_id: self._twin(o.twin_id).record.revision for o in setting.task.objects})
            if isinstance(stored, StoredEpisode):
                yield stored

    @cached_property
    def _tasks(self) -> dict[str, TaskRecord]:
        return {} if self.tasks is None else {task.task_id: task for task in read_tasks(self.tasks)}

    def _task_setting(self, batch: Batch, seed: int) -> TaskSetting | None:
        """Set up a batch's task; None if it has none or the robot cannot start it."""
        if batch.task_id is None:
            return None
        if batch.task_id not in self._tasks:
            raise UsageError(
                f"{self.tasks}: no task {batch.task_id} there any more; make the episodes in another folder"
            )
        assert self.scenes is not None
        return task_setting(
            self._tasks[batch.task_id], self.scenes, self.dataset, self._pool, self._robot,
            lambda twin_id: tuple(self._grasps(twin_id).values()), seed=seed,
        )  # fmt: skip

    def _setting(self, batch: Batch, rng: np.random.Generator) -> Setting | None:
        workspace, skill = self._robot.workspace, load_skill(self.settings.skill)
        if batch.twin_id is not None:
            target = self._pool.twin(batch.twin_id)
            return table_setting(
                skill,
                target,
                self._pool,
                self._placeable_of,
                self.settings.others,
                workspace,
                rng,
                self.start_placements,
            )
        assert batch.scene_id is not None and self.scenes is not None
        scene = Scene.read(Path(self.scenes) / scene_name(batch.scene_id), self.dataset)
        return scene_setting(skill, scene, lambda: self._pool, self._is_graspable, workspace, rng)

    def _placeable_of(self, twin: PoolTwin) -> Placeable:
        return self._placeable(twin.twin_id)

    def start_placements(self, skill: Skill, target: PoolTwin) -> Sequence[StandingPose]:
        """Return the placements in which a target may start: if the goal is a placement, those from which a grasp leads there."""
        return feasible_start_placements(
            skill,
            target,
            self._pool.body(target.twin_id).body,
            lambda: [each.grasp for each in self._grasps(target.twin_id).values()],
            self._robot.gripper,
        )

    def has_grasps(self, twin_id: str) -> bool:
        """Tell whether a twin has a verified grasp usable by the robot's hand."""
        return bool(self._grasps(twin_id))

    def _is_graspable(self, twin_id: str) -> bool:
        return self._twin(twin_id).record.grasps is not None

    def _attempt(
        self, batch: Batch, number: int, seed: int, setting: Setting | None, task_set: TaskSetting | None
    ) -> Attempt | StoredEpisode:
        skill = self._skill_of(batch)
        episode_id = f"{batch.batch_id}-{number:08d}"
        if setting is None:
            return attempt_row(
                episode_id,
                self._robot,
                skill,
                batch.twin_id or "",
                "",
                batch.scene_id,
                seed,
                0,
                EpisodeFacts("no_room"),
                task_id=batch.task_id,
            )
        task = setting.task
        target = task.objects[task.target]
        twin = self._twin(target.twin_id)
        assert twin.record.language is not None
        grasps = self._grasps(target.twin_id)
        problem = PickPlaceProblem(
            target=with_surface(target, twin, self._robot.gripper),
            goal_object_to_world=task.goal_object_to_world,
            grasps=tuple(each.grasp for each in shuffled(grasps.values(), np.random.default_rng([seed, 1]))),
            obstacles=tuple(each for place, each in enumerate(task.objects) if place != task.target),
            static_boxes=tuple(furniture_boxes(setting.furniture)),
            seed=seed,
            fixtures=tuple(box for fixture in setting.fixtures for box in fixture.boxes),
            level=frozenset(
                each.name for each in task.objects if must_stay_level(each, self._pool.body(each.twin_id).opening)
            ),
        )
        facts, recording = run_episode(
            problem, self._planner, self._robot, self.settings.episode, setting.skill_goal,
            None if task_set is None else task_set.multi_step_sequence,
        )  # fmt: skip
        spoken = self._instructions(setting, seed) if task_set is None else task_set.task.instructions
        attempt = attempt_row(
            episode_id, self._robot, skill, target.twin_id, twin.record.language.category, setting.scene_id, seed,
            len(problem.obstacles), facts, grasps.get(facts.grasp.grasp_id) if facts.grasp else None, spoken,
            batch.task_id,
        )  # fmt: skip
        if attempt.outcome != "kept" or recording is None:
            return attempt
        objects = tuple(RecordedObject(each.name, each.twin_id) for each in sorted(task.objects, key=lambda o: o.name))
        said = {
            "goal_object_to_world": task.goal_object_to_world.tolist(),
            "furniture": setting.furniture.model_dump(mode="json"),
            "ambient": list(setting.ambient),
            "lights": [light.model_dump(mode="json") for light in setting.lights],
            "twin_revision": twin.record.revision,
        }
        if task_set is not None:
            said["task"] = {"task_id": task_set.task.task_id, "goal": task_set.task.goal}
        if setting.fixtures:
            said["fixtures"] = [to_json(fixture) for fixture in setting.fixtures]
        if setting.skill_goal is not None and setting.skill_goal.granules is not None:
            said["granule_radius_m"] = setting.skill_goal.granules.radius_m
        if tilts := carry_tilts_rad(recording, task.objects, problem.level):
            said["carry_tilt_rad"] = tilts
        if facts.taker_grasp is not None:
            said["taker_grasp_id"] = facts.taker_grasp.grasp_id
        if facts.events:
            said["events"] = [asdict(event) for event in facts.events]
        return StoredEpisode(attempt, recording, recorded_robot(self._robot), objects, said)

    def _skill_of(self, batch: Batch) -> str:
        """Return the skill's name, for a task those of its steps: ``place_in+near``."""
        if batch.task_id is None:
            return self.settings.skill
        return "+".join(step.skill for step in self._tasks[batch.task_id].steps)

    def _instructions(self, setting: Setting, seed: int) -> tuple[str, ...]:
        task = setting.task
        target = task.objects[task.target]
        if setting.skill_goal is not None:
            words = {each.name: self._language(each.twin_id) for each in task.objects}
            return goal_instructions(setting.skill_goal.goal.literals[0], words, seed=seed)
        return episode_instructions(
            self._language(target.twin_id),
            *task.start_and_goal_m,
            seed=seed,
            others=[self._language(each.twin_id) for place, each in enumerate(task.objects) if place != task.target],
        )

    def _language(self, twin_id: str) -> Any:
        return self._twin(twin_id).record.language
