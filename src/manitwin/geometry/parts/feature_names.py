"""Names of features (places on an object) and of rules for its working end, used by the priors; independent of meshes."""

from __future__ import annotations

from typing import Literal

Feature = Literal[
    "opening", "rim", "inside", "handle", "handle_end", "head", "face", "tip", "edge", "middle", "neck", "spout",
    "top", "base", "side", "center", "front", "back", "end", "ring", "mouth", "bristles", "muzzle", "grip", "housing",
    "apex", "arch_end", "end_wall", "toe", "stem", "nozzle", "crest", "teeth", "spine", "case", "strap", "lens",
    "bow", "beam",
]  # fmt: skip
"""A place on an object that can be located from geometry."""

HeadEnd = Literal["wide", "narrow", "thin", "thick", "short", "straight", "heavy", "up"]
"""The rule that identifies the working end: by width; by thickness; "short": the shorter section (a cap), or the wider end if no
border is found; "straight": the end opposite a hook (an umbrella), or the wider end if none is bent; "heavy": the side of the
centre of mass; "up": the upper end.
"""
