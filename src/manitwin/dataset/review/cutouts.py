"""``manitwin review cutouts``: inspect low-confidence mattes, and build the photos whose mattes are confirmed."""

from __future__ import annotations

import io
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Unpack

import numpy as np
from PIL import Image

from manitwin.dataset.review.item_rebuild import rebuild_items
from manitwin.dataset.review.photos_left_out import PhotosLeftOut
from manitwin.engine.amendments import read_amendments, write_amendments
from manitwin.engine.drive import RunOptions, RunReport
from manitwin.engine.ledger.location import local_ledger
from manitwin.engine.ledger.reading import read_ledger
from manitwin.errors import TwinError, UsageError
from manitwin.formats.json_file import parse_json_object
from manitwin.pipeline.cutout import CONFIRMED, CUTOUT, confirmation, reduced
from manitwin.pipeline.drawn_outline import DRAWN
from manitwin.pipeline.human_corrections import HUMAN
from manitwin.pipeline.item import Item
from manitwin.pipeline.photo import PhotoStage
from manitwin.pipeline.photo_groups import distinct_names
from manitwin.render.contact_sheet import TILE_PX, contact_sheet
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import RECORD, parse_record

SHOWN = 48
"""Mattes per sheet."""
AROUND = (200, 0, 200)
"""Tint of the removed background: magenta, which is rare in objects and backgrounds."""
BELIEVED = "its cut-out was believed"
DIMMED = 0.25
"""Opacity of the photo in the removed background."""


@dataclass(frozen=True)
class DoubtedPhoto:
    """A photo with its ledger number, reason of rejection, and the sha256 of its stored matte (None if there is none).

    ``place`` is the index, from 0, among several photos of an object; None for a single photo.
    """

    twin_id: str
    number: int
    item: Item
    detail: str
    sha256: str | None
    place: int | None = None

    @property
    def key(self) -> str:
        """Unique name of this photo: the twin id, for one of several photos followed by the photo's number, counted from 1."""
        return self.twin_id if self.place is None else f"{self.twin_id}-{self.place + 1}"

    @property
    def file(self) -> Path:
        """The photo file."""
        return Path(self.item.files[self.place or 0])

    @property
    def title(self) -> str:
        """The title of its item; for one of several photos, the file name and its position."""
        if self.place is None:
            return self.item.title
        files = self.item.files
        return f"{distinct_names(files)[self.place]}, photo {self.place + 1} of {len(files)}"


def doubted_photos(root: DatasetRoot) -> list[DoubtedPhoto]:
    """Return the rejected photos of a data set that have a stored matte, in item order.

    Raises UsageError if the data set has no ledger.
    """
    return [photo for photo in photos_to_draw(root) if photo.sha256 is not None]


def photos_to_draw(root: DatasetRoot, redraw: Iterable[str] = ()) -> list[DoubtedPhoto]:
    """Return the photos rejected for their matte, including those without a foreground, in item order.

    For an object with several photos that was rejected, these are the photos that could not be segmented, or all if none could.
    ``redraw`` are id prefixes of further photos whose mattes were accepted. Raises UsageError if the data set has no ledger, and
    for a prefix that is not that of exactly one photo.
    """
    path, found = local_ledger(root), []
    with read_ledger(path) as ledger:
        rows = ledger.execute(
            "SELECT number, twin_id, item, state = 'rejected' AND reason IN ('low_confidence_matte', 'several_objects',"
            " 'no_object'), state = 'rejected' AND kind = 'photos' FROM items WHERE twin_id IS NOT NULL AND kind IN ('image',"
            " 'photos') ORDER BY number"
        ).fetchall()
    chosen = {_match_prefix(root, begun, [str(row[1]) for row in rows], "no photo") for begun in redraw}
    groups = PhotosLeftOut(root)
    for number, twin_id, said, is_refused, may_lack in rows:
        is_shown = is_refused or twin_id in chosen
        if not is_shown and not may_lack:
            continue
        try:
            record = parse_record(root.read_bytes(f"{root.twin_name(twin_id)}/{RECORD}"))
        except (FileNotFoundError, TwinError):  # `manitwin check` reports and repairs these
            continue
        detail = BELIEVED if record.rejection is None else record.rejection.detail
        item = Item.from_json(parse_json_object(said, f"{path}: item {number}", UsageError, file_names=True))
        shown = DoubtedPhoto(twin_id, int(number), item, detail, record.files.get(CUTOUT))
        if not item.views:
            found.append(shown)
            continue
        places = groups.of(twin_id, item) or (range(len(item.files)) if is_shown else ())
        found += [replace(shown, place=place, sha256=None) for place in places]
    return found


def write_sheets(root: DatasetRoot, photos: Sequence[DoubtedPhoto], path: Path) -> list[Path]:
    """Draw the mattes on sheets of ``SHOWN`` tiles, with the background tinted magenta; return the files, numbered from the
    second.

    Raises UsageError if there are no photos.
    """
    if not photos:
        raise UsageError(f"{root.url}: has no doubtful cut-out to draw")
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
    """Build the photos whose mattes an ``annotator`` has confirmed; return the photos and the run report.

    ``twin_ids`` may be unique prefixes. Raises UsageError, before anything is written, for ids without a doubted matte, and if
    another run is active on the data set.
    """
    chosen = _select_photos(root, doubted_photos(root), twin_ids)
    for photo in chosen:
        amendments = read_amendments(root, photo.twin_id)
        said = amendments.setdefault(PhotoStage.name, {})
        said.pop(DRAWN, None)  # an outline drawn earlier would take precedence over the matte
        picture = root.read_bytes(f"{root.twin_name(photo.twin_id)}/{CUTOUT}", UsageError)
        said[CONFIRMED] = confirmation(picture, f"{HUMAN}{annotator}")
        write_amendments(root, photo.twin_id, amendments)
    return chosen, rebuild_items(root, ((each.number, each.item) for each in chosen), jobs, **options)


def _select_photos(root: DatasetRoot, photos: Sequence[DoubtedPhoto], twin_ids: Iterable[str]) -> list[DoubtedPhoto]:
    known = {photo.twin_id: photo for photo in photos}
    found = dict.fromkeys(
        _match_prefix(root, said, list(known), "no rejected photo with a cut-out") for said in twin_ids
    )
    return [known[twin_id] for twin_id in found]


def _match_prefix(root: DatasetRoot, begun: str, twin_ids: Sequence[str], none: str) -> str:
    """Return the one id with a prefix; raises UsageError if there is none or several."""
    alike = [each for each in twin_ids if begun and each.startswith(begun)]
    if len(alike) != 1:
        why = none if not alike else f"{len(alike)} photos match"
        raise UsageError(f"{begun}: {why}; `manitwin review cutouts {root.url}` lists them")
    return alike[0]


def _tile(root: DatasetRoot, twin_id: str) -> np.ndarray:
    """Return a matte tile ``(TILE_PX, TILE_PX, 3) uint8`` with dimmed and tinted background."""
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
