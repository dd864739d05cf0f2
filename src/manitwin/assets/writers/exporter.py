"""Exporter interface: a pure function from a twin in memory to files in memory."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import trimesh

from manitwin.assets.writers.format_notes import FormatNotes
from manitwin.twin.loaded_links import parts_by_link
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.record import Physical, TwinRecord

VIEW = "views/rgb_00.webp"
"""The view that represents the twin in formats with one picture."""


@dataclass(frozen=True)
class TwinContent:
    """The content of a finished twin, in metres in the object frame (Z up).

    ``name`` is a file and element name, unique to the twin. ``hulls`` are vertices ``(V, 3)`` and faces ``(F, 3)`` of each
    collision hull. ``grasps`` holds the columns of grasps.parquet. ``picture`` is an encoded picture of a view, or None. For a
    twin with links, ``link_of_visual`` gives the index of the link of each part in ``visual``; no part spans two links.
    """

    name: str
    record: TwinRecord
    visual_glb: bytes
    visual: tuple[trimesh.Trimesh, ...]
    hulls: tuple[tuple[np.ndarray, np.ndarray], ...]
    grasps: dict[str, list[Any]]
    source: bytes
    picture: bytes | None = None
    link_of_visual: tuple[int, ...] = ()

    @property
    def physical(self) -> Physical:
        """The physical properties, which every accepted twin has."""
        assert self.record.physical is not None
        return self.record.physical

    def as_one_body(self) -> TwinContent:
        """Return the twin without links and joints, as one rigid body in its present pose, for formats without joints."""
        return replace(self, record=self.record.model_copy(update={"links": [], "joints": []}), link_of_visual=())

    @classmethod
    def of(cls, twin: Twin) -> TwinContent:
        """Read the content of a twin; raise TwinError for a rejected one."""
        record = twin.record
        twin.physical  # noqa: B018  raises TwinError for a rejected twin
        by_link = parts_by_link(twin.visual, twin.face_links(), len(record.links)) if record.links else [twin.visual]
        return cls(
            name=export_name(record),
            record=record,
            visual_glb=twin.read_bytes("visual.glb"),
            visual=tuple(part for parts in by_link for part in parts),
            hulls=tuple((np.asarray(hull.vertices), np.asarray(hull.faces)) for hull in twin.hulls),
            grasps=twin.grasp_table().to_pydict(),
            source=twin.read_bytes(record.source.file),
            picture=twin.read_bytes(VIEW) if VIEW in record.files else None,
            link_of_visual=tuple(link for link, parts in enumerate(by_link) for _ in parts) if record.links else (),
        )


def export_name(record: TwinRecord) -> str:
    """Return a name valid in every format: lower-case letters, digits and underscores, the category and the start of the twin's
    id.
    """
    category = record.language.category if record.language is not None else record.name or "object"
    word = re.sub(r"[^a-z0-9]+", "_", category.lower()).strip("_")[:40] or "object"
    return f"{'o_' if word[0].isdigit() else ''}{word}_{record.twin_id[:8]}"


@dataclass(frozen=True)
class Exported:
    """Exported files by name relative to the export folder.

    ``main`` is the file that a user opens. ``cannot_say`` lists what the format cannot express, one line each, for the README.
    ``notes`` say where the files hold each quantity and how to load them; None selects the built-in notes of the format.
    ``joints`` says that the files contain the links and joints of an articulated twin; otherwise the twin is exported as one
    rigid body, which the README states.
    """

    files: dict[str, bytes]
    main: str
    cannot_say: tuple[str, ...] = ()
    notes: FormatNotes | None = None
    joints: bool = False


class Exporter(Protocol):
    """Writes a twin in one format, deterministically. Raises ExportError if the twin lacks what the format needs."""

    def __call__(self, twin: TwinContent) -> Exported:
        """Return the exported files."""
        ...
