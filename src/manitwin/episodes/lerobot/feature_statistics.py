"""Statistics of features, for an episode and for a whole set, as LeRobot's normalisation reads them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

from manitwin.episodes.lerobot.frame_features import Feature
from manitwin.episodes.lerobot.lerobot_format import QUANTILES

Statistics = dict[str, list[Any]]
"""``min, max, mean, std, q01, ...`` as lists with a number per dimension, ``count`` as a list of one number."""

BINS = 5000
"""Quantiles of a whole set come from a histogram with this many bins between min and max, as in lerobot's
RunningQuantileStats: their error is at most one bin. Those of an episode are exact.
"""


def episode_statistics(columns: dict[str, np.ndarray]) -> dict[str, Statistics]:
    """Return the statistics of arrays ``(T, width)`` or ``(T,)`` by feature."""
    matrices = [np.asarray(array, np.float64).reshape(len(array), -1) for array in columns.values()]
    values = np.hstack(matrices)  # stacked, because a call per feature costs more than the arithmetic
    quantiles = np.quantile(values, list(QUANTILES.values()), axis=0)
    rows = {
        "min": values.min(0),
        "max": values.max(0),
        "mean": values.mean(0),
        "std": values.std(0),
        **dict(zip(QUANTILES, quantiles, strict=True)),
    }
    result: dict[str, Statistics] = {}
    begin = 0
    for name, matrix in zip(columns, matrices, strict=True):
        where = slice(begin, begin := begin + matrix.shape[1])
        result[name] = {"count": [len(values)], **{kind: row[where].tolist() for kind, row in rows.items()}}
    return result


class PooledStatistics:
    """Mean, variance and bounds of a feature, accumulated over episodes.

    Source: T. F. Chan, G. H. Golub, R. J. LeVeque, Updating formulae and a pairwise algorithm for computing sample variances,
    1979, equation 2.1.
    """

    def __init__(self, first: Statistics):
        """Start with the statistics of one episode; arrays keep their shape, including those of pictures."""
        self.count: int = first["count"][0]
        self.mean = np.array(first["mean"], np.float64)
        self.squares = self.count * np.array(first["std"], np.float64) ** 2
        self.low, self.high = np.array(first["min"], np.float64), np.array(first["max"], np.float64)

    def add(self, other: Statistics) -> None:
        """Add another episode's statistics."""
        count: int = other["count"][0]
        both, delta = self.count + count, np.array(other["mean"], np.float64) - self.mean
        self.squares += count * np.array(other["std"], np.float64) ** 2 + delta**2 * self.count * count / both
        self.mean += delta * count / both
        self.count = both
        self.low, self.high = np.minimum(self.low, other["min"]), np.maximum(self.high, other["max"])

    def statistics(self, quantiles: np.ndarray) -> Statistics:
        """Return the pooled statistics with the given quantiles ``(5, ...)``."""
        return {
            "min": self.low.tolist(),
            "max": self.high.tolist(),
            "mean": self.mean.tolist(),
            "std": np.sqrt(self.squares / self.count).tolist(),
            "count": [self.count],
            **{name: row.tolist() for name, row in zip(QUANTILES, quantiles, strict=True)},
        }


def quantiles_of_files(
    files: Iterable[Path], features: Sequence[Feature], pooled: dict[str, PooledStatistics]
) -> dict[str, np.ndarray]:
    """Return the quantiles ``(5, width)`` of each feature over data files, with one file in memory at a time."""
    counts = {f.name: np.zeros((f.width, BINS), np.int64) for f in features}
    for path in files:
        with pq.ParquetFile(path) as file:
            for feature in features:
                column = file.read([feature.name])[feature.name].combine_chunks()
                flat = column if feature.names is None else column.flatten()
                values = flat.to_numpy(zero_copy_only=False).astype(np.float64).reshape(-1, feature.width)
                low, high = pooled[feature.name].low, pooled[feature.name].high
                step = (values - low) / np.where(high > low, high - low, 1) * BINS
                steps = np.clip(step.astype(np.int64), 0, BINS - 1)
                for dimension in range(feature.width):
                    counts[feature.name][dimension] += np.bincount(steps[:, dimension], minlength=BINS)
    return {name: _quantiles(rows, pooled[name]) for name, rows in counts.items()}


def _quantiles(counts: np.ndarray, pooled: PooledStatistics) -> np.ndarray:
    result = np.empty((len(QUANTILES), len(counts)))
    for dimension, row in enumerate(counts):
        below = np.concatenate([[0], np.cumsum(row)])
        for place, share in enumerate(QUANTILES.values()):
            wanted = share * below[-1]
            step = int(np.searchsorted(below[1:], wanted))
            within = (wanted - below[step]) / row[step] if row[step] else 0.0
            low, high = pooled.low[dimension], pooled.high[dimension]
            result[place, dimension] = low + (high - low) * (step + within) / BINS
    return result
