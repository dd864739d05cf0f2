"""Task record: a goal in a scene, the skills that reach it, and its instructions; one line of ``tasks.jsonl``."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator

from manitwin.episodes.goals.goal import Goal
from manitwin.errors import ManiTwinError
from manitwin.twin.store import sha256_of_json

TASK_SCHEMA_VERSION = 1
MOST_LITERALS = 8

_Name = Annotated[str, StringConstraints(pattern=r"^[0-9A-Za-z_][0-9A-Za-z_. -]{0,199}$")]
_Words = Annotated[str, StringConstraints(min_length=1, max_length=500)]


class _StrictModel(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class TaskStep(_StrictModel):
    """The skill for one literal, with its target and optional partner."""

    skill: _Name
    target: _Name
    partner: _Name | None = None


class TaskDifficulty(_StrictModel):
    """Difficulty of a task: ``score`` is the sum of the other fields, whose counts docs/tasks.md defines."""

    score: int = Field(ge=1)
    literals: int = Field(ge=1, le=MOST_LITERALS)
    functional_frames: int = Field(ge=0)
    close_neighbours: int = Field(ge=0)
    tight_fits: int = Field(ge=0)
    hard_to_plan: int = Field(ge=0)


class TaskRecord(_StrictModel):
    """A task in a scene; its ``steps`` achieve the ``goal``'s literals in order.

    ``scene_sha256`` is the digest of the scene's file, ``seed`` determines the poses of fixtures and placements. ``held_out``
    are instructions from templates that no ``instructions`` use. ``source``: enumerated, or proposed by a model.
    """

    schema_version: Literal[1]
    task_id: _Name
    scene_id: _Name
    scene_sha256: Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")]
    robot: str = Field(min_length=1, max_length=4096)
    seed: int = Field(ge=0, lt=1 << 63)
    kind: str = Field(min_length=1, max_length=400)
    source: Literal["enumerated", "proposed"]
    objects: dict[_Name, _Name]
    steps: tuple[TaskStep, ...] = Field(min_length=1, max_length=MOST_LITERALS)
    goal: dict[str, Any]
    instructions: tuple[_Words, ...] = Field(min_length=1, max_length=100)
    held_out: tuple[_Words, ...] = Field(min_length=1, max_length=100)
    difficulty: TaskDifficulty

    @model_validator(mode="after")
    def _fits_together(self) -> TaskRecord:
        try:
            goal = self.parsed_goal
        except ManiTwinError as error:
            raise ValueError(str(error)) from error
        if len(goal.literals) != len(self.steps):
            raise ValueError(f"{len(goal.literals)} literals but {len(self.steps)} steps; each literal needs one step")
        for step, literal in zip(self.steps, goal.literals, strict=True):
            if literal.subject != step.target:
                raise ValueError(f"{literal} is not about {step.target}, which its step takes")
            for name in (step.target, step.partner):
                if name is not None and name not in self.objects:
                    raise ValueError(f"no object {name!r}; there are: {', '.join(sorted(self.objects))}")
        if self.kind != kind_of(goal):
            raise ValueError(f"the kind {self.kind!r} is not {kind_of(goal)!r}, that of its goal")
        return self

    @property
    def parsed_goal(self) -> Goal:
        """The goal; raises UsageError if it is invalid."""
        return Goal.from_json(self.goal)


def kind_of(goal: Goal) -> str:
    """Return the kind of a goal: its sorted predicates, such as ``in+near``."""
    return "+".join(sorted(literal.predicate for literal in goal.literals))


def task_id_of(scene_sha256: str, robot: str, seed: int, steps: tuple[TaskStep, ...], goal: Goal) -> str:
    """Return an id derived from the content of a task."""
    said = [scene_sha256, robot, seed, [step.model_dump(mode="json") for step in steps], goal.to_json()]
    return sha256_of_json(said)[:16]
