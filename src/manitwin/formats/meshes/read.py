"""Reading of mesh files of any supported format into textured parts, with unit, up axis and findings."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from manitwin.formats.isolated import ProcessCrashed, run_isolated
from manitwin.formats.meshes.dae import read_dae
from manitwin.formats.meshes.fbx import read_fbx
from manitwin.formats.meshes.gltf import read_gltf
from manitwin.formats.meshes.msh import read_msh
from manitwin.formats.meshes.obj import read_obj
from manitwin.formats.meshes.off import read_off
from manitwin.formats.meshes.ply import read_ply
from manitwin.formats.meshes.shading_normals import has_constant_normal, with_normals, without_normals
from manitwin.formats.meshes.source import MeshLimits, MeshSource
from manitwin.formats.meshes.step import read_step
from manitwin.formats.meshes.stl import read_stl
from manitwin.formats.meshes.three_mf import read_three_mf
from manitwin.formats.sniff import sniff

_SUFFIXES = {
    "glb": (".glb",),
    "gltf": (".gltf",),
    "obj": (".obj",),
    "ply": (".ply",),
    "stl": (".stl",),
    "dae": (".dae",),
    "usdz": (".usdz",),
    "3mf": (".3mf",),
    "fbx": (".fbx",),
    "step": (".step", ".stp", ".p21"),
    "msh": (".msh",),
    "off": (".off",),
}
_MAX_COORDINATE = 1e12
"""In the file's unit: larger than a survey in millimetres, and areas and volumes stay finite in single precision."""
_MIN_UNIT_M, _MAX_UNIT_M = 1e-9, 1e6


@dataclass(frozen=True)
class MeshFile:
    """The content of a mesh file.

    ``parts`` are trimesh meshes with TextureVisuals and PBRMaterial, in the file's own unit and axes, with scene transforms
    applied. ``unit_m`` is the length of the unit in metres and ``up`` the up axis ('x' | 'y' | 'z'), each None if the format
    does not define it. ``findings`` are sentences about what was left out or assumed, ``files`` the other files that were read.
    """

    parts: list[trimesh.Trimesh]
    format: str
    unit_m: float | None
    up: str | None
    findings: list[str]
    files: tuple[Path, ...] = ()


def read_mesh(
    path: Path,
    *,
    limits: MeshLimits | None = None,
    root: Path | None = None,
    texture_folders: tuple[Path, ...] = (),
    hull_of_points: bool = False,
) -> MeshFile:
    """Read a mesh file, detecting the format by content; files that it names are read only from its own folder, or ``root``.

    ``texture_folders``: folders in which missing pictures are looked up by file name. ``hull_of_points``: an OBJ or MSH file
    with only points is read as their convex hull, as in MuJoCo.

    Raises InputError: ``unreadable``, ``too_large``, ``empty``, ``wrong_type``, ``animated``, ``no_faces``, ``not_finite``.
    """
    sniffed = sniff(path)
    source = MeshSource(
        path, limits or MeshLimits(), root=root, texture_folders=texture_folders, hull_of_points=hull_of_points
    )
    if sniffed.kind != "mesh":
        raise source.refused("wrong_type", f"contains an image ({sniffed.format}), not a mesh", "pass it as an image")
    if path.suffix.lower() not in _SUFFIXES[sniffed.format]:
        source.add_finding(
            f"the file is named {path.suffix or 'without a suffix'} and holds {sniffed.format}; it was read as that"
        )
    with source.convert_errors(sniffed.format):
        parts, unit_m, up = _read(sniffed.format, source)
        parts = _checked(parts, source)
    if unit_m is not None and not _MIN_UNIT_M <= unit_m <= _MAX_UNIT_M:
        source.add_finding(f"its unit of {unit_m} m was not used")
        unit_m = None
    return MeshFile(parts, sniffed.format, unit_m, up, source.findings, source.files())


def _read(format: str, source: MeshSource) -> tuple[list[trimesh.Trimesh], float | None, str | None]:
    if format == "glb":
        return read_gltf(source, binary=True), 1.0, "y"
    if format == "gltf":
        return read_gltf(source, binary=False), 1.0, "y"
    if format == "dae":
        return read_dae(source)
    if format == "usdz":
        return _read_usdz(source)
    if format == "3mf":
        return *read_three_mf(source), None
    if format == "fbx":
        return read_fbx(source)
    if format == "step":
        return read_step(source), 1.0, None
    readers = {"obj": read_obj, "ply": read_ply, "stl": read_stl, "msh": read_msh, "off": read_off}
    return readers[format](source), None, None


def _read_usdz(source: MeshSource) -> tuple[list[trimesh.Trimesh], float | None, str | None]:
    try:
        parts, unit_m, up, findings, source.bytes_read = run_isolated("manitwin.formats.meshes.usdz:read_usdz", source)
    except ProcessCrashed as error:
        cause = "its USD is so damaged that the USD library crashes"
        raise source.unreadable(cause, "export it again") from error
    source.findings[:] = findings
    return parts, unit_m, up


def _checked(parts: list[trimesh.Trimesh], source: MeshSource) -> list[trimesh.Trimesh]:
    parts = [part for part in parts if len(part.faces)]
    if not parts:
        raise source.refused("no_faces", "it has no faces", "export the surface, not points or lines")
    if all(len(part.vertices) and np.abs(part.vertices).max() <= _MAX_COORDINATE for part in parts):  # false for NaN
        return _shaded(parts, source)
    total = sum(len(part.vertices) for part in parts)
    used = [part.vertices[np.unique(part.faces)] for part in parts]
    bad = sum(int((~np.isfinite(vertices)).any(axis=1).sum()) for vertices in used)
    far = sum(int((np.abs(vertices) > _MAX_COORDINATE).any(axis=1).sum()) for vertices in used)
    if bad or far:
        cause = f"{bad} of {total} vertices are NaN or infinite"
        if not bad:
            cause = (
                f"{far} of {total} vertices lie farther out than {_MAX_COORDINATE:.0e}, which no size can be told of"
            )
        raise source.refused("not_finite", cause, "repair the mesh in the program that made it, and export it again")
    for part in parts:
        unused = ~(np.abs(part.vertices) <= _MAX_COORDINATE).all(axis=1)
        if unused.any():
            part.vertices[unused] = 0.0
            part.remove_unreferenced_vertices()
    return _shaded(parts, source)


def _shaded(parts: list[trimesh.Trimesh], source: MeshSource) -> list[trimesh.Trimesh]:
    for index, part in enumerate(parts):
        if has_constant_normal(part):
            source.add_finding(
                "normals in it are one vector for faces that look other ways; they are computed from the faces"
            )
            parts[index] = without_normals(part)
    return [with_normals(part) for part in parts] if source.limits.shading else parts
