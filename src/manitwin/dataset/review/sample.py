"""A sample that stands for a data set: every twin as likely as any other, and every stratum with its share."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.dataset.index.query import Index
from manitwin.errors import UsageError

SIZES_M = (0.05, 0.1, 0.2, 0.4)
"""Bounds of the strata of size, by the longest side: each holds things twice as long as the one before."""
COLUMNS = ("twin_id", "category", "longest_m", "kind")


@dataclass(frozen=True)
class Listed:
    """A twin with what the strata are made of: category, longest side (m), kind of input; None where the index does not say."""

    twin_id: str
    category: str | None
    longest_m: float | None
    kind: str | None

    @property
    def stratum(self) -> tuple[str, str, str]:
        """Category, class of size and origin."""
        size = "?" if self.longest_m is None else str(int(np.searchsorted(SIZES_M, self.longest_m, side="right")))
        return self.category or "?", size, self.kind or "?"


def listed_twins(index: Index) -> list[Listed]:
    """Return all accepted twins of an index, sorted by id."""
    rows = index.select("twins", columns=COLUMNS).to_pylist()
    return [Listed(**row) for row in rows]


def stratified_sample(twins: Iterable[Listed], size: int, seed: int) -> list[str]:
    """Return the ids of ``size`` twins (all, where there are no more), in an order that is shuffled by the seed.

    Systematic sampling of a list that is sorted by strata (W. G. Cochran, Sampling Techniques, 3rd ed., section 8.3: implicit
    stratification). Every twin has the probability ``size``/N, so that shares in the sample need no weights; of a stratum of
    n twins, that lie together in the list, the sample has ``n * size/N`` rounded down or up: of every category, and within
    it of every class of size, and of origin. Within a stratum the order is that of the seed. Same twins, size, seed: same sample.
    """
    if size < 1:
        raise UsageError(f"a sample of {size} twins; give 1 or more")
    ordered = sorted(twins, key=lambda twin: (twin.stratum, _drawn(seed, twin.twin_id)))
    size = min(size, len(ordered))
    start = np.random.default_rng(seed).random()
    places = (int((number + start) * len(ordered) / size) for number in range(size))
    chosen = [ordered[min(place, len(ordered) - 1)].twin_id for place in places]
    return sorted(chosen, key=lambda twin_id: _drawn(seed + 1, twin_id))


def strata_counts(twins: Sequence[Listed], chosen: Iterable[str]) -> Mapping[str, tuple[int, int]]:
    """Return of each category (twins in the sample, twins in all)."""
    wanted, counts = set(chosen), dict[str, tuple[int, int]]()
    for twin in twins:
        sampled, total = counts.get(twin.stratum[0], (0, 0))
        counts[twin.stratum[0]] = sampled + (twin.twin_id in wanted), total + 1
    return dict(sorted(counts.items()))


def _drawn(seed: int, twin_id: str) -> str:
    """Return what a twin is ordered by: a number of its own that the seed gives, whatever other twins there are."""
    return hashlib.sha256(f"{seed}:{twin_id}".encode()).hexdigest()
