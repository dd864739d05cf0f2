"""Masks from outlines that a person drew, stored with a twin so that its own files suffice to rebuild it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from manitwin.engine.stage import Draft
from manitwin.errors import InputError, Rejected
from manitwin.formats.image_file import full_size
from manitwin.pipeline.item import Item
from manitwin.pipeline.stated_place import as_box


def drawn_mask(draft: Draft[Item], place: int | None = None) -> bytes | None:
    """Return the outline that a person drew on a photo as a mask file; None if there is none, or it is unusable.

    ``place`` is the index of the photo if it is one of several of an object.
    """
    item, said = draft.payload, draft.amendments.get("photo")
    if said is None:
        return None
    # importing the cut-out code takes half a CPU-second, and few photos are amended
    from manitwin.pipeline.drawn_outline import drawn_outline, mask_file

    try:
        drawn = drawn_outline(said, item.title, place)
        if drawn is None:
            return None
        return mask_file(drawn, full_size(Path(item.files[place or 0]))[:2], as_box(item.box_px))
    except (Rejected, InputError):  # the photo was rejected or left out for this reason
        return None


def with_drawn_masks(draft: Draft[Item], folder: Path) -> Item:
    """Return the item of several photos, with a mask file in ``folder`` for each photo with a drawn outline."""
    item, masks = draft.payload, list(draft.payload.masks or ("",) * len(draft.payload.files))
    for place in range(len(item.files)):
        mask = drawn_mask(draft, place)
        if mask is not None:
            file = folder / f"drawn_{place:02d}.png"
            file.write_bytes(mask)
            masks[place] = str(file)
    return replace(item, masks=tuple(masks)) if any(masks) else item
