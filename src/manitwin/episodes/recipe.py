"""What a run makes of a batch: a folder with its episodes. The engine drives it like the building of twins."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar

from manitwin.engine.folder_recipe import FolderRecipe
from manitwin.engine.recipe import Ending, Identity
from manitwin.engine.stage import Draft, Stage
from manitwin.engine.stage_runner import StageCost
from manitwin.episodes.attempts_table import ATTEMPTS
from manitwin.episodes.batch import BATCH_RECORD, BATCH_SCHEMA_VERSION, Batch, BatchRecord, batch_name
from manitwin.episodes.episodes_stage import EPISODES, EpisodesStage
from manitwin.errors import Rejected
from manitwin.robots.load import load_robot
from manitwin.scenes.app_config import TrajectoriesConfig
from manitwin.twin.store import RUN, canonical_json, digests_below, sha256_of_json, write_bytes_atomically


@dataclass(frozen=True)
class EpisodesRecipe(FolderRecipe[BatchRecord]):
    """Batches of episodes. ``dataset`` and ``scenes`` are where twins and scenes are read from (no scenes: None)."""

    payload: ClassVar[type[Batch]] = Batch
    record: ClassVar[str] = BATCH_RECORD
    record_type: ClassVar[type[BatchRecord]] = BatchRecord
    can_reject: ClassVar[bool] = False

    config: TrajectoriesConfig
    dataset: str
    scenes: str | None = None

    @cached_property
    def sha256(self) -> str:
        """The digest of what decides an episode, but for the twins: their revisions stand in the batch's record."""
        decides = self.config.model_dump(mode="json", exclude={"run", "batch", "retire_failed_share"})
        decides["robot"] = load_robot(self.config.robot).sha256
        return sha256_of_json([decides, EpisodesStage.version])

    @property
    def seed(self) -> int:
        """The seed of everything random."""
        return self.config.seed

    def folder_of(self, item_id: str) -> str:
        """Return the batch's folder."""
        return batch_name(item_id)

    def identify(self, payload: Batch) -> Identity:
        """Return the batch's id."""
        return Identity(payload.batch_id, "batch")

    def stages(self, kind: str) -> list[Stage]:
        """Return the one stage."""
        return [EpisodesStage(self.config, self.dataset, self.scenes)]

    def write(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> BatchRecord:
        """Write the batch's folder."""
        for name in (EPISODES, ATTEMPTS):
            shutil.copyfile(draft.path(name), fresh / name)
        files = digests_below(fresh)
        cost = {"stages": {name: vars(each) for name, each in costs.items()}}
        write_bytes_atomically(fresh / RUN, canonical_json(cost).encode())
        said = {
            "schema_version": BATCH_SCHEMA_VERSION,
            "batch_id": draft.item_id,
            "files": files,
            **draft.field("batch"),
        }
        return self.seal(fresh, said)

    def ending(self, record: BatchRecord) -> Ending:
        """Return how a batch's record says that it ended."""
        detail = f"{record.kept} of {record.attempted} episodes kept, {record.planned} executed, {record.succeeded} succeeded"
        return Ending("accepted", record.revision, None, detail)
