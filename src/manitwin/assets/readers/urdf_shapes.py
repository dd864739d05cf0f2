"""The visual and collision shapes of URDF links, origins and scales applied."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets import primitives
from manitwin.assets.asset import CollisionShape
from manitwin.assets.asset_files import AssetFiles, joined
from manitwin.errors import AssetError
from manitwin.formats.meshes.textures import bake_transform, make_part, pbr_material, srgb_to_linear
from manitwin.formats.xml_file import number, numbers, origin_of

_PACKAGE = "package://"
_BARE_MESHES = (".stl",)  # a mesh that has a colour of its own keeps it


class LinkShapes:
    """Reads shapes of the links of one URDF."""

    def __init__(self, file: Path, robot: etree._Element, files: AssetFiles):
        self._file, self._files = file, files
        self._colors = {
            material.get("name"): color
            for material in robot.iter("material")
            if (color := self._rgba(material)) is not None
        }

    def visual(self, link: etree._Element, link_to_asset: np.ndarray) -> Iterator[trimesh.Trimesh]:
        """Yield a link's visual parts in the asset's axes."""
        for index, element in enumerate(link.findall("visual")):
            what = f"{self._file.name}: link {link.get('name')} visual {index}"
            color = self._color(element)
            for part in self._parts(element, what, color):
                part.metadata["name"] = str(part.metadata["name"])
                yield bake_transform(part, link_to_asset @ origin_of(element, what) @ self._scale(element, what))

    def collision(self, link: etree._Element, link_to_asset: np.ndarray) -> Iterator[CollisionShape]:
        """Yield a link's collision shapes in the asset's axes.

        A mesh counts as its convex hull: PyBullet, SAPIEN and MuJoCo take it so unless they are told otherwise.
        """
        for index, element in enumerate(link.findall("collision")):
            what = f"{self._file.name}: link {link.get('name')} collision {index}"
            to_asset = link_to_asset @ origin_of(element, what) @ self._scale(element, what)
            parts = [bake_transform(part, to_asset) for part in self._parts(element, what, None)]
            if parts:
                vertices, faces = joined(parts)
                name = element.get("name") or f"{link.get('name')}_{index:02d}"
                yield CollisionShape(name, vertices, faces, convex=True, file=self._mesh_file(element))

    def _parts(self, element: etree._Element, what: str, color: np.ndarray | None) -> list[trimesh.Trimesh]:
        shape = _shape(element, what)
        if shape.tag == "mesh":
            return self._mesh_parts(shape, color)
        solid = _primitive(shape, what)
        self._files.count(len(solid.faces))
        return [make_part(solid.vertices, solid.faces, material=plain_material(color), name=str(shape.tag))]

    def _mesh_parts(self, shape: etree._Element, color: np.ndarray | None) -> list[trimesh.Trimesh]:
        name = shape.get("filename") or ""
        path = self._files.find(name, self._candidates(name))
        if path is None:
            return []
        mesh = self._files.mesh(path)
        if mesh.format == "dae" and mesh.up == "y":
            # RViz and Gazebo Classic disagree here; ROS documents URDF meshes as taken along the link's axes
            self._files.remark(f"{path.name}: its COLLADA says that Y is up; it was not turned, as ROS does not")
        unit_m = mesh.unit_m if mesh.format == "dae" and mesh.unit_m is not None else 1.0
        parts = [bake_transform(part, np.diag([unit_m, unit_m, unit_m, 1.0])) for part in mesh.parts]
        if color is None or path.suffix.lower() not in _BARE_MESHES:
            return parts
        return [make_part(p.vertices, p.faces, material=plain_material(color), name=p.metadata["name"]) for p in parts]

    def _candidates(self, name: str) -> Iterator[Path]:
        clean = name.replace("\\", "/").removeprefix("file://")
        root, beside = self._files.root, self._file.parent
        if clean.startswith(_PACKAGE):
            inside = clean.removeprefix(_PACKAGE)
            yield from (root / inside, beside / inside)
            without_package = inside.partition("/")[2]
            if without_package:
                yield from (root / without_package, beside / without_package)
        else:
            yield beside / clean

    def _mesh_file(self, element: etree._Element) -> Path | None:
        shape = element.find("geometry/mesh")
        if shape is None:
            return None
        paths = [path.resolve() for path in self._candidates(shape.get("filename") or "")]
        return next((path for path in paths if path in self._files.used), None)

    @staticmethod
    def _scale(element: etree._Element, what: str) -> np.ndarray:
        mesh = element.find("geometry/mesh")
        scale = None if mesh is None else mesh.get("scale")
        return np.eye(4) if scale is None else np.diag([*_scale_numbers(scale, what), 1.0])

    def _color(self, element: etree._Element) -> np.ndarray | None:
        material = element.find("material")
        if material is None:
            return None
        own = self._rgba(material)
        return own if own is not None else self._colors.get(material.get("name"))

    def _rgba(self, material: etree._Element) -> np.ndarray | None:
        color = material.find("color")
        if color is None:
            return None
        return numbers(color.get("rgba"), 4, f"{self._file.name}: material {material.get('name')}")


def _shape(element: etree._Element, what: str) -> etree._Element:
    geometry = element.find("geometry")
    shapes = [] if geometry is None else list(geometry.iterchildren(tag="*"))
    if len(shapes) != 1:
        raise AssetError(f"{what}: its <geometry> holds {len(shapes)} shapes, not one")
    return shapes[0]


def _primitive(shape: etree._Element, what: str) -> trimesh.Trimesh:
    if shape.tag == "box":
        size = numbers(shape.get("size"), 3, f"{what} size")
        return primitives.box(np.array([_positive(str(side), f"{what} size") for side in size]))
    if shape.tag == "sphere":
        return primitives.sphere(_positive(shape.get("radius"), f"{what} radius"))
    if shape.tag in ("cylinder", "capsule"):
        build = primitives.cylinder if shape.tag == "cylinder" else primitives.capsule
        return build(_positive(shape.get("radius"), f"{what} radius"), _positive(shape.get("length"), f"{what} length"))
    raise AssetError(f"{what}: shape <{shape.tag}> is unknown; valid: box, capsule, cylinder, mesh, sphere")


def _positive(text: str | None, what: str) -> float:
    value = number(text, what)
    if value <= 0:
        raise AssetError(f"{what}: {value} is not above zero")
    return value


def _scale_numbers(text: str, what: str) -> np.ndarray:
    if len(text.split()) == 1:  # older exporters write one factor
        return np.repeat(numbers(text, 1, f"{what} scale"), 3)
    return numbers(text, 3, f"{what} scale")


def plain_material(rgba: np.ndarray | None) -> trimesh.visual.material.PBRMaterial:
    """Return a material of one sRGB colour ``(4,)`` in 0..1; grey for None."""
    if rgba is None:
        return pbr_material(base_color=(0.8, 0.8, 0.8))
    linear = srgb_to_linear(np.clip(rgba[:3], 0, 1))
    alpha = float(np.clip(rgba[3], 0, 1))
    return pbr_material(base_color=(*linear, alpha), alpha_mode="BLEND" if alpha < 1 else None)
