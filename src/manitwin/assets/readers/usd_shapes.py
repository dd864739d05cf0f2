"""Visual and collision geometry of a USD stage."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
import trimesh
from PIL import Image
from pxr import Sdf, Usd, UsdGeom, UsdPhysics

from manitwin.assets import primitives
from manitwin.assets.asset import CollisionShape
from manitwin.assets.asset_files import MAX_SHAPES
from manitwin.assets.readers.usd_layers import LayerFiles
from manitwin.errors import AssetError
from manitwin.formats.meshes.shading_normals import triangle_fans
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import DEFAULT_COLOR, bake_transform, make_part, pbr_material
from manitwin.formats.meshes.usd_placed_prims import PlacedPrim
from manitwin.formats.meshes.usd_skin import Skeletons
from manitwin.formats.meshes.usd_surfaces import PreviewSurfaces, UsdSurface, flat_colored
from manitwin.formats.meshes.usdz import display_color, mesh_parts, mesh_polygons

_MAX_SIZE_M = 1e6  # larger objects are invalid, and their products overflow single precision
_SOLIDS = ("Cube", "Sphere", "Cylinder", "Capsule", "Cone")
_ALONG = {
    "X": [[0, 0, 1], [1, 0, 0], [0, 1, 0]],
    "Y": [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
    "Z": np.eye(3),
}  # rotations from an axis along Z


Seen = tuple[trimesh.Trimesh, PlacedPrim]
"""A visual part, and the prim it comes from."""
Felt = tuple[CollisionShape, PlacedPrim]


class StageShapes:
    """The shapes of a stage's prims in world axes and metres, with transforms and scales applied."""

    def __init__(
        self,
        placed: Sequence[PlacedPrim],
        unit_m: float,
        surfaces: LayeredSurfaces,
        skeletons: Skeletons,
        source: MeshSource,
    ):
        self._unit_m, self._surfaces, self._skeletons, self._source = unit_m, surfaces, skeletons, source
        self._faces = 0
        self._made: dict[Sdf.Path, list[trimesh.Trimesh]] = {}
        self.placed = tuple(placed)
        self._shapes = [each for each in placed if self._is_shape(each.prim) and not self._has_zero_size(each.prim)]

    def to_world(self, placed: PlacedPrim) -> np.ndarray:
        """Return the transform ``(4, 4)`` from a prim's own axes and unit to the stage's axes and metres."""
        return metric_transform(placed, self._unit_m, self._source)

    def visual(self) -> list[Seen]:
        """Return the visual parts: visible shapes with a purpose for rendering."""
        parts: list[Seen] = []
        for placed in self._shapes:
            if placed.is_hidden():
                self._source.add_finding("hidden shapes in it are no part of what is seen")
            elif is_rendered(placed):
                matrix = self.to_world(placed)
                parts += [
                    (self._checked(bake_transform(part, matrix), placed.prim), placed) for part in self._parts(placed)
                ]
        return parts

    def colliders(self) -> Iterator[PlacedPrim]:
        """Yield the colliding shapes: those at or below a collision API, and those of purpose guide."""
        for placed in self._shapes:
            owner = nearest_with(placed, UsdPhysics.CollisionAPI)
            if owner is None and UsdGeom.Imageable(placed.prim).ComputePurpose() == UsdGeom.Tokens.guide:
                self._source.add_finding(
                    "shapes of purpose guide without a collision API were taken as collision shapes"
                )
                yield placed
            elif owner is not None and UsdPhysics.CollisionAPI(owner).GetCollisionEnabledAttr().Get() is not False:
                if owner != placed.prim:
                    self._source.add_finding(
                        f"the collision API is on {owner.GetTypeName() or 'a prim'}, not on the shapes below it"
                    )
                yield placed

    def collision(self) -> list[Felt]:
        """Return the collision shapes; ``convex`` if the approximation is a hull, a box or a sphere."""
        shapes: list[Felt] = []
        for placed in self.colliders():
            prim = placed.prim
            local, convex = self._collider(placed)
            baked = bake_transform(local, self.to_world(placed))
            self._checked(baked, prim)
            vertices, faces = np.asarray(baked.vertices), np.asarray(baked.faces)
            primitive = not prim.IsA(UsdGeom.Mesh)
            shapes.append((CollisionShape(prim.GetName(), vertices, faces, convex, primitive=primitive), placed))
        return shapes

    def _collider(self, placed: PlacedPrim) -> tuple[trimesh.Trimesh, bool]:
        prim = placed.prim
        if not prim.IsA(UsdGeom.Mesh):
            return self._primitive(prim), True
        mesh = _bare_mesh(UsdGeom.Mesh(prim), self._source)
        owner = nearest_with(placed, UsdPhysics.MeshCollisionAPI)
        approximation = "none" if owner is None else UsdPhysics.MeshCollisionAPI(owner).GetApproximationAttr().Get()
        if approximation == UsdPhysics.Tokens.boundingCube and len(mesh.vertices):
            return _grey(mesh.bounding_box.copy(), prim), True
        if approximation == UsdPhysics.Tokens.boundingSphere and len(mesh.vertices):
            centre = mesh.bounds.mean(0)
            ball = primitives.sphere(float(np.linalg.norm(mesh.vertices - centre, axis=1).max()))
            ball.apply_translation(centre)
            return _grey(ball, prim), True
        if approximation not in ("none", UsdPhysics.Tokens.convexHull):
            self._source.add_finding(
                f"collision shapes are left to the simulator to approximate ({str(approximation)[:40]})"
            )
        return mesh, approximation == UsdPhysics.Tokens.convexHull

    def _parts(self, placed: PlacedPrim) -> list[trimesh.Trimesh]:
        """Return a prim's parts in its own axes; instanced prims are converted once."""
        if placed.prim.GetPath() not in self._made:
            self._made[placed.prim.GetPath()] = self._parts_of(placed.prim)
        return self._made[placed.prim.GetPath()]

    def _parts_of(self, prim: Usd.Prim) -> list[trimesh.Trimesh]:
        if prim.IsA(UsdGeom.Mesh):
            return mesh_parts(UsdGeom.Mesh(prim), self._surfaces, self._skeletons, self._source)
        solid = self._primitive(prim)
        material = flat_colored(self._surfaces.bound_surface(prim), display_color(prim))
        return [make_part(solid.vertices, solid.faces, material=material, name=prim.GetName())]

    def _primitive(self, prim: Usd.Prim) -> trimesh.Trimesh:
        """Return the mesh of a cube, sphere, cylinder, capsule or cone in its own axes and unit."""
        kind = str(prim.GetTypeName())
        if kind == "Cube":
            return _grey(trimesh.creation.box(np.full(3, self._number(prim, "size"))), prim)
        radius = self._number(prim, "radius")
        if kind == "Sphere":
            return _grey(primitives.sphere(radius), prim)
        height = self._number(prim, "height")
        if kind == "Capsule":
            mesh = primitives.capsule(radius, height)
        elif kind == "Cylinder":
            mesh = primitives.cylinder(radius, height)
        else:
            mesh = trimesh.creation.cone(radius, height, sections=48)
            mesh.apply_translation([0, 0, -height / 2])
        axis = str(prim.GetAttribute("axis").Get(Usd.TimeCode.EarliestTime()))
        if axis not in _ALONG:
            raise AssetError(f"{self._source.path}: axis of {prim.GetPath()} is {axis[:20]!r}; valid are X, Y and Z")
        turn = np.asarray(_ALONG[axis], dtype=float)
        return _grey(trimesh.Trimesh(np.asarray(mesh.vertices) @ turn.T, mesh.faces, process=False), prim)

    def _number(self, prim: Usd.Prim, name: str) -> float:
        value = float(prim.GetAttribute(name).Get(Usd.TimeCode.EarliestTime()))
        if not 0 < value * self._unit_m <= _MAX_SIZE_M:  # also refuses NaN
            raise AssetError(
                f"{self._source.path}: {name} of {prim.GetPath()} is {value}; give more than 0, {_MAX_SIZE_M:g} m at most"
            )
        return value

    def _is_shape(self, prim: Usd.Prim) -> bool:
        if is_solid(prim):
            return True
        if UsdGeom.Imageable(prim).ComputePurpose() == UsdGeom.Tokens.guide and not prim.HasAPI(
            UsdPhysics.CollisionAPI
        ):
            return False  # drawn for users, such as grasp lines
        if prim.IsA(UsdGeom.Gprim):
            self._source.add_finding(f"{prim.GetTypeName()} prims in it were left out")
        return False

    def _has_zero_size(self, prim: Usd.Prim) -> bool:
        """Return whether a shape has zero size, as URDF markers have."""
        sizes = (prim.GetAttribute(name) for name in ("size", "radius", "height") if not prim.IsA(UsdGeom.Mesh))
        nothing = any(each and each.Get(Usd.TimeCode.EarliestTime()) == 0 for each in sizes)
        if nothing:
            self._source.add_finding("shapes of no size in it were left out")
        return nothing

    def _checked(self, part: trimesh.Trimesh, prim: Usd.Prim) -> trimesh.Trimesh:
        self._faces += len(part.faces)
        self._source.check_faces(self._faces)
        vertices = np.asarray(part.vertices)
        if not np.isfinite(vertices).all() or (len(vertices) and np.abs(vertices).max() > _MAX_SIZE_M):
            raise AssetError(
                f"{self._source.path}: points of {prim.GetPath()} are not finite or too large; give finite numbers,"
                f" {_MAX_SIZE_M:g} m at most"
            )
        return part


