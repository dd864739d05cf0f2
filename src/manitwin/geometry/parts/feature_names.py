"""Names of places on an object, and of what tells its working end: priors say them, and none of them needs a mesh."""

from __future__ import annotations

from typing import Literal

Feature = Literal[
    "opening", "rim", "inside", "handle", "handle_end", "head", "face", "tip", "edge", "middle", "neck", "spout",
    "top", "base", "side", "center", "front", "back", "end", "ring", "mouth", "bristles", "muzzle", "grip", "housing",
    "apex", "arch_end", "end_wall", "toe", "stem", "nozzle", "crest", "teeth", "spine", "case", "strap", "lens",
    "bow", "beam",
]  # fmt: skip
"""A place on an object that geometry can point out."""

HeadEnd = Literal["wide", "narrow", "thin", "thick", "short", "straight", "heavy", "up"]
"""What tells the working end: its width, its thickness, being the shorter section (a cap; the wider end where no border shows),
being away from an end that is bent to a hook (an umbrella; the wider end where none is), the side of the centre of mass, or
being the upper one."""
