"""Escaping of untrusted text for terminals and logs."""

from __future__ import annotations

import unicodedata

_KEPT = frozenset("\n\t")
_INVISIBLE = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
"""Unicode's general categories of controls, formats (bidirectional overrides, joiners, tags), surrogates and separators."""


def printable(text: str, *, max_characters: int | None = None) -> str:
    r"""Escape characters that a terminal would obey or hide, as ``\x1b`` and ``\u202e``; newlines and tabs stay.

    Controls, bidirectional overrides and other format characters, lone surrogates (undecodable bytes of a file name) and line
    separators are escaped as Python does. Text longer than ``max_characters`` is cut in the middle.
    """
    if max_characters is not None and len(text) > max_characters:
        half = max(1, (max_characters - 3) // 2)
        text = f"{text[:half]}...{text[-half:]}"
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c in _KEPT or unicodedata.category(c) not in _INVISIBLE else _escaped(c) for c in text)


def printable_line(text: str, *, max_characters: int | None = None) -> str:
    """Return ``printable`` text with newlines and tabs escaped too, for untrusted names and messages on one line."""
    return printable(text, max_characters=max_characters).replace("\n", "\\n").replace("\t", "\\t")


def printable_json(text: str) -> str:
    r"""Escape the same characters in a JSON text by JSON's own escapes, without changing its value."""
    if text.isascii() and "\x7f" not in text:
        return text
    return "".join(c if c in _KEPT or unicodedata.category(c) not in _INVISIBLE else _json_escaped(c) for c in text)


def _json_escaped(character: str) -> str:
    units = character.encode("utf-16-be", errors="surrogatepass").hex()
    return "".join(f"\\u{units[at : at + 4]}" for at in range(0, len(units), 4))


def _escaped(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
