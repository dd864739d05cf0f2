"""Closed surface with texture coordinates: cuts that keep it closed, and resting poses on a flat base or back."""

from __future__ import annotations

from dataclasses import dataclass

import manifold3d
import numpy as np
import trimesh
from scipy.spatial import ConvexHull, QhullError

from manitwin.geometry.boxes import turn_to_sides

GRAZING_COSINE = 0.3
"""At this angle (73 degrees) a pixel of the photo is three and a half times as long as wide on the surface."""
UPRIGHT_TIP_ANGLE_DEG = 8.0  # minimum tip angle of an object that stands in the photo
TILTED_TIP_ANGLE_DEG = 15.0  # an object that does not stand in the photo must be more stable to be set upright
_CUTS = (0.015, 0.03, 0.05, 0.08)  # shares of the height at which a flat base is tried
# up to where both head and handle of a thin object with a thick head touch the ground
_LYING_CUTS = (0.03, 0.06, 0.1, 0.15, 0.2, 0.25, 0.3)
UPRIGHT_TO_LYING = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
"""Rotation that turns the direction towards the camera up: (x, y, z) -> (x, z, -y)."""


@dataclass(frozen=True)
class LiftedSurface:
    """A closed triangle mesh: ``vertices (V, 3)``, ``faces (F, 3)`` wound outward, ``uv (V, 2)`` (v upward).

    x is to the right of the photo, y up, z towards the camera, in pixels of the mask until scaled. Every vertex has one
    texture coordinate, of the photo projected along z, so there are no seams. ``facing (V,)`` is the cosine of the viewing
    angle: 1 for a frontal view, 0 on the outline, -1 where the photo cannot show the surface.
    """

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray
    facing: np.ndarray

    def visible_faces(self) -> np.ndarray:
        """Return for each face (F,) whether the photo shows it; faces with a corner at a grazing angle count as unseen."""
        return np.asarray(self.facing[self.faces].min(axis=1) > GRAZING_COSINE)

    def moved(self, matrix: np.ndarray, offset: np.ndarray) -> LiftedSurface:
        """Return the surface under ``x -> matrix @ x + offset``; ``matrix`` must not mirror."""
        return LiftedSurface(self.vertices @ matrix.T + offset, self.faces, self.uv, self.facing)


def bare_mesh(surface: LiftedSurface) -> trimesh.Trimesh:
    """Return the geometry without texture."""
    return trimesh.Trimesh(surface.vertices, surface.faces, process=False)


