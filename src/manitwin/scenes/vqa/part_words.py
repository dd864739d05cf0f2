"""Words for parts and points, and which of them identify one place in a picture."""

from __future__ import annotations

import numpy as np

from manitwin.scenes.vqa.posed_objects import PosedObject

ALL_ROUND = frozenset(
    {
        "rim", "body", "barrel", "base", "side", "sides", "middle", "sole", "surface", "headband", "neck", "shaft", "top",
        "wall", "end", "far end", "end flap", "edge", "ear cup", "front", "back", "hole", "bore",
    }
)  # fmt: skip
"""Labels of features that extend around or along an object or occur twice, so that a picture does not identify the place."""
OPENINGS = frozenset({"opening", "mouth"})
"""Labels of features that are located by their centre, which is not on the surface."""
WIDE = ALL_ROUND - {"base", "neck", "shaft", "top", "front", "back"}
"""Names of parts that a reader may see where the labels show another part: the body of a pan includes its inside."""
SIDES_OF_WHAT_STANDS = frozenset({"top", "bottom", "underside"})
"""Names of sides that are up or down, which hold only for an object that stands upright."""
UNTOLD_SIDES = frozenset({"front", "back", "side", "left side", "right side"})
"""Names of sides that a picture does not distinguish."""
STANDS_RAD = np.radians(12)
PART_GONE_PX = 2
"""A part is invisible if no more pixels show it (of a picture of 512 x 512)."""


def is_locatable(name: str, thing: PosedObject) -> bool:
    """Return whether a picture identifies the place that a part's name denotes: a box that lies has no top."""
    word = name.casefold()
    return word not in UNTOLD_SIDES and (word not in SIDES_OF_WHAT_STANDS or is_upright(thing))


def is_upright(thing: PosedObject) -> bool:
    """Return whether +Z of an object's frame points up."""
    return bool(thing.pose[2, 2] >= np.cos(STANDS_RAD))
