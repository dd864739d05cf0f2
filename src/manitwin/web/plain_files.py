"""The gallery and the pages of chosen twins as plain files: to open from a disk, put on any web host, or send to somebody."""

from __future__ import annotations

import base64
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from manitwin.errors import TwinError, UsageError
from manitwin.formats.output_folder import new_folder
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import Twin
from manitwin.web.episode_folders import is_episodes
from manitwin.web.gallery_page import plain_gallery_page
from manitwin.web.gallery_query import Gallery, View
from manitwin.web.html import GALLERY, STAGE, STYLE, THREE, VIEWER
from manitwin.web.links import FileLinks
from manitwin.web.package_files import LICENSE, package_file
from manitwin.web.scene_folders import is_scenes
from manitwin.web.served_files import CARD, MODEL, VIEWS, TwinFolders, open_file
from manitwin.web.twin_document import document_bytes, twin_document
from manitwin.web.twin_page import DATA_SCRIPT, MODEL_SCRIPT, twin_page

MOST_TWINS = 2_000
"""Of one folder: its gallery is one page, and each twin takes a megabyte or two."""


@dataclass
class PlainFiles:
    """What was written: how many twins, bytes in all, and those that were left out with the reason, by id."""

    twins: int = 0
    size_bytes: int = 0
    left_out: dict[str, str] = field(default_factory=dict)


def write_plain_files(
    place: str,
    out: Path,
    *,
    sample: int | None = None,
    seed: int = 0,
    where: str = "",
    on_twin: Callable[[str], None] = lambda twin_id: None,
) -> PlainFiles:
    """Write ``out``, a new folder, with the accepted twins of a data set that satisfy ``where``, or of one twin's folder.

    ``sample`` are so many of them, drawn by the seed. The same twins, sample and seed give the same bytes. An input
    that is a photo is not written: it may hold more than the twin, such as the place where it was taken. Raises UsageError
    where there are none, or more than ``MOST_TWINS``.
    """
    if is_scenes(place) or is_episodes(place):
        raise UsageError(f"{place}: scenes and episodes are shown by the server alone; leave out --static")
    with TemporaryDirectory(prefix="manitwin-view-") as cache:
        twins = TwinFolders(place, Path(cache) if "://" in place else None)
        return _written(place, twins, out, sample, seed, where, on_twin)


def _written(
    place: str,
    twins: TwinFolders,
    out: Path,
    sample: int | None,
    seed: int,
    where: str,
    on_twin: Callable[[str], None],
) -> PlainFiles:
    if twins.only is not None and (where or sample is not None):
        raise UsageError(f"{place}: is one twin, of which there is nothing to choose; leave out --sample and --where")
    if twins.only is not None:
        rows, title = [_row(twins.only)], twins.only.record.name or twins.only.record.twin_id
    else:
        root = DatasetRoot(place)
        rows, title = Gallery(root).chosen(View(where=where)), Path(root.path).name or "twins"
    rows = _sampled(rows, sample, seed)
    if not rows:
        raise UsageError(f"{place}: no accepted twin is chosen; give another --where")
    if len(rows) > MOST_TWINS:
        raise UsageError(f"{place}: {len(rows):,} twins are chosen, {MOST_TWINS:,} at most; give --sample or --where")
    done = PlainFiles()
    with new_folder(out) as fresh:
        written = []
        for row in rows:
            try:
                done.size_bytes += _write_twin(fresh, twins.twin(row["twin_id"]))
                written.append(row)
            except (TwinError, UsageError) as error:
                done.left_out[row["twin_id"]] = str(error)
            on_twin(row["twin_id"])
        said = f"{len(written):,} accepted twins" + (f" of {title}" if twins.only is None else "")
        page = plain_gallery_page(written, "accepted", title, said, FileLinks())
        done.size_bytes += _write(fresh / "index.html", page.encode())
        for name in (STYLE, GALLERY, THREE, STAGE, VIEWER, LICENSE):
            done.size_bytes += _write(fresh / "static" / name, package_file(name))
    done.twins = len(written)
    return done


def _sampled(rows: list[dict[str, Any]], sample: int | None, seed: int) -> list[dict[str, Any]]:
    if sample is None or sample >= len(rows):
        return rows
    chosen = np.random.default_rng(seed).choice(len(rows), sample, replace=False)
    return [rows[i] for i in sorted(chosen)]


def _row(twin: Twin) -> dict[str, Any]:
    """Return what a card says of one twin; raises UsageError for a rejected one."""
    record = twin.record
    if record.physical is None or record.language is None or record.grasps is None:
        raise UsageError(f"{twin.folder}: is no accepted twin; plain files show those that were accepted")
    robustness = record.grasps.robustness
    return {
        "twin_id": record.twin_id,
        "revision": record.revision,
        "name": record.name,
        "category": record.language.category,
        "material": record.language.material,
        "longest_m": max(record.physical.extents_m),
        "mass_kg": record.physical.mass_kg.value,
        "simulated": record.grasps.simulated,
        "verified": record.grasps.verified,
        "robustness_median": robustness.median if robustness else None,
    }


def _write_twin(out: Path, twin: Twin) -> int:
    """Write the page of a twin with its files, all or nothing of them; returns their bytes."""
    document = twin_document(twin)
    if document["unreadable"]:  # what is sent to others is whole, and names no folder of this machine
        raise TwinError(document["unreadable"][0])
    content = {"index.html": twin_page(twin, FileLinks("../../")).encode()}
    content[DATA_SCRIPT] = b"globalThis.manitwinTwin=" + document_bytes(document) + b";\n"
    model = base64.b64encode(_file(twin.folder, MODEL))
    content[MODEL_SCRIPT] = b'globalThis.manitwinModel="' + model + b'";\n'
    named = [name for name in sorted(twin.record.files) if name == CARD or VIEWS.fullmatch(name)]
    content |= {name: _file(twin.folder, name) for name in named}
    folder = out / "twins" / twin.record.twin_id
    return sum(_write(folder / name, data) for name, data in content.items())


def _file(folder: Path, name: str) -> bytes:
    return b"".join(open_file(folder, name).chunks())


def _write(path: Path, content: bytes) -> int:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return len(content)
