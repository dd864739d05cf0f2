"""Leakage-free splits: twins of one input, or of nearly equal shape and size, form a group that is never divided."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence

from manitwin.dataset.index.near_duplicates import NearDuplicates

SPLITS = (("train", 0.8), ("val", 0.1), ("test", 0.1))


def assign_groups(twin_ids: Sequence[str], near: NearDuplicates) -> dict[str, str]:
    """Return the group of each twin, named by its smallest id: the connected components of equal inputs and near duplicates."""
    first = {twin_id: twin_id for twin_id in twin_ids}

    def root(twin_id: str) -> str:
        while first[twin_id] != twin_id:
            twin_id = first[twin_id]
        return twin_id

    links: Iterable[tuple[str, str]] = [
        *((ids[0], other) for ids in near.same_source.values() for other in ids[1:]),
        *((pair.first, pair.second) for pair in near.pairs),
    ]
    for one, other in links:
        low, high = sorted((root(one), root(other)))
        first[high] = low
    return {twin_id: root(twin_id) for twin_id in twin_ids}


def split_of(group: str) -> str:
    """Return the split of a group, drawn from the digest of its name. All views, clouds and captions of its twins follow it."""
    place = int.from_bytes(hashlib.sha256(group.encode()).digest()[:8], "big") / 2**64
    for name, share in SPLITS:
        if place < share:
            return name
        place -= share
    return SPLITS[-1][0]
