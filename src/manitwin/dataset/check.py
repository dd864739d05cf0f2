"""Consistency check of a data set: compare the ledger, the index and the twin folders, and offer a repair per disagreement.

The folders are the ground truth: repairs change the ledger and the index to match them, or have a damaged folder rebuilt.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.machine_resources import available_cores
from manitwin.engine.stage_runner import RESULT, is_complete_result
from manitwin.errors import NewerVersion, TwinError, UsageError
from manitwin.formats.printable import printable_line
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.integrity import find_damage, find_foreign_files
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import RECORD, REMEDY, WORK, parse_record

INDEX = "index"
_FOLDER = re.compile(r"[0-9A-Za-z_-][0-9A-Za-z_.-]*")
"""Valid names of twin, stage and result folders. Names from the ledger are checked against it, since a ledger may be tampered
with.
"""


@dataclass(frozen=True)
class Disagreement:
    """One inconsistency and the function that repairs it; ``repair`` is None if it needs a manual decision."""

    what: str
    repair: Callable[[], None] | None


def disagreements(
    ledger: Ledger, root: DatasetRoot, keeps_work: bool, *, digests: bool = False
) -> Iterator[Disagreement]:
    """Yield every difference between a ledger and the folders below the root. No other process may write to the ledger.

    Files of finished twins are compared by size, with ``digests`` also by content. ``keeps_work`` also checks the stage results.
    """
    yield from _interrupted_items(ledger)
    yield from _missing_folders(ledger, root, digests)
    yield from _unrecorded_folders(ledger, root)
    yield from _partial_folders(root)
    if keeps_work:
        yield from _missing_stage_results(ledger, root, digests)
    yield from _index_disagreements(ledger, root)


def _interrupted_items(ledger: Ledger) -> Iterator[Disagreement]:
    (count,) = ledger.connection.execute("SELECT count(*) FROM stages WHERE state = 'running'").fetchone()
    if count:
        yield Disagreement(
            f"{count} stages are marked as running, but no run is active",
            partial(_execute, ledger, "UPDATE stages SET state = 'waiting' WHERE state = 'running'", [()]),
        )


def _missing_folders(ledger: Ledger, root: DatasetRoot, digests: bool) -> Iterator[Disagreement]:
    rows = ledger.connection.execute(
        "SELECT number, twin_id, state, revision FROM items WHERE state IN ('accepted', 'rejected') ORDER BY number"
    ).fetchall()
    for number, twin_id, state, revision in rows:
        called = f"item {number}, twin {printable_line(str(twin_id), max_characters=80)}"
        if not _FOLDER.fullmatch(str(twin_id)):
            yield Disagreement(f"{called}: not the name of a twin", partial(_reopen, ledger, number))
            continue
        try:
            record = _read_verified_record(root, twin_id)
        except FileNotFoundError:
            wrong: str | None = f"{state} in the ledger, but its folder is missing"
        except NewerVersion as error:
            yield Disagreement(f"{called}: {error}", None)
            continue
        except TwinError as error:
            wrong = str(error)
        else:
            wrong = _find_damage(root, record, state, revision, digests)
            foreign = find_foreign_files(root, root.twin_name(twin_id), record)
            if foreign and not wrong:
                yield Disagreement(
                    f"{called}: its folder contains {foreign}, which does not belong to it; remove it", None
                )
        if wrong:
            yield Disagreement(f"{called}: {wrong}", partial(_discard_twin, ledger, root, number, twin_id))


def _read_verified_record(root: DatasetRoot, twin_id: str) -> TwinRecord:
    """Return a twin's record after checking its revision; raises FileNotFoundError and TwinError."""
    name = f"{root.twin_name(twin_id)}/{RECORD}"
    record = parse_record(root.read_bytes(name), name, sealed=True)
    if record.twin_id != twin_id:
        raise TwinError(f"{name}: of the twin {record.twin_id!r}; {REMEDY}")
    return record


def _find_damage(root: DatasetRoot, record: TwinRecord, state: str, revision: str, digests: bool) -> str | None:
    if record.status != state:
        return f"{state} in the ledger, but {record.status} in its folder"
    if record.revision != revision:
        return "its folder has another revision than the ledger"
    return find_damage(root, root.twin_name(record.twin_id), record, digests=digests)


def damaged_twins(root: DatasetRoot, *, digests: bool = False) -> Iterator[str]:
    """Yield one line per damaged twin, or twin with foreign files in its folder, of a data set that has no ledger."""
    for twin_id in root.twin_ids():
        folder = root.twin_name(twin_id)
        try:
            record = _read_verified_record(root, twin_id)
        except TwinError as error:
            yield str(error)
            continue
        wrong = find_damage(root, folder, record, digests=digests)
        foreign = find_foreign_files(root, folder, record)
        if wrong:
            yield f"twin {twin_id}: {wrong}; remove {folder} and build its input again"
        elif foreign:
            yield f"twin {twin_id}: its folder contains {foreign}, which does not belong to it; remove it"


def _unrecorded_folders(ledger: Ledger, root: DatasetRoot) -> Iterator[Disagreement]:
    for twin_id in root.twin_ids():
        row = ledger.connection.execute(
            "SELECT number, state FROM items WHERE twin_id = ? AND state <> 'duplicate'", (twin_id,)
        ).fetchone()
        if row is None:
            # An item that has not been surveyed since the folder was made will find the folder by itself.
            (unknown,) = ledger.connection.execute("SELECT count(*) FROM items WHERE twin_id IS NULL").fetchone()
            if not unknown:
                yield Disagreement(
                    f"twin {twin_id}: a folder without an item in the ledger; a build with its input adopts it",
                    None,
                )


