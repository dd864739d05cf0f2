"""What one worker does at a time: some episodes of one object, or in one scene; and what it leaves."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from manitwin.errors import EpisodesError
from manitwin.stages.stage import Item
from manitwin.store import sha256_of_json

BATCHES = "batches"
BATCH_RECORD = "batch.json"
BATCH_SCHEMA_VERSION = 1


@dataclass(frozen=True)
class Batch:
    """Episodes number ``first`` to ``first + count - 1`` of the whole: of a twin on a table, or of a scene."""

    robot: str
    first: int
    count: int
    twin_id: str | None = None
    scene_id: str | None = None

    @property
    def batch_id(self) -> str:
        """An id by what is asked."""
        return sha256_of_json(asdict(self))[:16]

    def item(self) -> Item:
        """Return the batch as an item of a run."""
        return Item(file=None, text=json.dumps(asdict(self), sort_keys=True))

    @classmethod
    def of(cls, item: Item) -> Batch:
        """Return the batch that an item asks for."""
        return cls(**json.loads(item.text or ""))


def batches(
    robot: str, episodes: int, size: int, *, twin_ids: Sequence[str] = (), scene_ids: Sequence[str] = ()
) -> Iterator[Batch]:
    """Deal out episodes evenly: every twin, or every scene, has as many as any other, up to one.

    Batches go round, so that a run that is stopped has some of every twin.
    """
    of = "twin_id" if twin_ids else "scene_id"
    ids = list(twin_ids or scene_ids)
    share, more = divmod(episodes, len(ids))
    left = {each: share + (number < more) for number, each in enumerate(ids)}
    first = 0
    while any(left.values()):
        for each in ids:
            count = min(size, left[each])
            if count:
                yield Batch(robot, first, count, **{of: each})
                first, left[each] = first + count, left[each] - count


class BatchRecord(BaseModel):
    """``batch.json``: what the batch was, what became of its attempts, and the digests of its files.

    ``twins`` has the ids of all twins that were set up in it, with the revisions that they had then.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    schema_version: int
    batch_id: str
    config_sha256: str
    revision: str
    twins: dict[str, str]
    attempted: int
    planned: int
    succeeded: int
    kept: int
    files: dict[str, str]


def read_batch(folder: Path) -> BatchRecord:
    """Read the record of a finished batch; raises EpisodesError where it cannot be read."""
    path = folder / BATCH_RECORD
    try:
        return BatchRecord.model_validate_json(path.read_bytes())
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the whole"
        raise EpisodesError(f"{path}: {where}: {first['msg']}; run manitwin trajectories again") from error
    except OSError as error:
        raise EpisodesError(f"{path}: cannot be read ({error}); run manitwin trajectories again") from error
