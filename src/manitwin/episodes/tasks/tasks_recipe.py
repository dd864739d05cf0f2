"""Recipe of tasks: from a scene to its tasks and the counts of its candidates."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property, lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.config import Resource
from manitwin.engine.folder_recipe import FolderRecipe, FolderRecord
from manitwin.engine.recipe import Ending, Identity
from manitwin.engine.stage import Draft, Stage, report_progress
from manitwin.engine.stage_runner import StageCost
from manitwin.engine.task import Payload
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.two_arms import planner_of
from manitwin.episodes.settings import TasksConfig
from manitwin.episodes.target_grasps import TargetGrasp, usable_grasps
from manitwin.episodes.tasks.candidates import Candidate
from manitwin.episodes.tasks.difficulty import difficulty_of
from manitwin.episodes.tasks.feasibility_check import PlannedTask
from manitwin.episodes.tasks.proposals import propose
from manitwin.episodes.tasks.task_files import TASKS, tasks_bytes
from manitwin.episodes.tasks.task_instructions import task_instructions
from manitwin.episodes.tasks.task_record import TaskRecord, TaskStep, kind_of, task_id_of
from manitwin.episodes.tasks.task_sampling import CandidateCounts, sample_tasks
from manitwin.episodes.tasks.task_scene import TaskScene
from manitwin.errors import Rejected, UsageError
from manitwin.models.vlm.chat_from_spec import chat_of
from manitwin.robots.load import load_robot
from manitwin.robots.robot import Robot
from manitwin.scenes.layouts.pool import cached_pool
from manitwin.scenes.loaded_scene import Scene
from manitwin.scenes.scene_files import scene_bytes, scene_name
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.store import canonical_json, sha256_of_json, write_bytes_atomically

SCENE_TASKS = "scene_tasks"
COUNTS = "candidates.json"
KEPT_TWINS = 256


@dataclass(frozen=True)
class TaskedScene(Payload):
    """A scene in which tasks are sampled."""

    scene_id: str

    @property
    def title(self) -> str:
        """Display title."""
        return f"tasks of {self.scene_id}"


class SceneTasksRecord(FolderRecord):
    """``scene_tasks.json``: the number of tasks of a scene."""

    schema_version: int
    scene_id: str
    tasks: int


class TasksStage:
    """Stage that samples the tasks of a scene."""

    name = "tasks"
    version = "11"
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = (TASKS, COUNTS)
    needs: Resource = "cpu"
    backend = "planner"
    model: str | None = None

    def __init__(self, settings: TasksConfig, dataset: str, scenes: str):
        """Take the configuration, and the locations of twins and scenes."""
        self.settings, self._dataset, self._scenes = settings, dataset, scenes
        self._grasps = lru_cache(KEPT_TWINS)(self._read_grasps)

    @cached_property
    def _robot(self) -> Robot:
        return load_robot(self.settings.robot)

    @cached_property
    def _planner(self) -> PickPlacePlanner:
        return planner_of(self._robot, self.settings.episode.timestep_s)

    @cached_property
    def _source(self) -> TwinSource:
        return TwinSource(self._dataset)

    def _read_grasps(self, twin_id: str) -> tuple[TargetGrasp, ...]:
        return usable_grasps(self._source.twin(twin_id), self._robot.gripper)

    def run(self, draft: Draft[TaskedScene], folder: Path) -> dict[str, Any]:
        """Write the scene's tasks, and the counts of its candidates."""
        loaded = Scene.read(Path(self._scenes) / scene_name(draft.payload.scene_id), self._dataset)
        scene = TaskScene(loaded, cached_pool(self._dataset), self._robot, self._grasps)
        key = [draft.seed, int(sha256(draft.payload.scene_id.encode()).hexdigest()[:8], 16)]
        proposed, thrown = self._proposed(scene)
        drawn, tally = sample_tasks(
            scene, self._planner, self.settings, np.random.default_rng(key), proposed,
            lambda found: report_progress(found, self.settings.per_scene, "tasks"),
        )  # fmt: skip
        tally.dropped.update(thrown)
        digest = sha256(scene_bytes(loaded.record)).hexdigest()
        tasks = [record for each in drawn if (record := self._record(scene, digest, *each, tally)) is not None]
        (folder / TASKS).write_bytes(tasks_bytes(tasks))
        (folder / COUNTS).write_text(canonical_json(tally.to_json()))
        return {}

    def _proposed(self, scene: TaskScene) -> tuple[list[Candidate], dict[str, int]]:
        chat = chat_of(self.settings.vlm, "propose tasks")
        return ([], {}) if chat is None else propose(scene, chat, self.settings.proposals)

    def _record(
        self,
        scene: TaskScene,
        scene_sha256: str,
        planned: PlannedTask,
        seed: int,
        proposed: bool,
        tally: CandidateCounts,
    ) -> TaskRecord | None:
        steps = tuple(
            TaskStep(skill=each.skill.name, target=each.target, partner=each.partner) for each in planned.sequence.steps
        )
        try:
            told, held_out = task_instructions(planned.goal, scene.words, seed=seed % (1 << 31))
        except UsageError:  # a predicate without templates
            tally.dropped["no_words"] += 1
            return None
        return TaskRecord(
            schema_version=1,
            task_id=task_id_of(scene_sha256, self.settings.robot, seed, steps, planned.goal),
            scene_id=scene.scene.record.scene_id,
            scene_sha256=scene_sha256,
            robot=self.settings.robot,
            seed=seed,
            kind=kind_of(planned.goal),
            source="proposed" if proposed else "enumerated",
            objects={each.name: each.twin_id for each in scene.objects},
            steps=steps,
            goal=planned.goal.to_json(),
            instructions=told,
            held_out=held_out,
            difficulty=difficulty_of(scene, planned),
        )


