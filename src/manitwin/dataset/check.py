"""Do the ledger and the folders agree? What differs is named, and put right from the folders, which are the truth."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.stage_runner import RESULT
from manitwin.errors import TwinError
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import RECORD, WORK, parse_record


@dataclass(frozen=True)
class Disagreement:
    """One thing that is not as it should be, and what puts it right (None: only a person can)."""

    what: str
    repair: Callable[[], None] | None


def disagreements(ledger: Ledger, root: DatasetRoot, keeps_work: bool) -> Iterator[Disagreement]:
    """Yield all that differs between a ledger that nobody else writes and the folders below the root."""
    yield from _interrupted(ledger)
    yield from _ended_without_folder(ledger, root)
    yield from _folders_nobody_ended(ledger, root)
    yield from _half_folders(root)
    if keeps_work:
        yield from _done_without_result(ledger, root)
    yield from _index(ledger, root)


def _interrupted(ledger: Ledger) -> Iterator[Disagreement]:
    (count,) = ledger.connection.execute("SELECT count(*) FROM stages WHERE state = 'running'").fetchone()
    if count:
        yield Disagreement(
            f"{count} stages are marked as running, and no run is at work",
            partial(_execute, ledger, "UPDATE stages SET state = 'waiting' WHERE state = 'running'", [()]),
        )


def _ended_without_folder(ledger: Ledger, root: DatasetRoot) -> Iterator[Disagreement]:
    rows = ledger.connection.execute(
        "SELECT number, twin_id, state, revision FROM items WHERE state IN ('accepted', 'rejected') ORDER BY number"
    ).fetchall()
    for number, twin_id, state, revision in rows:
        wrong = _what_is_wrong(root, twin_id, state, revision)
        if wrong:
            yield Disagreement(f"item {number}, twin {twin_id}: {wrong}", partial(_redo, ledger, root, number, twin_id))


def _what_is_wrong(root: DatasetRoot, twin_id: str, state: str, revision: str) -> str | None:
    name = f"{root.twin_name(twin_id)}/{RECORD}"
    if not root.exists(name):
        return f"{state} in the ledger, and there is no folder"
    try:
        record = parse_record(root.read_bytes(name), name)
    except TwinError as error:
        return str(error)
    if record.status != state:
        return f"{state} in the ledger, {record.status} in its folder"
    if record.revision != revision:
        return "its folder is of another revision than the ledger's"
    return _lacking(root, twin_id, record)


def _lacking(root: DatasetRoot, twin_id: str, record: TwinRecord) -> str | None:
    missing = [file for file in record.files if not root.exists(f"{root.twin_name(twin_id)}/{file}")]
    return f"its folder lacks {', '.join(missing)}" if missing else None


def damaged_twins(root: DatasetRoot) -> Iterator[str]:
    """Yield what is wrong with twins of a data set that has no ledger: one line a twin that cannot be read or lacks files."""
    for twin_id in root.twin_ids():
        name = f"{root.twin_name(twin_id)}/{RECORD}"
        try:
            lacking = _lacking(root, twin_id, parse_record(root.read_bytes(name), name))
        except TwinError as error:
            yield str(error)
            continue
        if lacking:
            yield f"twin {twin_id}: {lacking}"


def _folders_nobody_ended(ledger: Ledger, root: DatasetRoot) -> Iterator[Disagreement]:
    for twin_id in root.twin_ids():
        row = ledger.connection.execute(
            "SELECT number, state FROM items WHERE twin_id = ? AND state <> 'duplicate'", (twin_id,)
        ).fetchone()
        if row is None:
            # an item that was never surveyed since the folder was made will find it by itself
            (unknown,) = ledger.connection.execute("SELECT count(*) FROM items WHERE twin_id IS NULL").fetchone()
            if not unknown:
                yield Disagreement(f"twin {twin_id}: a folder, and no item of the ledger makes it", None)


def _half_folders(root: DatasetRoot) -> Iterator[Disagreement]:
    if root.local is None:
        return
    work = root.local / WORK
    for pattern in ("*/*/.*", "*.finished", "*.replaced"):
        for path in sorted(work.glob(pattern)):
            name = path.relative_to(root.local).as_posix()
            yield Disagreement(f"{name}: left half-made", partial(root.remove, name))
    for path in sorted((root.local / "twins").glob("*/*")):
        if not (path / RECORD).is_file():
            name = path.relative_to(root.local).as_posix()
            yield Disagreement(f"{name}: a twin's folder without {RECORD}", partial(root.remove, name))


def _done_without_result(ledger: Ledger, root: DatasetRoot) -> Iterator[Disagreement]:
    rows = ledger.connection.execute(
        "SELECT s.number, i.twin_id, s.stage, s.key FROM stages s JOIN items i USING (number)"
        " WHERE s.state = 'done' AND s.key IS NOT NULL ORDER BY s.number"
    ).fetchall()
    for number, twin_id, stage, key in rows:
        name = f"{WORK}/{twin_id}/{stage}/{key}/{RESULT}"
        if root.exists(name) and _is_json(root.read_bytes(name)):
            continue
        yield Disagreement(
            f"item {number}, stage {stage}: done in the ledger, and its result is not there",
            partial(_execute, ledger, "DELETE FROM stages WHERE number = ? AND stage = ?", [(number, stage)]),
        )


def _index(ledger: Ledger, root: DatasetRoot) -> Iterator[Disagreement]:
    from manitwin.dataset.index.parts import indexed_twins  # takes a second to import

    in_tables = indexed_twins(root)
    ended = dict(
        ledger.connection.execute(
            "SELECT twin_id, revision FROM items WHERE state IN ('accepted', 'rejected') AND indexed = 1"
        ).fetchall()
    )
    lost = sorted(twin_id for twin_id, revision in ended.items() if in_tables.get(twin_id) != revision)
    if lost:
        yield Disagreement(
            f"{len(lost)} twins are marked as indexed, and no table has them as they are ({lost[0]} ...)",
            partial(
                _execute, ledger, "UPDATE items SET indexed = 0 WHERE twin_id = ?", [(twin_id,) for twin_id in lost]
            ),
        )
    finished = {twin_id for (twin_id,) in ledger.connection.execute("SELECT twin_id FROM items")}
    strangers = sorted(in_tables.keys() - finished)
    if strangers:
        yield Disagreement(
            f"{len(strangers)} twins of the tables are of no item ({strangers[0]} ...); manitwin index makes the tables again",
            None,
        )


def _is_json(content: bytes) -> bool:
    try:
        json.loads(content)
    except ValueError:
        return False
    return True


def _redo(ledger: Ledger, root: DatasetRoot, number: int, twin_id: str) -> None:
    """Have an item's folder put together again, from the results of its stages where they are still there."""
    root.remove(root.twin_name(twin_id))
    ledger.reopen([number])


def _execute(ledger: Ledger, statement: str, rows: list[tuple[object, ...]]) -> None:
    ledger.connection.executemany(statement, rows)
    ledger.commit()
