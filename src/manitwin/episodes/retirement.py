"""Retirement of grasps that fail in episodes.

The grasp trial tests a hand in free space, without table, long carry or neighbours.
"""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import groupby

import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.dataset.review.store import REVIEWS, ReviewStore, reviews_path
from manitwin.engine.ledger.ledger import LEDGER, Ledger
from manitwin.episodes.attempts import EXECUTION_FAILURES, Attempt
from manitwin.episodes.settings import HANDOVER
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.grasp_table import read_grasp_table
from manitwin.twin.integrity import write_sizes
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.store import read_record, replace_files

GRASPS = "grasps.parquet"

OF_THE_FIRST_HAND = ("dropped", "not_lifted")


@dataclass(frozen=True)
class Retirement:
    """A grasp to retire: the number of its executions with its own gripper, and the outcomes of the failed ones."""

    twin_id: str
    grasp_id: str
    executed: int
    outcomes: dict[str, int]

    @property
    def failed(self) -> int:
        """Number of failed executions."""
        return sum(self.outcomes.values())


def find_retirements(attempts: Iterable[Attempt], *, failed_share: float) -> list[Retirement]:
    """Return the grasps of which more than ``failed_share`` of the executions failed, sorted by twin and grasp.

    Transferred grasps are ignored, because they say nothing about the gripper for which a grasp was verified. For a handover
    the grasp is the first hand's, whose failures are those before the second hand takes over.
    """
    executed: Counter[tuple[str, str]] = Counter()
    failed: dict[tuple[str, str], Counter[str]] = {}
    for attempt in attempts:
        if not attempt.planned or attempt.transferred or attempt.grasp_id is None:
            continue
        key = attempt.twin_id, attempt.grasp_id
        executed[key] += 1
        if attempt.outcome in (OF_THE_FIRST_HAND if attempt.skill == HANDOVER else EXECUTION_FAILURES):
            failed.setdefault(key, Counter())[attempt.outcome] += 1
    return [
        Retirement(*key, executed[key], dict(sorted(outcomes.items())))
        for key, outcomes in sorted(failed.items())
        if outcomes.total() > failed_share * executed[key]
    ]


def retire_grasps(twins: TwinSource, found: Iterable[Retirement]) -> int:
    """Mark grasps as retired in their twins' tables; return the number of newly retired ones.

    A data set's ledger and index are updated, and reviews of those twins are kept. Raises UsageError for a data set at a URL,
    whose twins are only cached locally, and if a run is in progress on it.
    """
    by_twin = {twin_id: {each.grasp_id for each in group} for twin_id, group in _by_twin(found)}
    count, revised = 0, dict[str, tuple[str, str]]()
    for twin_id, grasp_ids in by_twin.items():
        folder = twins.folder(twin_id)
        table = read_grasp_table(folder / GRASPS)
        before = table["retired"].to_pylist()
        after = [was or grasp in grasp_ids for was, grasp in zip(before, table["grasp_id"].to_pylist(), strict=True)]
        fresh = sum(after) - sum(before)
        if fresh:
            count += fresh
            seen = read_record(folder).revision
            amended = replace_files(
                folder, {GRASPS: _with_column(table, "retired", after)}, partial(write_sizes, folder)
            )
            revised[twin_id] = seen, amended.revision
    if revised and twins.root.exists(LEDGER):
        _follow(twins.root, {twin_id: revision for twin_id, (_, revision) in revised.items()})
    if revised and twins.root.exists(REVIEWS):
        with ReviewStore(reviews_path(twins.root)) as store:  # reviews do not concern grasps that fail with an arm
            store.record_successors(revised)
    return count


def _by_twin(found: Iterable[Retirement]) -> Iterator[tuple[str, Iterator[Retirement]]]:
    return groupby(sorted(found, key=lambda each: each.twin_id), key=lambda each: each.twin_id)


def _with_column(table: pa.Table, name: str, values: list[bool]) -> bytes:
    at = table.schema.get_field_index(name)
    stream = io.BytesIO()
    pq.write_table(table.set_column(at, table.schema.field(at), pa.array(values, pa.bool_())), stream)
    return stream.getvalue()


def _follow(root: DatasetRoot, revisions: dict[str, str]) -> None:
    """Update ledger and index to the twins' new revisions."""
    from manitwin.dataset.index.parts import write_part  # takes a second to import

    assert root.local is not None
    ledger = Ledger(root.local / LEDGER)
    try:
        for twin_id, revision in revisions.items():
            ledger.record_revision(twin_id, revision)
        if root.exists("index"):
            write_part(root, revisions)
            ledger.mark_indexed(revisions)
    finally:
        ledger.close()
