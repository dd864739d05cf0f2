"""Recipes: what a run makes of each item. They are the interface between the engine and what it runs: twins, layouts, episodes.

A twin, a layout, a batch of episodes and its pictures are each a folder that is finished once its record is in it.
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
    """How an item ended: ``reason`` is the code of a rejection, ``revision`` that of its finished folder.

    ``hint`` says what would give a better result from the same input.
    """

    status: Literal["accepted", "rejected"]
    revision: str
    reason: str | None
    detail: str
    hint: str | None = None

    @property
    def detail_and_hint(self) -> str:
        """The detail and the hint, in one line for a person."""
        return "; ".join(filter(None, (self.detail, self.hint)))


@dataclass(frozen=True)
class Identity:
    """The id of what a task makes, the kind of its input, and why nothing can be made of it where that is so."""

    item_id: str
    kind: str
    rejected: Rejected | None = None


class Tables(Protocol):
    """Tables over all finished folders of a data set, written by workers while a run goes on. It is sent to every worker."""

    def add(self, root: DatasetRoot, ids: Sequence[str]) -> None:
        """Add finished folders, new or made again; of ids whose folder is gone the rows are taken out."""
        ...

    def merge(self, root: DatasetRoot) -> None:
        """Merge what was added in parts, once a run is at its end."""
        ...

    def heal(self, root: DatasetRoot) -> bool:
        """Remove tables that cannot be read; returns True where there are none, so that all folders are to be added."""
        ...


class Recipe(Protocol):
    """The stages of every kind of input, and how their results become a folder. It is sent to every worker."""

    @property
    def sha256(self) -> str:
        """The digest of everything in it that decides a result; items that ended under another digest are run again."""
        ...

    @property
    def tables(self) -> Tables | None:
        """The tables that are kept of what it makes; None: none are."""
        ...

    @property
    def seed(self) -> int:
        """The seed of everything random."""
        ...

    @property
    def record(self) -> str:
        """The file that makes a folder a finished one; it is written last."""
        ...

    @property
    def payload(self) -> type[Payload]:
        """The type of what its tasks ask for."""
        ...

    @property
    def can_reject(self) -> bool:
        """Whether an item may end as rejected; else what cannot be made of it is a failure."""
        ...

    @property
    def replaces(self) -> bool:
        """Whether what ended under another recipe is made again; else it stays as it is, and only what is missing is made."""
        ...

    @property
    def made_again(self) -> str:
        """What becomes of items that are made again as they ended under another recipe, in words for a person."""
        ...

    def folder_of(self, item_id: str) -> str:
        """Return the name of an item's finished folder below the data set's root."""
        ...

    def identify(self, payload: Any) -> Identity:
        """Return the id of what is asked for; of files by their bytes."""
        ...

    def stages(self, kind: str) -> list[Stage]:
        """Return the stages for a kind of input, in order."""
        ...

    def finish(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> Ending:
        """Write the finished folder at ``fresh``; ``stage`` is the last one that ran."""
        ...

    def damage(self, root: DatasetRoot, item_id: str) -> str | None:
        """Return what is wrong with a finished folder, by cheap checks alone; None where nothing is."""
        ...

    def ending_of(self, record: bytes, amended_sha256: str | None = None) -> Ending | None:
        """Return how an item ended by its folder's ``record``; None where this recipe or amendment would make another folder."""
        ...
