"""Read a mesh file of any format into textured parts in metres' worth of facts: unit, up axis, findings."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from manitwin.errors import InputError
from manitwin.formats.isolated import ProcessCrashed, run_isolated
from manitwin.formats.meshes.dae import read_dae
from manitwin.formats.meshes.gltf import read_gltf
from manitwin.formats.meshes.obj import read_obj
from manitwin.formats.meshes.ply import read_ply
from manitwin.formats.meshes.source import MeshLimits, MeshSource
from manitwin.formats.meshes.textures import make_part, normals_of, pbr_material
from manitwin.formats.meshes.triangles import with_creased_normals
from manitwin.formats.sniff import sniff
from manitwin.geometry.repair.welding import weld_equal

_SUFFIXES = {
    "glb": (".glb",),
    "gltf": (".gltf",),
    "obj": (".obj",),
    "ply": (".ply",),
    "stl": (".stl",),
    "dae": (".dae",),
    "usdz": (".usdz",),
}
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 84
_REMEDY = "download or export it again"


@dataclass(frozen=True)
class MeshFile:
    """The content of a mesh file.

    ``parts`` are trimesh meshes with TextureVisuals and PBRMaterial, in the file's own unit and axes, scene transforms
    baked. ``unit_m`` is the length of that unit in metres and ``up`` the file's up axis ('x' | 'y' | 'z'), None where
    the format does not say. ``findings`` are plain sentences about what was left out or assumed.
    """

    parts: list[trimesh.Trimesh]
    format: str
    unit_m: float | None
    up: str | None
    findings: list[str]


def read_mesh(path: Path, *, limits: MeshLimits | None = None) -> MeshFile:
    """Read a mesh file, by content and not by name; files that it names are only read from its own folder.

    Raises InputError: ``unreadable``, ``empty``, ``wrong_type``, ``animated``, ``no_faces``, ``not_finite``.
    """
    sniffed = sniff(path)
    source = MeshSource(path, limits or MeshLimits())
    if sniffed.kind != "mesh":
        raise source.refused("wrong_type", f"holds an image ({sniffed.format}), not a mesh", "give it as an image")
    if path.suffix.lower() not in _SUFFIXES[sniffed.format]:
        source.find(
            f"the file is named {path.suffix or 'without a suffix'} and holds {sniffed.format}; it was read as that"
        )
    try:
        parts, unit_m, up = _read(sniffed.format, source)
    except InputError:
        raise
    except MemoryError as error:
        raise source.unreadable("it asks for more memory than there is", "simplify it") from error
    except (
        ValueError,
        KeyError,
        IndexError,
        TypeError,
        AttributeError,
        OverflowError,
        RecursionError,
        OSError,
        struct.error,
    ) as error:
        # broken files fail in more ways than a reader can name; none of them is a fault of this program
        raise source.unreadable(
            f"its {sniffed.format} is broken ({type(error).__name__}: {str(error)[:80]})", "export it again"
        ) from error
    return MeshFile(_checked(parts, source), sniffed.format, unit_m, up, source.findings)


def _read(format: str, source: MeshSource) -> tuple[list[trimesh.Trimesh], float | None, str | None]:
    if format == "glb":
        return read_gltf(source, binary=True), 1.0, "y"
    if format == "gltf":
        return read_gltf(source, binary=False), 1.0, "y"
    if format == "dae":
        return read_dae(source)
    if format == "usdz":
        return _read_usdz(source)
    readers = {"obj": read_obj, "ply": read_ply, "stl": read_stl}
    return readers[format](source), None, None


def _read_usdz(source: MeshSource) -> tuple[list[trimesh.Trimesh], float | None, str | None]:
    try:
        parts, unit_m, up, read = run_isolated("manitwin.formats.meshes.usdz:read_usdz", source)
    except ProcessCrashed as error:
        cause = "its USD is so broken that the USD library crashes on it"
        raise source.unreadable(cause, "export it again") from error
    source.findings[:], source.bytes_read = read.findings, read.bytes_read
    return parts, unit_m, up


def _checked(parts: list[trimesh.Trimesh], source: MeshSource) -> list[trimesh.Trimesh]:
    parts = [part for part in parts if len(part.faces)]
    if not parts:
        raise source.refused("no_faces", "it has no faces", "export the surface, not points or lines")
    bad = sum(int((~np.isfinite(part.vertices[np.unique(part.faces)])).any(axis=1).sum()) for part in parts)
    if bad:
        total = sum(len(part.vertices) for part in parts)
        raise source.refused(
            "not_finite",
            f"{bad} of {total} vertices are NaN or infinite",
            "repair it where it was made and export again",
        )
    for part in parts:
        unused = ~np.isfinite(part.vertices).all(axis=1)
        if unused.any():
            part.vertices[unused] = 0.0
            part.remove_unreferenced_vertices()
    return [part if normals_of(part) is not None else with_creased_normals(part) for part in parts]


def read_stl(source: MeshSource) -> list[trimesh.Trimesh]:
    """Read an STL into one grey part; equal corners are shared so that shading can be smooth.

    Raises InputError ``unreadable`` where the file is cut short.
    """
    data = source.data()
    count = int.from_bytes(data[80:84], "little") if len(data) >= _HEADER else 0
    if len(data) >= _HEADER and len(data) == _HEADER + count * _TRIANGLE.itemsize:
        source.check_faces(count)
        corners = np.frombuffer(data, dtype=_TRIANGLE, offset=_HEADER)["vertices"].reshape(-1, 3).astype(np.float64)
    elif re.match(rb"\s*solid\b", data, re.IGNORECASE):
        corners = _ascii(data.decode("utf-8", errors="replace"), source)
    else:
        raise source.unreadable(
            f"truncated: it says {count} triangles and has {len(data)} bytes",
            _REMEDY,
        )
    vertices, faces = weld_equal(corners, np.arange(len(corners)).reshape(-1, 3))
    return [make_part(vertices, faces, material=pbr_material(base_color=(0.8, 0.8, 0.8)), name="mesh")]


def _ascii(text: str, source: MeshSource) -> np.ndarray:
    rows = re.findall(r"^\s*vertex\s+(\S+)\s+(\S+)\s+(\S+)\s*$", text, re.IGNORECASE | re.MULTILINE)
    source.check_faces(len(rows) // 3)
    facets = len(re.findall(r"^\s*facet\b", text, re.IGNORECASE | re.MULTILINE))
    if len(rows) != 3 * facets:
        raise source.unreadable(f"truncated or broken: {facets} facets and {len(rows)} corners", _REMEDY)
    try:
        return np.array(rows, dtype=np.float64).reshape(-1, 3)
    except ValueError as error:
        raise source.unreadable("a vertex does not hold three numbers", _REMEDY) from error
