"""Morph targets of glTF documents, applied with the weights of the file (glTF 2.0, section 3.7.2.2)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from manitwin.formats.meshes.gltf_document import Accessors
from manitwin.formats.meshes.source import MeshSource

_AXES = 3


def target_weights(given: Any, source: MeshSource) -> tuple[float, ...]:
    """Return the weights of a node or mesh, empty if it has none; raises InputError ``unreadable``."""
    if given is None:
        return ()
    if not isinstance(given, list) or not all(
        isinstance(each, int | float) and not isinstance(each, bool) for each in given
    ):
        raise source.unreadable("its morph target weights are not a list of numbers", "export it again")
    return tuple(float(each) for each in given)


def apply_morph_targets(
    rows: np.ndarray,
    targets: Any,
    weights: Sequence[float],
    accessors: Accessors,
    source: MeshSource,
    attribute: str = "POSITION",
) -> np.ndarray:
    """Return rows ``(V, 3)`` of an attribute plus the weighted displacements of the targets.

    Targets beyond the weights are ignored, and a target without the attribute does not change it. Raises InputError
    ``unreadable``.
    """
    if not isinstance(targets, list) or not all(isinstance(target, dict) for target in targets):
        raise source.unreadable("its morph targets are not a list of objects", "export it again")
    moved = rows.astype(np.float64)
    for target, weight in zip(targets, weights, strict=False):
        if weight == 0 or attribute not in target:
            continue
        added = accessors.array(target[attribute])
        if added.shape != (len(rows), _AXES):
            raise source.unreadable("a morph target does not fit its mesh", "export it again")
        with np.errstate(all="ignore"):  # overflows are found when vertices are checked
            moved += weight * added.astype(np.float64)
    return moved
