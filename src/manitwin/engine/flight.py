"""One item on its way through the stages, as the driver sees it."""

from __future__ import annotations

from dataclasses import dataclass, field

from manitwin.config import Resource
from manitwin.engine.jobs import Finish, Job, RunStage, StageRejected, Survey
from manitwin.engine.stage import ASSEMBLE, INPUT, PaidStage, Stage
from manitwin.engine.stage_runner import StageKey
from manitwin.engine.task import Task


@dataclass(frozen=True)
class PlannedStage:
    """A stage as the driver sees it: what it runs on, and about what services will charge for it."""

    name: str
    needs: Resource
    expected_usd: float

    @classmethod
    def of(cls, stage: Stage) -> PlannedStage:
        """Return what the driver has to know of a stage."""
        return cls(stage.name, stage.needs, stage.expected_usd if isinstance(stage, PaidStage) else 0.0)


@dataclass
class Flight:
    """The state of an item under way; ``plan`` names its stages and what each needs, once its kind is known.

    ``attempts`` counts how often stages that are not done were tried, in earlier runs as well.
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
        """The stage that comes next."""
        if self.plan is None:
            return INPUT
        if self.rejected is not None or len(self.done) == len(self.plan):
            return ASSEMBLE
        return self.plan[len(self.done)].name

    @property
    def needs(self) -> Resource:
        """The resource that the next job runs on."""
        return self.plan[len(self.done)].needs if self.plan is not None and self.stage != ASSEMBLE else "cpu"

    @property
    def expected_usd(self) -> float:
        """About what services will charge for the next job."""
        return self.plan[len(self.done)].expected_usd if self.plan is not None and self.stage != ASSEMBLE else 0.0

    @property
    def priority(self) -> tuple[int, int]:
        """Smaller goes first: items that are nearly there, then those that came first."""
        return (-1000 if self.stage == ASSEMBLE else -len(self.done), self.number)

    def attempt(self, stage: str) -> int:
        """Return which attempt at a stage the next one is, from 1."""
        return self.attempts.get(stage, 0) + 1

    def job(self) -> Job:
        """Return the next job."""
        stage = self.stage
        if stage == INPUT:
            return Survey(self.task)
        if stage == ASSEMBLE:
            return Finish(self.task, self.kind, tuple(self.done), self.last, self.rejected)
        return RunStage(self.task, self.kind, len(self.done), stage, self.needs, tuple(self.done))
