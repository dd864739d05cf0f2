"""Writing and reading of shards. Each file is verified against its twin's digests; tar members have no dates and owners.

webdataset splits a member's name at the first dot into the sample key (the twin id) and the part name. Parts have no folders:
``views/rgb_00.webp`` becomes ``rgb_00.webp``, and every other folder becomes one archive, ``collision/hull_00.obj ...`` is
``collision.zip``. Archives are stored uncompressed. Their bytes then do not depend on the zlib version, they cannot be
decompression bombs, and the files keep the bytes whose digests are in twin.json.
"""

from __future__ import annotations

import io
import re
import tarfile
import tempfile
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from hashlib import sha256
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from manitwin.dataset.publish.privacy import check_part, check_source
from manitwin.dataset.publish.shard_plan import VIEWS, Shard, ShardTwin
from manitwin.errors import TwinError, UsageError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.json_file import parse_json_object
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import (
    RECORD,
    REMEDY,
    RUN,
    canonical_json,
    parse_record,
    read_record,
    replace_folder,
    revision_of,
)

KEY = re.compile(r"[0-9A-Za-z_-]+")
"""Valid sample keys and folder names."""

_FILE = re.compile(r"[0-9A-Za-z_-][0-9A-Za-z_.-]*(?:/[0-9A-Za-z_-][0-9A-Za-z_.-]*)*")
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest date of a ZIP entry


def write_shard(stream: BinaryIO, root: DatasetRoot, shard: Shard, places: tuple[bytes, ...]) -> None:
    """Write the tar archive of a shard; equal twins give equal bytes.

    ``places`` are local paths that must not occur in it. Raises TwinError for a twin that is altered, incomplete or names such a
    path, and UsageError for a twin whose revision differs from the index.
    """
    with tarfile.open(fileobj=stream, mode="w", format=tarfile.PAX_FORMAT) as tar:
        for twin in shard.twins:
            for part, content in twin_parts(root, twin):
                check_part(twin.twin_id, part, content, places)
                member = tarfile.TarInfo(f"{twin.twin_id}.{part}")  # default owner, date and mode 644
                member.size = len(content)
                tar.addfile(member, io.BytesIO(content))


def twin_parts(root: DatasetRoot, twin: ShardTwin) -> Iterator[tuple[str, bytes]]:
    """Yield the name and bytes of each part of a twin: its files, and run.json without the host."""
    folder = root.twin_name(twin.twin_id)
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
            return {name: root.read_bytes(f"{folder}/{name}") for name in names}
        paths = {root.full(f"{folder}/{name}"): name for name in names}
        return {paths[path]: content for path, content in root.fs.cat(list(paths)).items()}  # all files concurrently
    except FileNotFoundError as error:
        raise TwinError(f"{root.full(folder)}: a file is missing ({error}); build the twin again") from error


def _record(root: DatasetRoot, twin: ShardTwin, content: bytes) -> TwinRecord:
    place = f"{root.full(root.twin_name(twin.twin_id))}/{RECORD}"
    record = parse_record(content, place)
    if revision_of(parse_json_object(content, place, TwinError, remedy=REMEDY)) != record.revision:
        raise TwinError(f"{place}: altered since it was written; build the twin again")
    if (record.twin_id, record.revision) != (twin.twin_id, twin.revision):
        raise UsageError(f"{place}: not the revision in the index; run manitwin index {root.url}")
    check_source(record)
    return record


def _run(root: DatasetRoot, folder: str) -> bytes | None:
    name = f"{folder}/{RUN}"
    try:
        run = root.read_json(name, TwinError, remedy=REMEDY)
        return canonical_json({"host": {}, "stages": run["stages"]}).encode()
    except FileNotFoundError:
        return None
    except (KeyError, TypeError) as error:
        raise TwinError(f"{root.full(name)}: cannot be read ({error}); {REMEDY}") from error


