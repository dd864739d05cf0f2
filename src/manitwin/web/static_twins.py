"""Twins of scenes and episodes in static files: each twin is written once, with its page."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from manitwin.errors import ManiTwinError
from manitwin.web.links import FileLinks
from manitwin.web.served_files import TwinFolders
from manitwin.web.static_scripts import UP, write_twin
from manitwin.web.twin_page import MODEL_SCRIPT

Made = TypeVar("Made")


@dataclass
class WrittenPages:
    """Summary of written scenes or episodes: pages, ids and bytes of their twins, and reasons for those ``left_out``, by name.

    ``scripts`` are those that every page needs.
    """

    scripts: tuple[str, ...]
    pages: int = 0
    twins: set[str] = field(default_factory=set)
    size_bytes: int = 0
    left_out: dict[str, str] = field(default_factory=dict)

    def run_or_record(self, name: str, work: Callable[[], Made]) -> Made | None:
        """Return the result of ``work``; if it raises, record the reason under ``name`` in ``left_out`` and return None."""
        try:
            return work()
        except ManiTwinError as error:
            self.left_out[name] = str(error)
            return None

    def write_twins(self, out: Path, twins: TwinFolders, twin_ids: Iterable[str]) -> list[str]:
        """Write the twins that are not yet written; return the relative URLs of the scripts with their meshes.

        Raises UsageError and TwinError for a twin that is missing or cannot be read completely.
        """
        ids = sorted(set(twin_ids))
        for twin_id in ids:
            if twin_id not in self.twins:
                self.size_bytes += write_twin(out, twins.twin(twin_id), with_gallery=False)
                self.twins.add(twin_id)
        return [FileLinks(UP).file(twin_id, MODEL_SCRIPT, "") for twin_id in ids]