def unseen_share(surface: LiftedSurface) -> float:
    """Return the share of the area that the photo does not show."""
    a, b, c = (surface.vertices[surface.faces[:, corner]] for corner in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return float(areas[~surface.visible_faces()].sum() / areas.sum())


def to_manifold(surface: LiftedSurface) -> manifold3d.Manifold:
    """Return the solid; raises ValueError with manifold3d's status if the surface is not closed."""
    properties = np.column_stack([surface.vertices, surface.uv, surface.facing]).astype(np.float32)
    solid = manifold3d.Manifold(manifold3d.Mesh(properties, surface.faces.astype(np.uint32)))
    if solid.status() != manifold3d.Error.NoError:
        raise ValueError(f"the lifted surface is not a solid: {solid.status().name}")
    return solid


def from_manifold(solid: manifold3d.Manifold) -> LiftedSurface:
    """Return the largest part of a solid as a surface."""
    parts = solid.decompose()
    largest = max(parts, key=lambda part: part.volume()) if parts else solid
    mesh = largest.to_mesh()
    properties = np.asarray(mesh.vert_properties, float)
    # merges the vertices that a cut duplicates on its edge; their properties are equal
    target = np.arange(len(properties))
    target[np.asarray(mesh.merge_from_vert, np.int64)] = np.asarray(mesh.merge_to_vert, np.int64)
    used, faces = np.unique(target[np.asarray(mesh.tri_verts, np.int64)], return_inverse=True)
    return LiftedSurface(properties[used, :3], faces.reshape(-1, 3), properties[used, 3:5], properties[used, 5])


def cut_below(surface: LiftedSurface, axis: int, level: float) -> LiftedSurface:
    """Cut off the part below ``level`` along a coordinate axis; a flat face closes the cut."""
    normal = np.zeros(3)
    normal[axis] = 1.0
    return from_manifold(to_manifold(surface).trim_by_plane(normal.tolist(), float(level)))


def tip_angle_deg(surface: LiftedSurface) -> float:
    """Return the slope at which a solid on its lowest face (along y) tips over; 0 if it does not stand."""
    low = surface.vertices[:, 1].min()
    height = float(np.ptp(surface.vertices[:, 1]))
    feet = surface.vertices[surface.vertices[:, 1] < low + 1e-3 * height][:, [0, 2]]
    center = center_of_volume(surface)
    try:
        support = ConvexHull(feet)
    except (QhullError, ValueError):  # fewer than three contact points, or all on a line
        return 0.0
    margin = -(support.equations[:, :2] @ center[[0, 2]] + support.equations[:, 2]).max()
    return float(np.degrees(np.arctan2(margin, center[1] - low)))


def center_of_volume(surface: LiftedSurface) -> np.ndarray:
    """Return the centroid (3,) of the solid."""
    corners = surface.vertices[surface.faces]
    volumes = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return (corners.sum(axis=1) * volumes[:, None]).sum(axis=0) / (4 * volumes.sum())


def cut_standing_base(
    surface: LiftedSurface, least_angle_deg: float, cuts: tuple[float, ...] = _CUTS
) -> LiftedSurface | None:
    """Cut the smallest flat base with which the solid stands (along y); None if it tips over with all cuts."""
    low, height = surface.vertices[:, 1].min(), float(np.ptp(surface.vertices[:, 1]))
    for share in cuts:
        cut = cut_below(surface, 1, low + share * height)
        if tip_angle_deg(cut) >= least_angle_deg:
            return cut
    return None


def lay_on_back(surface: LiftedSurface) -> LiftedSurface:
    """Lay a relief with a flat back on that back, front upward."""
    return surface.moved(UPRIGHT_TO_LYING, np.zeros(3))


def lay_on_facet(surface: LiftedSurface) -> LiftedSurface:
    """Lay a round solid down, front upward, with a facet along its underside so that it does not roll."""
    lying = lay_on_back(surface)
    flattened = cut_standing_base(lying, UPRIGHT_TIP_ANGLE_DEG, _LYING_CUTS)
    if flattened is not None:
        return flattened
    low, height = lying.vertices[:, 1].min(), float(np.ptp(lying.vertices[:, 1]))
    return cut_below(lying, 1, low + _LYING_CUTS[-1] * height)


def align_footprint(surface: LiftedSurface) -> LiftedSurface:
    """Rotate a lying object about the vertical, by at most 45 degrees, so that its sides seen from above are along x and z.

    A photo shows a lying object at any angle; after the rotation, extents along the axes are its length and width.
    """
    cosine, sine = turn_to_sides(surface.vertices[:, [0, 2]])
    return surface.moved(np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]), np.zeros(3))


def normalised(surface: LiftedSurface) -> LiftedSurface:
    """Scale the longest side to 1, centre the footprint and put the lowest point at y = 0."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    scale = 1.0 / float((high - low).max())
    offset = -scale * np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    return surface.moved(scale * np.eye(3), offset)


def assert_solid(surface: LiftedSurface) -> None:
    """Raise ValueError unless the surface bounds a single solid of positive volume."""
    solid = to_manifold(surface)
    if solid.volume() <= 0:
        raise ValueError("the lifted surface is inside out")
    if len(solid.decompose()) != 1:
        raise ValueError("the lifted surface has several parts")
