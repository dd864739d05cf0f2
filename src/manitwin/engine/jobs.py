"""Jobs of workers and their results: ids, names and short texts, never meshes."""

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
"""The remedy where a disk is full, behind what says so."""


@dataclass(frozen=True)
class WorkerSetup:
    """Settings sent to every worker of a run: the data set, the recipe, and a folder for copies where the root is a URL.

    ``memory_gb`` is how much memory a worker process may take (0: no limit, as in the process that drives the run).
    """

    root_url: str
    recipe: Recipe
    cache: Path
    keep_work: bool
    memory_gb: float = 0.0


@dataclass(frozen=True)
class Survey:
    """Find the id of what a task makes, and what of it is there already."""

    task: Task
    needs: Resource = "cpu"


@dataclass(frozen=True)
class Surveyed:
    """The state of an item: the finished folder's ending, or the stages that need not run again."""

    item_id: str
    kind: str
    ending: Ending | None = None
    done: tuple[tuple[str, StageRun], ...] = ()
    rejected: StageRejected | None = None


@dataclass(frozen=True)
class RunStage:
    """Run the stage at a position of an item's list, given the results of those before it."""

    task: Task
    kind: str
    position: int
    stage: str
    needs: Resource
    done: tuple[StageKey, ...]


@dataclass(frozen=True)
class StageRejected:
    """A stage's answer that nothing is to be made of the item; it cost as well. ``rehearsed``: a rehearsal server's answer."""

    answer: Rejected
    cost: StageCost
    charged_usd: float = 0.0
    rehearsed: bool = False


@dataclass(frozen=True)
class Finish:
    """Put the finished folder together; ``stage`` is the last one that ran."""

    task: Task
    kind: str
    done: tuple[StageKey, ...]
    stage: str
    rejected: StageRejected | None = None
    needs: Resource = "cpu"


@dataclass(frozen=True)
class WriteTables:
    """Add finished folders to the tables, and take out those that are gone; with no ids, merge what was added in parts."""

    item_ids: tuple[str, ...]
    needs: Resource = "cpu"


@dataclass(frozen=True)
class Failure:
    """The reason why a job has no answer, in one line, with the native stack where a worker died and left one.

    ``charged_usd`` is what services charged all the same; ``trace`` is the traceback of an error that nobody expected.
    """

    kind: FailureKind
    message: str
    retry_after_s: float | None = None
    charged_usd: float = 0.0
    trace: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "message", encodable(self.message))  # other libraries quote names of files as they are


Job = Survey | RunStage | Finish | WriteTables
Reply = Surveyed | StageRun | StageRejected | Ending | Failure | None


class Executor(Protocol):
    """Slots for each resource; a job that is submitted comes back exactly once, with an answer or a Failure."""

    def slots(self, needs: Resource) -> int:
        """Return how many jobs of a resource run at a time, now: machines may come and go."""
        ...

    def submit(self, ticket: int, job: Job) -> None:
        """Give a job to a free slot, or to the short queue before it; ``ticket`` names it in ``ended``."""
        ...

    def ended(self, timeout_s: float) -> list[tuple[int, Reply]]:
        """Wait until a job has ended, or the time is up; returns all that have ended."""
        ...

    def parts(self) -> dict[int, StagePart]:
        """Return how much the stages that run have done, by ticket, where they say so and it is time to look."""
        ...

    def close(self) -> None:
        """Stop: jobs that run are cut off."""
        ...
