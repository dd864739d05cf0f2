"""Jobs and replies exchanged between driver and workers. They carry ids, names and short texts, never meshes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from manitwin.config import Resource
from manitwin.engine.recipe import Ending, Recipe
from manitwin.engine.stage import StagePart
from manitwin.engine.stage_runner import StageCost, StageKey, StageRun
from manitwin.engine.task import Task
from manitwin.errors import Rejected, encodable

FailureKind = Literal[
    "unavailable", "rate_limited", "denied", "unsupported", "no_space", "changed", "error", "died", "timeout"
]
MAKE_ROOM = "free disk space, then rerun the command to resume"
"""The remedy for a full disk, appended to the message."""


@dataclass(frozen=True)
class WorkerSetup:
    """Settings sent to every worker of a run; ``cache`` is the folder for local copies if the root is a URL.

    ``memory_gb`` is the memory limit of a worker process (0: no limit, as in the process that drives the run).
    """

    root_url: str
    recipe: Recipe
    cache: Path
    keep_work: bool
    memory_gb: float = 0.0


@dataclass(frozen=True)
class Survey:
    """Job: find the id of a task's result, and which stages and finished folder already exist."""

    task: Task
    needs: Resource = "cpu"


@dataclass(frozen=True)
class SurveyReply:
    """The reply to ``Survey``: how the existing finished folder ended, or the stages that need not run again."""

    item_id: str
    kind: str
    ending: Ending | None = None
    done: tuple[tuple[str, StageRun], ...] = ()
    rejected: StageRejected | None = None


@dataclass(frozen=True)
class RunStage:
    """Job: run the stage at a position of an item's plan, given the results of the stages before it."""

    task: Task
    kind: str
    position: int
    stage: str
    needs: Resource
    done: tuple[StageKey, ...]


@dataclass(frozen=True)
class StageRejected:
    """A stage rejected the item, at a cost. ``rehearsed``: the answer came from a rehearsal server."""

    answer: Rejected
    cost: StageCost
    charged_usd: float = 0.0
    rehearsed: bool = False


@dataclass(frozen=True)
class Finish:
    """Job: assemble the finished folder; ``stage`` is the last stage that ran."""

    task: Task
    kind: str
    done: tuple[StageKey, ...]
    stage: str
    rejected: StageRejected | None = None
    needs: Resource = "cpu"


@dataclass(frozen=True)
class WriteTables:
    """Job: add finished folders to the tables, and remove rows of missing folders; without ids, merge the table parts."""

    item_ids: tuple[str, ...]
    needs: Resource = "cpu"


@dataclass(frozen=True)
class Failure:
    """Why a job has no result, in one line, with the native stack if a dead worker left one.

    ``charged_usd`` is what services charged nevertheless; ``trace`` is the traceback of an unexpected error.
    """

    kind: FailureKind
    message: str
    retry_after_s: float | None = None
    charged_usd: float = 0.0
    trace: str = ""

    def __post_init__(self) -> None:
        # messages of other libraries quote file names unencoded
        object.__setattr__(self, "message", encodable(self.message))


Job = Survey | RunStage | Finish | WriteTables
Reply = SurveyReply | StageRun | StageRejected | Ending | Failure | None


class Executor(Protocol):
    """Runs jobs in slots per resource; each submitted job returns exactly once, with a reply or a Failure."""

    def slots(self, needs: Resource) -> int:
        """Return the current number of jobs of a resource that run concurrently; machines may come and go."""
        ...

    def submit(self, ticket: int, job: Job) -> None:
        """Submit a job to a free slot or the short queue before it; ``ended`` identifies it by ``ticket``."""
        ...

    def ended(self, timeout_s: float) -> list[tuple[int, Reply]]:
        """Wait until a job has ended or the timeout has passed; return all ended jobs."""
        ...

    def parts(self) -> dict[int, StagePart]:
        """Return the progress of running stages by ticket, if they report it and it is time to poll."""
        ...

    def close(self) -> None:
        """Stop; running jobs are aborted."""
        ...
