"""An asset with what many rules measure of it, each once and only when asked for."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
import trimesh
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from scipy.spatial import cKDTree

from manitwin.assets.asset import Asset
from manitwin.assets.audit.convex_shapes import ConvexShapes, UniformSolid, inertia_of_second_moment
from manitwin.assets.audit.finding import Complaint
from manitwin.geometry.distance import closest_points_on_triangles, distance_to_surface
from manitwin.geometry.ray_caster import MILLIMETRES
from manitwin.geometry.sampling import sample_surface
from manitwin.models.annotators.priors import Prior, lookup
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import read_record

SURFACE_SAMPLES = 3000
"""Points on the visual surface: some 4 mm apart on an object of a hand's size."""

FEW = 40
"""Up to so many points are measured one by one: to build a tree over all triangles costs as much."""

Measure = TypeVar("Measure")

OTHER_IN_SIMULATION = frozenset({"plane", "planes"})
"""Words whose everyday sense is not that of names of assets: a plane is a ground there, and no aeroplane."""

CLOSED = 1e-3
"""The sum of the area vectors of a closed surface is zero; up to this share of the area it counts as closed."""

AIR_SAMPLES = 1500
_AXES = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])

# As geometry.cavity has measured: the smallest vessel (a shoe) holds 5.4 % of its hull, the largest hollow sideways
# that is none (a clamp's jaws) 5.2 %.
_LEAST_SHARE_UP = 0.05
_LEAST_SHARE_SIDEWAYS = 0.10


@dataclass(frozen=True)
class SurfaceIntegrals:
    """Exact integrals over a surface: area, enclosed volume (None: not closed), a thin even shell of one kilogram."""

    area_m2: float
    volume_m3: float | None
    shell: UniformSolid
    solid_inertia_per_kg_m2: np.ndarray | None


