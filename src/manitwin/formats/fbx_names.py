"""The pictures that an FBX file names, binary or text, and where they lie on another machine than the one that wrote it."""

from __future__ import annotations

from collections.abc import Iterator

_KEYS = (b"RelativeFilename", b"FileName")
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
