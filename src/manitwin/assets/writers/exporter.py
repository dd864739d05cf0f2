"""What an exporter is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from manitwin.assets.writers.content import TwinContent
from manitwin.assets.writers.format_notes import FormatNotes


@dataclass(frozen=True)
class Exported:
    """Files by name below the export's folder, and what the format cannot say, one line each, for its README.

    ``main`` is the file that a person opens. ``notes``: where the files say what, and how they are loaded, for the README;
    None: those that ``format_notes`` has of a built-in format.
    """

    files: dict[str, bytes]
    main: str
    cannot_say: tuple[str, ...] = ()
    notes: FormatNotes | None = None


class Exporter(Protocol):
    """Write a twin in one format. Same twin: same bytes. Raises ExportError where the twin has not what the format needs."""

    def __call__(self, twin: TwinContent) -> Exported:
        """Return the files."""
        ...
