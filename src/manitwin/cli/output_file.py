"""Write a file that a person has named on the command line."""

from __future__ import annotations

from pathlib import Path

from manitwin.errors import UsageError


def write_output(file: Path, content: str | bytes) -> None:
    """Write bytes, or text as UTF-8, to a file; raises UsageError where that cannot be done."""
    try:
        file.write_bytes(content.encode() if isinstance(content, str) else content)
    except OSError as error:
        raise UsageError(f"{file}: cannot be written ({error.strerror}); give another file") from error
