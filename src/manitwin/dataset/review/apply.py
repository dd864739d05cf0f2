"""``manitwin review apply``: store corrections as amendments of twins and rebuild the affected stages."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Unpack

import numpy as np

from manitwin.dataset.index.query import Index
from manitwin.dataset.review.corrections import Conflict, Correction, resolve_corrections
from manitwin.dataset.review.item_rebuild import rebuild_items
from manitwin.dataset.review.review_subjects import read_twin, revisions
from manitwin.dataset.review.store import ReviewStore, reviews_path
from manitwin.engine.amendments import Amendments, read_amendments, write_amendments
from manitwin.engine.drive import RunOptions, RunReport
from manitwin.engine.ledger.location import local_ledger
from manitwin.engine.ledger.reading import read_ledger
from manitwin.errors import UsageError
from manitwin.formats.json_file import parse_json_object
from manitwin.pipeline.human_corrections import CATEGORY, MASS, MOVES, SIZE, STAGES, place_in_box
from manitwin.pipeline.item import Item
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.record import TwinRecord


@dataclass(frozen=True)
class ApplyResult:
    """Result of applying corrections. ``run`` is None if nothing was rebuilt; ``left`` maps twin ids to reasons why they were
    not.

    ``rejected`` maps the ids of twins that are rejected after the rebuild to the reasons.
    """

    corrections: list[Correction]
    conflicts: list[Conflict]
    left: dict[str, str] = field(default_factory=dict)
    run: RunReport | None = None
    rejected: dict[str, str] = field(default_factory=dict)


def apply_reviews(
    dataset: str, *, dry_run: bool = False, jobs: int | None = None, **options: Unpack[RunOptions]
) -> ApplyResult:
    """Write the undisputed corrections into the data set and rebuild the twins from the first stage that they change.

    Only verdicts on the current revisions count. Raises UsageError if there are no reviews, no index or no ledger, and if another
    run is active on the data set.
    """
    root = DatasetRoot(dataset)
    with ReviewStore(reviews_path(root), make=False) as store:
        stored = store.standing()
    now = revisions(Index(root))
    corrections, conflicts = resolve_corrections(
        each for each in stored if now.get(each.review.twin_id) == each.review.revision
    )
    twin_ids = list(dict.fromkeys(each.twin_id for each in corrections))
    items = _items(root, twin_ids) if twin_ids else {}
    left = {each: "the ledger has no item for it; build it in this data set" for each in twin_ids if each not in items}
    if dry_run or not items:
        return ApplyResult([each for each in corrections if each.twin_id not in left], conflicts, left)
    for twin_id in items:
        own = [each for each in corrections if each.twin_id == twin_id]
        write_amendments(
            root, twin_id, merge_corrections(read_amendments(root, twin_id), own, read_twin(root, twin_id))
        )
    run = rebuild_items(root, items.values(), jobs, **options)
    applied = [each for each in corrections if each.twin_id not in left]
    return ApplyResult(applied, conflicts, left, run, _rejected(root, items))


def merge_corrections(before: Amendments, corrections: Iterable[Correction], record: TwinRecord) -> Amendments:
    """Return a twin's amendments with additional corrections; the last correction of a value wins."""
    after: dict[str, dict[str, Any]] = {stage: dict(said) for stage, said in before.items()}
    for each in corrections:
        key = each.name if each.name in (CATEGORY, MASS, SIZE) else MOVES
        for stage in STAGES[key]:
            said = after.setdefault(stage, {})
            if key == CATEGORY:
                said[key] = each.value
            elif key == MOVES:
                move = {
                    "candidate": each.value,
                    "place": place_in_box(_sampled_positions_m(record), each.value),
                    "label": _label(record, each.name),
                    "source": each.source,
                }
                said[key] = {**said.get(key, {}), each.name: move}
            else:
                said[key] = {**each.value, "source": each.source}
    return after


def _sampled_positions_m(record: TwinRecord) -> np.ndarray:
    """Return the positions ``(N, 3)`` in metres of a twin's candidates as sampled, before refinement moved some of them."""
    assert record.points is not None, "an accepted twin has points"
    positions_m = np.array(record.points.candidates.positions_m, float)
    for each in record.points.candidates.refined:
        positions_m[each.candidate] = each.marked_position_m
    return positions_m


def _label(record: TwinRecord, point_id: str) -> str | None:
    points = record.points
    assert points is not None, "an accepted twin has points"
    labels: dict[str, str | None] = {point.id: point.label for point in points.functional}
    labels |= {point.id: point.label for point in points.grasp}
    if point_id not in labels:
        raise UsageError(f"{record.twin_id}: no longer has a point {point_id}; review it again")
    return labels[point_id]


def _rejected(root: DatasetRoot, twin_ids: Iterable[str]) -> dict[str, str]:
    """Return the reason code and detail of those twins that are now rejected."""
    found = dict[str, str]()
    with read_ledger(local_ledger(root)) as ledger:
        for twin_id in twin_ids:
            row = ledger.execute(
                "SELECT reason, detail FROM items WHERE twin_id = ? AND state = 'rejected'", (twin_id,)
            ).fetchone()
            if row is not None:
                found[twin_id] = f"{row[0]}: {row[1]}"
    return found


def _items(root: DatasetRoot, twin_ids: Iterable[str]) -> dict[str, tuple[int, Item]]:
    """Return the ledger number and item of each accepted twin that the ledger has."""
    path, found = local_ledger(root), dict[str, tuple[int, Item]]()
    with read_ledger(path) as ledger:
        for twin_id in twin_ids:
            row = ledger.execute(
                "SELECT number, item FROM items WHERE twin_id = ? AND state = 'accepted'", (twin_id,)
            ).fetchone()
            if row is not None:
                said = parse_json_object(row[1], f"{path}: item {row[0]}", UsageError, file_names=True)
                found[twin_id] = int(row[0]), Item.from_json(said)
    return found
