"""Train and validation split of scenes; a scene's split is independent of the other scenes in the set."""

from __future__ import annotations

import hashlib

TRAIN, VALIDATION = "train", "val"


def split_of(scene_id: str, validation_share: float) -> str:
    """Return the split of a scene from the hash of its id: the same in every export, also after scenes are added."""
    place = int.from_bytes(hashlib.sha256(scene_id.encode()).digest()[:8], "big") / 2**64
    return VALIDATION if place < validation_share else TRAIN
