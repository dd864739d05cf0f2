"""Target folder or URL of a publication: files are written atomically, and an interrupted publication can be resumed.

OUT/SHA256SUMS is written last and marks a complete publication. Until then, OUT/.publish/ holds a receipt per finished shard. A
shard whose receipt matches its planned contents is not written again.
"""

from __future__ import annotations

import io
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO

from manitwin.dataset.publish.shard_plan import Shard, check_hub_limits
from manitwin.dataset.publish.tables import SHARDS, SHARDS_FILE
from manitwin.errors import UsageError
from manitwin.formats.parquet_file import read_parquet
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import canonical_json, sha256_of_file

SUMS = "SHA256SUMS"
OPEN = ".publish"
_STARTED = f"{OPEN}/started"
_SCRATCH = "scratch-"
_ANEW = "publish into a new or empty folder"
_RECEIPT = {"shard": str, "twins": int, "bytes": int, "sha256": str, "contents_sha256": str}


@dataclass(frozen=True)
class Kind:
    """A kind of publication: the ``folders`` that it owns besides ``.publish/``, and the file ``sign`` of a finished one."""

    name: str
    folders: tuple[str, ...]
    sign: str


TWINS = Kind("twins", ("data", "index", "pictures"), SHARDS_FILE)
EPISODES = Kind("episodes", ("meta", "data", "videos"), "meta/info.json")


