"""Compilation of an MJCF file by MuJoCo, with meshes, textures and height fields that are read here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import trimesh
from PIL import Image

from manitwin.assets.asset_files import MESH_LIMITS, AssetFiles, concatenate_meshes
from manitwin.assets.readers.mjcf_dialects import MOST_LEFT_OUT, remove_unknown_to_schema
from manitwin.assets.readers.mjcf_document import MjcfSource
from manitwin.errors import AssetError
from manitwin.formats.meshes.source import MeshLimits, MeshSource
from manitwin.formats.meshes.textures import bake_transform, decode_texture, linear_to_srgb, srgb_to_linear
from manitwin.formats.xml_file import xml_text
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform

LEAST_MASS_KG, LEAST_INERTIA_KG_M2 = 1e-9, 1e-12
"""Mass and inertia of a moving body without any, so that MuJoCo accepts it."""
_LEAST_ROWS, _FEW_MESHES = 2, 3
NO_OBJECTS = "planes and height fields were left out: they are no objects"
_RGB = int(mujoco.mjtTextureRole.mjTEXROLE_RGB)
_FLAT = int(mujoco.mjtBuiltin.mjBUILTIN_FLAT)
_PATTERNS = (int(mujoco.mjtBuiltin.mjBUILTIN_GRADIENT), int(mujoco.mjtBuiltin.mjBUILTIN_CHECKER))
_SIDES = "RLUDFB"
"""Letters of the cube sides in the layout of a texture grid (MJCF reference, texture/gridlayout)."""
_CELL = 32


@dataclass(frozen=True)
class CompiledMjcf:
    """A compiled MJCF file: the spec, the model, and the meshes and textures read from files.

    ``meshes`` are the parts of each mesh by name, scaled, in the axes of its asset.
    """

    spec: Any
    model: Any
    meshes: dict[str, list[trimesh.Trimesh]]
    paint: MaterialTextures


@dataclass(frozen=True)
class MaterialTextures:
    """Appearance of material textures, by the name of the material.

    ``images`` are colour images, ``means`` their linear mean colours ``(3,)``. ``plain`` are the sRGB colours ``(3,)`` of
    textures that MuJoCo fills with one colour or a pattern. ``lost`` names the materials whose image could not be read.
    """

    images: dict[str, Image.Image]
    means: dict[str, np.ndarray]
    plain: dict[str, np.ndarray]
    lost: frozenset[str]


def compile_mjcf(
    source: MjcfSource, files: AssetFiles, chosen: Callable[[Any], set[int]] | None = None
) -> CompiledMjcf:
    """Compile an MJCF file; geoms of missing meshes are left out.

    ``chosen`` returns the indices of the bodies of a model that are needed. Meshes of other bodies are then replaced by
    stand-ins instead of being read, so that one link of a robot with fifty meshes costs one mesh.

    Raises AssetError with MuJoCo's message if it refuses the file.
    """
    name = source.file.name
    spec = _parse_spec(source, files)
    spec.compiler.fusestatic = False  # both options would remove bodies and geoms of the file
    spec.compiler.discardvisual = False
    found = _find_meshes(source, spec, files)
    paint = _load_textures(source, spec, files)
    _load_height_fields(source, spec, files)
    meshes = _load_meshes(spec, found, _wanted(spec, found, chosen), files)
    try:
        try:
            model = spec.compile()
        except (ValueError, RuntimeError, mujoco.FatalError) as error:
            if "mass and inertia of moving bodies" not in str(error):
                raise
            if not files.missing:  # otherwise its meshes would give it a mass
                files.remark_leniency("a body of it moves and has no mass, which MuJoCo refuses")
            spec.compiler.boundmass, spec.compiler.boundinertia = LEAST_MASS_KG, LEAST_INERTIA_KG_M2
            model = spec.compile()
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        raise AssetError(f"{name}: MuJoCo cannot compile it: {_line(error)}") from error
    if source.total_mass_kg is not None:
        mujoco.mj_setTotalmass(model, source.total_mass_kg)
    return CompiledMjcf(spec, model, meshes, paint)


def _parse_spec(source: MjcfSource, files: AssetFiles) -> Any:
    """Return MuJoCo's spec of a document after removing what its schema does not know; raises AssetError with its message."""
    for _ in range(MOST_LEFT_OUT):
        try:
            return mujoco.MjSpec.from_string(xml_text(source.root), include=source.model_texts())
        except (ValueError, RuntimeError, mujoco.FatalError) as error:
            if not remove_unknown_to_schema(str(error), (source.root, *source.models.values()), files):
                raise AssetError(f"{source.file.name}: MuJoCo cannot read it: {_line(error)}") from error
    raise AssetError(
        f"{source.file.name}: MuJoCo does not know {MOST_LEFT_OUT} of its elements and attributes or more; give a file of MJCF"
    )


