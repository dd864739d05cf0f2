"""Package of a 3MF archive (Open Packaging Conventions): its parts by name, including the model part."""

from __future__ import annotations

import io
import posixpath
import zipfile
import zlib
from collections.abc import Iterator
from functools import partial

from manitwin.errors import InputError
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.xml_file import parse_xml

_RELATIONSHIPS = "_rels/.rels"
_MODEL_RELATIONSHIP = "/3dmodel"
"""End of the relationship type that leads to the model (3MF Core Specification, section 2.1)."""
_CENTRAL_HEADER = b"PK\x01\x02"
"""Start of a member's entry in an archive's central directory (APPNOTE 4.3.12)."""
_MAX_MEMBERS = 10_000
_MAX_TEXT_BYTES = 16 << 20
_BLOCK_BYTES = 1 << 20
_BROKEN = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, OSError)


class ThreeMfPackage:
    """The parts of a 3MF archive by name, with a limit on the total unpacked size; nothing is written to disk."""

    def __init__(self, source: MeshSource):
        self._source = source
        content = source.data()
        if content.count(_CENTRAL_HEADER) > _MAX_MEMBERS:  # before a list of them is allocated
            raise source.too_large(f"it has more than {_MAX_MEMBERS} files in its archive", "pack fewer files")
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(content))
            self._members = {_part_name(member.filename): member for member in self._zip.infolist()}
        except (*_BROKEN, ValueError) as error:
            cause = f"truncated or broken: its archive cannot be read ({str(error)[:60]})"
            raise source.unreadable(cause, "download it again") from error

    def model(self) -> str:
        """Return the name of the part with the model; raises InputError ``unreadable`` if there is none."""
        text = self.text(f"/{_RELATIONSHIPS}")
        if text is not None:
            refusal = partial(InputError, "unreadable")
            root = parse_xml(text, "Relationships", self._source.name, refusal=refusal)
            for each in root.iter("{*}Relationship"):
                if (each.get("Type") or "").endswith(_MODEL_RELATIONSHIP):
                    return _part_name(each.get("Target") or "")
        found = sorted(name for name in self._members if name.endswith(".model"))
        if not found:
            raise self._source.unreadable("its archive contains no 3D model", "export it again as 3MF")
        return found[0]

    def blocks(self, name: str) -> Iterator[bytes]:
        """Yield the content of a required part in blocks.

        Raises InputError: ``unreadable`` if it is missing or broken, ``too_large`` beyond the limit.
        """
        member = self._members.get(_part_name(name))
        if member is None:
            raise self._source.unreadable(f"its part {name[:80]!r} is not in the archive", "export it again as 3MF")
        try:
            with self._zip.open(member) as stream:
                while block := stream.read(_BLOCK_BYTES):
                    self._count(len(block))
                    yield block
        except _BROKEN as error:
            cause = f"its part {name[:80]!r} is broken ({str(error)[:60]})"
            raise self._source.unreadable(cause, "download it again") from error

    def text(self, name: str) -> bytes | None:
        """Return the content of a part of at most 16 MiB, or None if it is missing or larger."""
        member = self._members.get(_part_name(name))
        if member is None or member.file_size > _MAX_TEXT_BYTES:
            return None
        return b"".join(self.blocks(name))

    def texture(self, name: str) -> bytes | None:
        """Return the content of a picture, or None with a finding if it is missing."""
        if _part_name(name) not in self._members:
            self._source.add_finding(f"texture {name[:80]!r} is not in the archive; carried on without it")
            return None
        return b"".join(self.blocks(name))

    def _count(self, size_bytes: int) -> None:
        self._source.bytes_read += size_bytes
        limit = self._source.limits.max_bytes
        if self._source.bytes_read > limit:
            raise self._source.too_large(f"it unpacks to more than {limit} bytes")


def _part_name(name: str) -> str:
    """Return a part's name normalized for comparison: absolute, case-insensitive (OPC, section 6.2.2.3)."""
    return posixpath.normpath("/" + name.replace("\\", "/").lstrip("/")).lower()
