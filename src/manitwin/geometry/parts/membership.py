"""Types of part rules: the rule names, the roles of each rule, and the resulting part of each point."""

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
"""The roles that each rule can assign; those of ``open``, ``closed`` and ``faced`` are surface zones (``skin_rules``)."""


@dataclass(frozen=True)
class Membership:
    """The part of each point ``(N,)`` as an index into ``roles``, and the confidence in the border.

    Within ``band_share`` of the longest side from a border, parts are separated at concavities instead of by the rule.
    """

    roles: tuple[str, ...]
    index: np.ndarray
    confidence: float
    band_share: float = 0.1