def _find_meshes(source: MjcfSource, spec: Any, files: AssetFiles) -> dict[str, Path]:
    """Return the files of meshes by name; geoms of missing meshes are removed from the spec."""
    found: dict[str, Path] = {}
    absent = []
    for mesh in list(spec.meshes):
        if not mesh.file:
            continue  # inline data
        path = _find(source, mesh.file, files)
        mesh.file = ""
        if path is None:
            absent.append(mesh)
        else:
            found[mesh.name] = path
    for mesh in absent:
        for geom in [geom for geom in spec.geoms if geom.meshname == mesh.name]:
            spec.delete(geom)
        spec.delete(mesh)
    return found


def _wanted(spec: Any, found: dict[str, Path], chosen: Callable[[Any], set[int]] | None) -> set[str]:
    """Return the names of the meshes of the chosen bodies; all if MuJoCo does not compile the stand-ins."""
    if chosen is None or len(found) < _FEW_MESHES:
        return set(found)
    trial = spec.copy()
    for mesh in trial.meshes:
        if mesh.name in found:
            _set_placeholder(mesh)
    trial.compiler.boundmass, trial.compiler.boundinertia = LEAST_MASS_KG, LEAST_INERTIA_KG_M2
    try:
        bodies = chosen(trial.compile())
    except (ValueError, RuntimeError, AssetError, mujoco.FatalError):
        return set(found)
    holders = {body.id: body for body in (trial.worldbody, *trial.bodies)}
    return {geom.meshname for index in bodies for geom in holders[index].geoms} & set(found)


def _set_placeholder(mesh: Any) -> None:
    """Set the geometry of a mesh to a tetrahedron with edges of 0.1 m along the axes."""
    mesh.uservert, mesh.userface = [0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1], [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]


def _load_meshes(
    spec: Any, found: dict[str, Path], wanted: set[str], files: AssetFiles
) -> dict[str, list[trimesh.Trimesh]]:
    """Read the needed meshes, pass their vertices to the spec, and return the parts as MuJoCo scales them."""
    meshes: dict[str, list[trimesh.Trimesh]] = {}
    for mesh in [mesh for mesh in spec.meshes if mesh.name in found]:
        if mesh.name not in wanted:
            _set_placeholder(mesh)
            continue
        parts = files.mesh(found[mesh.name], hull_of_points=True).parts
        vertices, faces = concatenate_meshes(parts)
        mesh.uservert, mesh.userface = vertices.reshape(-1), faces.reshape(-1).astype(np.int32)
        to_asset = np.diag([*mesh.scale, 1.0]) @ _reference(mesh)
        meshes[mesh.name] = [bake_transform(part, to_asset) for part in parts]
    return meshes


def _reference(mesh: Any) -> np.ndarray:
    """Return the transform that MuJoCo applies before scaling: translation by -refpos, rotation by the inverse of refquat."""
    rotation = rotation_from_quaternion_wxyz(np.array(mesh.refquat)).T
    return transform(rotation, -rotation @ np.array(mesh.refpos))


