"""Text of outsiders as a terminal and a log may show it."""

from __future__ import annotations

import unicodedata

_KEPT = frozenset("\n\t")
_INVISIBLE = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
"""Unicode's general categories of controls, formats (bidirectional overrides, joiners, tags), surrogates and separators."""


def printable(text: str, *, max_characters: int | None = None) -> str:
    r"""Return text with what a terminal would obey or hide written out, as ``\x1b`` and ``\u202e``; ends of lines and tabs stay.

    Controls, bidirectional overrides and other format characters, lone surrogates (the undecodable bytes of a file's name)
    and line separators are escaped as Python does. Text longer than ``max_characters`` is cut in the middle.
    """
    if max_characters is not None and len(text) > max_characters:
        half = max(1, (max_characters - 3) // 2)
        text = f"{text[:half]}...{text[-half:]}"
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c in _KEPT or unicodedata.category(c) not in _INVISIBLE else _escaped(c) for c in text)


def printable_line(text: str, *, max_characters: int | None = None) -> str:
    """Return ``printable`` text with ends of lines and tabs escaped too: what a name or a server says takes one line."""
    return printable(text, max_characters=max_characters).replace("\n", "\\n").replace("\t", "\\t")


def printable_json(text: str) -> str:
    r"""Return a JSON text with the same characters written as JSON's own escapes: it stands for the same value."""
    if text.isascii() and "\x7f" not in text:
        return text
    return "".join(c if c in _KEPT or unicodedata.category(c) not in _INVISIBLE else _json_escaped(c) for c in text)


def _json_escaped(character: str) -> str:
    units = character.encode("utf-16-be", errors="surrogatepass").hex()
    return "".join(f"\\u{units[at : at + 4]}" for at in range(0, len(units), 4))


def _escaped(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
