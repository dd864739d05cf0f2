"""Grouping of several photos of one object into one item, from manifest rows or the command line."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Any

from manitwin.errors import InputError, UsageError
from manitwin.formats.printable import printable_line
from manitwin.formats.source_files import MESH_SUFFIXES
from manitwin.models.generators.protocol import MOST_PHOTOS
from manitwin.pipeline.item import Item, file_sha256
from manitwin.pipeline.photo_thinning import MOST_GIVEN, select_photos
from manitwin.pipeline.stated_place import BOX
from manitwin.pipeline.stated_poses import poses_of

OF_THE_THING = ("name", "units", "up", "longest_side_m", "license", "attribution", "poses")
"""Columns that describe the object, not a photo: rows of one group must not contradict each other."""

Row = Mapping[str, Any]
ToItem = Callable[[dict[str, Any], str], Item]
"""Makes the item of one row; the second argument is the row's location for messages."""


def group_photos(
    items: Sequence[Item], turns_deg: Sequence[float] | None, where: str, poses: str | None = None
) -> Item:
    """Return the item of one object shown in the photos of ``items``, in their order.

    ``turns_deg`` is the camera's rotation for each photo, stored relative to the first in 0..360. ``poses`` is a file with the
    camera poses. With either, excess photos are thinned out evenly. A single photo is returned as it is. Raises UsageError for
    meshes, texts, a photo given twice, too many photos, turns that do not match the photos, and poses that are unreadable or do
    not match.
    """
    meshes = [item.title for item in items if item.file is not None and _is_mesh(item)]
    if meshes or any(item.file is None for item in items):
        told = f"{meshes[0]} is a mesh" if meshes else "a text is not a photo"
        raise UsageError(f"{where}: {told}; all views of one object must be photos; give a mesh or a text separately")
    files = [str(item.file) for item in items]
    twice = first_duplicate(files)
    if twice is not None:
        raise UsageError(f"{where}: {Path(twice).name} is given twice; give each photo once")
    unsaid = turns_deg is None and poses is None
    if len(items) > (MOST_PHOTOS if unsaid else MOST_GIVEN):
        told = ", or say where the camera was, to have them thinned out" if unsaid else ""
        most = MOST_PHOTOS if unsaid else MOST_GIVEN
        raise UsageError(
            f"{where}: {len(items)} photos of one object; give at most {most}, spread over the directions{told}"
        )
    turns = [] if turns_deg is None else list(turns_deg)
    if turns and (len(turns) != len(items) or not all(map(isfinite, turns))):
        raise UsageError(
            f"{where}: {len(items)} photos and the turns {', '.join(f'{turn:g}' for turn in turns)}: give one turn"
            f" per photo, in degrees, counter-clockwise seen from above, such as 0,90,180"
        )
    if turns and poses is not None:
        raise UsageError(f"{where}: turns and poses both describe the camera; give only one of them")
    try:
        kept = select_photos([Path(file) for file in files], turns, None if poses is None else Path(poses))
    except InputError as error:
        raise UsageError(f"{where}: {error.detail}") from error
    given = None if len(kept) == len(items) else len(items)
    items, turns = [items[number] for number in kept], [turns[number] for number in kept] if turns else []
    if any(item.box_px for item in items) and len(items) > 1:
        raise UsageError(f"{where}: {BOX} applies to a single photo; for several photos of one object give masks")
    masks = tuple(item.masks[0] if item.masks else "" for item in items)
    masks = masks if any(masks) else ()
    if poses is not None:
        return replace(_posed(items, masks, poses, where), photos_given=given)
    if len(items) == 1:
        return items[0]
    relative = tuple(round((turn - turns[0]) % 360.0, 6) % 360.0 for turn in turns)
    views = tuple(str(item.file) for item in items[1:])
    return replace(items[0], views=views, turns_deg=relative, photos_given=given, masks=masks)


def _posed(items: Sequence[Item], masks: tuple[str, ...], poses: str, where: str) -> Item:
    if len(items) == 1:
        raise UsageError(f"{where}: poses need several photos of one object, but there is only one; give more photos")
    views = tuple(str(each.file) for each in items[1:])
    item = replace(items[0], views=views, poses=os.path.realpath(poses), masks=masks)
    try:
        poses_of(item)
    except InputError as error:
        raise UsageError(f"{where}: {error.detail}") from error
    return item


def first_duplicate(files: Sequence[str]) -> str | None:
    """Return the first file that occurs twice; None if there is none."""
    return next((file for number, file in enumerate(files) if file in files[:number]), None)


