"""``manitwin review apply``: corrections become amendments of the twins, and what follows from them is made again."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Unpack

import numpy as np

from manitwin.dataset.index.query import Index
from manitwin.dataset.review.corrections import Conflict, Correction, settled
from manitwin.dataset.review.making_again import made_again
from manitwin.dataset.review.store import ReviewStore, reviews_path
from manitwin.dataset.review.twins_seen import read_twin, revisions
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
class Applied:
    """What was, or would be, put right: ``run`` is None where nothing was made again; ``left`` says of twins why they are not.

    ``rejected``: why twins are none any more with what was put right, by their ids.
    """

    corrections: list[Correction]
    conflicts: list[Conflict]
    left: dict[str, str] = field(default_factory=dict)
    run: RunReport | None = None
    rejected: dict[str, str] = field(default_factory=dict)


def apply_reviews(
    dataset: str, *, dry_run: bool = False, jobs: int | None = None, **options: Unpack[RunOptions]
) -> Applied:
    """Write the corrections that nobody contradicts into the data set, and make the twins again from the first stage they change.

    Only verdicts on twins as they are now count. Raises UsageError where there are no reviews, no index or no ledger, and where
    another run is at work there.
    """
    root = DatasetRoot(dataset)
    with ReviewStore(reviews_path(root), make=False) as store:
        stored = store.standing()
    now = revisions(Index(root))
    corrections, conflicts = settled(each for each in stored if now.get(each.review.twin_id) == each.review.revision)
    twin_ids = list(dict.fromkeys(each.twin_id for each in corrections))
    items = _items(root, twin_ids) if twin_ids else {}
    left = {each: "the ledger has no item for it; build it in this data set" for each in twin_ids if each not in items}
    if dry_run or not items:
        return Applied([each for each in corrections if each.twin_id not in left], conflicts, left)
    for twin_id in items:
        own = [each for each in corrections if each.twin_id == twin_id]
        write_amendments(root, twin_id, amended(read_amendments(root, twin_id), own, read_twin(root, twin_id)))
    run = made_again(root, items.values(), jobs, **options)
    applied = [each for each in corrections if each.twin_id not in left]
    return Applied(applied, conflicts, left, run, _rejected(root, items))


def amended(before: Amendments, corrections: Iterable[Correction], record: TwinRecord) -> Amendments:
    """Return a twin's amendments with more corrections: of one thing the last counts."""
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
                    "place": place_in_box(_marked_m(record), each.value),
                    "label": _label(record, each.name),
                    "source": each.source,
                }
                said[key] = {**said.get(key, {}), each.name: move}
            else:
                said[key] = {**each.value, "source": each.source}
    return after


def _marked_m(record: TwinRecord) -> np.ndarray:
    """Return the positions ``(N, 3)`` of a twin's candidates as they were chosen, before a closer look moved some."""
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
    """Return of those of the twins that are rejected now the code and what is said of it."""
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
    """Return the number and the item of each twin that the ledger has made."""
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
