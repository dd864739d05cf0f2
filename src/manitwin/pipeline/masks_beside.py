"""Pictures in a folder that are masks of the photos beside them, by their names: ``mug.jpg`` and ``mug_mask.png``."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Sequence

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
