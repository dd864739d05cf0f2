"""The frames of an SDF model, and the visual and collision shapes of its links, poses and scales applied."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import manifold3d
import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]
from scipy.spatial.transform import Rotation

from manitwin.assets import primitives
from manitwin.assets.asset import CollisionShape
from manitwin.assets.asset_files import MOST_NAMED, AssetFiles, joined
from manitwin.assets.readers.sdf_terrain import terrain
from manitwin.assets.readers.upright import Y_UP_FORMATS
from manitwin.assets.readers.urdf_shapes import candidates, mesh_parts, plain_material
from manitwin.errors import AssetError
from manitwin.formats.meshes.read import MeshFile
from manitwin.formats.meshes.textures import bake_transform, make_part
from manitwin.formats.xml_file import number, numbers, text_of
from manitwin.geometry.poses import GLTF_TO_OBJECT, transform

MODEL_FRAME = "__model__"
_SHEET_M = 1e-3
_MAX_POINTS = 10_000


def pose_of(element: etree._Element, what: str) -> np.ndarray:
    """Return the ``<pose>`` of an element ``(4, 4)``, relative to whatever it says; identity where it has none.

    Roll, pitch and yaw turn about fixed axes x, y, z in that order, in radians unless ``degrees`` says otherwise;
    ``rotation_format`` may be ``quat_xyzw``. Source: the SDFormat specification, version 1.9, ``pose``.
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
                continue  # before SDFormat 1.7 a joint might have the name of a link, and no pose was relative to it
            if not name or name in self._base:
                raise AssetError(f"{what}: without a name, or with that of another")
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
        """Return a frame's pose in the model's frame ``(4, 4)``; raises AssetError where its chain does not end there."""
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
        """Return the link that a frame is attached to, by name; a link is its own, and an unknown name stays."""
        seen: set[str] = set()
        while name in self._attached and name not in seen:
            seen.add(name)
            name = self._attached[name]
        return name


