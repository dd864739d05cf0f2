"""The protocol of a stage, and the handle that it works on: what the stages before it have made of an item.

Artifacts have names. A bare word (``physical``) is a field: JSON. A name with a suffix (``solid.npz``) is a file, one that
ends in ``/`` (``views/``) a folder. Each is written by exactly one stage and read by those that declare it; a name in
``reads`` that ends in ``?`` is read where it is there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from dataclasses import field as dataclass_field
from pathlib import Path
from typing import Any, Generic, Protocol, runtime_checkable

from pydantic import BaseModel

from manitwin.config import Resource
from manitwin.engine.job_memory import JobMemory, NoMemory
from manitwin.engine.task import PayloadT
from manitwin.errors import ManiTwinError

INPUT, ASSEMBLE = "input", "assemble"
"""The two steps around the stages: to read what was given, and to put the folder together."""


def is_field(name: str) -> bool:
    """Tell a field (JSON) from a file or folder artifact by its name."""
    return not name.endswith("/") and "." not in name


@dataclass
class Draft(Generic[PayloadT]):
    """An item in the making: fields and paths with their digests, by artifact name. Cheap to send to another process.

    ``payload`` is what its task asks for.

    ``jobs`` remembers what was asked of services that are paid by the job. ``rehearsed`` are the stages, among those whose
    results are here and those that these were made of, whose backend was a rehearsal server (``manitwin fake``).
    ``amendments`` is what people have put right, by stage; a stage that runs has its own alone.
    """

    item_id: str
    payload: PayloadT
    seed: int
    fields: dict[str, Any] = dataclass_field(default_factory=dict)
    paths: dict[str, Path] = dataclass_field(default_factory=dict)
    digests: dict[str, str] = dataclass_field(default_factory=dict)
    jobs: JobMemory = dataclass_field(default_factory=NoMemory)
    rehearsed: set[str] = dataclass_field(default_factory=set)
    amendments: dict[str, dict[str, Any]] = dataclass_field(default_factory=dict)

    def names(self) -> set[str]:
        """Return the names of all artifacts that are there."""
        return self.fields.keys() | self.paths.keys()

    def field(self, name: str) -> Any:
        """Return the JSON value of a field artifact; raises ManiTwinError where no stage has written it."""
        if name not in self.fields:
            raise ManiTwinError(
                f"no stage has written field {name!r}; there are: {', '.join(sorted(self.fields)) or 'none'}"
            )
        return self.fields[name]

    def path(self, name: str) -> Path:
        """Return the path of a file or folder artifact; raises ManiTwinError where no stage has written it."""
        if name not in self.paths:
            raise ManiTwinError(f"no stage has written {name!r}; there are: {', '.join(sorted(self.paths)) or 'none'}")
        return self.paths[name]


@runtime_checkable
class Stage(Protocol):
    """One step of the paper.

    ``run`` writes its files below ``folder`` under their artifact names, and returns its fields. It may raise ``Rejected``.
    It is a pure function of what it ``reads``, ``settings``, ``backend``, ``model``, ``draft.payload`` and ``draft.seed``.
    """

    @property
    def name(self) -> str:
        """The stage's name, and that of its folder."""
        ...

    @property
    def version(self) -> str:
        """Raised whenever the same inputs give another result."""
        ...

    @property
    def reads(self) -> tuple[str, ...]:
        """The artifacts that decide its result."""
        ...

    @property
    def writes(self) -> tuple[str, ...]:
        """The artifacts that it makes."""
        ...

    @property
    def needs(self) -> Resource:
        """The resource that it runs on."""
        ...

    @property
    def settings(self) -> BaseModel:
        """The stage's own slice of the configuration."""
        ...

    @property
    def backend(self) -> str:
        """The backend that does the work."""
        ...

    @property
    def model(self) -> str | None:
        """The model, gripper or weights that the backend uses."""
        ...

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Do the stage's work for an item: write its files into ``folder`` and return its fields, those that ``writes`` names.

        Raises Rejected where nothing can be made of the item, and a BackendError where a backend cannot work now.
        """
        ...


@runtime_checkable
class PaidStage(Protocol):
    """A stage that services charge for."""

    @property
    def expected_usd(self) -> float:
        """About what services charge for the stage of one item, USD."""
        ...


@dataclass(frozen=True)
class StagePart:
    """A stage has done ``done`` of ``total`` things, which ``unit`` names in the plural."""

    done: int
    total: int
    unit: str


_hear: ContextVar[Callable[[StagePart], None] | None] = ContextVar("hear_stage_parts", default=None)


def tell_part(done: int, total: int, unit: str) -> None:
    """Say how much of the stage that runs here is done; cheap where nobody listens."""
    hear = _hear.get()
    if hear is not None:
        hear(StagePart(done, total, unit))


@contextmanager
def heard_by(hear: Callable[[StagePart], None]) -> Iterator[None]:
    """Have the stages that run in the ``with`` statement heard."""
    token = _hear.set(hear)
    try:
        yield
    finally:
        _hear.reset(token)
