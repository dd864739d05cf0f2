"""The Stage protocol, and the Draft on which a stage works: an item with the results of its earlier stages.

Artifacts are identified by name. A bare word (``physical``) is a field, a JSON value. A name with a suffix (``solid.npz``) is a
file, and a name that ends in ``/`` (``views/``) a folder. Each artifact is written by exactly one stage and read by the stages
that declare it. A name in ``reads`` that ends in ``?`` is optional.
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
from manitwin.engine.job_memory import JobMemory, NullJobMemory
from manitwin.engine.task import PayloadT
from manitwin.errors import ManiTwinError

INPUT, ASSEMBLE = "input", "assemble"
"""The two steps around the stages: reading the input, and assembling the folder."""


def is_field(name: str) -> bool:
    """Return whether an artifact is a field (JSON) rather than a file or folder, from its name."""
    return not name.endswith("/") and "." not in name


@dataclass
class Draft(Generic[PayloadT]):
    """An item in progress: fields, paths and digests by artifact name. Cheap to send to another process.

    ``payload`` is that of its task. ``jobs`` remembers jobs submitted to services that charge per job. ``rehearsed`` names the
    stages, among those with results here and their predecessors, whose backend was a rehearsal server (``manitwin fake``).
    ``amendments`` holds manual corrections by stage; a running stage gets only its own.
    """

    item_id: str
    payload: PayloadT
    seed: int
    fields: dict[str, Any] = dataclass_field(default_factory=dict)
    paths: dict[str, Path] = dataclass_field(default_factory=dict)
    digests: dict[str, str] = dataclass_field(default_factory=dict)
    jobs: JobMemory = dataclass_field(default_factory=NullJobMemory)
    rehearsed: set[str] = dataclass_field(default_factory=set)
    amendments: dict[str, dict[str, Any]] = dataclass_field(default_factory=dict)

    def names(self) -> set[str]:
        """Return the names of all available artifacts."""
        return self.fields.keys() | self.paths.keys()

    def field(self, name: str) -> Any:
        """Return the JSON value of a field artifact. Raises ManiTwinError if no stage has written it."""
        if name not in self.fields:
            raise ManiTwinError(
                f"no stage has written field {name!r}; there are: {', '.join(sorted(self.fields)) or 'none'}"
            )
        return self.fields[name]

    def path(self, name: str) -> Path:
        """Return the path of a file or folder artifact. Raises ManiTwinError if no stage has written it."""
        if name not in self.paths:
            raise ManiTwinError(f"no stage has written {name!r}; there are: {', '.join(sorted(self.paths)) or 'none'}")
        return self.paths[name]


@runtime_checkable
class Stage(Protocol):
    """One step of the pipeline.

    ``run`` writes its files into ``folder`` under their artifact names, and returns its fields. It may raise ``Rejected``. It
    must be a pure function of what it ``reads``, ``settings``, ``backend``, ``model``, ``draft.payload`` and ``draft.seed``.
    """

    @property
    def name(self) -> str:
        """The name of the stage and of its folder."""
        ...

    @property
    def version(self) -> str:
        """The version of the algorithm; changed whenever the same inputs give another result."""
        ...

    @property
    def reads(self) -> tuple[str, ...]:
        """The artifacts that determine the result."""
        ...

    @property
    def writes(self) -> tuple[str, ...]:
        """The artifacts that the stage writes."""
        ...

    @property
    def needs(self) -> Resource:
        """The resource that the stage runs on."""
        ...

    @property
    def settings(self) -> BaseModel:
        """The stage's section of the configuration."""
        ...

    @property
    def backend(self) -> str:
        """The backend that the stage uses."""
        ...

    @property
    def model(self) -> str | None:
        """The model, gripper or weights that the backend uses."""
        ...

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Run the stage: write its files into ``folder`` and return its fields, as declared by ``writes``.

        Raises Rejected if the item cannot be processed, and a BackendError if a backend is not available now.
        """
        ...


@runtime_checkable
class PaidStage(Protocol):
    """A stage for which services charge money."""

    @property
    def expected_usd(self) -> float:
        """The approximate charge for the stage per item, in USD."""
        ...


@dataclass(frozen=True)
class StagePart:
    """Progress of a stage: ``done`` of ``total`` units, named by the plural noun ``unit``."""

    done: int
    total: int
    unit: str


_hear: ContextVar[Callable[[StagePart], None] | None] = ContextVar("hear_stage_parts", default=None)


def report_progress(done: int, total: int, unit: str) -> None:
    """Report the progress of the stage that runs in this context; cheap without a listener."""
    hear = _hear.get()
    if hear is not None:
        hear(StagePart(done, total, unit))


@contextmanager
def progress_listener(hear: Callable[[StagePart], None]) -> Iterator[None]:
    """Call ``hear`` with the progress of stages that run within the ``with`` statement."""
    token = _hear.set(hear)
    try:
        yield
    finally:
        _hear.reset(token)