@dataclass
class MeasuredAsset:
    """Measurements of one asset, in its own axes and metres; ``engines`` are those that it is to be run in."""

    asset: Asset
    engines: tuple[str, ...] = ()
    _kept: dict[Callable[..., Any], Any] = field(default_factory=dict)

    def once(self, measure: Callable[[MeasuredAsset], Measure]) -> Measure:
        """Return what a function measures of the asset, called once."""
        if measure not in self._kept:
            self._kept[measure] = measure(self)
        kept: Measure = self._kept[measure]
        return kept

    def complaints(self, check: Callable[[MeasuredAsset], Iterator[Complaint]]) -> list[Complaint]:
        """Return what a check says of the asset, asked once: other rules are silent where the cause is said already."""
        if check not in self._kept:
            self._kept[check] = list(check(self))
        kept: list[Complaint] = self._kept[check]
        return kept

    @cached_property
    def visual(self) -> trimesh.Trimesh | None:
        """All visual parts as one mesh, None where there are none."""
        parts = [part for part in self.asset.visual if len(part.faces)]
        if not parts:
            return None
        vertices, faces = trimesh.util.append_faces([p.vertices for p in parts], [p.faces for p in parts])
        return trimesh.Trimesh(vertices, faces, process=False)

    @cached_property
    def collision(self) -> trimesh.Trimesh | None:
        """All collision shapes as they stand, as one mesh; None where there are none."""
        shapes = [shape for shape in self.asset.collision if len(shape.faces)]
        if not shapes:
            return None
        vertices, faces = trimesh.util.append_faces([s.vertices for s in shapes], [s.faces for s in shapes])
        return trimesh.Trimesh(vertices, faces, process=False)

    @cached_property
    def body(self) -> trimesh.Trimesh | None:
        """The visual mesh, or the collision shapes where there is none."""
        return self.visual if self.visual is not None else self.collision

    @cached_property
    def bounds(self) -> np.ndarray | None:
        """The axis-aligned bounds ``(2, 3)`` of the visual meshes, or of the collision shapes where there are none."""
        return None if self.body is None else np.asarray(self.body.bounds)

    @cached_property
    def longest_m(self) -> float:
        """The longest side of the bounds, 0 without geometry."""
        return 0.0 if self.bounds is None else float(np.ptp(self.bounds, axis=0).max())

    @cached_property
    def up(self) -> np.ndarray:
        """The axis that stands up ``(3,)``."""
        return np.array([0.0, 1, 0]) if self.asset.up == "y" else np.array([0.0, 0, 1])

    @cached_property
    def lowest_m(self) -> float:
        """The lowest point along the up axis."""
        assert self.bounds is not None, "asked of an asset without geometry"
        return float(self.bounds[0] @ self.up)

    @cached_property
    def hull(self) -> ConvexShapes:
        """The convex hull of the body: one shape, or none where it is flat."""
        return ConvexShapes.of([] if self.body is None else [np.asarray(self.body.vertices, float)])

    @cached_property
    def shapes(self) -> ConvexShapes:
        """The convex hulls of the collision shapes."""
        return ConvexShapes.of([np.asarray(shape.vertices, float) for shape in self.asset.collision])

    @cached_property
    def surface(self) -> SurfaceIntegrals | None:
        """Integrals over the surface of the body; None without one."""
        return None if self.body is None else _integrate(self.body)

    @cached_property
    def samples(self) -> np.ndarray:
        """Points on the surface of the body ``(N, 3)``, even by area, the same at every call."""
        if self.body is None or float(self.body.area) <= 0:
            return np.zeros((0, 3))
        return sample_surface(self.body, SURFACE_SAMPLES, np.random.default_rng(0))[0]

    @cached_property
    def spacing_m(self) -> float:
        """How far apart neighbouring samples are in the mean."""
        return (
            float(np.sqrt(self.body.area / len(self.samples))) if self.body is not None and len(self.samples) else 0.0
        )

    @cached_property
    def _near(self) -> cKDTree:
        return cKDTree(self.samples)

    def distance_m(self, points: np.ndarray, exact_beyond_m: float) -> np.ndarray:
        """Return the distance of points ``(N, 3)`` to the surface of the body.

        Up to the samples first; what is farther from them than ``exact_beyond_m`` is measured exactly.
        """
        assert self.body is not None, "asked of an asset without geometry"
        distance = np.asarray(self._near.query(points)[0], dtype=float)
        far = np.flatnonzero(distance > exact_beyond_m)
        if len(far) > FEW:
            distance[far] = distance_to_surface(points[far], self.body)
        for index in far if len(far) <= FEW else ():
            distance[index] = self._exact_distance(points[index], float(distance[index]))
        return distance

    @cached_property
    def _balls(self) -> tuple[np.ndarray, np.ndarray]:
        """A ball around every triangle of the body: centres ``(F, 3)`` and radii ``(F,)``."""
        assert self.body is not None
        corners = np.asarray(self.body.triangles)
        centers = corners.mean(1)
        return centers, np.sqrt(((corners - centers[:, None]) ** 2).sum(2).max(1))

    def _exact_distance(self, point: np.ndarray, bound_m: float) -> float:
        """Return the distance of one point to the body, tried on the triangles whose balls are within the bound."""
        assert self.body is not None
        centers, radii = self._balls
        near = np.flatnonzero(np.linalg.norm(centers - point, axis=1) - radii <= bound_m)
        corners = np.asarray(self.body.triangles)[near]
        closest, _ = closest_points_on_triangles(np.repeat(point[None], len(near), axis=0), corners)
        return min(bound_m, float(np.linalg.norm(closest - point, axis=1).min()))

    @cached_property
    def air(self) -> OpenAir | None:
        """The air in the box of the visual meshes; None without them."""
        if self.visual is None or not len(self.hull):
            return None
        return open_air(self.visual, self.up, float(self.hull.volumes_m3.sum()))

    @cached_property
    def prior(self) -> Prior | None:
        """The prior of the asset's category, or of its name; None where unknown."""
        by_category = lookup(self.asset.category)
        words = self._name_in_words.lower().split()
        return by_category or (None if words and words[-1] in OTHER_IN_SIMULATION else lookup(self._name_in_words))

    @cached_property
    def material_words(self) -> str:
        """The material as declared, in lower case; the asset's name where none is."""
        return (self.asset.contact.material or self._name_in_words).lower()

    @property
    def _name_in_words(self) -> str:
        # 021_cup, porcelain_mug, Mug_2 and mug_dcdb0c83 name a cup and mugs
        words = re.sub(r"([a-z])([A-Z])", r"\1 \2", self.asset.name)
        return " ".join(word for word in re.split(r"[^A-Za-z]+", re.sub(r"_[0-9a-f]{8}$", "", words)) if word)

    @cached_property
    def record(self) -> TwinRecord | None:
        """The record of a twin; None for other assets."""
        if self.asset.format != "twin":
            return None
        path = self.asset.path
        return read_record(path if path.is_dir() else path.parent)


