"""An MJCF file after MuJoCo's compiler, with the meshes, textures and height fields that are read here and handed to it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import trimesh
from PIL import Image

from manitwin.assets.asset_files import MESH_LIMITS, AssetFiles, joined
from manitwin.assets.readers.mjcf_document import MjcfSource
from manitwin.errors import AssetError
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import bake_transform, decode_texture
from manitwin.formats.xml_file import xml_text
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform

_LEAST_MASS_KG, _LEAST_INERTIA_KG_M2 = 1e-9, 1e-12
_LEAST_ROWS = 2
NO_OBJECTS = "planes and height fields were left out: they are no objects"
_RGB = int(mujoco.mjtTextureRole.mjTEXROLE_RGB)


@dataclass(frozen=True)
class CompiledMjcf:
    """An MJCF file after MuJoCo's compiler: the spec, the model, and by name what was read from files.

    ``meshes`` are the parts of each mesh, scaled, in the axes of its asset; ``textures`` the colour image of each material.
    """

    spec: Any
    model: Any
    meshes: dict[str, list[trimesh.Trimesh]]
    textures: dict[str, Image.Image]


def compiled(source: MjcfSource, files: AssetFiles) -> CompiledMjcf:
    """Compile an MJCF file; geoms of meshes that are not there are left out.

    Raises AssetError with MuJoCo's own words where it refuses the file.
    """
    name = source.file.name
    try:
        spec = mujoco.MjSpec.from_string(xml_text(source.root), include=source.model_texts())
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        raise AssetError(f"{name}: MuJoCo cannot read it: {_line(error)}") from error
    spec.compiler.fusestatic = False  # both would take away bodies and geoms that the file has
    spec.compiler.discardvisual = False
    meshes = _take_meshes(source, spec, files)
    textures = _take_textures(source, spec, files)
    _take_height_fields(source, spec, files)
    try:
        try:
            model = spec.compile()
        except (ValueError, RuntimeError, mujoco.FatalError) as error:
            if "mass and inertia of moving bodies" not in str(error):
                raise
            if not files.missing:  # else it would have one with its meshes
                files.remark("a body of it moves and has no mass, which MuJoCo refuses")
            spec.compiler.boundmass, spec.compiler.boundinertia = _LEAST_MASS_KG, _LEAST_INERTIA_KG_M2
            model = spec.compile()
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        raise AssetError(f"{name}: MuJoCo cannot compile it: {_line(error)}") from error
    return CompiledMjcf(spec, model, meshes, textures)


def _take_meshes(source: MjcfSource, spec: Any, files: AssetFiles) -> dict[str, list[trimesh.Trimesh]]:
    """Read the mesh files, hand their vertices to the spec, and return the parts as MuJoCo scales them."""
    meshes: dict[str, list[trimesh.Trimesh]] = {}
    absent = []
    for mesh in list(spec.meshes):
        if not mesh.file:
            continue  # written out in the file itself
        path = _find(source, mesh.file, files)
        if path is None:
            absent.append(mesh)
            continue
        parts = files.mesh(path, hull_of_points=True).parts
        vertices, faces = joined(parts)
        mesh.uservert, mesh.userface = vertices.reshape(-1), faces.reshape(-1).astype(np.int32)
        mesh.file = ""
        to_asset = np.diag([*mesh.scale, 1.0]) @ _reference(mesh)
        meshes[mesh.name] = [bake_transform(part, to_asset) for part in parts]
    for mesh in absent:
        for geom in [geom for geom in spec.geoms if geom.meshname == mesh.name]:
            spec.delete(geom)
        spec.delete(mesh)
    return meshes


def _reference(mesh: Any) -> np.ndarray:
    """Return what MuJoCo does to vertices before it scales them: moved by -refpos, turned by the inverse of refquat."""
    rotation = rotation_from_quaternion_wxyz(np.array(mesh.refquat)).T
    return transform(rotation, -rotation @ np.array(mesh.refpos))


def _take_textures(source: MjcfSource, spec: Any, files: AssetFiles) -> dict[str, Image.Image]:
    """Read the colour textures of materials and take all textures out of the spec."""
    images: dict[str, Image.Image] = {}
    for texture in spec.textures:
        if not texture.file:
            continue
        image = _image(_find(source, texture.file, files), files)
        if image is not None:
            images[texture.name or Path(source.places[texture.file][0]).stem] = image
    by_material = {}
    for material in spec.materials:
        names = list(material.textures)
        chosen = next((names[i] for i in (_RGB, 0) if names[i] in images), None)
        if chosen is not None:
            by_material[material.name] = images[chosen]
        for role in range(len(names)):
            material.textures[role] = ""
    for texture in list(spec.textures):
        spec.delete(texture)
    return by_material


def _take_height_fields(source: MjcfSource, spec: Any, files: AssetFiles) -> None:
    """Read the pictures of height fields and hand their heights to the spec; those without are left out with their geoms."""
    for field in list(spec.hfields):
        heights = None
        if field.file:
            image = _image(_find(source, field.file, files), files)
            heights = None if image is None else np.asarray(image.convert("L"), float)[::-1]  # from the lowest row up
            field.file = ""
        elif len(field.userdata) == field.nrow * field.ncol:
            heights = np.asarray(field.userdata, float).reshape(field.nrow, field.ncol)
        if heights is not None and min(heights.shape) >= _LEAST_ROWS:
            files.count(2 * heights.size)
            field.nrow, field.ncol = heights.shape
            field.userdata = heights.reshape(-1).tolist()
            continue
        for geom in [geom for geom in spec.geoms if geom.hfieldname == field.name]:
            spec.delete(geom)
        spec.delete(field)
        files.remark(NO_OBJECTS)


def _image(path: Path | None, files: AssetFiles) -> Image.Image | None:
    if path is None or path.stat().st_size > MESH_LIMITS.max_bytes:
        return None
    notes = MeshSource(path, MESH_LIMITS)
    image = decode_texture(notes.data(), path.name, notes)
    for sentence in notes.findings:
        files.remark(sentence)
    return image


def _find(source: MjcfSource, key: str, files: AssetFiles) -> Path | None:
    name, place = source.places[key]
    return files.find(name, [place])


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:200]
