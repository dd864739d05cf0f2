"""Safe corrections: each follows from what the asset itself declares, and the old file is kept beside the new one.

Moving an origin is not among them, because other files may refer to the old one.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.assets.asset import Asset
from manitwin.assets.audit.convex_shapes import ConvexShapes
from manitwin.assets.read import only_file, robotwin_data
from manitwin.assets.readers.robotwin_data import FRAME_KEYS, read_json
from manitwin.errors import AssetError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.xml_file import MAX_XML_BYTES, add, edited_document, new_element, read_xml
from manitwin.twin.store import write_bytes_atomically

NEARLY = 0.05
"""Largest deviation of singular values from 1 at which the nearest rotation counts as intended: rounding to one digit."""

_MOMENTS = (("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2))


def write_missing_inertial(asset: Asset) -> str:
    """Write the centre of mass or inertia that a URDF lacks, or an inertia that is the template's 1.0.

    Both are those of the collision hulls, uniformly filled with the declared mass. Returns what was done, or why nothing was.
    Raises AssetError if the file cannot be read any more.
    """
    if asset.format not in ("urdf", "embodiedgen"):
        return f"not fixed: this is written into URDF files only, this is {asset.format}"
    mass = asset.inertial.mass_kg
    shapes = ConvexShapes.from_vertices([np.asarray(shape.vertices, float) for shape in asset.collision])
    if mass is None or not mass > 0 or not len(shapes):
        return "not fixed: it needs a mass above zero and collision shapes"
    file = only_file(asset.path) if asset.path.is_dir() else asset.path
    root = read_xml(file, "robot")
    links = root.findall("link")
    if len(links) != 1:
        return f"not fixed: {len(links)} links, and only the whole object's mass is known"
    inertial = links[0].find("inertial")
    if inertial is None:
        return "not fixed: it has no <inertial>"
    done = _complete(inertial, asset, shapes, mass)
    if not done:
        return "not fixed: nothing is left out"
    _replace(file, edited_document(root))
    return f"{file.name}: wrote {' and '.join(done)} of the collision shapes, evenly filled (the old file: {file.name}.orig)"


def _complete(inertial: Any, asset: Asset, shapes: ConvexShapes, mass_kg: float) -> list[str]:
    """Add missing values to an <inertial> element, and return what was added.

    Both are written in the axes of the link, which are those of the asset if there is one link.
    """
    done = []
    solid = shapes.uniform_solid
    tensor, inertia = asset.inertial.inertia_kg_m2, inertial.find("inertia")
    if inertial.find("origin") is None:
        origin = new_element("origin", xyz=_numbers(solid.center_of_mass_m), rpy="0 0 0")
        origin.tail = inertial.text
        inertial.insert(0, origin)
        done.append("the centre of mass")
    elif _is_turned(inertial.find("origin")):
        return []
    if inertia is None or (tensor is not None and np.allclose(tensor, np.eye(3), atol=1e-9)):
        if inertia is None:
            inertia = add(inertial, "inertia")
            inertia.tail = inertial.tail
        for name, row, column in _MOMENTS:
            inertia.set(name, repr(float(mass_kg * solid.inertia_per_kg_m2[row, column])))
        done.append("the inertia")
    return done


def _is_turned(origin: Any) -> bool:
    return any(float(angle) for angle in (origin.get("rpy") or "0 0 0").split())


def orthonormalise_frames(asset: Asset) -> str:
    """Replace the axes of nearly orthonormal RoboTwin frames by the nearest rotation, and return what was done.

    Frames that are mirrored or far from a rotation are left unchanged, as their meaning is unknown. Source: the polar factor by
    singular value decomposition (Higham 1986).
    """
    if asset.format != "robotwin":
        return f"not fixed: this is written into RoboTwin's model_data only, this is {asset.format}"
    file = robotwin_data(asset.path)[0] if asset.path.is_dir() else asset.path
    content = read_json(file)
    mended = 0
    for key in (key for keys in FRAME_KEYS.values() for key in keys):
        matrices = np.array(content.get(key) or [], dtype=float)
        single = matrices.shape == (4, 4)
        matrices = matrices[None] if single else matrices
        if matrices.ndim != 3 or matrices.shape[1:] != (4, 4):
            continue
        for matrix in matrices:
            nearest = _nearest_rotation(matrix[:3, :3])
            if nearest is not None:
                matrix[:3, :3] = nearest
                mended += 1
        content[key] = matrices[0].tolist() if single else matrices.tolist()
    if not mended:
        return "not fixed: no frame is nearly orthonormal"
    _replace(file, (json.dumps(content, indent=4, ensure_ascii=False) + "\n").encode())
    return f"{file.name}: made {mended} frames orthonormal (the old file: {file.name}.orig)"


def _nearest_rotation(axes: np.ndarray) -> np.ndarray | None:
    """Return the rotation closest to ``axes (3, 3)``; None if they are a rotation already, mirrored, or far from a rotation."""
    if not np.isfinite(axes).all() or np.abs(axes.T @ axes - np.eye(3)).max() < 1e-9:
        return None
    left, stretch, right = np.linalg.svd(axes)
    if np.linalg.det(axes) < 0 or np.abs(stretch - 1).max() > NEARLY:
        return None
    return left @ right


def _numbers(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)


def _replace(file: Path, content: bytes) -> None:
    """Write a file atomically, keeping its first version as ``<name>.orig``."""
    kept = file.with_name(f"{file.name}.orig")
    if not kept.exists():
        write_bytes_atomically(kept, read_bytes(file, MAX_XML_BYTES, AssetError, inside=file.parent))
    write_bytes_atomically(file, content)