class Publication:
    """Writes files below one root and records their digests.

    Owns everything below the folders of its kind and ``.publish/`` of the root.
    """

    def __init__(self, root: DatasetRoot, kind: Kind = TWINS):
        self.root, self.kind = root, kind
        self.digests: dict[str, str] = {}
        self.sizes: dict[str, int] = {}
        self._receipts: dict[str, dict[str, Any]] = {}

    def require_own_root(self) -> None:
        """Raise UsageError unless the root is empty or has a publication of this kind, interrupted or older."""
        root = self.root
        root.fs.invalidate_cache()
        if root.exists(_STARTED):
            begun = (
                root.read_bytes(_STARTED, UsageError, limit_bytes=1024).decode(errors="replace") or TWINS.name
            )  # older versions wrote an empty file, for twins
            if begun != self.kind.name:
                raise UsageError(
                    f"{root.url}: it contains an unfinished publication of {begun}; give a new or empty folder"
                )
        elif not self._is_finished() and self._visible_entries():
            raise UsageError(
                f"{root.url}: not empty, and not a publication of {self.kind.name} by manitwin; give a new or empty"
                f" folder"
            )

    def begin(self) -> None:
        """Open a new, interrupted or older publication. Raises UsageError if the root has anything else."""
        self.require_own_root()
        root = self.root
        if not root.exists(_STARTED):
            if self.kind == TWINS and self._is_finished():
                content = io.BytesIO(root.read_bytes(SHARDS_FILE, UsageError))
                name = root.full(SHARDS_FILE)
                for row in read_parquet(content, UsageError, schema=SHARDS, remedy=_ANEW, name=name).to_pylist():
                    self._write_receipt(row)
            root.write_bytes(_STARTED, self.kind.name.encode())
        root.remove(SUMS)
        for name in root.names_below(OPEN):
            if name.endswith(".json") and PurePosixPath(name).parent == PurePosixPath(OPEN):
                receipt = root.read_json(name, UsageError, remedy=_ANEW)
                if {field: type(value) for field, value in receipt.items()} != _RECEIPT:
                    raise UsageError(f"{root.full(name)}: no receipt of a shard; {_ANEW}")
                self._receipts[receipt["shard"]] = receipt

    def _is_finished(self) -> bool:
        return self.root.exists(SUMS) and self.root.exists(self.kind.sign)

    def _visible_entries(self) -> list[str]:
        path = self.root.path
        if not self.root.fs.exists(path):
            return []
        names = [PurePosixPath(str(entry)).name for entry in self.root.fs.ls(path, detail=False)]
        return [name for name in names if not name.startswith(".")]

    def has(self, shard: Shard) -> bool:
        """Return whether a shard with the planned contents exists; its digest then counts as written."""
        receipt = self._receipts.get(shard.name)
        if receipt is None or receipt["contents_sha256"] != shard.contents_sha256 or not self.root.exists(shard.name):
            return False
        if self.root.fs.info(self.root.full(shard.name))["size"] != receipt["bytes"]:
            return False
        self.digests[shard.name], self.sizes[shard.name] = receipt["sha256"], receipt["bytes"]
        return True

    def write_shard(self, shard: Shard, write: Callable[[BinaryIO], None]) -> None:
        """Write a shard to a temporary file, move it into place and write its receipt."""
        receipt = _receipt_name(shard.name)
        with self.scratch() as scratch:
            path = scratch / "shard.tar"
            with path.open("wb") as stream:
                write(stream)
                stream.flush()
                os.fsync(stream.fileno())
            self.root.remove(receipt)  # the receipt of an older shard is no longer valid
            self.put(path, shard.name)
        self._write_receipt(self.row(shard))

    def row(self, shard: Shard) -> dict[str, Any]:
        """Return a written shard as a row of the table of shards."""
        return {
            "shard": shard.name,
            "twins": len(shard.twins),
            "bytes": self.sizes[shard.name],
            "sha256": self.digests[shard.name],
            "contents_sha256": shard.contents_sha256,
        }

    def put(self, path: Path, name: str) -> None:
        """Move a finished file, on the root's own file system, into place."""
        self.digests[name], self.sizes[name] = sha256_of_file(path), path.stat().st_size
        if self.root.local is None:
            self.root.put_file(path, name)
            return
        place = self.root.local / name
        place.parent.mkdir(parents=True, exist_ok=True)
        os.replace(path, place)

    def write(self, name: str, content: bytes) -> None:
        """Write a small file."""
        self.root.write_bytes(name, content)
        self.digests[name], self.sizes[name] = sha256(content).hexdigest(), len(content)

    def finish(self) -> None:
        """Remove files left from an older publication, and write the digests of all files."""
        check_hub_limits({**self.sizes, SUMS: 0})
        there = {name for folder in self.kind.folders for name in self.root.names_below(folder)}
        for name in there - self.digests.keys():
            self.root.remove(name)
            folder = None if self.root.local is None else (self.root.local / name).parent
            if folder is not None and not any(folder.iterdir()):
                folder.rmdir()
        lines = [f"{digest}  {name}\n" for name, digest in sorted(self.digests.items())]
        self.root.write_bytes(SUMS, "".join(lines).encode())
        self.root.remove(OPEN)

    @contextmanager
    def scratch(self) -> Iterator[Path]:
        """Yield a temporary folder for files to ``put``; the publication need not have begun.

        For a local root, the folder is below ``.publish/``, where leftovers of killed processes are removed first. A root that
        did not exist before and is empty afterwards is removed.
        """
        if self.root.local is None:
            with tempfile.TemporaryDirectory() as scratch:
                yield Path(scratch)
            return
        opened = self.root.local / OPEN
        fresh = [each for each in opened.parents if not each.exists()]
        opened.mkdir(parents=True, exist_ok=True)
        for left in opened.glob(f"{_SCRATCH}*"):
            shutil.rmtree(left)
        try:
            with tempfile.TemporaryDirectory(prefix=_SCRATCH, dir=opened) as scratch:
                yield Path(scratch)
        finally:
            for folder in (opened, *fresh):
                if folder.is_dir() and not any(folder.iterdir()):
                    folder.rmdir()

    def _write_receipt(self, row: dict[str, Any]) -> None:
        self.root.write_bytes(_receipt_name(row["shard"]), canonical_json(row).encode())


def _receipt_name(shard: str) -> str:
    return f"{OPEN}/{PurePosixPath(shard).stem}.json"
