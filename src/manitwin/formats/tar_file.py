"""Reader of untrusted tarballs: selected members, each within a limit, and a limit on the total unpacked size."""

from __future__ import annotations

import gzip
import tarfile
import zlib
from collections.abc import Callable
from pathlib import Path

from manitwin.formats.bounded_file import Refusal, open_regular
from manitwin.formats.printable import printable_line

MAX_MEMBERS = 10_000


class _SizeExceeded(Exception):
    pass


class _Unpacked:
    """A gzipped stream limited to ``limit`` bytes, including the names and comments of a tarball."""

    def __init__(self, stream: gzip.GzipFile, limit: int) -> None:
        self._stream, self._left = stream, limit

    def read(self, size: int) -> bytes:
        """Return the next bytes; raises _TooMuch beyond the limit."""
        content = self._stream.read(min(size, self._left + 1))
        self._left -= len(content)
        if self._left < 0:
            raise _SizeExceeded
        return content


def read_members(
    path: Path, wanted: Callable[[str], int], refuse: Refusal, *, max_unpacked_bytes: int
) -> dict[str, bytes]:
    """Return, by name, the regular members of a gzipped tarball for which ``wanted`` returns a positive size limit.

    Nothing is written; links, devices and folders are skipped. Raises the error that ``refuse`` makes of a line: no such
    tarball, a member that exceeds its limit or occurs twice, more than ``MAX_MEMBERS`` members or ``max_unpacked_bytes`` bytes.
    """
    called = printable_line(path.name, max_characters=200)
    found: dict[str, bytes] = {}
    too_much = refuse(
        f"{called}: unpacks to more than {max_unpacked_bytes} bytes or {MAX_MEMBERS} files; give the tarball as it was published"
    )
    with open_regular(path, refuse) as stream, gzip.GzipFile(fileobj=stream) as unpacked:
        try:
            bounded = _Unpacked(unpacked, max_unpacked_bytes)
            with tarfile.open(fileobj=bounded, mode="r|") as archive:  # type: ignore[call-overload]
                for number, member in enumerate(archive):
                    if number >= MAX_MEMBERS:
                        raise too_much
                    limit = wanted(member.name) if member.isreg() and not member.issparse() else 0
                    if limit <= 0:
                        continue
                    if member.size > limit or member.name in found:
                        shown = printable_line(member.name, max_characters=100)
                        raise refuse(
                            f"{called}: {shown} of {member.size} bytes is larger than {limit}, or comes twice; fetch it again"
                        )
                    content = archive.extractfile(member)
                    found[member.name] = b"" if content is None else content.read(limit)
        except _SizeExceeded:
            raise too_much from None
        except (tarfile.TarError, zlib.error, EOFError, OSError, ValueError) as error:
            cause = printable_line(str(error) or type(error).__name__, max_characters=120)
            raise refuse(f"{called}: no gzipped tarball that can be read ({cause}); fetch it again") from error
    return found
