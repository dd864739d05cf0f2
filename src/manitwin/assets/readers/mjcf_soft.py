"""Soft bodies of an MJCF file: their shape at rest, as MuJoCo constructs it."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset_files import AssetFiles, concatenate_meshes
from manitwin.assets.readers.mjcf_document import MjcfSource
from manitwin.errors import AssetError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.meshes.textures import make_part, pbr_material, srgb_to_linear

_MAX_FILE_FACES = 20_000
"""Largest flex that is read from a file: it is passed to MuJoCo as text."""
_MAX_GMSH_BYTES = 16 << 20
_THINNEST_M, _ROD_SIDES = 1e-4, 6
_OF_MOTION = ("dof", "mass", "inertiabox", "origin")
"""Attributes of a flex that concern its motion, or how its interior is divided."""


def rewrite_flexes_at_rest(source: MjcfSource, files: AssetFiles) -> None:
    """Rewrite the flexes of a document so that MuJoCo builds their shapes from data, rigidly fixed to their parent bodies.

    A Gmsh file is passed to MuJoCo as bytes, a triangle mesh as numbers.
    """
    for root in (source.root, *source.models.values()):
        for flex in list(root.iter("flexcomp")):
            for child in flex.iterchildren("*"):
                flex.remove(child)
            for name in _OF_MOTION:
                flex.attrib.pop(name, None)
            flex.set("rigid", "true")
            if flex.get("file") and not _take_file(flex, source, files):
                flex.getparent().remove(flex)


def _take_file(flex: etree._Element, source: MjcfSource, files: AssetFiles) -> bool:
    name, place, below = source.places[flex.attrib.pop("file")]
    path = files.find(name, [place], below)
    if path is None:
        return False
    if flex.get("type") == "gmsh":
        key = f"flex_{len(source.soft_files)}.msh"
        source.soft_files[key] = read_bytes(path, _MAX_GMSH_BYTES, AssetError)
        flex.set("file", key)
        return True
    vertices, faces = concatenate_meshes(files.mesh(path, hull_of_points=True).parts)
    if len(faces) > _MAX_FILE_FACES:
        files.remark(f"a soft body of {len(faces)} triangles was left out: it is more than is read")
        return False
    flex.set("type", "direct")
    flex.set("dim", "2")
    flex.set("point", " ".join(map(repr, vertices.reshape(-1).tolist())))
    flex.set("element", " ".join(map(str, faces.reshape(-1).tolist())))
    return True


def soft_parts(model: Any) -> list[trimesh.Trimesh]:
    """Return the surfaces of a compiled model's flexes in world axes, each with its colour; one-dimensional flexes as rods."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_flex(model, data)
    parts = []
    for flex in range(model.nflex):
        first, count = int(model.flex_vertadr[flex]), int(model.flex_vertnum[flex])
        points = np.array(data.flexvert_xpos[first : first + count], float)
        if int(model.flex_dim[flex]) == 1:
            points, faces = _rod_mesh(model, flex, points)
        else:
            faces = _faces(model, flex)
        red, green, blue = srgb_to_linear(np.clip(np.array(model.flex_rgba[flex][:3], float), 0, 1))
        material = pbr_material(None, base_color=(red, green, blue))
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_FLEX, flex) or f"flex_{flex:02d}"
        parts.append(make_part(points, faces, material=material, name=name))
    return parts


def _rod_mesh(model: Any, flex: int, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces of rods along the segments of a one-dimensional flex, with its radius."""
    start, count = int(model.flex_elemdataadr[flex]), 2 * int(model.flex_elemnum[flex])
    pieces = points[np.array(model.flex_elem[start : start + count], int).reshape(-1, 2)]
    radius_m = max(float(model.flex_radius[flex]), _THINNEST_M)
    long = pieces[np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1) > 0]
    return concatenate_meshes(
        [trimesh.creation.cylinder(radius_m, segment=piece, sections=_ROD_SIDES) for piece in long]
    )


def _faces(model: Any, flex: int) -> np.ndarray:
    """Return the triangles ``(F, 3)`` of a flex: its elements if it is two-dimensional, otherwise its shell."""
    if int(model.flex_dim[flex]) == 2:
        start, count = int(model.flex_elemdataadr[flex]), 3 * int(model.flex_elemnum[flex])
        return np.array(model.flex_elem[start : start + count], int).reshape(-1, 3)
    start, count = int(model.flex_shelldataadr[flex]), 3 * int(model.flex_shellnum[flex])
    return np.array(model.flex_shell[start : start + count], int).reshape(-1, 3)
