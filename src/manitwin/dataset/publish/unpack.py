"""Make twins' folders of a shard again, trusting nothing in it."""

from __future__ import annotations

import tarfile
import tempfile
from collections.abc import Iterator
from pathlib import Path

from manitwin.dataset.publish.shards import KEY, parts_of, unpack
from manitwin.errors import TwinError, UsageError
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.store import RECORD, RUN, read_record, replace_folder


def unpack_shard(shard: str | Path, out: str | Path) -> list[Path]:
    """Write the twins of a shard into a data set at ``out`` (``out/twins/<2 hex>/<twin_id>/``); returns their folders.

    A twin is written beside its place, verified against its own digests and renamed, so that no folder is ever half made;
    one that is there already is replaced. Raises UsageError for a shard that is not there, and TwinError, naming the
    member, for anything that no shard of ours has: links, devices, sparse files, names with folders, parts that twin.json
    does not name, altered files.
    """
    path, place = Path(shard), Path(out)
    if not path.is_file():
        raise UsageError(f"{shard}: no such file; give a .tar of a published data set")
    place.mkdir(parents=True, exist_ok=True)
    folders = []
    with tempfile.TemporaryDirectory(prefix=".unpack-", dir=place) as scratch:
        try:
            for twin_id, parts in samples(path):
                fresh = _write_twin(path, twin_id, parts, Path(scratch))
                folders.append(place / twin_name(twin_id))
                replace_folder(fresh, folders[-1])
        except tarfile.TarError as error:
            raise TwinError(f"{path}: not a whole tar file ({error}); download it again") from error
    return folders


def samples(shard: Path) -> Iterator[tuple[str, dict[str, bytes]]]:
    """Yield the key and the parts of each sample of a shard; raises TwinError for a member that none of ours has."""
    key, parts = "", dict[str, bytes]()
    with tarfile.open(shard, "r:") as tar:
        for member in tar:
            this, _, part = member.name.partition(".")
            if not KEY.fullmatch(this) or not part or "/" in part or "\\" in part:
                raise TwinError(f"{shard}: member {member.name!r} is not named <twin_id>.<part>; not unpacked")
            if not member.isreg() or member.issparse():
                raise TwinError(f"{shard}: member {member.name!r} is no plain file; not unpacked")
            if key and this != key:
                yield key, parts
                parts = {}
            key = this
            if part in parts:
                raise TwinError(f"{shard}: member {member.name!r} is there twice; not unpacked")
            stream = tar.extractfile(member)
            content = stream.read() if stream is not None else b""
            if len(content) != member.size:
                raise TwinError(f"{shard}: member {member.name!r} is cut off; download it again")
            parts[part] = content
    if key:
        yield key, parts


def _write_twin(shard: Path, twin_id: str, parts: dict[str, bytes], scratch: Path) -> Path:
    folder = scratch / twin_id
    folder.mkdir()
    if RECORD not in parts:
        raise TwinError(f"{shard}: sample {twin_id} has no {RECORD}; not unpacked")
    (folder / RECORD).write_bytes(parts[RECORD])
    record = read_record(folder)
    if record.twin_id != twin_id:
        raise TwinError(f"{shard}: sample {twin_id} has the record of {record.twin_id!r}; not unpacked")
    named = parts_of([*record.files, RECORD, *([RUN] if RUN in parts else [])])
    if set(named) != set(parts):
        odd = sorted(set(named) ^ set(parts))
        raise TwinError(
            f"{shard}: sample {twin_id}: {', '.join(odd)} is missing or not named by {RECORD}; not unpacked"
        )
    for part, files in named.items():
        for name, content in unpack(files, parts[part]).items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
    read_record(folder, verify=True)
    return folder
