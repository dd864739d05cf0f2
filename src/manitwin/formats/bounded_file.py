"""Bounded reading of untrusted files: only regular files inside a given folder, up to a size limit."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from manitwin.formats.printable import printable_line

Refusal = Callable[[str], Exception]
"""Makes the error for a message: an error class of the calling module, or a function."""

_NAME_CHARACTERS = 200
_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a named pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def with_remedy(refuse: Refusal, remedy: str) -> Refusal:
    """Return a refusal that replaces the remedy in a message, the text after the last semicolon."""

    def refused(line: str) -> Exception:
        return refuse(f"{line.rpartition('; ')[0] or line}; {remedy}")

    return refused


def open_regular(path: Path, refuse: Refusal, *, inside: Path | None = None, name: str | None = None) -> BinaryIO:
    """Open a regular file for reading bytes; a pipe, device, socket or folder is refused without blocking.

    A symbolic link is followed if it leads to a regular file, and with ``inside`` only if that lies below this folder. ``name``
    is what messages call the file (default: its own name). Raises the error that ``refuse`` makes of a line with cause and
    remedy.
    """
    called = printable_line(path.name if name is None else name, max_characters=_NAME_CHARACTERS)
    try:
        if inside is not None and not path.resolve().is_relative_to(inside.resolve()):
            raise refuse(f"{called}: leads outside its folder, and is not read; replace the link by the file")
        # does not wait for the other end of a pipe, nor acquire a controlling terminal
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
    except (OSError, ValueError, RuntimeError) as error:  # NUL in a name; loop of links (RuntimeError until 3.12)
        raise refuse(f"{called}: cannot be opened ({_cause(error)}); check the path") from error
    try:
        mode = os.fstat(descriptor).st_mode
        if not stat.S_ISREG(mode):
            kind = _KINDS.get(stat.S_IFMT(mode), "not a regular file")
            raise refuse(f"{called}: is {kind}, but only regular files are read; give a file")
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def read_bytes(
    path: Path,
    limit_bytes: int,
    refuse: Refusal,
    *,
    inside: Path | None = None,
    name: str | None = None,
    refuse_size: Refusal | None = None,
) -> bytes:
    """Return the content of a regular file of at most ``limit_bytes``; opened and refused like ``open_regular``.

    ``refuse_size`` makes the error for a larger file (default: ``refuse``).
    """
    called = printable_line(path.name if name is None else name, max_characters=_NAME_CHARACTERS)
    with open_regular(path, refuse, inside=inside, name=name) as stream:
        size = os.fstat(stream.fileno()).st_size
        try:
            content = _content(stream, size, limit_bytes) if size <= limit_bytes else b""
        except OSError as error:
            raise refuse(f"{called}: cannot be read ({_cause(error)}); check the disk, or copy it again") from error
    if size > limit_bytes or len(content) > limit_bytes:
        said = max(size, len(content))
        refuse_size = refuse_size or refuse
        raise refuse_size(f"{called}: {said} bytes exceed the limit of {limit_bytes}; give a smaller file")
    return content


def _content(stream: BinaryIO, size: int, limit_bytes: int) -> bytes:
    """Return the bytes of a file, up to one more than the limit, since it may grow, and files in /proc report size 0.

    Memory is allocated by the reported size; a single ``read`` would allocate the whole limit at once.
    """
    parts, left = [], limit_bytes + 1
    while left and (part := stream.read(min(left, max(size + 1, 1 << 16)))):
        parts.append(part)
        left -= len(part)
    return b"".join(parts)


def read_text(
    path: Path, limit_bytes: int, refuse: Refusal, *, inside: Path | None = None, name: str | None = None
) -> str:
    """Return the content of a regular UTF-8 text file, without a byte order mark; limits and errors as in ``read_bytes``."""
    content = read_bytes(path, limit_bytes, refuse, inside=inside, name=name)
    return decode_text(content, path.name if name is None else name, refuse)


def decode_text(content: bytes, name: str, refuse: Refusal) -> str:
    """Decode UTF-8 text without a byte order mark; raises the error that ``refuse`` makes of a line starting with ``name``."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        called = printable_line(name, max_characters=_NAME_CHARACTERS)
        raise refuse(f"{called}: not UTF-8 text ({error.reason} at byte {error.start}); save it as UTF-8") from error


def _cause(error: Exception) -> str:
    said = error.strerror if isinstance(error, OSError) else None
    return said or printable_line(str(error), max_characters=_NAME_CHARACTERS) or type(error).__name__