def parts_of(files: Iterable[str]) -> dict[str, list[str]]:
    """Return ``{part: names of its files}``, sorted, for the files of a twin.

    Raises TwinError for a file name that leaves the folder, and for two files with the same part name.
    """
    parts: dict[str, list[str]] = {}
    single: set[str] = set()
    for file in sorted(files):
        if not _FILE.fullmatch(file):
            raise TwinError(
                f"{file!r}: not a valid file name in a twin; use letters, digits and . _ - in relative names"
            )
        path, alone = PurePosixPath(file), not is_archive([file])
        part = path.name if alone else f"{path.parts[0]}.zip"
        part = part.lower()  # webdataset lower-cases part names
        if part in single or (alone and part in parts):
            raise TwinError(f"{file}: another file of the twin has the same part {part!r}; rename one of them")
        if alone:
            single.add(part)
        parts.setdefault(part, []).append(file)
    return dict(sorted(parts.items()))


def is_archive(files: list[str]) -> bool:
    """Return whether the files of a part are stored in an archive."""
    parts = PurePosixPath(files[0]).parts
    return len(parts) > 2 or (len(parts) == 2 and parts[0] != VIEWS)


def pack(files: list[str], contents: Mapping[str, bytes]) -> bytes:
    """Return a part's bytes: those of its file, or an uncompressed, undated ZIP archive of the folder's files."""
    if not is_archive(files):
        return contents[files[0]]
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        for file in files:
            entry = zipfile.ZipInfo(file.partition("/")[2], _EPOCH)
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, contents[file])
    return stream.getvalue()


def unpack(files: list[str], content: bytes) -> dict[str, bytes]:
    """Return the files of a part; raises TwinError for an archive that is compressed or has other entries."""
    if not is_archive(files):
        return {files[0]: content}
    folder = files[0].partition("/")[0]
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = archive.infolist()
            if any(entry.compress_type != zipfile.ZIP_STORED for entry in entries):
                raise TwinError(f"{folder}.zip: compressed, unlike the shards of manitwin; download the shard again")
            if sorted(f"{folder}/{entry.filename}" for entry in entries) != files:
                raise TwinError(f"{folder}.zip: its files are not those named in twin.json; download the shard again")
            return {f"{folder}/{entry.filename}": archive.read(entry) for entry in entries}
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError) as error:
        raise TwinError(f"{folder}.zip: cannot be read ({error}); download the shard again") from error


def unpack_shard(shard: str | Path, out: str | Path) -> list[Path]:
    """Write the twins of a shard into a data set at ``out`` (``out/twins/<2 hex>/<twin_id>/``); return their folders.

    A twin is written to a temporary folder, verified against its own digests and renamed into place, so that no folder is ever
    incomplete; an existing twin is replaced. Raises UsageError if the shard is missing. Raises TwinError, naming the member, for
    content that no valid shard has: links, devices, sparse files, names with folders, parts that twin.json does not name, and
    altered files.
    """
    path, place = Path(shard), Path(out)
    open_regular(path, UsageError, name=str(shard)).close()
    place.mkdir(parents=True, exist_ok=True)
    folders = []
    with tempfile.TemporaryDirectory(prefix=".unpack-", dir=place) as scratch:
        try:
            for twin_id, parts in samples(path):
                fresh = _write_twin(path, twin_id, parts, Path(scratch))
                folders.append(place / twin_name(twin_id))
                replace_folder(fresh, folders[-1])
        except tarfile.TarError as error:
            raise TwinError(f"{path}: not a complete tar file ({error}); download it again") from error
    return folders


def samples(shard: Path) -> Iterator[tuple[str, dict[str, bytes]]]:
    """Yield the key and parts of each sample of a shard; raises TwinError for members that no valid shard has."""
    key, parts = "", dict[str, bytes]()
    with tarfile.open(shard, "r:") as tar:
        for member in tar:
            this, _, part = member.name.partition(".")
            if not KEY.fullmatch(this) or not part or "/" in part or "\\" in part:
                raise TwinError(f"{shard}: member {member.name!r} is not named <twin_id>.<part>; not unpacked")
            if not member.isreg() or member.issparse():
                raise TwinError(f"{shard}: member {member.name!r} is not a regular file; not unpacked")
            if key and this != key:
                yield key, parts
                parts = {}
            key = this
            if part in parts:
                raise TwinError(f"{shard}: member {member.name!r} occurs twice; not unpacked")
            stream = tar.extractfile(member)
            content = stream.read() if stream is not None else b""
            if len(content) != member.size:
                raise TwinError(f"{shard}: member {member.name!r} is truncated; download it again")
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
