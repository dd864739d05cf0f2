"""An asset with what many rules measure of it, each once and only when asked for."""

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
from manitwin.assets.audit.open_air import OpenAir, open_air
from manitwin.geometry.distance import closest_points_on_triangles, distance_to_surface
from manitwin.geometry.sampling import sample_surface
from manitwin.models.annotators.prior_names import found_by, lookup
from manitwin.models.annotators.prior_records import Prior
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import read_record

SURFACE_SAMPLES = 3000
"""Points on the visual surface: some 4 mm apart on an object of a hand's size."""

FEW = 40
"""Up to so many points are measured one by one: to build a tree over all triangles costs as much."""

Measure = TypeVar("Measure")

CLOSED = 1e-3
"""The sum of the area vectors of a closed surface is zero; up to this share of the area it counts as closed."""


@dataclass(frozen=True)
class SurfaceIntegrals:
    """Exact integrals over a surface: area, enclosed volume (None: not closed), a thin even shell of one kilogram."""

    area_m2: float
    volume_m3: float | None
    shell: UniformSolid
    solid_inertia_per_kg_m2: np.ndarray | None


@dataclass
class MeasuredAsset:
    """Measurements of one asset, in its own axes and metres; ``engines`` are those that it is to be run in.

    ``as_drawn``: meshes that collide do so with their triangles, as they do in Gazebo. ``root``: the folder below which the files
    that the asset names are read.
    """

    asset: Asset
    engines: tuple[str, ...] = ()
    as_drawn: bool = False
    root: Path | None = None
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
        of_name = None if self.asset.partial else _prior_of_name(self._name_in_words)  # a Bolt that walks is no bolt
        return lookup(self.asset.category) or of_name

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


def _prior_of_name(words: str) -> Prior | None:
    """Return the prior of what a name says, None where its word is wider: a plane is no aeroplane, and a tile no domino.

    What it is found by has to end with the category's own word, which other names of the category do not.
    """
    found = found_by(words)
    if found is None:
        return None
    prior, word = found
    toy = prior.category.startswith("toy ") and "toy" not in words.lower().split()
    wider = word != prior.category and (prior.category.endswith(word) or word.split()[-1] != prior.category.split()[-1])
    return None if toy or wider else prior


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
