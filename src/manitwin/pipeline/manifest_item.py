"""Conversion of a manifest row, a file or a text to an item."""

from __future__ import annotations

import os
import re
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, cast, get_args

from manitwin.errors import UsageError, unknown_name_message
from manitwin.formats.missing_path import missing_path_message
from manitwin.formats.printable import printable_line
from manitwin.geometry.length_unit import StatedUnit
from manitwin.pipeline.inspection import inspect_import
from manitwin.pipeline.item import Item
from manitwin.pipeline.stated_place import BOX, MASK, require_of_photo, stated_box_px, stated_mask
from manitwin.pipeline.stated_size import stated_size_m, with_defaults
from manitwin.twin.import_record import IMPORT_RECORD, IMPORTED_MESH, is_imported

_COLUMNS_SHOWN = 20
LONGEST = {"name": 200, "text": 4000, "license": 200, "attribution": 4000, "file": 4095, "poses": 4095, "mask": 4095}
"""Most characters of a column's value; a longer name is not a name, and no generator accepts longer texts."""
_CONTROLS = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""Characters that control a terminal or the reading direction, and lone surrogates; tab and end of line are allowed."""
_LINES = re.compile(r"[\r\n\t\u2028\u2029]")
COLUMNS = (
    "file",
    "text",
    "name",
    "units",
    "up",
    "longest_side_m",
    "mask",
    "box_px",
    "license",
    "attribution",
    "group",
    "turn_deg",
    "poses",
)
Up = Literal["y", "z", "auto"]


def item_of(
    row: dict[str, Any], folder: Path, defaults: dict[str, Any], where: str, unknown: dict[str, str] | None = None
) -> Item:
    """Return the item of a row, completed by the ``defaults``; paths are absolute or relative to ``folder``.

    ``where`` is the prefix of messages; ``unknown`` are the row's other columns. Raises UsageError.
    """
    said = {key: str(value).strip() for key, value in row.items() if key in COLUMNS and value not in (None, "")}
    values = with_defaults(said, defaults)
    for key, value in values.items():
        if isinstance(value, str) and (why := unusable(key, value)):
            raise UsageError(f"{where}: {key}: {why}")
    file, text = values.get("file"), values.get("text")
    if (file is None) == (text is None):
        columns = f"; the first line must name the columns; unknown: {listed_columns(unknown)}" if unknown else ""
        raise UsageError(f"{where}: give either 'file' or 'text' in a row{columns}")
    if file is not None:
        path = os.path.join(folder, file.rstrip("/") or file)
        if not os.path.isfile(path):
            if os.path.isdir(path) and is_imported(Path(path)):
                return _imported_item(Path(path).resolve(), values, where)
            what = "not a file" if os.path.exists(path) else missing_path_message(file)
            raise UsageError(f"{where}: {shortened(path)} is {what}; paths are absolute or relative to the manifest")
        file = _resolved(path)
    for key, kind in (("units", StatedUnit), ("up", Up)):
        if values[key] not in get_args(kind):
            raise UsageError(f"{where}: {unknown_name_message(key, str(values[key]), get_args(kind))}")
    require_of_photo(values, file, where)
    mask, box_px = stated_mask(values.get(MASK), folder, where), stated_box_px(values.get(BOX), where)
    return Item(
        file=file,
        text=text,
        name=values["name"] or None,
        units=cast(StatedUnit, values["units"]),
        up=cast(Up, values["up"]),
        license=values["license"],
        attribution=values["attribution"],
        longest_side_m=stated_size_m(values, where),
        masks=() if mask is None else (mask,),
        box_px=box_px or (),
    )


def _resolved(path: str) -> str:
    """Return the real path of a file; the path of its folder is cached, as manifests name many files in few folders.

    A link to a file with another suffix is kept: content stores such as the cache of Hugging Face have ``mug.obj`` as a link to
    a file named by its digest, without the files that the mesh references beside it.
    """
    place = os.path.join(_real_folder(os.path.dirname(path)), os.path.basename(path))
    if not os.path.islink(place):
        return place
    real = os.path.realpath(place)
    return real if os.path.splitext(real)[1].lower() == os.path.splitext(place)[1].lower() else place


@lru_cache(maxsize=4096)
def _real_folder(path: str) -> str:
    return os.path.realpath(path)


def forget_folders() -> None:
    """Clear the cache of folder paths, as links may have changed."""
    _real_folder.cache_clear()


def listed_columns(unknown: dict[str, str]) -> str:
    """List the unknown columns, truncated if there are many."""
    named = [unknown[column] for column in sorted(unknown)[:_COLUMNS_SHOWN]]
    return ", ".join([*named, "..."] if len(unknown) > _COLUMNS_SHOWN else named)


def unusable(key: str, value: str) -> str | None:
    """Return why a column's value cannot be used; None if it can. File names may contain any characters except NUL."""
    most = LONGEST.get(key, LONGEST["name"])
    if len(value) > most:
        return f"{len(value)} characters; give at most {most}"
    if key in ("file", "poses", "mask"):
        return "contains a NUL character; check the path" if "\0" in value else None
    if _CONTROLS.search(value) or (key in ("name", "license") and _LINES.search(value)):
        return (
            f"{printable_line(value, max_characters=60)!r} contains control characters; use printable characters only"
        )
    return None


def shortened(path: str) -> str:
    """Return a path for a message, shortened in the middle."""
    return printable_line(path, max_characters=200)


def _imported_item(folder: Path, values: dict[str, Any], where: str) -> Item:
    """Return the item of an imported asset; its unit and axes are those that the import wrote, regardless of the user's input.

    A stated longest side is used: some converters write a wrong unit, and some data sets have none.
    """
    longest_side_m = stated_size_m(values, where)
    require_of_photo(values, str(folder / IMPORTED_MESH), where)
    name, license_, attribution = inspect_import(folder / IMPORT_RECORD)
    return Item(
        file=str(folder / IMPORTED_MESH),
        name=values["name"] or name,
        units="m",
        up="y",
        longest_side_m=longest_side_m,
        license=values["license"] or license_,
        attribution=values["attribution"] or attribution,
        given=str(folder / IMPORT_RECORD),
    )
