"""Measurements of an asset that several rules share, computed lazily and once."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from manitwin.assets.asset import Asset
from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.convex_shapes import ConvexShapes, UniformSolid, inertia_of_second_moment
from manitwin.assets.audit.open_air import FreeSpace, sample_free_space
from manitwin.geometry.distance import closest_points_on_triangles, distance_to_surface
from manitwin.geometry.sampling import sample_surface
from manitwin.models.annotators.prior_names import find_prior, found_by
from manitwin.models.annotators.prior_records import Prior
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import read_record

SURFACE_SAMPLES = 3000
"""Points on the visual surface: some 4 mm apart on a hand-sized object."""

FEW = 40
"""Up to this many points are measured individually, because building a tree over all triangles costs as much."""

Measure = TypeVar("Measure")

CLOSED = 1e-3
"""The area vectors of a closed surface sum to zero; up to this share of the area, a surface counts as closed."""


@dataclass(frozen=True)
class SurfaceIntegrals:
    """Exact integrals over a surface: area, enclosed volume (None if open), and a thin uniform shell of one kilogram."""

    area_m2: float
    volume_m3: float | None
    shell: UniformSolid
    solid_inertia_per_kg_m2: np.ndarray | None


@dataclass
class MeasuredAsset:
    """Measurements of one asset, in its own axes and metres; ``engines`` are those to simulate it in.

    ``as_drawn``: collision meshes collide with their triangles, as in Gazebo. ``root``: the folder below which the files that
    the asset names are read.
    """

    asset: Asset
    engines: tuple[str, ...] = ()
    as_drawn: bool = False
    root: Path | None = None
    _kept: dict[Callable[..., Any], Any] = field(default_factory=dict)

    def measure_once(self, measure: Callable[[MeasuredAsset], Measure]) -> Measure:
        """Return the measurement of a function on the asset, computed once."""
        if measure not in self._kept:
            self._kept[measure] = measure(self)
        kept: Measure = self._kept[measure]
        return kept

    def complaints(self, check: Callable[[MeasuredAsset], Iterator[Complaint]]) -> list[Complaint]:
        """Return the complaints of a check, computed once; rules use them to stay silent on consequences of another defect."""
        if check not in self._kept:
            self._kept[check] = list(check(self))
        kept: list[Complaint] = self._kept[check]
        return kept

    @cached_property
    def visual(self) -> trimesh.Trimesh | None:
        """All visual parts as one mesh, None if there are none."""
        parts = [part for part in self.asset.visual if len(part.faces)]
        if not parts:
            return None
        vertices, faces = trimesh.util.append_faces([p.vertices for p in parts], [p.faces for p in parts])
        return trimesh.Trimesh(vertices, faces, process=False)

    @cached_property
    def collision(self) -> trimesh.Trimesh | None:
        """All collision shapes as given, as one mesh; None if there are none."""
        shapes = [shape for shape in self.asset.collision if len(shape.faces)]
        if not shapes:
            return None
        vertices, faces = trimesh.util.append_faces([s.vertices for s in shapes], [s.faces for s in shapes])
        return trimesh.Trimesh(vertices, faces, process=False)

    @cached_property
    def body(self) -> trimesh.Trimesh | None:
        """The visual mesh, or the collision shapes if there is none."""
        return self.visual if self.visual is not None else self.collision

    @cached_property
    def bounds(self) -> np.ndarray | None:
        """The axis-aligned bounds ``(2, 3)`` of the visual mesh, or else of the collision shapes."""
        return None if self.body is None else np.asarray(self.body.bounds)

    @cached_property
    def longest_m(self) -> float:
        """The longest side of the bounds, 0 without geometry."""
        return 0.0 if self.bounds is None else float(np.ptp(self.bounds, axis=0).max())

    @cached_property
    def up(self) -> np.ndarray:
        """The vertical axis ``(3,)``."""
        return np.array([0.0, 1, 0]) if self.asset.up == "y" else np.array([0.0, 0, 1])

    @cached_property
    def lowest_m(self) -> float:
        """The lowest coordinate along the up axis."""
        assert self.bounds is not None, "asked of an asset without geometry"
        return float(self.bounds[0] @ self.up)

    @cached_property
    def hull(self) -> ConvexShapes:
        """The convex hull of the body: one shape, or none if it is flat."""
        return ConvexShapes.from_vertices([] if self.body is None else [np.asarray(self.body.vertices, float)])

    @cached_property
    def shapes(self) -> ConvexShapes:
        """The convex hulls of the collision shapes."""
        return ConvexShapes.from_vertices([np.asarray(shape.vertices, float) for shape in self.asset.collision])

    @cached_property
    def surface(self) -> SurfaceIntegrals | None:
        """Integrals over the surface of the body; None without geometry."""
        return None if self.body is None else _integrate(self.body)

    @cached_property
    def samples(self) -> np.ndarray:
        """Points on the surface of the body ``(N, 3)``, uniform by area and deterministic."""
        if self.body is None or float(self.body.area) <= 0:
            return np.zeros((0, 3))
        return sample_surface(self.body, SURFACE_SAMPLES, np.random.default_rng(0))[0]

    @cached_property
    def spacing_m(self) -> float:
        """The mean distance between neighbouring samples."""
        return (
            float(np.sqrt(self.body.area / len(self.samples))) if self.body is not None and len(self.samples) else 0.0
        )

    @cached_property
    def _near(self) -> cKDTree:
        return cKDTree(self.samples)

    def distance_m(self, points: np.ndarray, exact_beyond_m: float) -> np.ndarray:
        """Return the distances of points ``(N, 3)`` to the surface of the body.

        They are distances to the samples; those above ``exact_beyond_m`` are computed exactly.
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
        """Bounding spheres of the triangles of the body: centres ``(F, 3)`` and radii ``(F,)``."""
        assert self.body is not None
        corners = np.asarray(self.body.triangles)
        centers = corners.mean(1)
        return centers, np.sqrt(((corners - centers[:, None]) ** 2).sum(2).max(1))

    def _exact_distance(self, point: np.ndarray, bound_m: float) -> float:
        """Return the distance of one point to the body, over the triangles whose bounding spheres are within the bound."""
        assert self.body is not None
        centers, radii = self._balls
        near = np.flatnonzero(np.linalg.norm(centers - point, axis=1) - radii <= bound_m)
        corners = np.asarray(self.body.triangles)[near]
        closest, _ = closest_points_on_triangles(np.repeat(point[None], len(near), axis=0), corners)
        return min(bound_m, float(np.linalg.norm(closest - point, axis=1).min()))

    @cached_property
    def free_space(self) -> FreeSpace | None:
        """The free space in the bounding box of the visual mesh; None without one."""
        if self.visual is None or not len(self.hull):
            return None
        return sample_free_space(self.visual, self.up, float(self.hull.volumes_m3.sum()))

    @cached_property
    def prior(self) -> Prior | None:
        """The prior of the asset's category, or of its name; None if unknown."""
        # the name of a robot, such as Bolt, says nothing about one of its parts
        of_name = None if self.asset.partial else _prior_of_name(self._name_in_words)
        return find_prior(self.asset.category) or of_name

    @cached_property
    def material_words(self) -> str:
        """The declared material in lower case; the name of the asset if none is declared."""
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


def _prior_of_name(words: str) -> Prior | None:
    """Return the prior that a name matches, None if the matching word is ambiguous: a plane need not be a toy aeroplane.

    The matching words must end with the last word of the category, which excludes other names of the category.
    """
    found = found_by(words)
    if found is None:
        return None
    prior, word = found
    toy = prior.category.startswith("toy ") and "toy" not in words.lower().split()
    wider = word != prior.category and (prior.category.endswith(word) or word.split()[-1] != prior.category.split()[-1])
    return None if toy or wider else prior


def _integrate(mesh: trimesh.Trimesh) -> SurfaceIntegrals:
    """Integrate over triangles exactly (as geometry.mass_properties does), without requiring shared vertices."""
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
