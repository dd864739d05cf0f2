"""The way of one input through all stages in this process."""

from __future__ import annotations

import fcntl
import shutil
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from manitwin.config import BuildConfig
from manitwin.engine.events import OnStage, StageEnded, StageStarted, StageState
from manitwin.engine.job_memory import RootJobMemory
from manitwin.engine.recipe import Ending, Identity
from manitwin.engine.stage import Draft
from manitwin.engine.stage_order import INPUT
from manitwin.engine.stage_runner import JOBS, StageCost, lost_usd, run_stage
from manitwin.engine.task import Task
from manitwin.engine.worker import NO_SPACE
from manitwin.errors import AccessDenied, ManiTwinError, RateLimited, Rejected, Unavailable
from manitwin.pipeline.item import Item
from manitwin.pipeline.recipe import TwinRecipe, expected_usd
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import RECORD, WORK, replace_folder

REPORT = "error.txt"
Status = Literal["accepted", "rejected", "unfinished"]


@dataclass(frozen=True)
class ItemResult:
    """What became of one item: its folder where it has one, one line that says why, and the code of a rejection.

    ``error`` is the class of the error of this package that left it unfinished.
    """

    item: Item
    twin_id: str
    status: Status
    detail: str
    folder: Path | None
    reused: bool = False
    reason: str | None = None
    error: str | None = None


def build_item(
    item: Item,
    out: Path,
    config: BuildConfig,
    on_stage: OnStage = lambda event: None,
    may_spend: Callable[[float], None] = lambda usd: None,
) -> ItemResult:
    """Take one item through all stages; never raises for what the item or a backend does.

    ``may_spend`` hears what services will about charge, and raises BackendError where that is too much.
    A rejection is a result. A backend that fails, or a defect, leaves the item unfinished: what its stages have done stays in
    ``.work`` and is taken up by the next run.
    """
    recipe = TwinRecipe(config)
    identity = recipe.identify(item)
    place = out / identity.item_id
    done = recipe.ending_of((place / RECORD).read_bytes()) if (place / RECORD).is_file() else None
    if done is not None:
        return ItemResult(item, identity.item_id, done.status, _line(done), place, reused=True, reason=done.reason)
    work = out / WORK / identity.item_id
    work.mkdir(parents=True, exist_ok=True)
    try:
        may_spend(expected_usd(recipe.stages(identity.kind)))
        with _only_one(work):
            ending = _build(item, identity, recipe, work, on_stage)
            replace_folder(_fresh(work), place)
    except ManiTwinError as error:
        return ItemResult(item, identity.item_id, "unfinished", str(error), None, error=type(error).__name__)
    except BlockingIOError as error:
        return ItemResult(item, identity.item_id, "unfinished", str(error), None)
    except Exception as error:
        report = work / REPORT
        report.write_text(traceback.format_exc())
        detail = f"a defect in manitwin: {type(error).__name__}: {error}; the traceback is in {report}"
        return ItemResult(item, identity.item_id, "unfinished", " ".join(detail.split()), None)
    return ItemResult(item, identity.item_id, ending.status, _line(ending), place, reason=ending.reason)


@contextmanager
def _only_one(work: Path) -> Iterator[None]:
    """Hold a lock that ends with the process, so that two runs do not build one twin at a time."""
    with (work / "lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise BlockingIOError(f"another run is building {work.name} now; wait for it, then run again") from error
        for stale in work.glob("*/.*"):  # a stage that was cut off in the middle
            shutil.rmtree(stale, ignore_errors=True)
        (work / REPORT).unlink(missing_ok=True)
        yield


def _build(item: Item, identity: Identity, recipe: TwinRecipe, work: Path, on_stage: OnStage) -> Ending:
    task = Task(0, item, identity.item_id)
    draft = Draft(identity.item_id, item, recipe.seed, jobs=RootJobMemory(DatasetRoot(work), JOBS))
    costs: dict[str, StageCost] = {}
    rejected, last = identity.rejected, INPUT
    for stage in recipe.stages(identity.kind) if rejected is None else []:
        on_stage(StageStarted(task, stage.name))
        last, started, cpu_started = stage.name, time.perf_counter(), time.process_time()
        try:
            ran = run_stage(stage, draft, work)
        except Rejected as answer:
            rejected = answer
            seconds = time.perf_counter() - started
            costs[last] = StageCost(seconds, time.process_time() - cpu_started, lost_usd(work / last))
            on_stage(StageEnded(task, last, "rejected", seconds, str(answer)))
            break
        except Exception as error:
            on_stage(_failed(task, last, time.perf_counter() - started, error))
            raise
        costs[last] = ran.cost
        seconds = 0.0 if ran.reused else ran.cost.seconds
        how: StageState = "there already" if ran.reused else "done"
        on_stage(StageEnded(task, last, how, seconds))
    return recipe.finish(draft, identity.kind, costs, rejected, last, _fresh(work))


def _failed(task: Task[Item], stage: str, seconds: float, error: Exception) -> StageEnded:
    """Return that a stage failed, or waits where a service or room on the disk is missing: the item is not to blame."""
    missing = isinstance(error, Unavailable | RateLimited | AccessDenied) or getattr(error, "errno", None) in NO_SPACE
    detail = " ".join(f"{type(error).__name__}: {error}".split())
    trace = "" if isinstance(error, ManiTwinError) else traceback.format_exc()
    return StageEnded(task, stage, "waiting" if missing else "failed", seconds, detail, trace)


def _fresh(work: Path) -> Path:
    return work.with_name(f"{work.name}.finished")


def _line(ending: Ending) -> str:
    return f"{ending.reason}: {ending.detail_and_hint}" if ending.reason else ending.detail_and_hint
