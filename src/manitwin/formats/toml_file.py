"""Parser of untrusted TOML with bounded size and depth; all TOML from outside the package is parsed here."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from manitwin.formats.bounded_file import Refusal, decode_text, read_bytes
from manitwin.formats.printable import printable_line

MAX_TOML_BYTES = 1 << 20
_CAUSE_CHARACTERS = 120


def parse_toml(content: bytes | str, name: str, refuse: Refusal) -> dict[str, Any]:
    """Return the tables of a TOML 1.0 text; raises the error that ``refuse`` makes of a line starting with ``name``."""
    called = printable_line(name, max_characters=_CAUSE_CHARACTERS)
    text = decode_text(content, name, refuse) if isinstance(content, bytes) else content
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise refuse(f"{called}: its TOML is nested too deep to be read; mend it") from error
    except ValueError as error:  # also for an integer with more digits than Python converts
        cause = printable_line(str(error).split(";")[0], max_characters=_CAUSE_CHARACTERS)
        raise refuse(f"{called}: not TOML: {cause}") from error


def read_toml(
    path: Path, refuse: Refusal, *, limit_bytes: int = MAX_TOML_BYTES, name: str | None = None
) -> dict[str, Any]:
    """Read a regular file of at most ``limit_bytes`` of TOML; opened like ``bounded_file.open_regular``."""
    return parse_toml(read_bytes(path, limit_bytes, refuse, name=name), path.name if name is None else name, refuse)
