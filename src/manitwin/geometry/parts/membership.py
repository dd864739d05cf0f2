"""What a rule of parts says: which part each place of a surface is of, and the parts that each rule knows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

PartRule = Literal[
    "handled", "spouted", "capped", "stemmed", "ended", "sectioned", "pistol", "arched", "open", "closed", "faced",
]  # fmt: skip
PartRole = Literal[
    "body", "handle", "spout", "cap", "bowl", "stem", "foot", "head", "neck", "housing", "grip", "inside", "rim", "base", "top",
    "band", "cup", "side", "front", "back", "shaft", "tip", "end",
]  # fmt: skip
ROLES: dict[PartRule, tuple[PartRole, ...]] = {
    "handled": ("body", "handle"),
    "spouted": ("body", "handle", "spout"),
    "capped": ("body", "cap"),
    "stemmed": ("bowl", "stem", "foot"),
    "ended": ("head", "neck", "handle"),
    "sectioned": ("shaft", "tip", "end"),
    "pistol": ("housing", "grip"),
    "arched": ("band", "cup"),
    "open": ("body", "inside", "rim", "base"),
    "closed": ("body", "top", "base"),
    "faced": ("side", "front", "back"),
}
"""The parts that each rule may tell; those of ``open``, ``closed`` and ``faced`` are of the surface alone (``skin_rules``)."""


@dataclass(frozen=True)
class Membership:
    """The part of each point ``(N,)``, an index into ``roles``, and how sure the border is.

    Nearer to a border than ``band_share`` of the longest side hollows tell the parts, and not the rule.
    """

    roles: tuple[str, ...]
    index: np.ndarray
    confidence: float
    band_share: float = 0.1
