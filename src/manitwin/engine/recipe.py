"""Recipe protocol: the interface between the engine and what it makes (twins, layouts, episodes).

Each result (a twin, a layout, a batch of episodes or its videos) is a folder that is finished once it contains its record.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol

from manitwin.engine.stage import Draft, Stage
from manitwin.engine.stage_runner import StageCost
from manitwin.engine.task import Payload
from manitwin.errors import Rejected
from manitwin.twin.dataset_root import DatasetRoot


@dataclass(frozen=True)
class Ending:
    """How an item ended: ``reason`` is the code of a rejection, ``revision`` the revision of its finished folder.

    ``hint`` says how the same input could give a better result.
    """

    status: Literal["accepted", "rejected"]
    revision: str
    reason: str | None
    detail: str
    hint: str | None = None

    @property
    def detail_and_hint(self) -> str:
        """The detail and the hint in one line."""
        return "; ".join(filter(None, (self.detail, self.hint)))


@dataclass(frozen=True)
class Identity:
    """The id of a task's result, the kind of its input, and a rejection if the input cannot be processed."""

    item_id: str
    kind: str
    rejected: Rejected | None = None


class Tables(Protocol):
    """Tables over all finished folders of a data set, written by workers during a run. Pickled to every worker."""

    def add(self, root: DatasetRoot, ids: Sequence[str]) -> None:
        """Add finished folders, new or updated; remove the rows of ids whose folder is gone."""
        ...

    def merge(self, root: DatasetRoot) -> None:
        """Merge the table parts at the end of a run."""
        ...

    def heal(self, root: DatasetRoot) -> bool:
        """Remove unreadable tables; return True if there are none, so that all folders must be added."""
        ...


class Recipe(Protocol):
    """The stages for every kind of input, and the assembly of their results into a folder. Pickled to every worker."""

    @property
    def sha256(self) -> str:
        """The digest of everything in the recipe that determines a result; items that ended under another digest run again."""
        ...

    @property
    def tables(self) -> Tables | None:
        """The tables of its results; None if it keeps none."""
        ...

    @property
    def seed(self) -> int:
        """The random seed."""
        ...

    @property
    def record(self) -> str:
        """The file name of the record, which is written last and marks a folder as finished."""
        ...

    @property
    def payload(self) -> type[Payload]:
        """The payload type of its tasks."""
        ...

    @property
    def can_reject(self) -> bool:
        """Whether an item may end as rejected; otherwise a rejection is a failure."""
        ...

    @property
    def replaces(self) -> bool:
        """Whether items that ended under another recipe are made again; otherwise only missing items are made."""
        ...

    @property
    def made_again(self) -> str:
        """A message on items that are made again because they ended under another recipe."""
        ...

    def folder_of(self, item_id: str) -> str:
        """Return the path of an item's finished folder relative to the data set's root."""
        ...

    def identify(self, payload: Any) -> Identity:
        """Return the identity of a payload; files are identified by their content."""
        ...

    def stages(self, kind: str) -> list[Stage]:
        """Return the stages for a kind of input, in order."""
        ...

    def finish(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> Ending:
        """Write the finished folder at ``fresh``; ``stage`` is the last stage that ran."""
        ...

    def damage(self, root: DatasetRoot, item_id: str) -> str | None:
        """Return what is wrong with a finished folder, using cheap checks only; None if nothing is."""
        ...

    def ending_of(self, record: bytes, amended_sha256: str | None = None) -> Ending | None:
        """Return how an item ended from the bytes of its ``record``; None if this recipe or amendment would make another
        folder.
        """
        ...
