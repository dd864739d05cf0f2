"""Near-duplicate twins: twins made of the same input, and pairs of equal shape and size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from manitwin.dataset.index.query import Index
from manitwin.dataset.index.tables import DESCRIPTOR_LENGTH

MAX_SHAPE_DISTANCE = 0.02
"""Limit on the distance of two shape descriptors, see ``geometry.shape_descriptor``. On the visual meshes of 25 real objects, the
descriptor of the same object (resampled, rotated, scaled by 3.7; five times each) is 0.005 away in the median and at most 0.011.
Of the 300 pairs of different objects the nearest, a mug and a container, are 0.047 apart, the median pair 0.46.
"""

MAX_SIZE_RATIO = 1.05
"""Limit on the ratio of the radii of gyration. These are exact: repair, decimation and rounding change them by less than 5 %."""

NEIGHBOURS = 16
"""Nearest neighbours examined per twin, so that a thousand copies give 16,000 pairs instead of half a million."""


@dataclass(frozen=True)
class NearPair:
    """Two accepted twins of different inputs with equal shape and size, ``first < second``."""

    first: str
    second: str
    shape_distance: float
    size_ratio: float


@dataclass(frozen=True)
class NearDuplicates:
    """``same_source`` maps the sha256 of an input to the ids of the accepted twins made of it (two or more); ``pairs`` are
    nearest first.
    """

    same_source: dict[str, list[str]]
    pairs: list[NearPair]


def near_duplicates(
    index: Index, *, max_shape_distance: float = MAX_SHAPE_DISTANCE, max_size_ratio: float = MAX_SIZE_RATIO
) -> NearDuplicates:
    """Find twins of equal inputs, and pairs of other twins whose shape and size differ by at most the given limits.

    Of the twins of one input, only the first by id is compared with others. Mirrored objects count as the same shape; colours and
    labels are ignored. The descriptors are searched with a k-d tree, so time grows only slightly faster than the number of twins.
    """
    rows = index.select("twins", columns=["twin_id", "source_sha256", "radius_of_gyration_m", "shape_descriptor"])
    shapes = (
        rows["shape_descriptor"]
        .combine_chunks()
        .flatten()
        .to_numpy(zero_copy_only=False)
        .reshape(-1, DESCRIPTOR_LENGTH)
    )
    return near_duplicates_of(
        rows["twin_id"].to_pylist(),
        rows["source_sha256"].to_pylist(),
        rows["radius_of_gyration_m"].to_numpy(),
        shapes,
        max_shape_distance=max_shape_distance,
        max_size_ratio=max_size_ratio,
    )


def near_duplicates_of(
    twin_ids: Sequence[str],
    sources: Sequence[str],
    radii_m: np.ndarray,
    descriptors: np.ndarray,
    *,
    max_shape_distance: float = MAX_SHAPE_DISTANCE,
    max_size_ratio: float = MAX_SIZE_RATIO,
) -> NearDuplicates:
    """Find the near duplicates as ``near_duplicates`` does, among twins that are given.

    ``twin_ids`` are sorted; ``sources`` are the digests of their inputs, ``radii_m (N,)`` their radii of gyration and
    ``descriptors (N, DESCRIPTOR_LENGTH)`` their shape descriptors.
    """
    same_source: dict[str, list[str]] = {}
    for twin_id, source in zip(twin_ids, sources, strict=True):
        same_source.setdefault(source, []).append(twin_id)
    representatives = {ids[0] for ids in same_source.values()}
    keep = np.array([twin_id in representatives for twin_id in twin_ids], bool)
    ids = [twin_id for twin_id in twin_ids if twin_id in representatives]
    first, second, distance, ratio = _near_pairs(
        descriptors[keep], np.log(radii_m[keep]), max_shape_distance, np.log(max_size_ratio)
    )
    pairs = [
        NearPair(ids[a], ids[b], float(d), float(r)) for a, b, d, r in zip(first, second, distance, ratio, strict=True)
    ]
    shared = {source: twins for source, twins in sorted(same_source.items()) if len(twins) > 1}
    return NearDuplicates(shared, pairs)


def _near_pairs(
    shapes: np.ndarray, log_sizes: np.ndarray, max_distance: float, max_log_ratio: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the index pairs within both limits, their distances and size ratios, nearest first.

    The tree holds shape and size in units of their limits, so a pair within both limits is at most sqrt(2) apart.
    """
    if len(shapes) < 2:
        return np.empty(0, int), np.empty(0, int), np.empty(0), np.empty(0)
    scaled = np.column_stack([log_sizes / max_log_ratio, shapes.astype(np.float64) / max_distance])
    count = min(NEIGHBOURS + 1, len(scaled))  # each twin is its own nearest neighbour
    _, near = cKDTree(scaled).query(scaled, k=count, distance_upper_bound=np.sqrt(2) * (1 + 1e-9))
    own = np.repeat(np.arange(len(scaled)), count)
    other = near.ravel()
    found = (other < len(scaled)) & (other != own)
    pairs = np.unique(np.sort(np.column_stack([own[found], other[found]]), axis=1), axis=0)
    first, second = pairs[:, 0], pairs[:, 1]
    distance = np.linalg.norm(shapes[first].astype(np.float64) - shapes[second], axis=1)
    log_ratio = np.abs(log_sizes[first] - log_sizes[second])
    within = (distance <= max_distance) & (log_ratio <= max_log_ratio)
    order = np.lexsort((second[within], first[within], distance[within]))
    first, second, distance, log_ratio = (values[within][order] for values in (first, second, distance, log_ratio))
    return first, second, distance, np.exp(log_ratio)
