"""Generation of many episodes: the recipe of batches, the engine's run, and the retirement of failing grasps."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Unpack

from manitwin.config import LARGEST_COUNT
from manitwin.engine.drive import RunOptions, RunReport, drive
from manitwin.engine.folder_recipe import FolderRecipe
from manitwin.engine.ledger.integrity import ledger_damaged_error
from manitwin.engine.ledger.location import CONFIG, local_ledger
from manitwin.engine.ledger.reading import read_ledger
from manitwin.engine.recipe import Ending, Identity
from manitwin.engine.stage import Draft, Stage
from manitwin.engine.stage_runner import StageCost
from manitwin.episodes.attempts import ATTEMPTS, read_attempts
from manitwin.episodes.batch import BATCH_RECORD, BATCH_SCHEMA_VERSION, Batch, BatchRecord, batch_name, missing_batches
from manitwin.episodes.configuration import read_configuration
from manitwin.episodes.episodes_source import EpisodesSource
from manitwin.episodes.episodes_stage import EPISODES, EpisodesStage
from manitwin.episodes.retirement import Retirement, find_retirements, retire_grasps
from manitwin.episodes.setting import Begins
from manitwin.episodes.settings import TrajectoriesConfig
from manitwin.episodes.skills.registry import load_skill
from manitwin.episodes.skills.robot_compatibility import check_grasps, check_hand
from manitwin.episodes.skills.skill import Skill
from manitwin.episodes.tasks.task_files import read_tasks
from manitwin.episodes.tasks.task_record import TaskRecord
from manitwin.errors import Rejected, UsageError
from manitwin.formats.json_file import parse_json_object
from manitwin.robots.grippers.twin_grippers import require_same_gripper
from manitwin.robots.load import load_robot
from manitwin.scenes.layouts.pool import Pool, PoolTwin, cached_pool
from manitwin.scenes.run_settings import check_settings
from manitwin.scenes.scene_files import scene_ids
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.store import RUN, canonical_json, digests_below, sha256_of_json, write_bytes_atomically

KIND = "trajectories"
MOST_PAIRED = 200  # largest pool for which pairs of twins are tested for a skill
DECIDE_NO_EPISODE = frozenset(("dataset", "scenes", "tasks", "run", "batch", "retire_failed_share"))


@dataclass(frozen=True)
class EpisodesRecipe(FolderRecipe[BatchRecord]):
    """Batches of episodes; ``dataset``, ``scenes`` and ``tasks`` are their sources (None if unused)."""

    payload = Batch
    record = BATCH_RECORD
    record_type = BatchRecord
    can_reject = False
    replaces = False

    config: TrajectoriesConfig
    dataset: str
    scenes: str | None = None
    tasks: str | None = None

    @cached_property
    def sha256(self) -> str:
        """Digest of everything that determines an episode except the twins, whose revisions are in the batch's record."""
        decides = self.config.model_dump(mode="json", exclude={"run", "batch", "retire_failed_share"})
        decides["robot"] = load_robot(self.config.robot).sha256
        return sha256_of_json([decides, EpisodesStage.version])

    @property
    def seed(self) -> int:
        """The seed of all random draws."""
        return self.config.seed

    def folder_of(self, item_id: str) -> str:
        """Return the batch's folder."""
        return batch_name(item_id)

    def identify(self, payload: Batch) -> Identity:
        """Return the batch's identity."""
        return Identity(payload.batch_id, "batch")

    def stages(self, kind: str) -> list[Stage]:
        """Return the single stage."""
        return [EpisodesStage(self.config, self.dataset, self.scenes, self.tasks)]

    def write(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> BatchRecord:
        """Write the batch's folder."""
        for name in (EPISODES, ATTEMPTS):
            shutil.copyfile(draft.path(name), fresh / name)
        files = digests_below(fresh)
        cost = {"stages": {name: vars(each) for name, each in costs.items()}}
        write_bytes_atomically(fresh / RUN, canonical_json(cost).encode())
        said = {
            "schema_version": BATCH_SCHEMA_VERSION,
            "batch_id": draft.item_id,
            "files": files,
            **draft.field("batch"),
        }
        return self.write_record(fresh, said)

    def ending(self, record: BatchRecord) -> Ending:
        """Return the ending stated by a batch's record."""
        detail = f"{record.kept} of {record.attempted} episodes kept, {record.planned} executed, {record.succeeded} succeeded"
        return Ending("accepted", record.revision, None, detail)


def _check_asked(config: TrajectoriesConfig, source: EpisodesSource) -> None:
    """Raise UsageError for settings that the source determines itself and that would be ignored silently."""
    if source.tasks is not None and config.skill != TrajectoriesConfig.model_fields["skill"].default:
        raise UsageError(
            f"skill is {config.skill}: tasks define their own skill; leave skill out, or give the scenes,"
            f" {source.scenes}"
        )
    if source.scenes is not None and config.others:
        raise UsageError(
            f"others is {config.others}: scenes have their own objects; leave others out, or give the data set,"
            f" {source.dataset}"
        )


def _with_robot_of(tasks: Sequence[TaskRecord], config: TrajectoriesConfig) -> TrajectoriesConfig:
    """Return settings with the robot of the tasks, if no robot is set and all tasks are for the same one."""
    robots = {task.robot for task in tasks}
    if len(robots) != 1 or "robot" in config.model_fields_set:
        return config
    return config.model_copy(update={"robot": robots.pop()})


def _check_out(out: DatasetRoot, source: EpisodesSource) -> None:
    """Raise UsageError if existing episodes in the folder have another kind of source (twins, scenes or tasks)."""
    if not out.exists(CONFIG):
        return
    said = out.read_json(CONFIG, UsageError, remedy="give another folder")
    of = said.get("tasks") or said.get("scenes") or said.get("dataset")
    differs = (said.get("scenes") is None, said.get("tasks")) != (source.scenes is None, source.tasks)
    if "scenes" in said and differs:
        raise UsageError(
            f"{out.url}: its episodes are of {of}; give another folder for those of"
            f" {source.tasks or source.scenes or source.dataset}"
        )


def make_episodes(
    place: str | Path,
    out: str | Path,
    count: int,
    config: TrajectoriesConfig,
    *,
    twins: str | Path | None = None,
    **run: Unpack[RunOptions],
) -> RunReport:
    """Attempt episodes with the twins, scenes or tasks at ``place`` until ``out`` has ``count``; existing ones are kept.

    ``twins`` is the current location of the scenes' twins; None: that recorded with the layouts.

    Raises UsageError for a location without twins or scenes, scenes whose twins have changed, twins without any grasp for the
    robot's hand or with grasps of a different gripper of its name, settings that tasks or scenes determine themselves, an
    unknown robot or skill, and an ``out`` with episodes of another source or other settings or with another run in progress.
    Raises EpisodesError if the episodes in ``out`` were made by an earlier version that recorded less.
    """
    if not 1 <= count <= LARGEST_COUNT:
        raise UsageError(f"{count:.6g} episodes; ask for 1 or more, at most {LARGEST_COUNT}")
    skill = load_skill(config.skill)
    source, root = EpisodesSource.detect(place, twins), DatasetRoot(out)
    _check_asked(config, source)
    tasks = [] if source.tasks is None else read_tasks(source.tasks)
    config = _with_robot_of(tasks, config)
    robot = load_robot(config.robot)
    check_hand(robot, skill)
    source.check_grippers(robot)
    for name in sorted({step.skill for task in tasks for step in task.steps}):
        check_hand(robot, load_skill(name))
    _check_out(root, source)
    configuration = {"kind": KIND, "dataset": source.dataset, "scenes": source.scenes, **config.model_dump(mode="json")}
    if source.tasks is not None:
        configuration["tasks"] = source.tasks
    check_settings(root, configuration, free=DECIDE_NO_EPISODE, made="batches of episodes")
    there = _scheduled_batches(root)
    _check_collectable(Path(out), there)
    try:
        if source.tasks is not None:
            ids = [task.task_id for task in tasks]
            deal = missing_batches(robot.name, count, config.batch, task_ids=ids, there=there)
        elif source.scenes is None:
            stage = EpisodesStage(config, source.dataset, None)
            pool = cached_pool(source.dataset)
            require_same_gripper(robot.gripper, ((twin.twin_id, twin.grippers) for twin in pool.twins), robot.name)
            check_grasps(robot, skill, [twin.twin_id for twin in pool.twins], stage.has_grasps)
            twin_ids = twins_for(skill, pool, stage.start_placements)
            deal = missing_batches(robot.name, count, config.batch, twin_ids=twin_ids, there=there)
        else:
            deal = missing_batches(
                robot.name, count, config.batch, scene_ids=scene_ids(Path(source.scenes)), there=there
            )
    except UsageError as error:
        raise UsageError(f"{root.url}: {error}") from error
    report = drive(
        EpisodesRecipe(config, source.dataset, source.scenes, source.tasks), deal, root, config.run,
        configuration=configuration, **run,
    )  # fmt: skip
    report.remarks.extend(source.remarks)
    before = sum(batch.count for batch in there)
    if before > count:
        report.remarks.append(f"{before} episodes exist already, more than the requested {count}; none was added")
    elif before:
        report.remarks.append(f"{before} of {count} episodes existed already")
    if source.scenes is None and (said := cached_pool(source.dataset).joints_remark):
        report.remarks.append(said)
    return report


def twins_for(skill: Skill | None, pool: Pool, begins: Begins) -> list[str]:
    """Return the ids of the twins for episodes: all, or for a skill those that it suits, with some partner if it needs one.

    They must also have a placement from which the skill's end placement can be reached. Partners and grasps are only tested
    for small pools, because every pair loads the shapes of two twins, and grasps load tables.
    """
    if skill is None or (skill.has_partner and len(pool.twins) > MOST_PAIRED):
        return [twin.twin_id for twin in pool.twins]

    def suits(target: PoolTwin) -> bool:
        partners = [each for each in pool.twins if each is not target] if skill.has_partner else [None]
        return any(skill.suits(pool, target, partner) for partner in partners)

    asks_for_grasps = len(pool.twins) <= MOST_PAIRED
    found = [twin.twin_id for twin in pool.twins if suits(twin) and (not asks_for_grasps or begins(skill, twin))]
    if not found:
        raise UsageError(
            f"none of {len(pool.twins)} twins can be used to {skill.name}; docs/skills.md lists the requirements"
        )
    return found


def _scheduled_batches(root: DatasetRoot) -> list[Batch]:
    """Return the batches scheduled by earlier runs at a root."""
    path = local_ledger(root)
    if not path.is_file():
        return []
    with read_ledger(path) as ledger:
        rows = ledger.execute("SELECT item FROM items WHERE state <> 'duplicate' ORDER BY number")
        return [_batch(text, path) for (text,) in rows]


def _check_collectable(out: Path, there: Sequence[Batch]) -> None:
    """Raise EpisodesError if the first existing batch has a version whose attempts cannot be collected.

    Otherwise this would only be detected after the missing batches have been made.
    """
    tables = (out / batch_name(batch.batch_id) / ATTEMPTS for batch in there)
    first = next((path for path in tables if path.is_file()), None)
    if first is not None:
        next(read_attempts(first), None)


def _batch(text: str, ledger: Path) -> Batch:
    try:
        return Batch.from_json(parse_json_object(text, str(ledger), UsageError))
    except (TypeError, KeyError, AttributeError) as error:
        raise ledger_damaged_error(ledger, error) from error


def retire_failing(out: Path) -> tuple[list[Retirement], int]:
    """Retire the grasps that fail according to a finished run; return them, and the number that was newly retired."""
    said = read_configuration(out)
    found = find_retirements(read_attempts(out / ATTEMPTS), failed_share=said["retire_failed_share"])
    return found, retire_grasps(TwinSource(said["dataset"]), found)
