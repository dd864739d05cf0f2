"""What kind of thing an input is: by the bytes of its files, or by what it claims to be."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from manitwin.errors import InputError
from manitwin.formats.sniff import sniff
from manitwin.formats.source_files import MESH_SUFFIXES
from manitwin.pipeline.item import Item

Kind = Literal["image", "photos", "text", "mesh"]
"""``photos``: several photos of one thing."""
KINDS_OF_INPUT: tuple[Kind, ...] = ("image", "photos", "text", "mesh")


def kind_of(item: Item) -> Kind:
    """Return the kind of an input by its bytes.

    Raises InputError, also ``wrong_type`` where one of several views of a thing is no photo, and OSError for a file that is gone.
    """
    kinds: list[Kind] = [sniff(Path(file)).kind for file in item.files]
    if not kinds:
        return "text"
    for file, kind in zip(item.files, kinds, strict=True):
        if item.views and kind != "image":
            raise InputError("wrong_type", f"{Path(file).name}: not an image; all views of one object must be photos")
    return "photos" if item.views else kinds[0]


def claimed_kind(item: Item) -> Kind:
    """Return what an input claims to be: for a file, by its suffix."""
    if item.file is None:
        return "text"
    if item.views:
        return "photos"
    return "mesh" if Path(item.file).suffix.lower() in MESH_SUFFIXES else "image"
