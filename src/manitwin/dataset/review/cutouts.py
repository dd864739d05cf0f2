"""``manitwin review cutouts``: people look at cut-outs that were doubted, and what they confirm is built."""

from __future__ import annotations

import io
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Unpack

import numpy as np
from PIL import Image

from manitwin.dataset.review.making_again import made_again
from manitwin.engine.amendments import read_amendments, write_amendments
from manitwin.engine.drive import RunOptions, RunReport
from manitwin.engine.ledger.location import local_ledger
from manitwin.engine.ledger.reading import read_ledger
from manitwin.errors import TwinError, UsageError
from manitwin.formats.json_file import parse_json_object
from manitwin.pipeline.cutout import CONFIRMED, CUTOUT, reduced
from manitwin.pipeline.human_corrections import HUMAN
from manitwin.pipeline.item import Item
from manitwin.pipeline.photo import PhotoStage
from manitwin.render.contact_sheet import TILE_PX, contact_sheet
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import RECORD, parse_record

SHOWN = 48
"""Cut-outs on one sheet."""
AROUND = (200, 0, 200)
"""Magenta, which few things and grounds have."""
DIMMED = 0.25
"""How much of the photo is still seen where it would be cut away."""


@dataclass(frozen=True)
class DoubtedPhoto:
    """A rejected photo: its number in the ledger, why it was rejected, and the digest of the cut-out beside that."""

    twin_id: str
    number: int
    item: Item
    detail: str
    sha256: str


def doubted_photos(root: DatasetRoot) -> list[DoubtedPhoto]:
    """Return the rejected photos of a data set that have a cut-out to be looked at, in the order of its items.

    Raises UsageError where it has no ledger.
    """
    path, found = local_ledger(root), []
    with read_ledger(path) as ledger:
        rows = ledger.execute(
            "SELECT number, twin_id, item FROM items WHERE state = 'rejected' AND twin_id IS NOT NULL AND reason IN"
            " ('low_confidence_matte', 'several_objects') ORDER BY number"
        ).fetchall()
    for number, twin_id, said in rows:
        try:
            record = parse_record(root.read_bytes(f"{root.twin_name(twin_id)}/{RECORD}"))
        except (FileNotFoundError, TwinError):  # told and put right by `manitwin check`
            continue
        if CUTOUT in record.files and record.rejection is not None:
            item = Item.from_json(parse_json_object(said, f"{path}: item {number}", UsageError, file_names=True))
            found.append(DoubtedPhoto(twin_id, int(number), item, record.rejection.detail, record.files[CUTOUT]))
    return found


def write_sheets(root: DatasetRoot, photos: Sequence[DoubtedPhoto], path: Path) -> list[Path]:
    """Draw the cut-outs on sheets of ``SHOWN``, what would be cut away in magenta; returns the files, numbered from the second.

    Raises UsageError where there is none.
    """
    if not photos:
        raise UsageError(f"{root.url}: has no doubted cut-out to be drawn")
    written = []
    for sheet, first in enumerate(range(0, len(photos), SHOWN), 1):
        tiles = [(each.twin_id, _tile(root, each.twin_id)) for each in photos[first : first + SHOWN]]
        file = path if sheet == 1 else path.with_stem(f"{path.stem}_{sheet}")
        contact_sheet(tiles).save(file)
        written.append(file)
    return written


def confirm(
    root: DatasetRoot,
    twin_ids: Collection[str],
    annotator: str,
    *,
    jobs: int | None = None,
    **options: Unpack[RunOptions],
) -> tuple[list[DoubtedPhoto], RunReport]:
    """Build the photos whose cut-outs an ``annotator`` has looked at and found right; return them, and what the run did.

    ``twin_ids`` may be shortened to any beginning that only one of them has. Raises UsageError naming those that have no doubted
    cut-out, before anything is written, and where another run is at work there.
    """
    chosen = _chosen(root, doubted_photos(root), twin_ids)
    for photo in chosen:
        amendments = read_amendments(root, photo.twin_id)
        said = amendments.setdefault(PhotoStage.name, {})
        said[CONFIRMED] = {"sha256": photo.sha256, "source": f"{HUMAN}{annotator}"}
        write_amendments(root, photo.twin_id, amendments)
    return chosen, made_again(root, ((each.number, each.item) for each in chosen), jobs, **options)


def _chosen(root: DatasetRoot, photos: Sequence[DoubtedPhoto], twin_ids: Iterable[str]) -> list[DoubtedPhoto]:
    found: dict[str, DoubtedPhoto] = {}
    for said in twin_ids:
        alike = [each for each in photos if said and each.twin_id.startswith(said)]
        if len(alike) != 1:
            why = "no rejected photo with a cut-out" if not alike else f"{len(alike)} photos begin so"
            raise UsageError(f"{said}: {why}; `manitwin review cutouts {root.url}` lists them")
        found[alike[0].twin_id] = alike[0]
    return list(found.values())


def _tile(root: DatasetRoot, twin_id: str) -> np.ndarray:
    """Return a cut-out ``(TILE_PX, TILE_PX, 3) uint8``, its surroundings dimmed and tinted."""
    name = f"{root.twin_name(twin_id)}/{CUTOUT}"
    picture = Image.open(io.BytesIO(root.read_bytes(name, UsageError))).convert("RGBA")
    rgba = reduced(np.asarray(picture), TILE_PX).astype(float)
    share = rgba[..., 3:] / 255
    around = DIMMED * rgba[..., :3] + (1 - DIMMED) * np.array(AROUND)
    tile = np.full((TILE_PX, TILE_PX, 3), 255, np.uint8)
    top, left = (TILE_PX - rgba.shape[0]) // 2, (TILE_PX - rgba.shape[1]) // 2
    shown = np.rint(share * rgba[..., :3] + (1 - share) * around).astype(np.uint8)
    tile[top : top + rgba.shape[0], left : left + rgba.shape[1]] = shown
    return tile
