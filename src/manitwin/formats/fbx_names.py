"""Pictures that an FBX file names or embeds, including those named by paths of another machine."""

from __future__ import annotations

from collections.abc import Iterator

_KEYS = (b"RelativeFilename", b"FileName")
_OF_A_PICTURE = (b"RelativeFilenameS", b"FilenameS", b"FileNameS")
_CONTENT = b"\x07ContentR"
"""Start of the record of a picture's bytes in a binary file: the length of its name, its name, and the type code for raw data."""
_LONGEST_NAME = 4096
_LENGTH_BYTES = 4


def fbx_file_names(data: bytes) -> Iterator[str]:
    """Yield each file name in an FBX file's content, resolved by ``beside``; names may repeat."""
    for key in _KEYS:
        at = data.find(key)
        while at >= 0:
            name = _value_at(data, at + len(key))
            if name:
                yield relative_name(name)
            at = data.find(key, at + len(key))


def embedded_files(data: bytes) -> dict[str, bytes]:
    """Return the pictures embedded in a binary FBX file, by the last part of the name that precedes each."""
    found = {}
    at = data.find(_CONTENT)
    while at >= 0:
        start = at + len(_CONTENT) + _LENGTH_BYTES
        length = int.from_bytes(data[at + len(_CONTENT) : start], "little")
        named = max(data.rfind(key, max(0, at - _LONGEST_NAME), at) + len(key) for key in _OF_A_PICTURE)
        name = _value_at(data, named - 1)
        if name and 0 < length <= len(data) - start:
            found[relative_name(name).rpartition("/")[2]] = data[start : start + length]
        at = data.find(_CONTENT, start)
    return found


def relative_name(name: str) -> str:
    """Return the path of a named file relative to the folder of the mesh.

    An absolute path, or one that leaves the folder, is reduced to its last part.
    """
    plain = name.replace("\\", "/")
    leads_away = plain.startswith("/") or plain[1:2] == ":" or ".." in plain.split("/")
    return plain.rpartition("/")[2] if leads_away else plain


def _value_at(data: bytes, at: int) -> str:
    """Return the text after a key: in a binary file ``S``, length and text; in a text file a colon and a quoted string."""
    if data[at : at + 1] == b"S":
        start = at + 1 + _LENGTH_BYTES
        length = int.from_bytes(data[at + 1 : start], "little")
        return data[start : start + length].decode("utf-8", "replace") if length <= _LONGEST_NAME else ""
    if data[at : at + 1] != b":":
        return ""
    line = data[at : at + _LONGEST_NAME].partition(b"\n")[0]
    quoted = line.split(b'"')
    return quoted[1].decode("utf-8", "replace") if len(quoted) > 2 else ""