class SdfShapes:
    """Reads shapes of the links of one SDF model; meshes are looked up in the asset's folder and nowhere else."""

    def __init__(self, file: Path, frames: ModelFrames, files: AssetFiles, *, turn_gltf: bool = False):
        self._file, self._frames, self._files, self._turn_gltf = file, frames, files, turn_gltf
        self.owners: list[int] = []

    def all(self, links: Iterable[etree._Element]) -> tuple[list[trimesh.Trimesh], list[CollisionShape]]:
        """Return the visual parts and the collision shapes of links; ``owners`` then has the place of each visual part's link."""
        placed = list(links)
        self._remark_scripts(placed)
        owned = [(place, part) for place, link in enumerate(placed) for part in self.visual(link)]
        self.owners, visual = [place for place, _ in owned], [part for _, part in owned]
        return visual, [shape for link in placed for shape in self.collision(link)]

    def visual(self, link: etree._Element) -> Iterator[trimesh.Trimesh]:
        """Yield a link's visual parts in the model's frame."""
        for element, what in self._elements(link, "visual"):
            yield from self._placed(element, link, what)

    def collision(self, link: etree._Element) -> Iterator[CollisionShape]:
        """Yield a link's collision shapes in the model's frame.

        A mesh counts as its convex hull, as in every other format: Gazebo's own engines take its triangles, which only
        SDFormat 1.11 can change.
        """
        for index, (element, what) in enumerate(self._elements(link, "collision")):
            parts = self._placed(element, link, what)
            if parts:
                name = element.get("name") or f"{link.get('name')}_{index:02d}"
                drawn = element.find("geometry/heightmap") is not None
                primitive = element.find("geometry/mesh") is None and not drawn
                path = self._mesh_path(element)
                yield CollisionShape(name, *joined(parts), not drawn, path, primitive, as_drawn=drawn)

    def _remark_scripts(self, links: list[etree._Element]) -> None:
        """Note the material scripts of visuals: they are in the language of OGRE, Gazebo's renderer."""
        scripts = [script for link in links for script in link.findall("visual/material/script")]
        told = [text_of(script, "name") or text_of(script, "uri") or text_of(script, ".") for script in scripts]
        names = [repr(name[:60]) for name in dict.fromkeys(told) if name is not None]
        if names:
            more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
            named = ", ".join(names[:MOST_NAMED])
            self._files.remark(f"colours and textures of Gazebo's material scripts are not read: {named}{more}")

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
        shape, color = shapes[0], _diffuse(element, what)
        if shape.tag == "polyline":  # several: what lies within two of them is a hole
            return [self._solid(_polyline(shapes, what), shape, color)]
        if shape.tag == "mesh":
            return self._mesh_parts(shape, color, what)
        if shape.tag == "heightmap":
            uri = text_of(shape, "uri") or ""
            path = self._files.find(uri, self._candidates(uri))
            surface = None if path is None else terrain(shape, path, self._files, what)
            return [] if surface is None else [self._solid(surface, shape, color)]
        solid = _primitive(shape, what)
        if solid is None:
            if shape.tag != "empty":
                self._files.remark(f"{element.get('name')!r} is <{shape.tag}>, not read as a shape, and was left out")
            return []
        return [self._solid(solid, shape, color)]

    def _solid(self, solid: trimesh.Trimesh, shape: etree._Element, color: np.ndarray | None) -> trimesh.Trimesh:
        self._files.count(len(solid.faces))
        return make_part(solid.vertices, solid.faces, material=plain_material(color), name=str(shape.tag))

    def _mesh_parts(self, shape: etree._Element, color: np.ndarray | None, what: str) -> list[trimesh.Trimesh]:
        uri = text_of(shape, "uri") or ""
        path = self._files.find(uri, self._candidates(uri))
        if path is None or self._files.is_of_unread_format(path):
            return []
        scale = text_of(shape, "scale")
        mesh = self._submesh(shape, self._files.mesh(path), path)
        parts = mesh_parts(
            self._files,
            path,
            mesh,
            color=color,
            turned_note="it was not turned",  # as for URDF: simulators disagree
            scale=None if scale is None else numbers(scale, 3, f"{what} scale"),
        )
        turn = self._turn_gltf and mesh.format in Y_UP_FORMATS
        return [bake_transform(part, GLTF_TO_OBJECT) for part in parts] if turn else parts

    def _submesh(self, shape: etree._Element, mesh: MeshFile, path: Path) -> MeshFile:
        name = text_of(shape, "submesh/name")
        if name is None:
            return mesh
        chosen = [part for part in mesh.parts if part.metadata["name"] == name]
        if not chosen or (text_of(shape, "submesh/center") or "").lower() in ("true", "1"):
            self._files.remark(f"{path.name}: submesh {name[:60]!r} could not be taken alone; the whole mesh was read")
            return mesh
        return replace(mesh, parts=chosen)

    def _candidates(self, uri: str) -> Iterator[Path]:
        clean = uri.replace("\\", "/").removeprefix("file://")
        yield from candidates(clean, self._file, self._files.root)

    def _mesh_path(self, element: etree._Element) -> Path | None:
        uri = text_of(element, "geometry/mesh/uri")
        return None if uri is None else self._files.used_one(uri, self._candidates(uri))


def _primitive(shape: etree._Element, what: str) -> trimesh.Trimesh | None:
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
    """Return the rectangle that a plane shows, as a sheet under it; to collide with it has no end."""
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


def _polyline(shapes: list[etree._Element], what: str) -> trimesh.Trimesh:
    """Return the prism over closed lines of points, from z = 0 to the height of the first."""
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


def _diffuse(element: etree._Element, what: str) -> np.ndarray | None:
    text = text_of(element, "material/diffuse")
    if text is None:
        return None
    if len(text.split()) == 3:
        text += " 1"
    return numbers(text, 4, f"{what} diffuse")
