"""What a run makes of a batch: a folder with its episodes. The engine drives it like the building of twins."""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from pydantic import ValidationError

from manitwin.engine.recipe import Ending, Identity
from manitwin.engine.stage import Draft, Item, Stage
from manitwin.engine.stage_runner import StageCost
from manitwin.episodes.attempts_table import ATTEMPTS
from manitwin.episodes.batch import BATCH_RECORD, BATCH_SCHEMA_VERSION, BATCHES, Batch, BatchRecord
from manitwin.episodes.episodes_stage import EPISODES, EpisodesStage
from manitwin.errors import ManiTwinError, Rejected
from manitwin.robots.load import load_robot
from manitwin.scenes.app_config import TrajectoriesConfig
from manitwin.twin.store import RUN, canonical_json, sha256_of_file, sha256_of_json, write_bytes_atomically


@dataclass(frozen=True)
class EpisodesRecipe:
    """Batches of episodes. ``dataset`` and ``scenes`` are where twins and scenes are read from (no scenes: None)."""

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
    def tables(self) -> None:
        """There are none."""

    @property
    def seed(self) -> int:
        """The seed of everything random."""
        return self.config.seed

    @property
    def record(self) -> str:
        """The record of a batch."""
        return BATCH_RECORD

    def folder_of(self, twin_id: str) -> str:
        """Return the batch's folder."""
        return f"{BATCHES}/{twin_id[:2]}/{twin_id}"

    def identify(self, item: Item) -> Identity:
        """Return the batch's id."""
        return Identity(Batch.of_item(item).batch_id, "batch")

    def stages(self, kind: str) -> list[Stage]:
        """Return the one stage."""
        return [EpisodesStage(self.config, self.dataset, self.scenes)]

    def finish(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> Ending:
        """Write the batch's folder."""
        if rejected is not None:
            raise ManiTwinError(f"batch {draft.twin_id}: {rejected}; an episode is never rejected as a whole")
        shutil.rmtree(fresh, ignore_errors=True)
        fresh.mkdir(parents=True)
        for name in (EPISODES, ATTEMPTS):
            shutil.copyfile(draft.path(name), fresh / name)
        files = {name: sha256_of_file(fresh / name) for name in (EPISODES, ATTEMPTS)}
        said = {
            "schema_version": BATCH_SCHEMA_VERSION,
            "batch_id": draft.twin_id,
            "config_sha256": self.sha256,
            "files": files,
            **draft.field("batch"),
        }
        record = BatchRecord(**said, revision=sha256_of_json(said))
        cost = {"stages": {name: vars(each) for name, each in costs.items()}}
        write_bytes_atomically(fresh / RUN, canonical_json(cost).encode())
        write_bytes_atomically(fresh / BATCH_RECORD, canonical_json(record.model_dump(mode="json")).encode())
        return _ending(record)

    def ending_of(self, record: bytes) -> Ending | None:
        """Return how a finished batch ended; None where this recipe would make another one."""
        try:
            batch = BatchRecord(**json.loads(record))
        except (ValueError, ValidationError):
            return None
        return _ending(batch) if batch.config_sha256 == self.sha256 else None


def _ending(record: BatchRecord) -> Ending:
    detail = (
        f"{record.kept} of {record.attempted} episodes kept, {record.planned} executed, {record.succeeded} succeeded"
    )
    return Ending("accepted", record.revision, None, detail)
