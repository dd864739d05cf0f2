"""The twins that stand in scenes and episodes of plain files: each is written once, with its page."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from manitwin.errors import ManiTwinError
from manitwin.web.links import FileLinks
from manitwin.web.plain_scripts import UP, write_twin
from manitwin.web.served_files import TwinFolders
from manitwin.web.twin_page import MODEL_SCRIPT

Made = TypeVar("Made")


@dataclass
class Written:
    """What was written of scenes or episodes: pages, ids and bytes of their twins, and why which were ``left_out``, by name.

    ``scripts`` are those that every page needs.
    """

    scripts: tuple[str, ...]
    pages: int = 0
    twins: set[str] = field(default_factory=set)
    size_bytes: int = 0
    left_out: dict[str, str] = field(default_factory=dict)

    def wholly(self, name: str, work: Callable[[], Made]) -> Made | None:
        """Return what ``work`` makes; where it raises, note the reason under ``name`` in ``left_out`` and return None."""
        try:
            return work()
        except ManiTwinError as error:
            self.left_out[name] = str(error)
            return None

    def write_twins(self, out: Path, twins: TwinFolders, twin_ids: Iterable[str]) -> list[str]:
        """Write the twins that are not written yet; returns the addresses of the scripts with their meshes, for a page of them.

        Raises UsageError and TwinError for one that is gone or cannot be read whole.
        """
        ids = sorted(set(twin_ids))
        for twin_id in ids:
            if twin_id not in self.twins:
                self.size_bytes += write_twin(out, twins.twin(twin_id), with_gallery=False)
                self.twins.add(twin_id)
        return [FileLinks(UP).file(twin_id, MODEL_SCRIPT, "") for twin_id in ids]
