"""Splits of affordance sets: twins of one input, and near duplicates, are in one split, as in a catalog."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from manitwin.dataset.catalog.groups import assign_groups, split_of
from manitwin.dataset.index.near_duplicates import near_duplicates_of
from manitwin.errors import TwinError
from manitwin.geometry.shape_descriptor import ShapeDescriptor
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.shape_file import compute_shape, read_shape


def split_twins(twins: Sequence[Twin]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the split of each twin by its id, and the twins whose shape cannot be read, with reasons."""
    shapes: dict[str, ShapeDescriptor] = {}
    left_out: dict[str, str] = {}
    for twin in twins:
        try:
            shapes[twin.record.twin_id] = read_shape(twin.folder) or compute_shape(twin.folder / "visual.glb")
        except TwinError as error:
            left_out[twin.record.twin_id] = str(error)
    return splits_of(shapes, {twin.record.twin_id: twin.record.source.sha256 for twin in twins}), left_out


def splits_of(shapes: Mapping[str, ShapeDescriptor], sources: Mapping[str, str]) -> dict[str, str]:
    """Return the split of each twin by its id; ``sources`` are the digests of the twins' inputs by id."""
    ids = sorted(shapes)
    near = near_duplicates_of(
        ids,
        [sources[twin_id] for twin_id in ids],
        np.array([shapes[twin_id].radius_of_gyration_m for twin_id in ids]),
        np.array([shapes[twin_id].values for twin_id in ids]),
    )
    return {twin_id: split_of(group) for twin_id, group in assign_groups(ids, near).items()}
