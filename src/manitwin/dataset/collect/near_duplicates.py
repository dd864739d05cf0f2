"""Near-duplicate inputs of a catalogue, such as the same photo in another size or the same mesh in another format."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np

from manitwin.dataset.collect.looks import ALIKE, PICTURE, SHAPE, VERSION, similarity
from manitwin.dataset.collect.store import Catalogue
from manitwin.formats.isolated import Limits, ProcessCrashed, run_isolated
from manitwin.models.classifiers.efficientnet_lite import load_weights

LOOK = "manitwin.dataset.collect.looks:look_of_input"
LIMITS = Limits(seconds=60.0, memory_bytes=8 << 30)
BATCH = 100


def mark_near_duplicates(catalogue: Path) -> dict[str, int]:
    """Compute the missing look vectors of all files, and mark files that look like an earlier file as its duplicates.

    Returns the number of duplicates per kind, ``picture`` and ``shape``. Each file is read in a process with resource limits; a
    file that cannot be read is never a duplicate. Of similar files, the first in the catalogue stays. Raises UsageError if there
    is no catalogue, and Unavailable without the weights of the network.
    """
    load_weights()  # fails before any file is read
    with Catalogue(catalogue) as store:
        waiting = iter(store.files_without_feature(VERSION))
        while batch := list(islice(waiting, BATCH)):
            store.put_features(VERSION, [(digest, _compute_feature(place, kind)) for digest, place, kind in batch])
        found = list(_find_near_duplicates(store.features(VERSION)))
        store.put_near_duplicates({digest: of for digest, of, _ in found})
    counts = Counter(by for _, _, by in found)
    return {by: counts[by] for by in (PICTURE, SHAPE)}


def _compute_feature(place: str, kind: str) -> bytes | None:
    try:
        look: bytes | None = run_isolated(LOOK, place, kind, limits=LIMITS)
    except (ProcessCrashed, MemoryError):
        return None
    return look


def _find_near_duplicates(looks: list[tuple[str, str, bytes]]) -> Iterator[tuple[str, str, str]]:
    """Yield digest, digest of the original, and kind for each input that looks like an earlier input that is no
    duplicate itself.
    """
    for by in (PICTURE, SHAPE):
        mine = [(digest, look) for digest, kind, look in looks if (kind == "image") == (by == PICTURE)]
        if not mine:
            continue
        vectors = np.array([np.frombuffer(look, "<f2") for _, look in mine], np.float32)
        first: list[int] = []
        for place, (digest, _) in enumerate(mine):
            near = similarity(vectors[place], vectors[first], by) if first else np.zeros(0)
            best = int(near.argmax()) if len(near) else 0
            if len(near) and near[best] >= ALIKE[by]:
                yield digest, mine[first[best]][0], by
            else:
                first.append(place)
