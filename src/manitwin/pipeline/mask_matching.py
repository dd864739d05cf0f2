"""Masks in a folder that belong to photos by their names: ``mug.jpg`` and ``mug_mask.png``."""

from __future__ import annotations

import os
import posixpath
import re
from collections.abc import Sequence
from pathlib import Path

from manitwin.formats.source_files import IMAGE_SUFFIXES, MESH_SUFFIXES

_OF_A_PHOTO = re.compile(r"(.+)[_.-]mask", re.IGNORECASE)


def match_masks(names: Sequence[str]) -> dict[str, str]:
    """Map masks to photos among image names (with ``/``), by name within the same folder.

    A mask that matches two photos of one name (``mug.jpg``, ``mug.png``) belongs to neither, and a mask has no mask itself.
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


def masks_beside_photos(photos: Sequence[Path]) -> dict[Path, Path]:
    """Return the mask beside each photo that has one; each folder is read once.

    Folders with a mesh are skipped, as their images may be textures. An unreadable folder has no masks.
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
    masks = match_masks([name for name in names if suffixes[name] in IMAGE_SUFFIXES])
    return {photo: mask for mask, photo in masks.items()}
