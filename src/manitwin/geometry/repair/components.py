"""Connected parts of a mesh, and counting of separate objects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import ConvexHull, Delaunay, QhullError, cKDTree

from manitwin.geometry.repair.halfedges import label_components
from manitwin.geometry.sampling import sample_surface

_POINTS_A_PART = 4000  # surface points besides the vertices: gaps are resolved to about 1/60 of a part's size
_ENCLOSED_SHARE = 0.5  # least share of a part's points inside another's convex hull for being enclosed
_MOST_PARTS = 200  # number of parts compared; parts beyond the largest 200 are specks


@dataclass(frozen=True)
class Part:
    """A connected component of a mesh: its faces, and its shares of the summed area and of the summed convex hull volumes."""

    faces: np.ndarray
    area_share: float
    hull_volume_share: float

    @property
    def share(self) -> float:
        """The larger share: flat objects have area, compact ones volume."""
        return max(self.area_share, self.hull_volume_share)


@dataclass(frozen=True)
class SeparateObjects:
    """The number of separate objects, and of parts too small to be objects.

    ``larger_m (3,)``: by how much the floating small parts enlarge the axis-aligned bounding box of the objects.
    """

    count: int
    specks: int
    larger_m: tuple[float, float, float] = (0.0, 0.0, 0.0)


def connected_parts(mesh: trimesh.Trimesh) -> list[Part]:
    """Return the parts of a mesh that share no vertices, largest hull first."""
    faces = np.asarray(mesh.faces)
    labels = label_components(len(mesh.vertices), faces[:, :2].ravel(), faces[:, 1:].ravel())[faces[:, 0]]
    _, labels = np.unique(labels, return_inverse=True)
    groups = np.split(np.argsort(labels, kind="stable"), np.cumsum(np.bincount(labels))[:-1])
    areas = np.array([mesh.area_faces[group].sum() for group in groups])
    hulls = np.array([_hull_volume(mesh.vertices[np.unique(faces[group])]) for group in groups])
    tiny = np.finfo(float).tiny
    parts = [
        Part(group, float(area / max(areas.sum(), tiny)), float(hull / max(hulls.sum(), tiny)))
        for group, area, hull in zip(groups, areas, hulls, strict=True)
    ]
    return sorted(parts, key=lambda part: (-part.hull_volume_share, -part.area_share, int(part.faces[0])))


def separate_objects(
    mesh: trimesh.Trimesh, *, gap_m: float, object_share: float, rng: np.random.Generator
) -> SeparateObjects:
    """Count the separate objects in a mesh.

    Parts belong to one object if they touch, come within ``gap_m`` of each other, or lie mostly inside one another's convex
    hull (pads of a headset, screws, a lid over a pot). A group with less than ``object_share`` of the summed area and of the
    summed hull volumes counts as specks; if all groups are that small, each is an object (a plate of game pieces).
    """
    every = connected_parts(mesh)
    parts = sorted(every, key=lambda part: -part.share)[:_MOST_PARTS]
    groups = _groups(mesh, parts, gap_m, rng)
    is_thing = [
        max(sum(parts[i].area_share for i in group), sum(parts[i].hull_volume_share for i in group)) >= object_share
        for group in groups
    ]
    if not any(is_thing):
        is_thing = [True] * len(groups)
    crumbs = [i for group, thing in zip(groups, is_thing, strict=True) if not thing for i in group]
    things = [i for group, thing in zip(groups, is_thing, strict=True) if thing for i in group]
    larger_m = _box(mesh, parts, things + crumbs) - _box(mesh, parts, things)
    x, y, z = larger_m.tolist()
    return SeparateObjects(sum(is_thing), len(every) - len(parts) + len(crumbs), (x, y, z))


def _box(mesh: trimesh.Trimesh, parts: list[Part], chosen: list[int]) -> np.ndarray:
    """Return the sides ``(3,)`` of the box along the axes around some of the parts."""
    faces = np.concatenate([parts[i].faces for i in chosen])
    return np.asarray(np.ptp(mesh.vertices[mesh.faces[faces].ravel()], axis=0))


def _groups(mesh: trimesh.Trimesh, parts: list[Part], gap_m: float, rng: np.random.Generator) -> list[list[int]]:
    """Group parts, as indices into ``parts``; gaps are measured between vertices and surface samples."""
    if len(parts) == 1:
        return [[0]]
    clouds = []
    for part in parts:
        piece = trimesh.Trimesh(mesh.vertices, mesh.faces[part.faces], process=False)
        samples = sample_surface(piece, _POINTS_A_PART, rng)[0] if piece.area > 0 else np.empty((0, 3))
        clouds.append(np.concatenate((mesh.vertices[np.unique(piece.faces)], samples)))
    trees = [cKDTree(cloud) for cloud in clouds]
    links = [
        (i, j)
        for i in range(len(parts))
        for j in range(i + 1, len(parts))
        if _near(trees[i], trees[j], gap_m) or _enclosed(clouds[j], clouds[i]) or _enclosed(clouds[i], clouds[j])
    ]
    pairs = np.array(links, dtype=np.int64).reshape(-1, 2)
    labels = label_components(len(parts), pairs[:, 0], pairs[:, 1])
    return [np.flatnonzero(labels == label).tolist() for label in range(int(labels.max()) + 1)]


def _hull_volume(points: np.ndarray) -> float:
    """Return the volume of the convex hull; 0.0 for flat sets."""
    try:
        return float(ConvexHull(points).volume)
    except (QhullError, ValueError):
        return 0.0


def _near(a: cKDTree, b: cKDTree, gap_m: float) -> bool:
    if (a.mins - gap_m > b.maxes).any() or (b.mins - gap_m > a.maxes).any():
        return False
    return bool(np.isfinite(a.query(b.data, distance_upper_bound=gap_m)[0]).any())


def _enclosed(inner: np.ndarray, outer: np.ndarray) -> bool:
    """Return whether most of ``inner`` lies inside the convex hull of ``outer``."""
    in_box = ((inner >= outer.min(0)) & (inner <= outer.max(0))).all(1)
    if in_box.mean() < _ENCLOSED_SHARE:
        return False
    try:
        hull = Delaunay(outer[ConvexHull(outer).vertices])
    except QhullError:
        return False
    return bool((hull.find_simplex(inner) >= 0).mean() >= _ENCLOSED_SHARE)
