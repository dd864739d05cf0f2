"""Write a shard: the members of its twins, each file checked against its twin's digests, in a tar of no date and no owner."""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Iterator
from hashlib import sha256
from typing import Any, BinaryIO

from pydantic import ValidationError

from manitwin.dataset.publish.members import pack, parts_of
from manitwin.dataset.publish.privacy import check_part, check_source
from manitwin.dataset.publish.shard_plan import Shard, ShardTwin
from manitwin.errors import TwinError, UsageError
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import RECORD, RUN, canonical_json, revision_of


def write_shard(stream: BinaryIO, root: DatasetRoot, shard: Shard, places: tuple[bytes, ...]) -> None:
    """Write the tar of a shard; the same twins give the same bytes.

    ``places`` are local paths that may not be in it. Raises TwinError for a twin that is altered, incomplete or names such
    a path, UsageError for one that is not what the index says.
    """
    with tarfile.open(fileobj=stream, mode="w", format=tarfile.PAX_FORMAT) as tar:
        for twin in shard.twins:
            for part, content in twin_parts(root, twin):
                check_part(twin.twin_id, part, content, places)
                member = tarfile.TarInfo(f"{twin.twin_id}.{part}")  # no owner, no date, mode 644: its defaults
                member.size = len(content)
                tar.addfile(member, io.BytesIO(content))


def twin_parts(root: DatasetRoot, twin: ShardTwin) -> Iterator[tuple[str, bytes]]:
    """Yield a twin's parts by name: its files, and run.json without the machine that it ran on."""
    folder = twin_name(twin.twin_id)
    content = _contents(root, folder, [RECORD])[RECORD]
    record = _record(root, twin, content)
    contents = _contents(root, folder, sorted(record.files))
    for name, digest in record.files.items():
        if sha256(contents[name]).hexdigest() != digest:
            raise TwinError(f"{root.full(folder)}/{name}: altered since it was written; build the twin again")
    contents[RECORD] = content
    run = _run(root, folder)
    if run is not None:
        contents[RUN] = run
    for part, files in parts_of(contents).items():
        yield part, pack(files, contents)


def _contents(root: DatasetRoot, folder: str, names: list[str]) -> dict[str, bytes]:
    try:
        if root.local is not None:
            return {name: (root.local / folder / name).read_bytes() for name in names}
        paths = {root.full(f"{folder}/{name}"): name for name in names}
        return {paths[path]: content for path, content in root.fs.cat(list(paths)).items()}  # all at once
    except FileNotFoundError as error:
        raise TwinError(f"{root.full(folder)}: a file is missing ({error}); build the twin again") from error


def _record(root: DatasetRoot, twin: ShardTwin, content: bytes) -> TwinRecord:
    place = f"{root.full(twin_name(twin.twin_id))}/{RECORD}"
    try:
        data = json.loads(content)
        record = TwinRecord(**data)
    except (ValueError, TypeError, ValidationError) as error:
        raise TwinError(f"{place}: cannot be read ({str(error).splitlines()[0]}); build the twin again") from error
    if revision_of(data) != record.revision:
        raise TwinError(f"{place}: altered since it was written; build the twin again")
    if (record.twin_id, record.revision) != (twin.twin_id, twin.revision):
        raise UsageError(f"{place}: not the revision that the index has; run manitwin index {root.url}")
    check_source(record)
    return record


def _run(root: DatasetRoot, folder: str) -> bytes | None:
    name = f"{folder}/{RUN}"
    try:
        run: Any = json.loads(root.read_bytes(name))
        return canonical_json({"host": {}, "stages": run["stages"]}).encode()
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError) as error:
        raise TwinError(f"{root.full(name)}: cannot be read ({error}); build the twin again") from error
