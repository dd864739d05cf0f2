"""Find tasks in scenes, and make environments of them."""

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
    """The outcome of ``make_tasks``; ``totals`` are None where the run has not ended.

    ``bddl`` has how many tasks were written as BDDL and how many could not be, None where that was not asked for.
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
    """Find tasks in the scenes of a folder, check each by planning, and write ``tasks.jsonl`` with instructions.

    ``twins``: where the twins of the scenes are now. ``bddl`` also writes what BDDL can say. Raises UsageError for a place
    without scenes, an unknown robot, an ``out`` made with other settings, or where another run is at work there.
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
    """Return the Gymnasium environment of a task of a file or folder of tasks; the only one needs no ``task_id``.

    Observations are states, with pictures of ``cameras`` besides; docs/policies.md says what is in them and what an action is.
    ``twins``: where the twins are now. There are ``rate_hz`` actions a second, 20, 10 or 5: as many as in the data that a policy
    learned from. An episode is cut off after ``max_steps`` steps. With ``start_noise`` the seeds of ``reset`` draw other starts.
    Raises UsageError for an unknown task or camera, another rate, and a scene that is another one than the task's.
    """
    from manitwin.episodes.environment.make import make_env as make

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
