"""Base class of all recipes: the folder is written from scratch with its record last, and the record states how the item
ended.
"""

from __future__ import annotations

import shutil
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import BaseModel, ConfigDict

from manitwin.engine.recipe import Ending, Tables
from manitwin.engine.stage import Draft
from manitwin.engine.stage_runner import StageCost
from manitwin.engine.task import Payload
from manitwin.errors import ManiTwinError, NewerVersion, Rejected, TwinError
from manitwin.formats.json_file import parse_json_object
from manitwin.formats.schema_version import is_newer, newer_schema_message
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import canonical_json, sha256_of_json, write_bytes_atomically


class FolderRecord(BaseModel):
    """The record of a finished folder: the digest of its recipe, and a revision that hashes everything that determines the
    folder.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    config_sha256: str
    revision: str


RecordT = TypeVar("RecordT", bound=BaseModel)


class FolderRecipe(ABC, Generic[RecordT]):
    """A recipe whose results are folders with a record of one type in the file ``record``; it keeps no tables.

    Subclasses with records that are not a ``FolderRecord`` override ``parse`` and ``is_current``.
    """

    payload: ClassVar[type[Payload]]
    record: ClassVar[str]
    record_type: ClassVar[type[BaseModel]]
    record_schema: ClassVar[int] = 1
    can_reject: ClassVar[bool] = True
    replaces: ClassVar[bool] = True
    made_again: ClassVar[str] = "what would be another result now is made again"
    tables: Tables | None = None

    @property
    @abstractmethod
    def sha256(self) -> str:
        """The digest of everything in the recipe that determines a result."""

    @abstractmethod
    def ending(self, record: RecordT) -> Ending:
        """Return how the item of a record ended."""

    @abstractmethod
    def write(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> RecordT:
        """Write all files and the record into the empty folder ``fresh``; ``stage`` is the last stage that ran."""

    def parse(self, record: bytes) -> RecordT:
        """Parse a record. Raises NewerVersion for the schema of a newer version, else ValueError or ManiTwinError if it is
        malformed.
        """
        version = parse_json_object(record, self.record, TwinError).get("schema_version")
        if is_newer(version, self.record_schema):
            raise NewerVersion(newer_schema_message(self.record, version, self.record_schema))
        return self.record_type.model_validate_json(record)  # type: ignore[return-value]

    def is_current(self, record: RecordT) -> bool:
        """Return whether this recipe would produce the same folder."""
        return isinstance(record, FolderRecord) and record.config_sha256 == self.sha256

    def finish(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> Ending:
        """Write the finished folder at ``fresh``. Raises ManiTwinError for a rejection if the recipe cannot reject items."""
        if rejected is not None and not self.can_reject:
            raise ManiTwinError(f"{kind} {draft.item_id}: {rejected}; this item cannot be rejected as a whole")
        shutil.rmtree(fresh, ignore_errors=True)
        fresh.mkdir(parents=True)
        return self.ending(self.write(draft, kind, costs, rejected, stage, fresh))

    def damage(self, root: DatasetRoot, item_id: str) -> str | None:
        """Return what is wrong with a finished folder, None if nothing is; only the presence of its record is checked."""
        return None if root.exists(f"{self.folder_of(item_id)}/{self.record}") else f"its folder lacks {self.record}"

    @abstractmethod
    def folder_of(self, item_id: str) -> str:
        """Return the path of an item's finished folder relative to the data set's root."""

    def amended_sha256(self, record: RecordT) -> str | None:
        """Return the digest of the amendments that a folder was made with; None if it was made without."""
        return None

    def ending_of(self, record: bytes, amended_sha256: str | None = None) -> Ending | None:
        """Return how a finished folder ended; None if it is unreadable, or if this recipe or these amendments would make another
        one.

        Raises NewerVersion for a folder written by a newer version of this package, which an older version must not replace.
        """
        try:
            read = self.parse(record)
        except NewerVersion:
            raise
        except (ValueError, ManiTwinError):
            return None
        current = self.is_current(read) and self.amended_sha256(read) == amended_sha256
        return self.ending(read) if current else None

    def write_record(self, fresh: Path, said: dict[str, Any], *, decided_by: Any = None) -> RecordT:
        """Write the record, last of all files, with its revision: the digest of ``said``, together with ``decided_by`` if
        given.
        """
        said = {**said, "config_sha256": self.sha256}
        revision = sha256_of_json(said if decided_by is None else [said, decided_by])
        record: Any = self.record_type(**said, revision=revision)
        write_bytes_atomically(fresh / self.record, canonical_json(record.model_dump(mode="json")).encode())
        return record
