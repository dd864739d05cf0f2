"""Representative sample of a data set: equal inclusion probabilities, proportional over the strata."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.dataset.index.query import Index
from manitwin.errors import UsageError

SIZES_M = (0.05, 0.1, 0.2, 0.4)
"""Bounds of the size strata in metres (longest side); each class spans a factor of two."""
COLUMNS = ("twin_id", "category", "longest_m", "kind")


@dataclass(frozen=True)
class SampledTwin:
    """A twin with its stratification variables: category, longest side (m), kind of input; None if the index lacks them."""

    twin_id: str
    category: str | None
    longest_m: float | None
    kind: str | None

    @property
    def stratum(self) -> tuple[str, str, str]:
        """Category, size class and kind of input."""
        size = "?" if self.longest_m is None else str(int(np.searchsorted(SIZES_M, self.longest_m, side="right")))
        return self.category or "?", size, self.kind or "?"


def listed_twins(index: Index) -> list[SampledTwin]:
    """Return all accepted twins of an index, sorted by id."""
    rows = index.select("twins", columns=COLUMNS).to_pylist()
    return [SampledTwin(**row) for row in rows]


def stratified_sample(twins: Iterable[SampledTwin], size: int, seed: int) -> list[str]:
    """Return the ids of ``size`` twins (of all twins if there are fewer), shuffled by the seed.

    Systematic sampling of a list sorted by strata (W. G. Cochran, Sampling Techniques, 3rd ed., section 8.3: implicit
    stratification). Every twin has the inclusion probability ``size``/N, so that shares in the sample need no weights. A stratum
    of n twins, contiguous in the list, contributes ``n * size/N`` twins, rounded down or up; this holds for every category, for
    every size class within it, and for every kind of input. Within a stratum the seed gives the order. Equal twins, size and seed
    give the same sample.
    """
    if size < 1:
        raise UsageError(f"a sample of {size} twins; give 1 or more")
    ordered = sorted(twins, key=lambda twin: (twin.stratum, _drawn(seed, twin.twin_id)))
    size = min(size, len(ordered))
    start = np.random.default_rng(seed).random()
    places = (int((number + start) * len(ordered) / size) for number in range(size))
    chosen = [ordered[min(place, len(ordered) - 1)].twin_id for place in places]
    return sorted(chosen, key=lambda twin_id: _drawn(seed + 1, twin_id))


def strata_counts(twins: Sequence[SampledTwin], chosen: Iterable[str]) -> Mapping[str, tuple[int, int]]:
    """Return, per category, the number of twins in the sample and in total."""
    wanted, counts = set(chosen), dict[str, tuple[int, int]]()
    for twin in twins:
        sampled, total = counts.get(twin.stratum[0], (0, 0))
        counts[twin.stratum[0]] = sampled + (twin.twin_id in wanted), total + 1
    return dict(sorted(counts.items()))


def _drawn(seed: int, twin_id: str) -> str:
    """Return the sort key of a twin, determined by the seed and its id alone."""
    return hashlib.sha256(f"{seed}:{twin_id}".encode()).hexdigest()