def _load_textures(source: MjcfSource, spec: Any, files: AssetFiles) -> MaterialTextures:
    """Read the colour textures of materials and remove all textures from the spec."""
    shown: dict[str, Image.Image | np.ndarray | None] = {}
    means: dict[str, np.ndarray] = {}
    patterns: set[str] = set()
    for texture in spec.textures:
        if texture.file:
            image = _image(_find(source, texture.file, files), files, files.limits)
            # an unnamed texture is named after its file, which was replaced by a key
            for name in {texture.name, Path(source.places[texture.file][0]).stem} - {""}:
                if name == texture.name or texture.name in ("", Path(texture.file).stem):
                    shown[name] = image
                    if image is not None:
                        means[name] = _mean_color(image, texture)
        elif int(texture.builtin) == _FLAT:
            shown[texture.name] = np.array(texture.rgb1, float)
        elif int(texture.builtin) in _PATTERNS:
            both = np.clip(np.array([texture.rgb1, texture.rgb2], float), 0, 1)
            shown[texture.name] = linear_to_srgb(srgb_to_linear(both).mean(axis=0))
            patterns.add(texture.name)
        elif any(texture.cubefiles):
            shown[texture.name] = None
            patterns.add(texture.name)
    by_material: dict[str, Image.Image | np.ndarray | None] = {}
    mean_of: dict[str, np.ndarray] = {}
    for material in spec.materials:
        named = [name for name in (material.textures[_RGB], material.textures[0]) if name and name in shown]
        if named:
            chosen = next((name for name in named if shown[name] is not None), named[0])
            by_material[material.name] = shown[chosen]
            if chosen in means:
                mean_of[material.name] = means[chosen]
            if chosen in patterns:
                files.remark(
                    "patterns that MuJoCo draws, and pictures of the six sides of a cube, are shown as one colour"
                )
        for role in range(len(material.textures)):
            material.textures[role] = ""
    for texture in list(spec.textures):
        spec.delete(texture)
    return MaterialTextures(
        {name: what for name, what in by_material.items() if isinstance(what, Image.Image)},
        mean_of,
        {name: what for name, what in by_material.items() if isinstance(what, np.ndarray)},
        frozenset(name for name, what in by_material.items() if what is None),
    )


def _mean_color(image: Image.Image, texture: Any) -> np.ndarray:
    """Return the linear mean colour ``(3,)`` of a texture image, over the grid cells that its layout names."""
    rows, columns = (max(1, int(count)) for count in texture.gridsize)
    layout = "".join(str(letter) for letter in texture.gridlayout)
    named = [place for place in range(min(rows * columns, len(layout))) if layout[place] in _SIDES]
    picture = image.convert("RGB")
    width, height = picture.width / columns, picture.height / rows
    boxes = [
        (column * width, row * height, (column + 1) * width, (row + 1) * height)
        for row, column in (divmod(place, columns) for place in (named if rows * columns > 1 else []))
    ]
    cells = [picture.resize((_CELL, _CELL), Image.Resampling.BOX, box) for box in boxes or [(0, 0, *picture.size)]]
    seen = np.array([np.asarray(cell, float).reshape(-1, 3) for cell in cells]) / 255
    return np.asarray(srgb_to_linear(seen).mean(axis=(0, 1)))


def _load_height_fields(source: MjcfSource, spec: Any, files: AssetFiles) -> None:
    """Read the pictures of height fields and pass their heights to the spec; those without data are removed with their geoms."""
    for field in list(spec.hfields):
        heights = None
        if field.file:
            image = _image(_find(source, field.file, files), files, MESH_LIMITS)
            heights = None if image is None else np.asarray(image.convert("L"), float)[::-1]  # from the lowest row up
            field.file = ""
        elif len(field.userdata) == field.nrow * field.ncol:
            heights = np.asarray(field.userdata, float).reshape(field.nrow, field.ncol)
        if heights is not None and min(heights.shape) >= _LEAST_ROWS:
            files.count_shape(2 * heights.size)
            field.nrow, field.ncol = heights.shape
            field.userdata = heights.reshape(-1).tolist()
            continue
        for geom in [geom for geom in spec.geoms if geom.hfieldname == field.name]:
            spec.delete(geom)
        spec.delete(field)
        files.remark(NO_OBJECTS)


def _image(path: Path | None, files: AssetFiles, limits: MeshLimits) -> Image.Image | None:
    if path is None or path.stat().st_size > limits.max_bytes:
        return None
    notes = MeshSource(path, limits)
    image = decode_texture(notes.data(), path.name, notes)
    for sentence in notes.findings:
        files.remark(sentence)
    return image


def _find(source: MjcfSource, key: str, files: AssetFiles) -> Path | None:
    name, place, below = source.places[key]
    homes = [source.homes[key]] if key in source.homes else []
    return files.find(name, [place, *homes], below)


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:200]