def distinct_names(files: Sequence[str]) -> list[str]:
    """Return the display names of photos: file names, preceded by as many parent folders as needed to distinguish them."""
    paths = [Path(file).parts for file in files]
    names = []
    for number, own in enumerate(paths):
        rest = [other for other in paths[:number] + paths[number + 1 :] if other != own]
        longest = next((n for n in range(1, len(own)) if all(other[-n:] != own[-n:] for other in rest)), len(own))
        names.append("/".join(own[-longest:]))
    return names


def identical_file_messages(files: Sequence[str]) -> list[str]:
    """Report files with the same content as an earlier one, which is possible for renders of a round object but not for photos.

    Raises InputError for an unreadable file.
    """
    first: dict[str, str] = {}
    earlier = [(file, first.setdefault(file_sha256(Path(file)), file)) for file in files]
    names = dict(zip(files, distinct_names(files), strict=True))
    return [f"{names[file]}: the same picture as {names[other]}" for file, other in earlier if other != file]


def _is_mesh(item: Item) -> bool:
    return item.given is not None or Path(item.file or "").suffix.lower() in MESH_SUFFIXES


@dataclass
class PhotoGroups:
    """The manifest rows with a group, collected until the manifest's end; ``turn_deg`` is one of their columns."""

    manifest: Path
    rows: dict[str, list[tuple[int, Row]]] = field(default_factory=lambda: defaultdict(list))

    def add(self, line: int, row: Row) -> bool:
        """Store a row if it has a group, and return whether it has. Raises UsageError for a turn or poses without a group."""
        group = _cell_text(row, "group")
        if not group and _cell_text(row, "turn_deg"):
            raise UsageError(
                f"{self.manifest}:{line}: turn_deg needs several photos of one object; give the row a group too"
            )
        if not group and _cell_text(row, "poses"):
            raise UsageError(
                f"{self.manifest}:{line}: poses need several photos of one object; give their rows a group too"
            )
        if group:
            self.rows[group].append((line, row))
        return bool(group)

    def items(self, to_item: ToItem) -> Iterator[tuple[Item, str]]:
        """Yield each group's item, and the location of its rows, in the order of their first rows.

        Raises UsageError with the rows if they contradict each other, and like ``group_photos``.
        """
        for group, rows in self.rows.items():
            shown = printable_line(group, max_characters=60)
            where = f"{self.manifest}: group {shown!r} ({_numbered([line for line, _ in rows])})"
            said = {column: _agreed(where, column, rows) for column in OF_THE_THING}
            poses = said.pop("poses") or None
            known = {column: value for column, value in said.items() if value}
            items = [to_item({**row, **known}, f"{self.manifest}:{line}") for line, row in rows]
            place = None if poses is None else os.path.join(self.manifest.parent, poses)
            yield group_photos(items, _turns(where, rows), where, place), where


def _cell_text(row: Row, column: str) -> str:
    value = row.get(column)
    return "" if value is None else str(value).strip()


def _agreed(where: str, column: str, rows: Iterable[tuple[int, Row]]) -> str:
    """Return the value of a column on which all rows with a value agree. Raises UsageError if they differ."""
    values: dict[str, int] = {}
    for line, row in rows:
        value = _cell_text(row, column)
        if value:
            values.setdefault(value, line)
    if len(values) > 1:
        told = " and ".join(
            f"{printable_line(value, max_characters=40)!r} (row {line})" for value, line in values.items()
        )
        raise UsageError(
            f"{where}: all rows of an object must have the same {column}, but they have {told}; correct them"
        )
    return next(iter(values), "")


def _turns(where: str, rows: Sequence[tuple[int, Row]]) -> list[float] | None:
    said = {line: _cell_text(row, "turn_deg") for line, row in rows}
    missing = [line for line, value in said.items() if not value]
    if len(missing) == len(said):
        return None
    if missing:
        raise UsageError(
            f"{where}: {_numbered(missing)} without a turn_deg; give one in every row of a group, or in none"
        )
    try:
        return [float(value) for value in said.values()]
    except ValueError:
        values = ", ".join(printable_line(value, max_characters=20) for value in said.values())
        raise UsageError(f"{where}: turn_deg is {values}; give degrees, such as 0, 90 and 180") from None


def _numbered(lines: Sequence[int]) -> str:
    return f"row{'s' if len(lines) > 1 else ''} {', '.join(map(str, lines[:6]))}{', ...' if len(lines) > 6 else ''}"
