"""Task generation for many scenes: the engine's run, then one balanced task file and a report of the rejections."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from math import floor
from pathlib import Path
from typing import Any, Unpack

from manitwin.engine.drive import RunOptions, RunReport, drive
from manitwin.engine.ledger.location import CONFIG
from manitwin.episodes.episodes_source import EpisodesSource
from manitwin.episodes.settings import TasksConfig
from manitwin.episodes.tasks.bddl import write_bddl
from manitwin.episodes.tasks.task_files import TASKS, read_tasks, write_tasks
from manitwin.episodes.tasks.task_record import TaskRecord
from manitwin.episodes.tasks.tasks_recipe import COUNTS, SCENE_TASKS, TaskedScene, TasksRecipe
from manitwin.errors import UsageError
from manitwin.formats.json_file import read_json_object
from manitwin.models.vlm.chat_from_spec import chat_of
from manitwin.robots.load import load_robot
from manitwin.scenes.run_settings import check_settings
from manitwin.scenes.scene_files import read_scene, scene_ids, scene_name
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import canonical_json, write_bytes_atomically

KIND = "tasks"
REPORT = "tasks_report.json"
DECIDE_NO_TASK = frozenset(("dataset", "scenes", "run"))
LEAST_OF_TWO = 0.2  # least share of tasks with two literals or more


@dataclass(frozen=True)
class TaskTotals:
    """Totals over all scenes; ``dropped`` counts rejections by reason, including tasks removed to balance the kinds."""

    scenes: int
    tasks: int
    kinds: dict[str, int]
    of_two_literals: int
    candidates: int
    candidates_of_two_literals: int
    checked: int
    plannable: int
    dropped: dict[str, int]
    by_kind: dict[str, dict[str, int]] = field(default_factory=dict)


def make_tasks(
    scenes: str | Path,
    out: str | Path,
    config: TasksConfig,
    *,
    twins: str | Path | None = None,
    **run: Unpack[RunOptions],
) -> tuple[RunReport, TaskTotals | None]:
    """Sample tasks in all scenes of a folder, and write ``tasks.jsonl`` and ``tasks_report.json``.

    Scenes that already have tasks are skipped. The totals are None if the run has not finished. Raises UsageError for a
    location without scenes, scenes whose twins have changed or have grasps of a different gripper with the robot's gripper
    name, an unknown robot or model, an ``out`` with tasks of other settings, and an ``out`` with another run in progress.
    """
    robot = load_robot(config.robot)
    chat_of(config.vlm, "propose tasks")
    source, root = EpisodesSource.detect(scenes, twins), DatasetRoot(out)
    if source.scenes is None:
        raise UsageError(f"{scenes}: no scenes; `manitwin layout DATASET -o SCENES` makes some")
    source.check_grippers(robot)
    configuration = {"kind": KIND, "dataset": source.dataset, "scenes": source.scenes, **config.model_dump(mode="json")}
    check_settings(root, configuration, free=DECIDE_NO_TASK, made="scenes' tasks")
    recipe = TasksRecipe(config, source.dataset, source.scenes)
    ids = scene_ids(Path(source.scenes))
    report = drive(
        recipe, map(TaskedScene, ids), root, config.run, configuration=configuration, **run,
    )  # fmt: skip
    report.remarks.extend(source.remarks)
    if report.exit_code == 4:
        return report, None
    return report, collect_tasks(Path(out), config)


def collect_tasks(out: Path, config: TasksConfig) -> TaskTotals:
    """Write all scenes' tasks into one file, and the report; return the totals."""
    folders = sorted(path.parent for path in (out / SCENE_TASKS).glob(f"*/*/{TASKS}"))
    everything = [task for folder in folders for task in read_tasks(folder)]
    kept, dropped = balanced_tasks(everything, config.most_of_kind, config.two_literal_share)
    totals = _totals(folders, kept, dropped)
    write_tasks(out / TASKS, kept)
    write_bytes_atomically(out / REPORT, canonical_json(asdict(totals)).encode())
    return totals


def balanced_tasks(
    tasks: Sequence[TaskRecord], most_of_kind: float, two_literal_share: float
) -> tuple[list[TaskRecord], Counter[str]]:
    """Remove tasks, last ones first, until no kind is too frequent and two-literal tasks are not too rare; return the rest."""
    kept, dropped = list(tasks), Counter[str]()
    while True:
        kinds = Counter(task.kind for task in kept)
        (kind, most) = max(kinds.items(), key=lambda item: (item[1], item[0]), default=("", 0))
        two = sum(len(task.steps) > 1 for task in kept)
        least = min(LEAST_OF_TWO, two_literal_share)
        if most > max(1, floor(most_of_kind * len(kept))) and len(kinds) > 1 / most_of_kind:
            dropped["too_many_of_kind"] += 1
        elif 0 < two < least * len(kept):
            single = Counter(task.kind for task in kept if len(task.steps) == 1)
            kind = max(single.items(), key=lambda item: (item[1], item[0]))[0]
            dropped["too_few_of_two_literals"] += 1
        else:
            return kept, dropped
        del kept[max(place for place, task in enumerate(kept) if task.kind == kind)]


def _totals(folders: Sequence[Path], kept: Sequence[TaskRecord], dropped: Counter[str]) -> TaskTotals:
    counts: dict[str, Counter[str]] = {name: Counter() for name in ("candidates", "checked", "plannable", "dropped")}
    for folder in folders:
        said: dict[str, Any] = read_json_object(folder / COUNTS, UsageError, inside=folder, name=str(folder / COUNTS))
        for name, counter in counts.items():
            counter.update(said.get(name, {}))
    counts["dropped"].update(dropped)
    kinds = Counter(task.kind for task in kept)
    singles = {kind: count for kind, count in counts["candidates"].items() if "+" not in kind}
    by_kind = {
        kind: {name: counts[name][kind] for name in ("candidates", "checked", "plannable")} | {"tasks": kinds[kind]}
        for kind in sorted(counts["candidates"])
        if "+" not in kind or counts["checked"][kind]
    }
    return TaskTotals(
        scenes=len(folders),
        tasks=len(kept),
        kinds=dict(sorted(kinds.items(), key=lambda item: (-item[1], item[0]))),
        of_two_literals=sum(len(task.steps) > 1 for task in kept),
        candidates=sum(singles.values()),
        candidates_of_two_literals=counts["candidates"].total() - sum(singles.values()),
        checked=counts["checked"].total(),
        plannable=counts["plannable"].total(),
        dropped=dict(sorted(counts["dropped"].items(), key=lambda item: (-item[1], item[0]))),
        by_kind=by_kind,
    )


def export_bddl(out: Path) -> tuple[int, int]:
    """Write the tasks of a folder as BDDL to its ``bddl/``; return the numbers of written and inexpressible tasks."""
    said = read_json_object(out / CONFIG, UsageError, inside=out, name=str(out / CONFIG))
    tasks = read_tasks(out)
    scenes = {each: read_scene(Path(said["scenes"]) / scene_name(each)) for each in {task.scene_id for task in tasks}}
    return write_bddl(tasks, scenes, out / "bddl")
