"""The pictures that an FBX file names or holds, and where they lie on another machine than the one that wrote it."""

from __future__ import annotations

from collections.abc import Iterator

_KEYS = (b"RelativeFilename", b"FileName")
_OF_A_PICTURE = (b"RelativeFilenameS", b"FilenameS", b"FileNameS")
_CONTENT = b"\x07ContentR"
"""How the record of a picture's bytes begins in a binary file: the length of its name, its name, and that it is raw."""
_LONGEST_NAME = 4096
_LENGTH_BYTES = 4


def fbx_file_names(data: bytes) -> Iterator[str]:
    """Yield each name of a file in an FBX file's content, as ``beside`` has it; the same one may come again."""
    for key in _KEYS:
        at = data.find(key)
        while at >= 0:
            name = _value_at(data, at + len(key))
            if name:
                yield beside(name)
            at = data.find(key, at + len(key))


def embedded_files(data: bytes) -> dict[str, bytes]:
    """Return the pictures that a binary FBX file holds, by the last part of the name that stands before each of them."""
    found = {}
    at = data.find(_CONTENT)
    while at >= 0:
        start = at + len(_CONTENT) + _LENGTH_BYTES
        length = int.from_bytes(data[at + len(_CONTENT) : start], "little")
        named = max(data.rfind(key, max(0, at - _LONGEST_NAME), at) + len(key) for key in _OF_A_PICTURE)
        name = _value_at(data, named - 1)
        if name and 0 < length <= len(data) - start:
            found[beside(name).rpartition("/")[2]] = data[start : start + length]
        at = data.find(_CONTENT, start)
    return found


def beside(name: str) -> str:
    """Return where a file that is named lies from the folder of the mesh.

    A path of the machine that wrote it, or out of the folder, counts by its last part alone.
    """
    plain = name.replace("\\", "/")
    leads_away = plain.startswith("/") or plain[1:2] == ":" or ".." in plain.split("/")
    return plain.rpartition("/")[2] if leads_away else plain


def _value_at(data: bytes, at: int) -> str:
    """Return the text behind a key: of a binary file ``S``, its length and itself, of a text one quoted behind a colon."""
    if data[at : at + 1] == b"S":
        start = at + 1 + _LENGTH_BYTES
        length = int.from_bytes(data[at + 1 : start], "little")
        return data[start : start + length].decode("utf-8", "replace") if length <= _LONGEST_NAME else ""
    if data[at : at + 1] != b":":
        return ""
    line = data[at : at + _LONGEST_NAME].partition(b"\n")[0]
    quoted = line.split(b'"')
    return quoted[1].decode("utf-8", "replace") if len(quoted) > 2 else ""
