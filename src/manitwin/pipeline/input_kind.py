"""Kinds of inputs, by the content of their files or by their names."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from manitwin.errors import InputError
from manitwin.formats.sniff import sniff
from manitwin.formats.source_files import MESH_SUFFIXES
from manitwin.pipeline.item import Item

Kind = Literal["image", "photos", "text", "mesh"]
"""``photos``: several photos of one object."""
KINDS_OF_INPUT: tuple[Kind, ...] = ("image", "photos", "text", "mesh")


def kind_of(item: Item) -> Kind:
    """Return the kind of an input from the content of its files.

    Raises InputError (``wrong_type`` also if one of several views is not a photo), and OSError for a missing file.
    """
    kinds: list[Kind] = [sniff(Path(file)).kind for file in item.files]
    if not kinds:
        return "text"
    for file, kind in zip(item.files, kinds, strict=True):
        if item.views and kind != "image":
            raise InputError("wrong_type", f"{Path(file).name}: not an image; all views of one object must be photos")
    return "photos" if item.views else kinds[0]


def claimed_kind(item: Item) -> Kind:
    """Return the kind of an input that its suffix claims."""
    if item.file is None:
        return "text"
    if item.views:
        return "photos"
    return "mesh" if Path(item.file).suffix.lower() in MESH_SUFFIXES else "image"
