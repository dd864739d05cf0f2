"""Pictures in a folder that are masks of the photos beside them, by their names: ``mug.jpg`` and ``mug_mask.png``."""

from __future__ import annotations

import os
import posixpath
import re
from collections.abc import Sequence
from pathlib import Path

from manitwin.formats.source_files import IMAGE_SUFFIXES, MESH_SUFFIXES

_OF_A_PHOTO = re.compile(r"(.+)[_.-]mask", re.IGNORECASE)


def masks_beside(names: Sequence[str]) -> dict[str, str]:
    """Return of images by their names, with ``/``, each that is called a mask of another one in its folder: mask to photo.

    What is a mask of two photos of one name (``mug.jpg``, ``mug.png``) is that of neither, and a mask has none itself.
    """
    photos: dict[str, list[str]] = {}
    for name in names:
        photos.setdefault(posixpath.splitext(name)[0], []).append(name)
    found = {}
    for stem, masks in photos.items():
        named = _OF_A_PHOTO.fullmatch(posixpath.basename(stem))
        of = photos.get(posixpath.join(posixpath.dirname(stem), named[1]), []) if named else []
        if len(of) == len(masks) == 1:
            found[masks[0]] = of[0]
    return {mask: photo for mask, photo in found.items() if photo not in found}


def masks_of_photos(photos: Sequence[Path]) -> dict[Path, Path]:
    """Return the mask that lies beside each of some photos, where one does: a folder of theirs is read once.

    In a folder with a mesh there is none, as pictures there may be its textures. A folder that cannot be read has none.
    """
    found: dict[Path, dict[str, str]] = {}
    for photo in photos:
        if photo.parent not in found:
            found[photo.parent] = _photos_with_masks(photo.parent)
    return {photo: photo.with_name(mask) for photo in photos if (mask := found[photo.parent].get(photo.name))}


def _photos_with_masks(folder: Path) -> dict[str, str]:
    try:
        names = sorted(os.listdir(folder))
    except OSError:
        return {}
    suffixes = {name: posixpath.splitext(name)[1].lower() for name in names}
    if MESH_SUFFIXES & set(suffixes.values()):
        return {}
    masks = masks_beside([name for name in names if suffixes[name] in IMAGE_SUFFIXES])
    return {photo: mask for mask, photo in masks.items()}