def check_prims(placed: Sequence[PlacedPrim], source: MeshSource) -> None:
    """Raise AssetError for values that do not have the types of their schemas, and for too many shapes."""
    for prim in {each.prim.GetPath(): each.prim for each in placed}.values():
        check_types(prim, source)
    if sum(each.prim.IsA(UsdGeom.Gprim) for each in placed) > MAX_SHAPES:
        raise AssetError(f"{source.path}: more than {MAX_SHAPES} shapes; it is no single object")


def metric_transform(placed: PlacedPrim, unit_m: float, source: MeshSource) -> np.ndarray:
    """Return the transform ``(4, 4)`` from a prim's own axes and unit to the stage's axes and metres."""
    matrix = np.diag([unit_m, unit_m, unit_m, 1.0]) @ placed.to_world
    if not np.isfinite(matrix).all() or np.abs(matrix).max() > _MAX_SIZE_M:
        raise AssetError(
            f"{source.path}: the transform of {placed.prim.GetPath()} is {matrix[:3].tolist()}; give finite numbers, and"
            f" lengths of {_MAX_SIZE_M:g} m at most"
        )
    return np.asarray(matrix)


def is_solid(prim: Usd.Prim) -> bool:
    """Return whether a prim is a supported shape."""
    return bool(prim.IsA(UsdGeom.Mesh)) or str(prim.GetTypeName()) in _SOLIDS