def _integrate(mesh: trimesh.Trimesh) -> SurfaceIntegrals:
    """Integrate over triangles exactly (as geometry.mass_properties does), without asking that vertices are shared."""
    origin = mesh.bounds.mean(0)
    corners = (np.asarray(mesh.vertices, float) - origin)[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    areas = np.linalg.norm(normals, axis=1)
    area, total = float(areas.sum()), corners.sum(1)
    center = areas @ total / (3 * max(area, 1e-300))
    second = _second_moment(areas / (12 * max(area, 1e-300)), corners - center, total - 3 * center)
    shell = UniformSolid(0.0, center + origin, inertia_of_second_moment(second))
    volumes = np.einsum("ij,ij->i", corners[:, 0], normals) / 3
    volume = float(volumes.sum())
    if np.linalg.norm(normals.sum(0)) > CLOSED * area or volume <= 0:
        return SurfaceIntegrals(area, None, shell, None)
    mean = volumes @ total / (4 * volume)
    second = _second_moment(volumes / (20 * volume), corners, total) - np.outer(mean, mean)
    return SurfaceIntegrals(area, volume, shell, inertia_of_second_moment(second))


def _second_moment(weights: np.ndarray, corners: np.ndarray, total: np.ndarray) -> np.ndarray:
    points = corners.reshape(-1, 3)
    return points.T @ (np.repeat(weights, 3)[:, None] * points) + total.T @ (weights[:, None] * total)


@dataclass(frozen=True)
class OpenAir:
    """Points in an object's box from which some axis leads outside.

    ``points_m (N, 3)``; ``hollow (N,)``: those in the largest hollow, which the object closes on all sides but ``opens (3,)``;
    None where there is no such hollow. Points that see a wall in every direction count as matter.
    """

    points_m: np.ndarray
    hollow: np.ndarray
    opens: np.ndarray | None


def open_air(mesh: trimesh.Trimesh, up: np.ndarray, hull_volume_m3: float) -> OpenAir:
    """Look along the six axes from random points in a mesh's box; ``up (3,)`` is an axis.

    Works on meshes with seams and on walls without thickness. A hollow that only opens downward is none: scans often
    lack their bottom.
    """
    low, high = mesh.bounds
    points = low + (high - low) * np.random.default_rng(0).random((AIR_SAMPLES, 3))
    escapes = _escapes(mesh, points)
    outside = escapes.any(1)
    points, escapes = points[outside], escapes[outside]
    pit = escapes.sum(1) == 1
    point_m3 = float(np.prod(high - low)) / AIR_SAMPLES
    best, share = None, 0.0
    for index, axis in enumerate(_AXES):
        if float(axis @ up) < -0.5:
            continue
        held = float((pit & escapes[:, index]).sum()) * point_m3 / hull_volume_m3 if hull_volume_m3 > 0 else 0.0
        least = _LEAST_SHARE_UP if float(axis @ up) > 0.5 else _LEAST_SHARE_SIDEWAYS
        if held >= least and held > share:
            best, share = index, held
    if best is None:
        return OpenAir(points, np.zeros(len(points), dtype=bool), None)
    return OpenAir(points, pit & escapes[:, best], _AXES[best])


def _escapes(mesh: trimesh.Trimesh, points: np.ndarray) -> np.ndarray:
    """Tell for points ``(N, 3)`` which of the six axes lead outside, ``(N, 6) bool``.

    Takes the mesh by its indices, unlike ``RayCaster``: the tree over it is most of the cost.
    """
    scene = EmbreeScene()
    vertices = (np.asarray(mesh.vertices) * MILLIMETRES).astype(np.float32)
    surface = TriangleMesh(scene, vertices, np.asarray(mesh.faces).astype(np.int32))
    origins = np.repeat((points * MILLIMETRES).astype(np.float32), len(_AXES), axis=0)
    hits = scene.run(origins, np.tile(_AXES.astype(np.float32), (len(points), 1)))
    del surface  # the scene knows of it, but does not keep it
    return np.asarray(hits < 0).reshape(len(points), len(_AXES))