@dataclass(frozen=True)
class TasksRecipe(FolderRecipe[SceneTasksRecord]):
    """Tasks of scenes; ``dataset`` and ``scenes`` are the locations of twins and scenes."""

    payload = TaskedScene
    record = "scene_tasks.json"
    record_type = SceneTasksRecord
    can_reject = False
    replaces = False

    config: TasksConfig
    dataset: str
    scenes: str

    @cached_property
    def sha256(self) -> str:
        """Digest of everything that determines a task except scenes and twins."""
        decides = self.config.model_dump(mode="json", exclude={"run"})
        decides["robot"] = load_robot(self.config.robot).sha256
        return sha256_of_json([decides, TasksStage.version])

    @property
    def seed(self) -> int:
        """The seed of all random draws."""
        return self.config.seed

    def folder_of(self, item_id: str) -> str:
        """Return the folder of a scene's tasks."""
        return f"{SCENE_TASKS}/{scene_name(item_id).partition('/')[2]}"

    def identify(self, payload: TaskedScene) -> Identity:
        """Return the scene's identity."""
        return Identity(payload.scene_id, "scene")

    def stages(self, kind: str) -> list[Stage]:
        """Return the single stage."""
        return [TasksStage(self.config, self.dataset, self.scenes)]

    def write(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> SceneTasksRecord:
        """Write the folder of a scene's tasks."""
        content = draft.path(TASKS).read_bytes()
        counts = draft.path(COUNTS).read_bytes()
        write_bytes_atomically(fresh / TASKS, content)
        write_bytes_atomically(fresh / COUNTS, counts)
        said = {"schema_version": 1, "scene_id": draft.item_id, "tasks": content.count(b"\n")}
        return self.write_record(fresh, said, decided_by=[content.decode(), json.loads(counts)])

    def ending(self, record: SceneTasksRecord) -> Ending:
        """Return the ending stated by a scene's record."""
        return Ending("accepted", record.revision, None, f"{record.tasks} tasks")
