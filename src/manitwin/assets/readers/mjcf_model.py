"""An MJCF file brought to what describes objects: includes put in, everything else taken out, nothing opened by MuJoCo."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]
from PIL import Image

from manitwin.assets.asset_files import MESH_LIMITS, AssetFiles, joined
from manitwin.assets.readers.mjcf_contents import keep_rigid_objects
from manitwin.errors import AssetError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import bake_transform, decode_texture
from manitwin.formats.xml_file import MAX_XML_BYTES, comments_before, read_xml, xml_text
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform

_MAX_INCLUDES = 32
_HEAD_BYTES = 1 << 16
_LEAST_MASS_KG, _LEAST_INERTIA_KG_M2 = 1e-9, 1e-12
NO_OBJECTS = "planes and height fields were left out: they are no objects"
_RGB = int(mujoco.mjtTextureRole.mjTEXROLE_RGB)


@dataclass(frozen=True)
class MjcfSource:
    """The XML that MuJoCo is given, and what was taken from it.

    ``texts`` are the comments at its head, and those of <custom> as ``name: data``.
    """

    file: Path
    root: etree._Element
    texts: tuple[str, ...]

    def writes(self, attributes: tuple[str, ...]) -> bool:
        """Tell whether a geom, or a default for geoms, writes one of these attributes."""
        return any(geom.get(name) is not None for geom in self.root.iter("geom") for name in attributes)


def open_mjcf(file: Path, files: AssetFiles) -> MjcfSource:
    """Parse an MJCF file and put its includes in; raises AssetError for what is broken or not read."""
    root = read_xml(file, "mujoco")
    comments = comments_before(root)
    _put_in_includes(file, root, file, files, {file.resolve()})
    texts = (*comments, *(f"{t.get('name')}: {t.get('data')}" for t in root.iterfind("custom/text")))
    keep_rigid_objects(file, root, files)
    return MjcfSource(file, root, texts)


def _put_in_includes(
    main: Path, root: etree._Element, file: Path, files: AssetFiles, done: set[Path], depth: int = 0
) -> None:
    """Replace <include> by the children of the included root, as MuJoCo does; each file once.

    A file is looked up from the main file's folder, and then from that of the ``file`` which includes it.
    """
    while (include := root.find(".//include")) is not None:
        name = (include.get("file") or "").replace("\\", "/")
        found = files.find(name, [main.parent / name, file.parent / name])
        if found is None:
            raise AssetError(
                f"{file.name}: the file {name[:80]!r} that it includes is not there, or above the root"
                f" {files.root.name!r}; give the folder that holds all of it"
            )
        if found in done or len(done) > _MAX_INCLUDES or depth > _MAX_INCLUDES:
            raise AssetError(f"{file.name}: includes {name[:80]!r} twice, or too many files")
        done.add(found)
        head = read_bytes(found, MAX_XML_BYTES, AssetError)[:_HEAD_BYTES]
        tag = "mujocoinclude" if b"<mujocoinclude" in head else "mujoco"
        included = read_xml(found, tag)
        _put_in_includes(main, included, found, files, done, depth + 1)
        parent, position = include.getparent(), include.getparent().index(include)
        parent.remove(include)
        for offset, child in enumerate(list(included)):
            parent.insert(position + offset, child)


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
        spec = mujoco.MjSpec.from_string(xml_text(source.root))
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        raise AssetError(f"{name}: MuJoCo cannot read it: {_line(error)}") from error
    spec.compiler.fusestatic = False  # both would take away bodies and geoms that the file has
    spec.compiler.discardvisual = False
    meshes = _take_meshes(source, spec, files)
    textures = _take_textures(source, spec, files)
    for geom in [geom for geom in spec.geoms if geom.type == mujoco.mjtGeom.mjGEOM_HFIELD]:  # their data is not read
        spec.delete(geom)
        files.remark(NO_OBJECTS)
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
        mesh.name = mesh.name or Path(mesh.file).stem
        path = _find(source, spec.meshdir, mesh.file, spec, files)
        if path is None:
            absent.append(mesh)
            continue
        parts = files.mesh(path).parts
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
        path = _find(source, spec.texturedir, texture.file, spec, files)
        if path is not None and path.stat().st_size <= MESH_LIMITS.max_bytes:
            notes = MeshSource(path, MESH_LIMITS)
            image = decode_texture(notes.data(), path.name, notes)
            for sentence in notes.findings:
                files.remark(sentence)
            if image is not None:
                images[texture.name or Path(texture.file).stem] = image
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


def _find(source: MjcfSource, folder: str, name: str, spec: Any, files: AssetFiles) -> Path | None:
    plain = name.replace("\\", "/")
    if spec.strippath:
        plain = plain.rsplit("/", 1)[-1]
    return files.find(plain, [source.file.parent / folder / plain])


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:200]
