"""Frames of an SDF model, and visual and collision shapes of its links with poses and scales applied."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]
from scipy.spatial.transform import Rotation

from manitwin.assets.asset import CollisionShape
from manitwin.assets.asset_files import AssetFiles, concatenate_meshes
from manitwin.assets.primitives import unwrap_primitive
from manitwin.assets.readers.sdf_materials import ScriptedMaterials
from manitwin.assets.readers.sdf_solids import primitive_of, prism_of
from manitwin.assets.readers.sdf_terrain import terrain
from manitwin.assets.readers.upright import Y_UP_FORMATS
from manitwin.assets.readers.urdf_shapes import candidates, mesh_parts, plain_material
from manitwin.errors import AssetError
from manitwin.formats.meshes.dae_nodes import geometries_of_nodes
from manitwin.formats.meshes.read import MeshFile
from manitwin.formats.meshes.textures import bake_transform, make_part
from manitwin.formats.xml_file import numbers, text_of
from manitwin.geometry.poses import GLTF_TO_OBJECT, transform

MODEL_FRAME = "__model__"


def pose_of(element: etree._Element, what: str) -> np.ndarray:
    """Return the ``<pose>`` of an element ``(4, 4)`` in the frame that it refers to; identity by default.

    Roll, pitch and yaw rotate about fixed axes x, y, z in this order, in radians unless ``degrees`` is set; ``rotation_format``
    may be ``quat_xyzw``. Source: the SDFormat specification, version 1.9, ``pose``.
    """
    pose = element.find("pose")
    if pose is None or not (pose.text or "").strip():
        return np.eye(4)
    if pose.get("rotation_format", "euler_rpy") == "quat_xyzw":
        values = numbers(pose.text, 7, f"{what} pose")
        length = float(np.linalg.norm(values[3:]))
        if length == 0:
            raise AssetError(f"{what} pose: a quaternion of length 0 is no rotation")
        return transform(Rotation.from_quat(values[3:] / length).as_matrix(), values[:3])
    values = numbers(pose.text, 6, f"{what} pose")
    degrees = pose.get("degrees", "false").strip().lower() in ("true", "1")
    return transform(Rotation.from_euler("xyz", values[3:], degrees=degrees).as_matrix(), values[:3])


class ModelFrames:
    """The named frames of one model: its links, its ``<frame>`` elements and its joints."""

    def __init__(self, file: Path, model: etree._Element):
        self._file = file
        self._base: dict[str, str] = {}
        self._pose: dict[str, np.ndarray] = {}
        self._attached: dict[str, str] = {}
        for element in (*model.findall("link"), *model.findall("frame"), *model.findall("joint")):
            name = element.get("name") or ""
            what = f"{file.name}: {element.tag} {name!r}"
            if element.tag == "joint" and name in self._base:
                continue  # before SDFormat 1.7, a joint could have the name of a link, and no pose was relative to it
            if not name or name in self._base:
                raise AssetError(f"{what}: has no name, or that of another element; give each its own")
            default = element.get("attached_to") or MODEL_FRAME
            if element.tag == "joint":
                default = (element.findtext("child") or "").strip()
            if element.tag != "link":
                self._attached[name] = default
            pose = element.find("pose")
            said = None if pose is None else pose.get("relative_to")
            self._base[name] = said or default
            self._pose[name] = pose_of(element, what)

    def to_model(self, name: str) -> np.ndarray:
        """Return a frame's pose in the model's frame ``(4, 4)``; raises AssetError if its chain does not end there."""
        chain: list[np.ndarray] = []
        seen: set[str] = set()
        at = name
        while at != MODEL_FRAME:
            if at in seen or at not in self._base:
                why = "goes in a circle" if at in seen else f"leads to {at[:60]!r}, which is no frame of the model"
                raise AssetError(f"{self._file.name}: the pose of {name!r} {why}")
            seen.add(at)
            chain.append(self._pose[at])
            at = self._base[at]
        result = np.eye(4)
        for pose in chain:
            result = pose @ result
        return result

    def link_of(self, name: str) -> str:
        """Return the name of the link that a frame is attached to; a link or an unknown name is returned unchanged."""
        seen: set[str] = set()
        while name in self._attached and name not in seen:
            seen.add(name)
            name = self._attached[name]
        return name


class SdfShapes:
    """Reads the shapes of links of one SDF model; meshes are looked up only below the root of the asset."""

    def __init__(self, file: Path, frames: ModelFrames, files: AssetFiles, *, turn_gltf: bool = False):
        self._file, self._frames, self._files, self._turn_gltf = file, frames, files, turn_gltf
        self._looks = ScriptedMaterials(files, self._candidates)
        self._nodes: dict[Path, dict[str, frozenset[str]]] = {}

    def by_link(self, links: Iterable[etree._Element]) -> list[tuple[list[trimesh.Trimesh], list[CollisionShape]]]:
        """Return the visual parts and the collision shapes of each link."""
        placed = list(links)
        seen = [list(self.visual(link)) for link in placed]
        self._looks.remark_absent()
        return [(parts, list(self.collision(link))) for link, parts in zip(placed, seen, strict=True)]

    def visual(self, link: etree._Element) -> Iterator[trimesh.Trimesh]:
        """Yield the visual parts of a link in the model's frame."""
        for element, what in self._elements(link, "visual"):
            yield from self._placed(element, link, what)

    def collision(self, link: etree._Element) -> Iterator[CollisionShape]:
        """Yield the collision shapes of a link in the model's frame.

        A mesh counts as its convex hull, as in every other format. Gazebo's own engines use its triangles, which only SDFormat
        1.11 can change.
        """
        for index, (element, what) in enumerate(self._elements(link, "collision")):
            parts = self._placed(element, link, what)
            if parts:
                name = element.get("name") or f"{link.get('name')}_{index:02d}"
                drawn = element.find("geometry/heightmap") is not None
                primitive = element.find("geometry/mesh") is None and not drawn
                path = self._mesh_path(element)
                yield CollisionShape(name, *concatenate_meshes(parts), not drawn, path, primitive, as_drawn=drawn)

    def _elements(self, link: etree._Element, tag: str) -> Iterator[tuple[etree._Element, str]]:
        for element in link.findall(tag):
            yield element, f"{self._file.name}: link {link.get('name')} {tag} {element.get('name')}"

    def _placed(self, element: etree._Element, link: etree._Element, what: str) -> list[trimesh.Trimesh]:
        pose = element.find("pose")
        base = None if pose is None else pose.get("relative_to")
        to_model = self._frames.to_model(base or link.get("name")) @ pose_of(element, what)
        return [bake_transform(part, to_model) for part in self._parts(element, what)]

    def _parts(self, element: etree._Element, what: str) -> list[trimesh.Trimesh]:
        geometry = element.find("geometry")
        shapes = [] if geometry is None else list(geometry.iterchildren(tag="*"))
        if len(shapes) != 1 and {shape.tag for shape in shapes} != {"polyline"}:
            raise AssetError(f"{what}: its <geometry> holds {len(shapes)} shapes, not one")
        look = self._looks.find_material(element)
        parts = self._parts_without_script(element, shapes, what, textured=look is not None and look.has_texture)
        if look is None:
            return parts
        called = (text_of(shapes[0], "uri") or shapes[0].tag).rpartition("/")[2]
        return [self._looks.apply_material(part, look, called) for part in parts]

    def _parts_without_script(
        self, element: etree._Element, shapes: list[etree._Element], what: str, *, textured: bool
    ) -> list[trimesh.Trimesh]:
        shape, color = shapes[0], _diffuse(element, what)
        if shape.tag == "polyline":  # of several outlines, regions inside two are holes
            return [self._solid(prism_of(shapes, what), shape, color, textured)]
        if shape.tag == "mesh":
            return self._mesh_parts(shape, color, what)
        if shape.tag == "heightmap":
            uri = text_of(shape, "uri") or ""
            path = self._files.find(uri, self._candidates(uri))
            surface = None if path is None else terrain(shape, path, self._files, what)
            return [] if surface is None else [self._solid(surface, shape, color, False)]
        solid = primitive_of(shape, what)
        if solid is None:
            if shape.tag != "empty":
                self._files.remark(f"{element.get('name')!r} is <{shape.tag}>, not read as a shape, and was left out")
            return []
        return [self._solid(solid, shape, color, textured)]

    def _solid(
        self, solid: trimesh.Trimesh, shape: etree._Element, color: np.ndarray | None, textured: bool
    ) -> trimesh.Trimesh:
        self._files.count_shape(len(solid.faces))
        name, material = str(shape.tag), plain_material(color)
        if not textured:
            return make_part(solid.vertices, solid.faces, material=material, name=name)
        vertices, faces, uv = unwrap_primitive(solid, name)
        return make_part(vertices, faces, material=material, name=name, uv=uv)

    def _mesh_parts(self, shape: etree._Element, color: np.ndarray | None, what: str) -> list[trimesh.Trimesh]:
        uri = text_of(shape, "uri") or ""
        path = self._files.find(uri, self._candidates(uri))
        if path is None or self._files.is_unsupported(path):
            return []
        scale = text_of(shape, "scale")
        whole = self._files.mesh(path)
        mesh = self._submesh(shape, whole, path)
        parts = mesh_parts(
            self._files,
            path,
            mesh,
            color=color,
            turned_note="it was not turned",  # as for URDF: simulators disagree
            scale=None if scale is None else numbers(scale, 3, f"{what} scale"),
        )
        if mesh is not whole and (text_of(shape, "submesh/center") or "").lower() in ("true", "1"):
            corners = np.concatenate([part.bounds for part in parts])
            parts = [bake_transform(p, transform(np.eye(3), -(corners.min(0) + corners.max(0)) / 2)) for p in parts]
        turn = self._turn_gltf and mesh.format in Y_UP_FORMATS
        return [bake_transform(part, GLTF_TO_OBJECT) for part in parts] if turn else parts

    def _submesh(self, shape: etree._Element, mesh: MeshFile, path: Path) -> MeshFile:
        """Return the parts of a mesh that <submesh> names; in COLLADA, those that a node of this name shows, as in Gazebo."""
        name = text_of(shape, "submesh/name")
        if name is None:
            return mesh
        names = frozenset({name})
        if mesh.format == "dae":
            if path not in self._nodes:
                self._nodes[path] = geometries_of_nodes(path, self._files.limits.max_bytes, self._files.root)
            names = self._nodes[path].get(name, names)
        chosen = [part for part in mesh.parts if part.metadata["name"] in names]
        if not chosen:
            self._files.remark(f"{path.name}: submesh {name[:60]!r} could not be taken alone; the whole mesh was read")
            return mesh
        return replace(mesh, parts=chosen)

    def _candidates(self, uri: str) -> Iterator[Path]:
        clean = uri.replace("\\", "/").removeprefix("file://")
        yield from candidates(clean, self._file, self._files.root)

    def _mesh_path(self, element: etree._Element) -> Path | None:
        uri = text_of(element, "geometry/mesh/uri")
        return None if uri is None else self._files.find_used(uri, self._candidates(uri))


def _diffuse(element: etree._Element, what: str) -> np.ndarray | None:
    text = text_of(element, "material/diffuse")
    if text is None:
        return None
    if len(text.split()) == 3:
        text += " 1"
    return numbers(text, 4, f"{what} diffuse")
