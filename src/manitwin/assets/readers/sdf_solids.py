"""Primitive shapes of SDF as meshes in metres: boxes, spheres, cylinders, planes and extruded polylines."""

from __future__ import annotations

import manifold3d
import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets import primitives
from manitwin.errors import AssetError
from manitwin.formats.xml_file import number, numbers, text_of

_SHEET_M = 1e-3
_MAX_POINTS = 10_000


def primitive_of(shape: etree._Element, what: str) -> trimesh.Trimesh | None:
    """Return the mesh of a box, ellipsoid, sphere, cylinder, capsule or plane, None for other shapes; raises AssetError."""
    if shape.tag == "box":
        return trimesh.creation.box(_all_positive(shape, "size", what))
    if shape.tag == "ellipsoid":
        return primitives.ellipsoid(_all_positive(shape, "radii", what))
    if shape.tag == "sphere":
        return primitives.sphere(_positive(shape, "radius", what))
    if shape.tag in ("cylinder", "capsule"):
        build = primitives.cylinder if shape.tag == "cylinder" else primitives.capsule
        return build(_positive(shape, "radius", what), _positive(shape, "length", what))
    if shape.tag == "plane":
        return _plane(shape, what)
    return None


def _plane(shape: etree._Element, what: str) -> trimesh.Trimesh:
    """Return the visible rectangle of a plane as a sheet below it; for collisions the plane is infinite."""
    normal = numbers(text_of(shape, "normal") or "0 0 1", 3, f"{what} normal")
    length = float(np.linalg.norm(normal))
    if length == 0:
        raise AssetError(f"{what} normal: a vector of length 0 has no direction")
    size = numbers(text_of(shape, "size") or "1 1", 2, f"{what} size")
    if (size <= 0).any():
        raise AssetError(f"{what} size: {size.min()} is not above zero")
    sheet = trimesh.creation.box((*size, _SHEET_M))
    sheet.apply_translation((0, 0, -_SHEET_M / 2))
    sheet.apply_transform(trimesh.geometry.align_vectors((0, 0, 1), normal / length))
    return sheet


def prism_of(shapes: list[etree._Element], what: str) -> trimesh.Trimesh:
    """Return the extrusion of closed polylines from z = 0 to the height of the first; raises AssetError."""
    lines = [
        [numbers(" ".join((point.text or "").split()), 2, f"{what} point") for point in shape.findall("point")]
        for shape in shapes
    ]
    height = _positive(shapes[0], "height", what)
    prism = None
    if all(len(line) >= 3 for line in lines) and sum(map(len, lines)) <= _MAX_POINTS:
        outline = manifold3d.CrossSection([np.array(line) for line in lines], manifold3d.FillRule.EvenOdd)
        prism = outline.extrude(height).to_mesh64()
    if prism is None or not len(prism.tri_verts):
        said = ", ".join(str(len(line)) for line in lines[:4])
        raise AssetError(f"{what}: its polyline of {said} points encloses no area; give 3 to {_MAX_POINTS}")
    return trimesh.Trimesh(prism.vert_properties[:, :3], prism.tri_verts.astype(np.int64), process=False)


def _positive(shape: etree._Element, tag: str, what: str) -> float:
    value = number(text_of(shape, tag), f"{what} {tag}")
    if value <= 0:
        raise AssetError(f"{what} {tag}: {value} is not above zero")
    return value


def _all_positive(shape: etree._Element, tag: str, what: str) -> np.ndarray:
    values = numbers(text_of(shape, tag), 3, f"{what} {tag}")
    if (values <= 0).any():
        raise AssetError(f"{what} {tag}: {values.min()} is not above zero")
    return values
