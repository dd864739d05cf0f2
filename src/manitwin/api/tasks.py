"""Find tasks in scenes, and make Gymnasium environments from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from manitwin.api.settings import settings_of

if TYPE_CHECKING:
    from manitwin.engine.drive import RunOptions, RunReport
    from manitwin.episodes.environment.environment import TaskEnvironment
    from manitwin.episodes.environment.start_noise import StartNoise
    from manitwin.episodes.settings import TasksConfig
    from manitwin.episodes.tasks.tasks_run import TaskTotals


@dataclass(frozen=True)
class TasksReport:
    """The result of ``make_tasks``; ``totals`` is None if the run has not finished.

    ``bddl`` is the number of tasks written as BDDL and the number that BDDL cannot express; None if BDDL was not requested.
    """

    run: RunReport
    totals: TaskTotals | None = None
    bddl: tuple[int, int] | None = None


def make_tasks(
    scenes: str | Path,
    out: str | Path,
    *,
    config: TasksConfig | str | Path | None = None,
    twins: str | Path | None = None,
    bddl: bool = False,
    jobs: int | None = None,
    **run: Unpack[RunOptions],
) -> TasksReport:
    """Find tasks in the scenes of a folder, check each by motion planning, and write ``tasks.jsonl`` with language instructions.

    ``twins``: the current location of the scenes' twins. ``bddl``: also write the tasks that BDDL can express. Raises
    UsageError for a folder without scenes, an unknown robot, an ``out`` that was made with other settings, or if another run is
    writing there.
    """
    from manitwin.episodes.settings import TasksConfig
    from manitwin.episodes.tasks.tasks_run import export_bddl
    from manitwin.episodes.tasks.tasks_run import make_tasks as make

    ended, totals = make(scenes, out, settings_of(TasksConfig, config, jobs), twins=twins, **run)
    return TasksReport(ended, totals, export_bddl(Path(out)) if bddl and totals is not None else None)


def make_env(
    tasks: str | Path,
    task_id: str | None = None,
    *,
    twins: str | Path | None = None,
    robot: str | None = None,
    cameras: Sequence[str] = (),
    picture_px: int = 128,
    max_steps: int = 1200,
    rate_hz: int = 20,
    start_noise: StartNoise | None = None,
) -> TaskEnvironment:
    """Return the Gymnasium environment of one task; ``task_id`` may be omitted if ``tasks`` contains a single task.

    ``tasks`` is a file or folder of tasks. Observations are states, plus images of ``cameras``; docs/policies.md describes the
    observation and action spaces. ``twins``: the current location of the twins. ``rate_hz``: actions per second, 20, 10 or 5;
    use the rate of the data that the policy was trained on. An episode is truncated after ``max_steps`` steps. With
    ``start_noise``, the seed of ``reset`` also perturbs the initial state. Raises UsageError for an unknown task or camera,
    another rate, or a scene that differs from the one that the task was made for.
    """
    from manitwin.episodes.environment.environment_factory import make_env as make

    return make(
        tasks,
        task_id,
        twins=twins,
        robot=robot,
        cameras=cameras,
        picture_px=picture_px,
        max_steps=max_steps,
        rate_hz=rate_hz,
        start_noise=start_noise,
    )