def is_rendered(placed: PlacedPrim) -> bool:
    """Return whether a shape is for rendering, rather than a guide or proxy."""
    return UsdGeom.Imageable(placed.prim).ComputePurpose() not in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy)


def nearest_with(placed: PlacedPrim, api: type) -> Usd.Prim | None:
    """Return the prim or its nearest ancestor that has an API, or None."""
    return next((prim for prim in placed.lineage() if prim.HasAPI(api)), None)


def _bare_mesh(mesh: UsdGeom.Mesh, source: MeshSource) -> trimesh.Trimesh:
    """Return the points of a mesh prim with its polygons cut into triangles, without other attributes."""
    polygons = mesh_polygons(mesh, source)
    if polygons is None:
        return _grey(trimesh.Trimesh(), mesh.GetPrim())
    points, sizes, indices = polygons
    corners, _ = triangle_fans(sizes)
    faces = indices[corners.reshape(-1)].reshape(-1, 3)
    if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        faces = faces[:, ::-1]
    return _grey(trimesh.Trimesh(points, faces, process=False), mesh.GetPrim())


def _grey(mesh: trimesh.Trimesh, prim: Usd.Prim) -> trimesh.Trimesh:
    vertices, faces = np.asarray(mesh.vertices).reshape(-1, 3), np.asarray(mesh.faces).reshape(-1, 3)
    return make_part(vertices, faces, material=pbr_material(base_color=DEFAULT_COLOR), name=prim.GetName())


class LayeredSurfaces(PreviewSurfaces):
    """Materials whose textures lie beside the layers of a stage, or in their packages."""

    def __init__(self, layers: LayerFiles, source: MeshSource):
        self._layers, self._source = layers, source
        self._materials: dict[str, UsdSurface] = {}
        self._images: dict[str, Image.Image | None] = {}

    def _picture(self, layer: Sdf.Layer, path: str) -> Image.Image | None:
        key = f"{layer.identifier}:{path}"
        return self._decoded(key, path, partial(self._layers.texture, layer, path))


def check_types(prim: Usd.Prim, source: MeshSource) -> None:
    """Raise AssetError if a value does not have the type of its schema, ignoring precision."""
    definition = prim.GetPrimDefinition()
    for name in definition.GetPropertyNames():
        attribute = prim.GetAttribute(name)
        if not attribute or not attribute.HasAuthoredValue():
            continue
        wanted = _kind(definition.GetAttributeDefinition(name).GetTypeName())
        for spec in attribute.GetPropertyStack(Usd.TimeCode.Default()):
            written = spec.typeName if isinstance(spec, Sdf.AttributeSpec) else "relationship"
            if written == "relationship" or _kind(written) != wanted:
                raise AssetError(
                    f"{source.path}: {attribute.GetPath()} is a {written}, not a {wanted}; declare it as that"
                )


def _kind(name: Sdf.ValueTypeName) -> str:
    """Return a value type without its precision: ``float`` for ``double``, ``half`` and ``float``."""
    bare = str(name.type.typeName).replace("pxr_half::", "").replace("TfToken", "string")
    return re.sub(r"(GfVec\d|GfQuat|GfMatrix\d)[dfh]", r"\1", re.sub(r"\b(?:double|half)\b", "float", bare))
