"""The geometry of a USD stage: what is seen, and what collides."""

from __future__ import annotations

import re
from collections.abc import Iterator
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
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import DEFAULT_COLOR, bake_transform, make_part, pbr_material
from manitwin.formats.meshes.triangles import triangle_fans
from manitwin.formats.meshes.usd_skin import Skeletons
from manitwin.formats.meshes.usd_surfaces import PreviewSurfaces, UsdSurface, flat_colored
from manitwin.formats.meshes.usdz import display_color, mesh_parts, mesh_polygons

_MAX_SIZE_M = 1e6  # what is larger is no object, and its products overflow single precision
_ALONG = {
    "X": [[0, 0, 1], [1, 0, 0], [0, 1, 0]],
    "Y": [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
    "Z": np.eye(3),
}  # from along Z


class StageShapes:
    """The shapes of a stage in its world's axes, transforms and scales baked in, in metres."""

    def __init__(self, stage: Usd.Stage, unit_m: float, surfaces: LayeredSurfaces, source: MeshSource):
        self._unit_m, self._surfaces, self._source = unit_m, surfaces, source
        self._transforms = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
        self._skeletons = Skeletons(stage, source)
        self._faces = 0
        self.prims = self._all_prims(stage)
        self.gprims = [prim for prim in self.prims if self._is_shape(prim)]

    def to_world(self, prim: Usd.Prim) -> np.ndarray:
        """Return the transform ``(4, 4)`` from a prim's own axes and unit to the stage's axes and metres."""
        matrix = np.array(self._transforms.GetLocalToWorldTransform(prim)).T  # USD multiplies rows
        matrix = np.diag([self._unit_m, self._unit_m, self._unit_m, 1.0]) @ matrix
        if not np.isfinite(matrix).all() or np.abs(matrix).max() > _MAX_SIZE_M:
            raise AssetError(
                f"{self._source.path}: the transform of {prim.GetPath()} is {matrix[:3].tolist()}; mend it"
            )
        return matrix

    def visual(self) -> tuple[trimesh.Trimesh, ...]:
        """Return what is seen: shapes that are visible and for rendering."""
        parts: list[trimesh.Trimesh] = []
        for prim in self.gprims:
            imageable = UsdGeom.Imageable(prim)
            if imageable.ComputeVisibility() == UsdGeom.Tokens.invisible:
                self._source.find("hidden shapes in it are no part of what is seen")
            elif imageable.ComputePurpose() not in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy):
                parts += [self._checked(bake_transform(part, self.to_world(prim)), prim) for part in self._parts(prim)]
        return tuple(parts)

    def colliders(self) -> Iterator[Usd.Prim]:
        """Yield the shapes that collide: those with a collision API or below one, and those for guidance only."""
        for prim in self.gprims:
            owner = _nearest_with(prim, UsdPhysics.CollisionAPI)
            if owner is None and UsdGeom.Imageable(prim).ComputePurpose() == UsdGeom.Tokens.guide:
                self._source.find("shapes of purpose guide without a collision API were taken as collision shapes")
                yield prim
            elif owner is not None and UsdPhysics.CollisionAPI(owner).GetCollisionEnabledAttr().Get() is not False:
                if owner != prim:
                    self._source.find(
                        f"the collision API is on {owner.GetTypeName() or 'a prim'}, not on the shapes below it"
                    )
                yield prim

    def collision(self) -> tuple[CollisionShape, ...]:
        """Return the collision shapes; ``convex`` where the approximation is a hull, a box or a sphere."""
        shapes = []
        for prim in self.colliders():
            local, convex = self._collider(prim)
            world = self.to_world(prim)
            baked = bake_transform(local, world)
            self._checked(baked, prim)
            vertices, faces = np.asarray(baked.vertices), np.asarray(baked.faces)
            primitive = not prim.IsA(UsdGeom.Mesh)
            shapes.append(CollisionShape(prim.GetName(), vertices, faces, convex, primitive=primitive))
        return tuple(shapes)

    def _collider(self, prim: Usd.Prim) -> tuple[trimesh.Trimesh, bool]:
        if not prim.IsA(UsdGeom.Mesh):
            return self._primitive(prim), True
        mesh = _bare_mesh(UsdGeom.Mesh(prim), self._source)
        owner = _nearest_with(prim, UsdPhysics.MeshCollisionAPI)
        approximation = "none" if owner is None else UsdPhysics.MeshCollisionAPI(owner).GetApproximationAttr().Get()
        if approximation == UsdPhysics.Tokens.boundingCube and len(mesh.vertices):
            return _grey(mesh.bounding_box.copy(), prim), True
        if approximation == UsdPhysics.Tokens.boundingSphere and len(mesh.vertices):
            centre = mesh.bounds.mean(0)
            ball = primitives.sphere(float(np.linalg.norm(mesh.vertices - centre, axis=1).max()))
            ball.apply_translation(centre)
            return _grey(ball, prim), True
        if approximation not in ("none", UsdPhysics.Tokens.convexHull):
            self._source.find(f"collision shapes are left to the simulator to approximate ({str(approximation)[:40]})")
        return mesh, approximation == UsdPhysics.Tokens.convexHull

    def _parts(self, prim: Usd.Prim) -> list[trimesh.Trimesh]:
        if prim.IsA(UsdGeom.Mesh):
            return mesh_parts(UsdGeom.Mesh(prim), self._surfaces, self._skeletons, self._source)
        solid = self._primitive(prim)
        material = flat_colored(self._surfaces.of(prim), display_color(prim))
        return [make_part(solid.vertices, solid.faces, material=material, name=prim.GetName())]

    def _primitive(self, prim: Usd.Prim) -> trimesh.Trimesh:
        """Return a cube, sphere, cylinder, capsule or cone as a mesh in its own axes and unit."""
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
        if not 0 < value * self._unit_m <= _MAX_SIZE_M:  # NaN is neither
            raise AssetError(f"{self._source.path}: {name} of {prim.GetPath()} is {value}; mend it")
        return value

    def _is_shape(self, prim: Usd.Prim) -> bool:
        if prim.IsA(UsdGeom.Mesh):
            return True
        if str(prim.GetTypeName()) in ("Cube", "Sphere", "Cylinder", "Capsule", "Cone"):
            return True
        if UsdGeom.Imageable(prim).ComputePurpose() == UsdGeom.Tokens.guide and not prim.HasAPI(
            UsdPhysics.CollisionAPI
        ):
            return False  # drawn for people, as lines of grasps are
        if prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.PointInstancer):
            self._source.find(f"{prim.GetTypeName()} prims in it were left out")
        return False

    def _checked(self, part: trimesh.Trimesh, prim: Usd.Prim) -> trimesh.Trimesh:
        self._faces += len(part.faces)
        self._source.check_faces(self._faces)
        vertices = np.asarray(part.vertices)
        if not np.isfinite(vertices).all() or (len(vertices) and np.abs(vertices).max() > _MAX_SIZE_M):
            raise AssetError(
                f"{self._source.path}: points of {prim.GetPath()} are not finite or beyond all size; mend them"
            )
        return part

    def _all_prims(self, stage: Usd.Stage) -> list[Usd.Prim]:
        prims = list(Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
        for prim in prims:
            check_types(prim, self._source)
        if sum(prim.IsA(UsdGeom.Gprim) for prim in prims) > MAX_SHAPES:
            raise AssetError(f"{self._source.path}: more than {MAX_SHAPES} shapes; it is no single object")
        return prims


def _nearest_with(prim: Usd.Prim, api: type) -> Usd.Prim | None:
    """Return the prim, or the nearest above it, that has an API."""
    while prim and not prim.IsPseudoRoot():
        if prim.HasAPI(api):
            return prim
        prim = prim.GetParent()
    return None


def _bare_mesh(mesh: UsdGeom.Mesh, source: MeshSource) -> trimesh.Trimesh:
    """Return a mesh prim's points and polygons, cut into triangles, and nothing else."""
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
    """Raise AssetError where a value is not of the type that its schema gives it, precision apart."""
    definition = prim.GetPrimDefinition()
    for name in definition.GetPropertyNames():
        attribute = prim.GetAttribute(name)
        if not attribute or not attribute.HasAuthoredValue():
            continue
        wanted = _kind(definition.GetAttributeDefinition(name).GetTypeName())
        for spec in attribute.GetPropertyStack(Usd.TimeCode.Default()):
            written = spec.typeName if isinstance(spec, Sdf.AttributeSpec) else "relationship"
            if written == "relationship" or _kind(written) != wanted:
                raise AssetError(f"{source.path}: {attribute.GetPath()} is a {written}, not a {wanted}; mend it")


def _kind(name: Sdf.ValueTypeName) -> str:
    """Return a value type without its precision: ``float`` for ``double``, ``half`` and ``float``."""
    bare = str(name.type.typeName).replace("pxr_half::", "").replace("TfToken", "string")
    return re.sub(r"(GfVec\d|GfQuat|GfMatrix\d)[dfh]", r"\1", re.sub(r"\b(?:double|half)\b", "float", bare))
