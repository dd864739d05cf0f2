"""The state of one item on its way through the stages, as the driver keeps it."""

from __future__ import annotations

from dataclasses import dataclass, field

from manitwin.config import Resource
from manitwin.engine.jobs import Finish, Job, RunStage, StageRejected, Survey
from manitwin.engine.stage import ASSEMBLE, INPUT, PaidStage, Stage
from manitwin.engine.stage_runner import StageKey
from manitwin.engine.task import Task


@dataclass(frozen=True)
class PlannedStage:
    """A stage as the driver sees it: its resource, and the approximate charge by services."""

    name: str
    needs: Resource
    expected_usd: float

    @classmethod
    def of(cls, stage: Stage) -> PlannedStage:
        """Return the driver's view of a stage."""
        return cls(stage.name, stage.needs, stage.expected_usd if isinstance(stage, PaidStage) else 0.0)


@dataclass
class Flight:
    """The state of an item in progress; ``plan`` lists its stages once its kind is known.

    ``attempts`` counts the attempts at unfinished stages, including those of earlier runs.
    """

    task: Task
    attempts: dict[str, int] = field(default_factory=dict)
    kind: str = ""
    plan: list[PlannedStage] | None = None
    done: list[StageKey] = field(default_factory=list)
    rejected: StageRejected | None = None
    last: str = INPUT

    @property
    def number(self) -> int:
        """The item's number in the ledger."""
        return self.task.number

    @property
    def stage(self) -> str:
        """The next stage."""
        if self.plan is None:
            return INPUT
        if self.rejected is not None or len(self.done) == len(self.plan):
            return ASSEMBLE
        return self.plan[len(self.done)].name

    @property
    def needs(self) -> Resource:
        """The resource of the next job."""
        return self.plan[len(self.done)].needs if self.plan is not None and self.stage != ASSEMBLE else "cpu"

    @property
    def expected_usd(self) -> float:
        """The approximate charge by services for the next job, in USD."""
        return self.plan[len(self.done)].expected_usd if self.plan is not None and self.stage != ASSEMBLE else 0.0

    @property
    def priority(self) -> tuple[int, int]:
        """Sort key, smallest first: items with the most completed stages, then the lowest number."""
        return (-1000 if self.stage == ASSEMBLE else -len(self.done), self.number)

    def attempt(self, stage: str) -> int:
        """Return the number of the next attempt at a stage, starting from 1."""
        return self.attempts.get(stage, 0) + 1

    def job(self) -> Job:
        """Return the next job."""
        stage = self.stage
        if stage == INPUT:
            return Survey(self.task)
        if stage == ASSEMBLE:
            return Finish(self.task, self.kind, tuple(self.done), self.last, self.rejected)
        return RunStage(self.task, self.kind, len(self.done), stage, self.needs, tuple(self.done))
