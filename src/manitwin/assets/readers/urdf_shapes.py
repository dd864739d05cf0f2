"""Visual and collision shapes of URDF links, with origins and scales applied."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets import primitives
from manitwin.assets.asset import CollisionShape
from manitwin.assets.asset_files import AssetFiles, concatenate_meshes
from manitwin.assets.obj_groups import obj_groups
from manitwin.assets.readers.upright import Y_UP_FORMATS
from manitwin.assets.root import upward
from manitwin.formats.meshes.read import MeshFile
from manitwin.formats.meshes.source import PACKAGE_SCHEMES
from manitwin.formats.meshes.textures import (
    DEFAULT_COLOR,
    bake_transform,
    make_part,
    material_of,
    pbr_material,
    srgb_to_linear,
)
from manitwin.geometry.poses import GLTF_TO_OBJECT, transform_points
from manitwin.robots.urdf import UrdfTree, geometry_of, origin_of, values_of

_LOST_LIBRARY = re.compile(r"material library '.+' is not there")


class LinkShapes:
    """Reads the shapes of links of one URDF."""

    def __init__(self, tree: UrdfTree, file: Path, files: AssetFiles, *, turn_gltf: bool = False):
        self._tree, self._file, self._files, self._turn_gltf = tree, file, files, turn_gltf
        materials = [*tree.element.findall("material"), *tree.element.iterfind("link/visual/material")]
        self._colors = {each.get("name"): color for each in materials if (color := _rgba(each)) is not None}

    def shapes(
        self, links: Iterable[tuple[etree._Element, np.ndarray]]
    ) -> tuple[list[trimesh.Trimesh], list[CollisionShape]]:
        """Return the visual parts and the collision shapes of links with their poses ``(4, 4)``."""
        placed = list(links)
        visual = [part for link, pose in placed for part in self.visual(link, pose)]
        return visual, [shape for link, pose in placed for shape in self.collision(link, pose)]

    def visual(self, link: etree._Element, link_to_asset: np.ndarray) -> Iterator[trimesh.Trimesh]:
        """Yield a link's visual parts in the asset's axes; identical visual elements are shown once."""
        seen: set[bytes] = set()
        for index, element in enumerate(link.findall("visual")):
            written = etree.tostring(element, method="c14n")
            if written in seen:
                self._files.remark(f"link {link.get('name')!r}: visuals that repeat another one were left out")
                continue
            seen.add(written)
            to_asset = link_to_asset @ origin_of(element) @ _scale(element)
            for part in self._parts(element, f"link {link.get('name')!r} visual {index}", self._color(element)):
                part.metadata["name"] = str(part.metadata["name"])
                yield bake_transform(part, to_asset)

    def collision(self, link: etree._Element, link_to_asset: np.ndarray) -> Iterator[CollisionShape]:
        """Yield a link's collision shapes in the asset's axes.

        A mesh counts as its convex hull, which is the default of PyBullet, SAPIEN and MuJoCo.
        """
        for index, element in enumerate(link.findall("collision")):
            to_asset = link_to_asset @ origin_of(element) @ _scale(element)
            where = f"link {link.get('name')!r} collision {index}"
            parts = [bake_transform(part, to_asset) for part in self._parts(element, where, None)]
            if parts:
                vertices, faces = concatenate_meshes(parts)
                name = element.get("name") or f"{link.get('name')}_{index:02d}"
                file = self._mesh_file(element)
                primitive = geometry_of(element).tag != "mesh"
                # Isaac Gym collides with a distance field of the mesh, PyBullet with the triangles of static bodies
                drawn = element.find("sdf") is not None or element.get("concave") == "yes"
                groups = () if drawn else placed_groups(file, to_asset)
                yield CollisionShape(name, vertices, faces, True, file, primitive, groups, as_drawn=drawn)

    def _parts(self, element: etree._Element, where: str, color: np.ndarray | None) -> list[trimesh.Trimesh]:
        shape = geometry_of(element)
        if shape.tag == "mesh":
            return self._mesh_parts(shape, color)
        for key in ("size", "radius", "length"):
            if not all(values_of(shape, key) > 0):
                self._files.remark(f"{where} has no size (<{shape.tag} {key}={shape.get(key)!r}>) and was left out")
                return []
        solid = _primitive(shape)
        self._files.count_shape(len(solid.faces))
        return [make_part(solid.vertices, solid.faces, material=plain_material(color), name=str(shape.tag))]

    def _mesh_parts(self, shape: etree._Element, color: np.ndarray | None) -> list[trimesh.Trimesh]:
        name = shape.get("filename") or ""
        path = self._files.find(name, self._candidates(name))
        if path is None or self._files.is_unsupported(path):
            return []
        # RViz and Gazebo Classic disagree; ROS takes meshes along the axes of the link
        note = "it was not turned, as ROS does not"
        mesh = self._files.mesh(path)
        parts = mesh_parts(self._files, path, mesh, color=color, turned_note=note)
        turn = self._turn_gltf and mesh.format in Y_UP_FORMATS
        return [bake_transform(part, GLTF_TO_OBJECT) for part in parts] if turn else parts

    def _candidates(self, name: str) -> Iterator[Path]:
        clean = name.replace("\\", "/").removeprefix("file://")
        yield from candidates(clean, self._file, self._files.root)

    def _mesh_file(self, element: etree._Element) -> Path | None:
        shape = element.find("geometry/mesh")
        if shape is None:
            return None
        name = shape.get("filename") or ""
        return self._files.find_used(name, self._candidates(name))

    def _color(self, element: etree._Element) -> np.ndarray | None:
        material = element.find("material")
        if material is None:
            return None
        own = _rgba(material)
        return own if own is not None else self._colors.get(material.get("name"))


def candidates(name: str, file: Path, root: Path) -> Iterator[Path]:
    """Yield candidate paths of a file that a description names, from the description's folder upward to the root.

    A name of a package or model (``package://NAME/...``) is resolved in the folder of that name, or in a folder that holds the
    package under another name. Isaac Gym resolves names relative to a folder given by its caller, which is one of those above.
    """
    scheme = next((scheme for scheme in PACKAGE_SCHEMES if name.startswith(scheme)), "")
    inside = name.removeprefix(scheme)
    inside = inside.lstrip("/") if scheme else inside  # Gazebo accepts model:///NAME too
    folders = list(upward(file.parent, root))
    if not scheme:
        yield file.parent / inside
        places = (Path(os.path.normpath(folder / inside)) for folder in folders[1:])
        yield from (place for place in places if place.is_relative_to(folders[-1]))
        return
    package, _, rest = inside.partition("/")
    yield from (folder / rest for folder in folders if folder.name == package and rest)
    yield from (folder / inside for folder in folders)
    if rest:
        yield from (folder / rest for folder in folders)


def placed_groups(file: Path | None, to_asset: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Return the groups of a mesh file that was read (``obj_groups``), transformed by ``to_asset (4, 4)``."""
    groups = [] if file is None else obj_groups(file)
    return tuple((transform_points(to_asset, vertices), faces) for vertices, faces in groups)


def _scale(element: etree._Element) -> np.ndarray:
    """Return a mesh's scale as a transform ``(4, 4)``; older exporters write a single factor."""
    mesh = element.find("geometry/mesh")
    return np.eye(4) if mesh is None else np.diag([*(np.ones(3) * values_of(mesh, "scale", "1")), 1.0])


def _rgba(material: etree._Element) -> np.ndarray | None:
    color = material.find("color")
    return None if color is None else values_of(color, "rgba")


def _primitive(shape: etree._Element) -> trimesh.Trimesh:
    if shape.tag == "box":
        return trimesh.creation.box(values_of(shape, "size"))
    if shape.tag == "sphere":
        return primitives.sphere(float(shape.get("radius")))
    build = primitives.cylinder if shape.tag == "cylinder" else primitives.capsule
    return build(float(shape.get("radius")), float(shape.get("length")))


def mesh_parts(
    files: AssetFiles,
    path: Path,
    mesh: MeshFile,
    *,
    color: np.ndarray | None,
    turned_note: str,
    scale: np.ndarray | None = None,
) -> list[trimesh.Trimesh]:
    """Return the parts of a mesh file that a description names, in metres and scaled by ``scale (3,)``.

    The unit of COLLADA is applied and its up axis is not, which ``turned_note`` explains. ``color`` applies to parts without a
    material, and to parts whose material is only a name in a missing library.
    """
    if mesh.format == "dae" and mesh.up == "y":
        files.remark(f"{path.name}: its COLLADA says that Y is up; {turned_note}")
    unit_m = mesh.unit_m if mesh.format == "dae" and mesh.unit_m is not None else 1.0
    factors = np.ones(3) if scale is None else scale
    parts = [bake_transform(part, np.diag([*(factors * unit_m), 1.0])) for part in mesh.parts]
    if color is None or mesh.format == "ply":  # a PLY with a lost texture is indistinguishable from one without texture
        return parts
    lost = any(_LOST_LIBRARY.match(finding) for finding in mesh.findings)
    return [
        make_part(p.vertices, p.faces, material=plain_material(color), name=p.metadata["name"])
        if _is_bare(p, lost)
        else p
        for p in parts
    ]


def _is_bare(part: trimesh.Trimesh, lost: bool) -> bool:
    """Return whether a mesh file gives a part no material; a part with a lost texture has one.

    ``lost``: a material library is missing, so that a part with only the name of a material has none.
    """
    material = material_of(part)
    grey = np.round(np.multiply(DEFAULT_COLOR, 255)).astype(int)
    is_grey = np.array_equal(np.asarray(material.baseColorFactor)[:3].astype(int), grey)
    return (lost or material.name is None) and material.baseColorTexture is None and is_grey


def plain_material(rgba: np.ndarray | None) -> trimesh.visual.material.PBRMaterial:
    """Return a material of one sRGB colour ``(4,)`` in 0..1; grey for None."""
    if rgba is None:
        return pbr_material(base_color=DEFAULT_COLOR)
    linear = srgb_to_linear(np.clip(rgba[:3], 0, 1))
    alpha = float(np.clip(rgba[3], 0, 1))
    return pbr_material(base_color=(*linear, alpha), alpha_mode="BLEND" if alpha < 1 else None)