def _partial_folders(root: DatasetRoot) -> Iterator[Disagreement]:
    if root.local is None:
        return
    work = root.local / WORK
    for pattern in ("*/*/.*", "*.finished", "*.replaced"):
        for path in sorted(work.glob(pattern)):
            name = path.relative_to(root.local).as_posix()
            yield Disagreement(f"{name}: left incomplete", partial(root.remove, name))
    for path in sorted((root.local / "twins").glob("*/*")):
        if not (path / RECORD).is_file():
            name = path.relative_to(root.local).as_posix()
            yield Disagreement(f"{name}: a twin's folder without {RECORD}", partial(root.remove, name))


def _missing_stage_results(ledger: Ledger, root: DatasetRoot, digests: bool) -> Iterator[Disagreement]:
    """Yield the stage results that are marked as done but are damaged or missing.

    If an item has ended and its whole folder of results is gone, nothing is reported: a user may delete it to free disk space,
    and stages that are needed later run again.
    """
    rows = ledger.connection.execute(
        "SELECT s.number, i.twin_id, s.stage, s.key, i.state IN ('accepted', 'rejected', 'duplicate')"
        " FROM stages s JOIN items i USING (number) WHERE s.state = 'done' AND s.key IS NOT NULL ORDER BY s.number"
    ).fetchall()
    removed = {
        twin_id
        for twin_id in {str(row[1]) for row in rows if row[4]}
        if _FOLDER.fullmatch(twin_id) and not root.exists(f"{WORK}/{twin_id}")
    }
    for number, twin_id, stage, key, has_ended in rows:
        if has_ended and twin_id in removed:
            continue
        name = f"{WORK}/{twin_id}/{stage}/{key}"
        if all(_FOLDER.fullmatch(each) for each in (str(twin_id), stage, key)) and _is_result(root, name, digests):
            continue
        yield Disagreement(
            f"item {number}, stage {stage}: done in the ledger, but its result is missing",
            partial(_discard_stage_result, ledger, root, number, stage, name),
        )


def _index_disagreements(ledger: Ledger, root: DatasetRoot) -> Iterator[Disagreement]:
    from manitwin.dataset.index.parts import indexed_twins  # the import takes a second

    try:
        in_tables = indexed_twins(root)
    except UsageError as error:
        yield Disagreement(f"the index: {str(error).partition('; run ')[0]}", partial(_reindex, ledger, root))
        return
    ended = dict(
        ledger.connection.execute(
            "SELECT twin_id, revision FROM items WHERE state IN ('accepted', 'rejected') AND indexed = 1"
        ).fetchall()
    )
    lost = sorted(twin_id for twin_id, revision in ended.items() if in_tables.get(twin_id) != revision)
    if lost:
        yield Disagreement(
            f"{len(lost)} twins are marked as indexed, but no table has their current revision ({lost[0]} ...)",
            partial(_reindex, ledger, root),
        )
    finished = {twin_id for (twin_id,) in ledger.connection.execute("SELECT twin_id FROM items")}
    strangers = sorted(in_tables.keys() - finished)
    if strangers:
        yield Disagreement(
            f"{len(strangers)} twins of the tables belong to no item ({strangers[0]} ...); manitwin index rebuilds"
            f" the tables",
            None,
        )


def _is_result(root: DatasetRoot, name: str, digests: bool) -> bool:
    if root.local is not None:
        return is_complete_result(root.local / name, digests=digests)
    try:
        return bool(root.exists(f"{name}/{RESULT}") and root.read_json(f"{name}/{RESULT}"))
    except TwinError:
        return False


def _discard_stage_result(ledger: Ledger, root: DatasetRoot, number: int, stage: str, name: str) -> None:
    """Delete a stage's result and its ledger row, so that the stage runs again when the item is rebuilt."""
    root.remove(name)
    _execute(ledger, "DELETE FROM stages WHERE number = ? AND stage = ?", [(number, stage)])


def _reindex(ledger: Ledger, root: DatasetRoot) -> None:
    """Rewrite the index from the intact folders. Reopened items are added by the next build."""
    _execute(ledger, "UPDATE items SET indexed = 0", [()])
    if next(root.twin_ids(), None) is None:
        root.remove(INDEX)
        return
    ledger.mark_indexed(rebuild_index(root))


def rebuild_index(root: DatasetRoot) -> set[str]:
    """Rewrite the index from the folders and return the ids of the twins in it."""
    from manitwin.dataset.index.parts import indexed_twins
    from manitwin.dataset.index.rebuild import rebuild

    root.remove(INDEX)
    rebuild(root, jobs=available_cores())
    return set(indexed_twins(root))


def _discard_twin(ledger: Ledger, root: DatasetRoot, number: int, twin_id: str) -> None:
    """Remove a twin's folder and reopen its item, so that it is assembled again, from existing stage results where possible."""
    root.remove(root.twin_name(twin_id))
    ledger.reopen([number])


def _reopen(ledger: Ledger, number: int) -> None:
    ledger.reopen([number])


def _execute(ledger: Ledger, statement: str, rows: list[tuple[object, ...]]) -> None:
    ledger.connection.executemany(statement, rows)
    ledger.commit()


def index_damage(root: DatasetRoot) -> str | None:
    """Return what is wrong with the index of a data set without a ledger; None if it is intact or does not exist."""
    from manitwin.dataset.index.parts import indexed_twins

    if not root.exists(INDEX):
        return None
    try:
        in_tables = indexed_twins(root)
    except UsageError as error:
        return f"the index: {str(error).partition('; run ')[0]}"
    differ = in_tables.keys() ^ set(root.twin_ids())
    return f"the index and the folders differ in {len(differ)} twins" if differ else None
