"""Batches of episodes, each of one twin, scene or task and made by one worker, and their records."""

from __future__ import annotations

import heapq
import itertools
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from manitwin.engine.folder_recipe import FolderRecord
from manitwin.engine.task import Payload
from manitwin.errors import EpisodesError, UsageError
from manitwin.formats.json_file import read_json_object
from manitwin.formats.schema_version import is_newer, newer_schema_message
from manitwin.twin.store import sha256_of_json

BATCHES = "batches"
BATCH_RECORD = "batch.json"
BATCH_SCHEMA_VERSION = 1
REMEDY_OF_REPEATS = "an older version made these in steps; make the episodes again in a new folder"


@dataclass(frozen=True)
class Batch(Payload):
    """Some episodes of a twin, a scene or a task, by their numbers in the run: ``count`` from ``first``, ``step`` apart."""

    robot: str
    first: int
    count: int
    twin_id: str | None = None
    scene_id: str | None = None
    step: int = 1
    task_id: str | None = None

    @property
    def numbers(self) -> range:
        """The numbers of its episodes."""
        return range(self.first, self.first + self.count * self.step, self.step)

    @property
    def source_id(self) -> str:
        """The id of its twin, scene or task."""
        return self.twin_id or self.scene_id or self.task_id or ""

    @property
    def batch_id(self) -> str:
        """An id derived from the fields."""
        return sha256_of_json(self.to_json())[:16]

    @property
    def title(self) -> str:
        """Display title."""
        return f"episodes {self.numbers[0]} to {self.numbers[-1]} of {self.source_id}"

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Batch:
        """Return the batch stored in a ledger; earlier versions stored its JSON as text."""
        return cls(**(json.loads(fields["text"]) if "text" in fields else fields))

    def to_json(self) -> dict[str, Any]:
        """Return the fields, omitting a ``step`` of 1 and an unset ``task_id``, so that ids of older versions stay valid."""
        left_out = {
            name for name, told in (("step", self.step != 1), ("task_id", self.task_id is not None)) if not told
        }
        return {name: value for name, value in super().to_json().items() if name not in left_out}


def missing_batches(
    robot: str,
    episodes: int,
    size: int,
    *,
    twin_ids: Sequence[str] = (),
    scene_ids: Sequence[str] = (),
    task_ids: Sequence[str] = (),
    there: Iterable[Batch] = (),
) -> list[Batch]:
    """Return the batches missing for ``episodes``: each number goes to the id with the fewest episodes so far.

    A number therefore has the same twin, scene or task, and the same seed, whether episodes are made in one run or in
    several. ``there`` are existing batches, whose numbers are not repeated. Raises UsageError if two existing batches share a
    number. Batches of different ids are interleaved, so that an interrupted run has episodes of every twin.
    """
    kind, ids = next(
        (each for each in (("twin_id", twin_ids), ("task_id", task_ids)) if each[1]), ("scene_id", scene_ids)
    )
    counts, taken = dict.fromkeys(ids, 0), set[int]()
    for batch in there:
        if not taken.isdisjoint(batch.numbers):
            raise UsageError(f"batch {batch.batch_id} repeats episodes of another one; {REMEDY_OF_REPEATS}")
        taken.update(batch.numbers)
        if batch.source_id in counts:
            counts[batch.source_id] += batch.count
    fewest = [(count, place, each) for place, (each, count) in enumerate(counts.items())]
    heapq.heapify(fewest)
    numbers: dict[str, list[int]] = {each: [] for each in ids}
    free = (number for number in itertools.count() if number not in taken)
    for number in itertools.islice(free, max(0, episodes - len(taken))):
        count, place, each = fewest[0]
        heapq.heapreplace(fewest, (count + 1, place, each))
        numbers[each].append(number)
    dealt = [
        [Batch(robot, run[0], len(run), step=run.step, **{kind: each}) for run in _runs(given, size)]
        for each, given in numbers.items()
    ]
    rounds = itertools.zip_longest(*dealt)
    return [batch for each_round in rounds for batch in each_round if batch is not None]


def _runs(numbers: Sequence[int], size: int) -> Iterator[range]:
    """Split increasing numbers into arithmetic progressions of at most ``size`` numbers; the step of a single number is 1."""
    start = 0
    while start < len(numbers):
        step = numbers[start + 1] - numbers[start] if start + 1 < len(numbers) and size > 1 else 1
        end = start + 1
        while end < len(numbers) and end - start < size and numbers[end] - numbers[end - 1] == step:
            end += 1
        if end - start == 1:
            step = 1
        yield range(numbers[start], numbers[end - 1] + 1, step)
        start = end


def batch_name(batch_id: str) -> str:
    """Return the relative folder of a batch below the episodes' root, and of its pictures below theirs."""
    return f"{BATCHES}/{batch_id[:2]}/{batch_id}"


class BatchRecord(FolderRecord):
    """``batch.json``: identity of a batch, counts of its attempts, and the digests of its files.

    ``twins`` maps the ids of all twins in it to their revisions at that time.
    """

    schema_version: int
    batch_id: str
    twins: dict[str, str]
    attempted: int
    planned: int
    succeeded: int
    kept: int
    files: dict[str, str]


_REMEDY = "run manitwin trajectories again"


def read_batch(folder: Path) -> BatchRecord:
    """Read the record of a finished batch; raises EpisodesError if it cannot be read."""
    path = folder / BATCH_RECORD
    said = read_json_object(path, EpisodesError, inside=folder, name=str(path), remedy=_REMEDY)
    if is_newer(said.get("schema_version"), BATCH_SCHEMA_VERSION):
        raise EpisodesError(newer_schema_message(path, said["schema_version"], BATCH_SCHEMA_VERSION))
    try:
        return BatchRecord(**said)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the whole"
        raise EpisodesError(f"{path}: {where}: {first['msg']}; {_REMEDY}") from error
