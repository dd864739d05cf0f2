"""Reading of a build's inputs (files, folders, CSV or JSONL manifests) as items."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from manitwin.engine.ledger.ledger import LEDGER
from manitwin.engine.ledger.location import CONFIG
from manitwin.errors import UsageError
from manitwin.formats.missing_path import missing_path_message
from manitwin.formats.output_folder import require_writable_folder
from manitwin.formats.printable import printable_line
from manitwin.formats.source_files import IMAGE_SUFFIXES, MESH_SUFFIXES
from manitwin.pipeline.folder_listing import FolderListing, list_folder
from manitwin.pipeline.item import Item
from manitwin.pipeline.manifest_item import COLUMNS, forget_folders, item_of, listed_columns, shortened
from manitwin.pipeline.manifest_rows import manifest_rows
from manitwin.pipeline.photo_groups import PhotoGroups, group_photos
from manitwin.pipeline.photo_thinning import thinned_words
from manitwin.pipeline.refused_inputs import RefusedInputs
from manitwin.pipeline.stated_place import BOX, MASK, require_one_photo
from manitwin.pipeline.stated_size import COLUMN as COLUMN_OF_SIZE
from manitwin.pipeline.stated_size import MEANT
from manitwin.pipeline.view_inputs import missing_pose_messages, order_photos
from manitwin.twin.dataset_root import DatasetRoot

MANIFEST_SUFFIXES = frozenset({".csv", ".jsonl"})
_SHOWN_CHARACTERS = 60
SHORT = 4
_KNOWN = frozenset(COLUMNS)

Refusal = Callable[[Item], str | None]
Turns = Sequence[float] | Callable[[int], Sequence[float]]
"""The turns of photos, or a function of their number, which for a folder is known only once it is listed."""


@dataclass
class Notes:
    """Messages to the user about the inputs: ``remarks`` are lines, ``folders`` classify the files of folders.

    ``under_way`` is the progress of reading, as a folder of 100,000 files takes a while.
    """

    remarks: list[str] = field(default_factory=list)
    folders: list[FolderListing] = field(default_factory=list)
    under_way: str = ""

    def tell(self, under_way: str) -> None:
        """Set the progress of reading the inputs."""
        self.under_way = under_way


def require_inputs(root: DatasetRoot, inputs: Sequence[str | Path], texts: Sequence[str]) -> None:
    """Raise UsageError if a build has neither inputs nor an existing data set, or if the data set cannot be created or
    written.
    """
    if root.flat:
        raise UsageError(
            f"{root.url}: contains twins in the flat layout of earlier versions, which can be read but not"
            f" extended; give a new folder"
        )
    if not inputs and not texts and not root.exists(CONFIG) and not root.exists(LEDGER):
        raise UsageError(
            f"{root.url}: no inputs given, and no data set to resume; give images, meshes, folders, manifests or texts"
        )
    if root.local is not None:
        require_writable_folder(root.local, "twins")


def iterate_items(
    inputs: Iterable[str | Path],
    defaults: dict[str, Any],
    notes: Notes,
    texts: Iterable[str] = (),
    *,
    strict: bool = False,
    count: int = 1,
    views: bool = False,
    turns_deg: Turns | None = None,
    poses: str | Path | None = None,
    refusal: Refusal = lambda item: None,
) -> Iterator[Item]:
    """Yield the items of ``_given_items``, with ``count`` variations of each text; with ``views`` a single item of all photos.

    Photos from a folder of ``views`` are in natural order (2 before 10). ``poses`` is a file with their camera poses; photos of
    a folder without a pose are left out, with a remark. A mask or box among the ``defaults`` is that of a single photo. Raises
    UsageError like ``_given_items``, if variations are requested of a file, and for views that are not all photos.
    """
    if any(defaults.get(column) is not None for column in (MASK, BOX)):
        inputs, texts = list(inputs), list(texts)
        require_one_photo(inputs, texts, views=views)
    if views:
        if texts := list(texts):
            raise UsageError("--views: a text; give the photos of one object, such as --views front.jpg side.jpg")
        yield from _one_of_views(list(inputs), defaults, notes, turns_deg, poses, refusal)
        return
    if turns_deg is not None or poses is not None:
        what = "turns" if poses is None else "poses"
        raise UsageError(f"{what} apply to several photos of one object; give --views too")
    for item in _given_items(inputs, defaults, notes, texts, strict, refusal):
        if item.file is not None and count > 1:
            raise UsageError(
                f"{item.title}: --count applies to texts, but this is a file; build the file in a separate command"
            )
        yield item
        yield from (replace(item, variation=number) for number in range(1, count))


def _one_of_views(
    inputs: Sequence[str | Path],
    defaults: dict[str, Any],
    notes: Notes,
    turns_deg: Turns | None,
    poses: str | Path | None,
    refusal: Refusal,
) -> Iterator[Item]:
    listed = next((path for path in inputs if Path(path).suffix.lower() in MANIFEST_SUFFIXES), None)
    if not inputs or listed is not None:
        told = "no photo" if listed is None else shortened(str(listed))
        raise UsageError(
            f"--views: {told}; give the photos of one object, or their folder, such as --views front.jpg side.jpg"
        )
    items: list[Item] = []
    for path in inputs:
        own = list(_given_items([path], defaults, notes, (), False, refusal))
        if Path(path).is_dir():
            files, without = order_photos(
                [Path(item.file or "") for item in own], None if poses is None else Path(poses)
            )
            by_file = {Path(item.file or ""): item for item in own}
            own = [by_file[file] for file in files]
            notes.remarks.extend(missing_pose_messages(without, poses))
        items += own
    turns = turns_deg(len(items)) if callable(turns_deg) else turns_deg
    item = group_photos(items, turns, "--views", None if poses is None else str(poses))
    notes.remarks.extend(_thinned(item, "--views"))
    yield item


def _thinned(item: Item, where: str) -> list[str]:
    return [] if item.photos_given is None else [f"{where}: {thinned_words(len(item.files), item.photos_given)}"]


def _given_items(
    inputs: Iterable[str | Path],
    defaults: dict[str, Any],
    notes: Notes,
    texts: Iterable[str],
    strict: bool,
    refusal: Refusal,
) -> Iterator[Item]:
    """Yield the items one at a time, so that manifests may have any length; notes are added at the end of each input.

    ``texts`` follow the ``inputs``. ``strict``: an unknown column is an error. ``refusal`` returns why an item can never be
    built. Raises UsageError for a missing path, a folder without inputs or an unreadable manifest; and, after the last item,
    one error for all rows with invalid values and all refused items.
    """
    refused = RefusedInputs()
    unsaid = dict.fromkeys(("name", "longest_side_m", "license", "attribution"))
    defaults = {"units": "auto", "up": "auto", **unsaid, **defaults}
    for given in inputs:
        path = Path(given)
        if not os.path.exists(path):
            raise UsageError(
                f"{shortened(str(given))}: {missing_path_message(str(given))}; give an image, a mesh, a folder, or a .csv or"
                " .jsonl manifest; put the description of an object behind --text"
            )
        if path.is_dir():
            for item in _folder_items(path, str(given), defaults, notes):
                yield from _allowed(item, str(given), refusal, refused)
        elif path.suffix.lower() in MANIFEST_SUFFIXES:
            yield from _manifest_items(path, defaults, notes, strict, refusal, refused)
        else:
            item = item_of({"file": str(path)}, Path.cwd(), defaults, str(path))
            yield from _allowed(item, str(given), refusal, refused)
    for text in texts:
        if not text.strip():
            raise UsageError("the text is empty; describe an object, such as 'a red mug'")
        yield from _allowed(item_of({"text": text}, Path.cwd(), defaults, text), "--text", refusal, refused)
    refused.tell()


def _allowed(item: Item, where: str, refusal: Refusal, refused: RefusedInputs) -> Iterator[Item]:
    with refused.noted():
        why = refusal(item)
        if why is not None:
            raise UsageError(f"{where}: {why}")
        yield item


def _folder_items(folder: Path, given: str, defaults: dict[str, Any], notes: Notes) -> Iterator[Item]:
    listing = list_folder(folder, notes.tell)
    if not listing.inputs:
        left = "".join(f"; {line.removeprefix(f'{folder}: ')}" for line in listing.remarks()[1:])
        known = ", ".join(sorted(MESH_SUFFIXES | IMAGE_SUFFIXES))
        raise UsageError(f"{given}: this folder contains no image or mesh{left}; known: {known}")
    masks = {str(photo): str(mask) for photo, mask in listing.masks.items()}
    for path in map(str, listing.inputs):
        row = {"file": path, "mask": masks[path]} if path in masks else {"file": path}
        yield item_of(row, Path.cwd(), defaults, str(folder))
    notes.folders.append(listing)
    notes.remarks.extend(listing.remarks())


def _manifest_items(
    path: Path, defaults: dict[str, Any], notes: Notes, strict: bool, refusal: Refusal, refused: RefusedInputs
) -> Iterator[Item]:
    unknown: dict[str, str] = {}
    groups = PhotoGroups(path)
    forget_folders()  # a link may have changed since the last reading
    line = None
    for line, row in manifest_rows(path, COLUMNS):
        for column in sorted(map(str, row.keys() - _KNOWN - unknown.keys())):
            shown = printable_line(column, max_characters=_SHOWN_CHARACTERS)
            near = _nearest(shown.lower().strip())
            near = [COLUMN_OF_SIZE] if shown.lower().strip() in MEANT else near
            unknown[column] = f"{shown!r} (did you mean {near[0]!r}?)" if near else repr(shown)
            if strict:
                raise UsageError(f"{path}: unknown column {unknown[column]}; valid: {', '.join(COLUMNS)}")
        notes.tell(f"row {line:,} of {path.name}")
        where = f"{path}:{line}"
        item = None
        with refused.noted():
            item = None if groups.add(line, row) else item_of(row, path.parent, defaults, where, unknown)
        if item is not None:
            yield from _allowed(item, where, refusal, refused)
    with refused.noted():  # an inconsistent group is reported with the preceding rows, and ends the groups
        for item, where in groups.items(lambda row, where: item_of(row, path.parent, defaults, where, unknown)):
            notes.remarks.extend(_thinned(item, where))
            yield from _allowed(item, where, refusal, refused)
    if line is None:
        raise UsageError(
            f"{path}: the manifest has no rows; it needs a column 'file' or 'text', and optionally"
            f" {', '.join(COLUMNS[2:])}"
        )
    if unknown:
        notes.remarks.append(f"{path}: columns not used: {listed_columns(unknown)}")


def _nearest(column: str) -> list[str]:
    """Return the column that a name may be meant for, if any; for short columns a closer match is required (mask vs. mass_kg)."""
    near = get_close_matches(column, COLUMNS, n=1, cutoff=0.6)
    return get_close_matches(column, near, cutoff=0.75) if near and len(near[0]) <= SHORT else near
