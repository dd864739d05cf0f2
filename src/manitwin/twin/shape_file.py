"""The shape descriptor file of a twin, so that comparing many twins does not require reading their meshes.

Mesh libraries are imported only for twins without this file.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from manitwin.errors import AssetError, TwinError
from manitwin.formats.json_file import json_number, json_vector, read_json_object
from manitwin.geometry.shape_descriptor import QUANTILES, ShapeDescriptor, shape_descriptor
from manitwin.twin.store import REMEDY, canonical_json

if TYPE_CHECKING:
    import trimesh

SHAPE = "shape.json"
MAX_SHAPE_BYTES = 16_384
_LENGTH = 2 * QUANTILES + 2
_SEED = 0  # fixed, so that all data sets describe shapes alike


def surface(path: Path) -> trimesh.Trimesh:
    """Return all parts of a twin's ``visual.glb`` as one untextured mesh in the object frame. Raises TwinError."""
    import trimesh

    from manitwin.twin.mesh_files import read_visual

    parts = read_visual(path)
    if not parts:
        raise TwinError(f"{path}: has no mesh in it; {REMEDY}")
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = [np.asarray(part.faces) + start for part, start in zip(parts, starts, strict=False)]
    return trimesh.Trimesh(np.vstack([part.vertices for part in parts]), np.vstack(faces), process=False)


def compute_shape(visual: Path) -> ShapeDescriptor:
    """Compute the shape descriptor of a twin's ``visual.glb``. Raises TwinError."""
    try:
        return shape_descriptor(surface(visual), seed=_SEED)
    except ValueError as error:
        raise TwinError(f"{visual}: {error}; {REMEDY}") from error


def shape_to_json(shape: ShapeDescriptor) -> bytes:
    """Return the content of ``shape.json``; equal shapes give equal bytes."""
    values = {"descriptor": shape.values.astype(float).tolist(), "radius_of_gyration_m": shape.radius_of_gyration_m}
    return canonical_json(values).encode()


def read_shape(folder: Path) -> ShapeDescriptor | None:
    """Read ``shape.json`` from a twin's folder; None if there is none, as in twins of earlier versions.

    Raises TwinError for a damaged file.
    """
    path = folder / SHAPE
    if not os.path.lexists(path):
        return None
    said = read_json_object(path, TwinError, limit_bytes=MAX_SHAPE_BYTES, inside=folder, name=str(path), remedy=REMEDY)
    try:
        values = json_vector(said.get("descriptor"), _LENGTH, "descriptor")
        radius_m = json_number(said.get("radius_of_gyration_m"), "radius_of_gyration_m")
    except AssetError as error:
        raise TwinError(f"{path}: {error}; {REMEDY}") from error
    return ShapeDescriptor(values.astype(np.float32), radius_m)
