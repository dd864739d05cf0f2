"""Words of parts and points: which of them mean one place that a picture tells."""

from __future__ import annotations

import numpy as np

from manitwin.scenes.vqa.things import Thing

ALL_ROUND = frozenset(
    {
        "rim", "body", "barrel", "base", "side", "sides", "middle", "sole", "surface", "headband", "neck", "shaft", "top",
        "wall", "end", "far end", "end flap", "edge", "ear cup", "front", "back", "hole", "bore",
    }
)  # fmt: skip
"""Labels of what goes around a thing or along it, or is there twice: which place is meant, a picture does not tell."""
OPENINGS = frozenset({"opening", "mouth"})
"""Labels of what is meant by its middle, which is not on the surface."""
WIDE = ALL_ROUND - {"base", "neck", "shaft", "top", "front", "back"}
"""Names of parts of which a person sees some where the labels have another part: the body of a pan is its inside too."""
SIDES_OF_WHAT_STANDS = frozenset({"top", "bottom", "underside"})
"""Names of sides that are those above and below: of a thing that stands as it is made, and of no other."""
UNTOLD_SIDES = frozenset({"front", "back", "side", "left side", "right side"})
"""Names of sides that nothing in the picture tells from the others."""
STANDS_RAD = np.radians(12)
PART_GONE_PX = 2
"""A part is not seen with so few pixels (of a picture of 512 x 512)."""


def is_told(name: str, thing: Thing) -> bool:
    """Whether a picture tells which place of a thing a part's name means: a box that lies has no top."""
    word = name.casefold()
    return word not in UNTOLD_SIDES and (word not in SIDES_OF_WHAT_STANDS or stands(thing))


def stands(thing: Thing) -> bool:
    """Whether +Z of a thing's frame is upward."""
    return bool(thing.pose[2, 2] >= np.cos(STANDS_RAD))
