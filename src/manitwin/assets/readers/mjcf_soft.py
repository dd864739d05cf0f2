"""Soft bodies of an MJCF file: the shape that they have at rest, as MuJoCo makes it."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset_files import AssetFiles, joined
from manitwin.assets.readers.mjcf_document import MjcfSource
from manitwin.formats.meshes.textures import make_part, pbr_material, srgb_to_linear

_MAX_FILE_FACES = 20_000
"""Of a flex from a file: it goes to MuJoCo as text."""
_OF_MOTION = ("dof", "mass", "inertiabox", "origin")
"""Attributes of a flex that say how it moves, or how its inside is divided."""


def as_shapes_at_rest(source: MjcfSource, files: AssetFiles) -> None:
    """Write the flexes of a document so that MuJoCo makes their shapes of numbers alone, fixed to the bodies that hold them.

    Those from files of tetrahedra are left out with a remark.
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
    name, place = source.places[flex.attrib.pop("file")]
    if flex.get("type") != "mesh":
        files.remark("a soft body from a file of tetrahedra was left out: that format is not read")
        return False
    path = files.find(name, [place])
    if path is None:
        return False
    vertices, faces = joined(files.mesh(path, hull_of_points=True).parts)
    if len(faces) > _MAX_FILE_FACES:
        files.remark(f"a soft body of {len(faces)} triangles was left out: it is more than is read")
        return False
    flex.set("type", "direct")
    flex.set("dim", "2")
    flex.set("point", " ".join(map(repr, vertices.reshape(-1).tolist())))
    flex.set("element", " ".join(map(str, faces.reshape(-1).tolist())))
    return True


def soft_parts(model: Any) -> list[trimesh.Trimesh]:
    """Return the surfaces of a compiled model's flexes in the world's axes, each in its colour; strings have none."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_flex(model, data)
    parts = []
    for flex in range(model.nflex):
        first, count = int(model.flex_vertadr[flex]), int(model.flex_vertnum[flex])
        faces = _faces(model, flex)
        if not len(faces):
            continue
        red, green, blue = srgb_to_linear(np.clip(np.array(model.flex_rgba[flex][:3], float), 0, 1))
        material = pbr_material(None, base_color=(red, green, blue))
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_FLEX, flex) or f"flex_{flex:02d}"
        parts.append(
            make_part(np.array(data.flexvert_xpos[first : first + count]), faces, material=material, name=name)
        )
    return parts


def _faces(model: Any, flex: int) -> np.ndarray:
    """Return the triangles ``(F, 3)`` of a flex: its elements where it is a sheet, the shell of one that is filled."""
    if int(model.flex_dim[flex]) == 1:
        return np.empty((0, 3), int)
    if int(model.flex_dim[flex]) == 2:
        start, count = int(model.flex_elemdataadr[flex]), 3 * int(model.flex_elemnum[flex])
        return np.array(model.flex_elem[start : start + count], int).reshape(-1, 3)
    start, count = int(model.flex_shelldataadr[flex]), 3 * int(model.flex_shellnum[flex])
    return np.array(model.flex_shell[start : start + count], int).reshape(-1, 3)
