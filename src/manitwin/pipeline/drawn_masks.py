"""Outlines that a person drew of photos, as the masks that a twin keeps beside them: its own files make it again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from manitwin.engine.stage import Draft
from manitwin.errors import InputError, Rejected
from manitwin.formats.image_file import full_size
from manitwin.pipeline.item import Item
from manitwin.pipeline.stated_place import as_box


def drawn_mask(draft: Draft[Item], place: int | None = None) -> bytes | None:
    """Return the outline that a person drew of a photo as a mask of it; None where nobody did, or none that can be used.

    ``place`` is that of the photo, from 0, where it is one of several of a thing.
    """
    item, said = draft.payload, draft.amendments.get("photo")
    if said is None:
        return None
    # what cuts photos out takes half a CPU-second to import, and few photos are amended
    from manitwin.pipeline.drawn_outline import drawn_outline, mask_file

    try:
        drawn = drawn_outline(said, item.title, place)
        if drawn is None:
            return None
        return mask_file(drawn, full_size(Path(item.files[place or 0]))[:2], as_box(item.box_px))
    except (Rejected, InputError):  # as the photo was rejected or left out for
        return None


def with_drawn_masks(draft: Draft[Item], folder: Path) -> Item:
    """Return the item of several photos with a mask in ``folder`` for each photo whose outline a person drew."""
    item, masks = draft.payload, list(draft.payload.masks or ("",) * len(draft.payload.files))
    for place in range(len(item.files)):
        mask = drawn_mask(draft, place)
        if mask is not None:
            file = folder / f"drawn_{place:02d}.png"
            file.write_bytes(mask)
            masks[place] = str(file)
    return replace(item, masks=tuple(masks)) if any(masks) else item
