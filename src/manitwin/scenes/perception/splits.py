"""The split of a data set of scenes: a scene is whole in one of them, whatever else is in the set."""

from __future__ import annotations

import hashlib

TRAIN, VALIDATION = "train", "val"


def split_of(scene_id: str, validation_share: float) -> str:
    """Return the split of a scene by the digest of its id: the same in every export, and when scenes are added."""
    place = int.from_bytes(hashlib.sha256(scene_id.encode()).digest()[:8], "big") / 2**64
    return VALIDATION if place < validation_share else TRAIN
