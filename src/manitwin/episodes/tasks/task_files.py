"""Task files, ``TASKS/tasks.jsonl``: one task per line, written atomically and validated strictly."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from pydantic import ValidationError

from manitwin.episodes.tasks.task_record import TASK_SCHEMA_VERSION, TaskRecord
from manitwin.errors import UsageError
from manitwin.formats.bounded_file import decode_text, read_bytes
from manitwin.formats.json_file import parse_json_object
from manitwin.formats.printable import printable_line
from manitwin.formats.schema_version import is_newer, newer_schema_message
from manitwin.twin.store import write_bytes_atomically

TASKS = "tasks.jsonl"
MOST_BYTES = 1 << 30
_REMEDY = "make the tasks again with manitwin tasks"


def tasks_bytes(tasks: Iterable[TaskRecord]) -> bytes:
    """Return the content of a task file; deterministic for equal tasks."""
    lines = (json.dumps(each.model_dump(mode="json"), sort_keys=True, ensure_ascii=False) for each in tasks)
    return "".join(f"{line}\n" for line in lines).encode()


def write_tasks(path: Path, tasks: Iterable[TaskRecord]) -> None:
    """Write a task file atomically."""
    write_bytes_atomically(path, tasks_bytes(tasks))


def read_tasks(place: str | Path) -> list[TaskRecord]:
    """Read a task file, or the one in a folder.

    Raises UsageError naming file, line and cause for a missing file, another schema version, or an invalid line.
    """
    path = Path(place) / TASKS if Path(place).is_dir() else Path(place)
    if not path.is_file():
        raise UsageError(f"{path}: not found; give a folder that manitwin tasks wrote, or its {TASKS}")
    text = decode_text(
        read_bytes(path, MOST_BYTES, UsageError, inside=path.parent, name=str(path)), str(path), UsageError
    )
    tasks = [_task(line, f"{path}:{number}") for number, line in enumerate(text.splitlines(), 1) if line.strip()]
    ids = {task.task_id for task in tasks}
    if len(ids) != len(tasks):
        raise UsageError(f"{path}: {len(tasks) - len(ids)} tasks are repeated; {_REMEDY}")
    return tasks


def _task(line: str, where: str) -> TaskRecord:
    said = parse_json_object(line, where, UsageError, remedy=_REMEDY)
    version = said.get("schema_version")
    if is_newer(version, TASK_SCHEMA_VERSION):
        raise UsageError(newer_schema_message(where, version, TASK_SCHEMA_VERSION))
    if version != TASK_SCHEMA_VERSION:
        shown = printable_line(str(version), max_characters=40)
        raise UsageError(f"{where}: task version {shown}, this package reads {TASK_SCHEMA_VERSION}; {_REMEDY}")
    try:
        return TaskRecord.model_validate_json(line)
    except ValidationError as error:
        first = error.errors()[0]
        place = printable_line(".".join(map(str, first["loc"])) or "the whole", max_characters=80)
        raise UsageError(f"{where}: {place}: {printable_line(first['msg'], max_characters=300)}; {_REMEDY}") from error


def one_task(place: str | Path, task_id: str | None) -> TaskRecord:
    """Return a task of a file by its id, or the only one without an id; raises UsageError for an unknown or ambiguous id."""
    tasks = read_tasks(place)
    if task_id is None and len(tasks) == 1:
        return tasks[0]
    for task in tasks:
        if task.task_id == task_id:
            return task
    some = ", ".join(task.task_id for task in tasks[:5]) + (", ..." if len(tasks) > 5 else "")
    asked = "say which task" if task_id is None else f"no task {printable_line(task_id, max_characters=40)!r}"
    raise UsageError(f"{place}: {asked}; there are {len(tasks)}: {some or 'none'}")
