"""Reader of USDZ meshes (Universal Scene Description packages) with UsdPreviewSurface materials."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import trimesh
from pxr import Sdf, Tf, Usd, UsdGeom, UsdShade

from manitwin.formats.meshes.shading_normals import triangle_fans
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import bake_transform, color_by_corner, make_part
from manitwin.formats.meshes.usd_errors import broken_usd_cause
from manitwin.formats.meshes.usd_placed_prims import placed_prims
from manitwin.formats.meshes.usd_skin import Skeletons, is_bound
from manitwin.formats.meshes.usd_surfaces import PreviewSurfaces, UsdSurface
from manitwin.formats.meshes.usd_units import metres_per_unit
from manitwin.formats.meshes.usdz_package import UsdzArchive

_UV_NAMES = ("st", "st0", "st_0", "UVMap", "uv", "map1", "Texture_uv")


def read_usdz(
    source: MeshSource,
) -> tuple[list[trimesh.Trimesh], float | None, str | None, list[str], int]:
    """Read all visible meshes of a USDZ package: parts with transforms applied, unit in metres, up axis 'y' | 'z'.

    To be run in an isolated process, so that findings and the number of bytes read are returned too. A stage without a unit is
    in centimetres (USD's fallback), which is returned as None. Raises InputError ``unreadable``, ``animated`` (value clips).
    """
    archive = UsdzArchive(source)
    if archive.root is None:
        raise source.unreadable("its first member is not a USD layer", "pack it with usdzip")
    archive.check_layers()
    try:
        parts, unit_m, up = _read(Usd.Stage.Open(str(source.path)), archive, source)
    except Tf.ErrorException as error:
        raise source.unreadable(broken_usd_cause(error), "export it again") from error
    return parts, unit_m, up, source.findings, source.bytes_read


def _read(
    stage: Usd.Stage, archive: UsdzArchive, source: MeshSource
) -> tuple[list[trimesh.Trimesh], float | None, str | None]:
    unit_m = metres_per_unit(stage)
    if unit_m is not None and not (np.isfinite(unit_m) and unit_m > 0):
        source.add_finding(f"its metersPerUnit is {unit_m} and was not used")
        unit_m = None
    up = "z" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else "y"
    return _parts(stage, archive, source), unit_m, up


def _parts(stage: Usd.Stage, archive: UsdzArchive, source: MeshSource) -> list[trimesh.Trimesh]:
    surfaces, skeletons = PreviewSurfaces(archive, source), Skeletons(stage, source)
    parts: list[trimesh.Trimesh] = []
    made: dict[Sdf.Path, list[trimesh.Trimesh]] = {}
    faces = 0
    for placed in placed_prims(stage, source):
        prim = placed.prim
        if not prim.IsA(UsdGeom.Mesh):
            drawn_for_people = UsdGeom.Imageable(prim).ComputePurpose() == UsdGeom.Tokens.guide  # such as grasp lines
            if not drawn_for_people and prim.IsA(UsdGeom.Gprim):
                source.add_finding(f"{prim.GetTypeName()} prims in it were left out: only meshes are read")
            continue
        if placed.is_hidden() or UsdGeom.Imageable(prim).ComputePurpose() in ("guide", "proxy"):
            source.add_finding("hidden, guide or proxy meshes in it were left out")
            continue
        if prim.GetPath() not in made:  # instanced meshes are converted once
            made[prim.GetPath()] = mesh_parts(UsdGeom.Mesh(prim), surfaces, skeletons, source)
        for part in made[prim.GetPath()]:
            faces += len(part.faces)
            source.check_faces(faces)
            source.check_parts(len(parts) + 1)
            parts.append(bake_transform(part, placed.to_world))
    return parts


def mesh_parts(
    mesh: UsdGeom.Mesh, surfaces: PreviewSurfaces, skeletons: Skeletons, source: MeshSource
) -> list[trimesh.Trimesh]:
    """Return one part for each material subset of a mesh prim, in the pose of its skeleton if it is bound to one."""
    polygons = mesh_polygons(mesh, source)
    if polygons is None or len(polygons[1]) == 0:
        return []
    points, sizes, indices = polygons
    if _is_subdivided(mesh):
        source.add_finding(
            "subdivision surfaces in it were read as the meshes that control them: larger than they are, with corners where"
            " they are round, the more so the coarser the mesh"
        )
    if is_bound(mesh.GetPrim()):
        source.add_finding("it is bound to a skeleton; it was taken in the first pose that the file holds")
        points = skeletons.pose_points(mesh.GetPrim(), points)
    for attribute in (mesh.GetPointsAttr(), mesh.GetFaceVertexIndicesAttr()):
        if attribute.ValueMightBeTimeVarying():
            source.add_finding("the file is animated; its first frame was taken")
    source.check_faces(int(np.maximum(sizes - 2, 0).sum()))
    corners, owner = triangle_fans(sizes)
    if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        corners = corners[:, ::-1]
    colors = _display_colors(mesh, indices, sizes)
    parts = []
    for surface, chosen in _subsets(mesh, surfaces, len(sizes)):
        flat = corners[chosen[owner]].reshape(-1)
        if not len(flat):
            continue
        uv = _uv(mesh, surface.uv_set, indices, len(points))
        if uv is not None and surface.uv_change is not None:
            with np.errstate(all="ignore"):  # make_part replaces overflows by 0
                uv = uv @ surface.uv_change[:2, :2].T + surface.uv_change[:2, 2]
        # corners that share a point and a texture coordinate share a vertex
        keys = [indices[flat].astype(np.float64)[:, None]] + ([] if uv is None else [uv[flat]])
        _, first, inverse = np.unique(np.hstack(keys), axis=0, return_index=True, return_inverse=True)
        part = make_part(
            points[indices[flat][first]],
            inverse.reshape(-1, 3),
            material=surface.material,
            name=mesh.GetPrim().GetName(),
            uv=None if uv is None else uv[flat][first],
        )
        if colors is not None and surface.material.name is None:
            part = color_by_corner(part, colors[flat].reshape(-1, 3, 3), source)
        parts.append(part)
    return parts


def _is_subdivided(mesh: UsdGeom.Mesh) -> bool:
    """Return whether a mesh explicitly requests subdivision; without a scheme, its writer mostly meant the polygons."""
    scheme = mesh.GetSubdivisionSchemeAttr()
    smooth = (UsdGeom.Tokens.catmullClark, UsdGeom.Tokens.loop)
    return bool(scheme.HasAuthoredValue() and scheme.Get() in smooth)


def mesh_polygons(mesh: UsdGeom.Mesh, source: MeshSource) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Return a mesh prim's points ``(V, 3)``, polygon sizes and corner indices; None if an attribute is missing.

    Raises InputError ``unreadable`` if they are inconsistent.
    """
    attributes = (mesh.GetPointsAttr(), mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr())
    points, sizes, indices = (_value(attribute) for attribute in attributes)
    if points is None or sizes is None or indices is None:
        return None
    points, sizes, indices = np.asarray(points, np.float64), np.asarray(sizes, np.int64), np.asarray(indices, np.int64)
    matching = (sizes >= 0).all() and sizes.sum() == len(indices)
    if not matching or (indices < 0).any() or (indices >= len(points)).any():
        raise source.unreadable(f"the faces of {mesh.GetPath()} do not match its points", "export it again")
    return points.reshape(-1, 3), sizes, indices


def _subsets(mesh: UsdGeom.Mesh, surfaces: PreviewSurfaces, count: int) -> Iterator[tuple[UsdSurface, np.ndarray]]:
    """Yield every surface of the mesh with a mask ``(count,)`` of its polygons."""
    rest = np.ones(count, dtype=bool)
    for subset in UsdGeom.Subset.GetGeomSubsets(mesh, UsdGeom.Tokens.face, UsdShade.Tokens.materialBind):
        chosen = np.zeros(count, dtype=bool)
        members = np.asarray(_value(subset.GetIndicesAttr()) or [], dtype=np.int64)
        chosen[members[(members >= 0) & (members < count)]] = True
        chosen &= rest
        rest &= ~chosen
        yield surfaces.bound_surface(subset.GetPrim()), chosen
    yield surfaces.bound_surface(mesh.GetPrim()), rest


def _uv(mesh: UsdGeom.Mesh, wanted: str | None, indices: np.ndarray, points: int) -> np.ndarray | None:
    """Return texture coordinates by corner ``(C, 2)``, origin at the lower left as in USD.

    ``wanted`` is the primvar that the material reads; if the mesh does not have it, common names are tried.
    """
    api = UsdGeom.PrimvarsAPI(mesh)
    named = [api.GetPrimvar(name) for name in (*((wanted,) if wanted else ()), *_UV_NAMES)]
    typed = [
        p for p in api.GetPrimvarsWithValues() if str(p.GetTypeName()) in ("texCoord2f[]", "texCoord2d[]", "float2[]")
    ]
    for primvar in [p for p in named if p and p.HasValue()] + typed:
        uv = _rows(primvar.ComputeFlattened(Usd.TimeCode.EarliestTime()), 2)
        if uv is None:
            continue
        if primvar.GetInterpolation() == UsdGeom.Tokens.faceVarying and len(uv) == len(indices):
            return uv
        if primvar.GetInterpolation() in (UsdGeom.Tokens.vertex, UsdGeom.Tokens.varying) and len(uv) == points:
            return uv[indices]
    return None


def display_color(prim: Usd.Prim) -> np.ndarray | None:
    """Return the displayColor of a shape as ``(N, 3) uint8`` sRGB, or None."""
    primvar = UsdGeom.Gprim(prim).GetDisplayColorPrimvar()
    given = primvar.ComputeFlattened(Usd.TimeCode.EarliestTime()) if primvar and primvar.HasValue() else None
    linear = _rows(given, 3)
    if linear is None or len(linear) == 0:
        return None
    return np.round(np.asarray(PreviewSurfaces.to_srgb(np.nan_to_num(linear))) * 255).astype(np.uint8)


def _display_colors(mesh: UsdGeom.Mesh, indices: np.ndarray, sizes: np.ndarray) -> np.ndarray | None:
    """Return displayColor by corner ``(C, 3) uint8`` sRGB, or None."""
    primvar, colors = mesh.GetDisplayColorPrimvar(), display_color(mesh.GetPrim())
    if colors is None:
        return None
    if len(colors) == 1:
        return np.repeat(colors, len(indices), axis=0)
    if len(colors) == len(indices):
        return colors
    if len(colors) == len(sizes) and primvar.GetInterpolation() == UsdGeom.Tokens.uniform:
        return np.repeat(colors, sizes, axis=0)
    return colors[indices] if len(colors) > indices.max() else None


def _rows(values: Any, columns: int) -> np.ndarray | None:
    """Return values of a primvar as ``(N, columns)``, None if there are none or USD does not know their type."""
    try:
        return None if values is None else np.asarray(values, np.float64).reshape(-1, columns)
    except (TypeError, ValueError):  # a value of an unregistered type is returned as written
        return None


def _value(attribute: Usd.Attribute) -> Any:
    return attribute.Get(Usd.TimeCode.EarliestTime())
