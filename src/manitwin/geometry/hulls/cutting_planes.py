"""Candidate cutting planes for a part of a solid, ranked by the hull volume that remains after the cut."""

from __future__ import annotations

from collections.abc import Sequence

import manifold3d
import numpy as np

from manitwin.geometry.cavity import Opening

_COARSE_SHARE = 7e-3  # fraction of a part's longest side: finer detail does not affect the choice of plane
_POSITIONS = (0.2, 0.5, 0.8)  # fractions of a part's width along a cutting normal
_MORE_POSITIONS = (0.1, 0.35, 0.65, 0.9)  # along the two normals with the best first positions


class CoarsePart:
    """The vertices and edges of a simplified part, on which cutting planes are compared."""

    def __init__(self, solid: manifold3d.Manifold, extents_m: np.ndarray):
        """Simplify a part's solid with axis-aligned extents ``(3,)``."""
        coarse = solid.simplify(_COARSE_SHARE * float(extents_m.max()))
        kept = coarse.status() == manifold3d.Error.NoError and not coarse.is_empty()
        self.vertices, triangles = surface_of(coarse if kept else solid)
        edges = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        once = edges[:, 0] < edges[:, 1]  # a closed surface has every edge in both directions
        self.starts, self.ends = edges[once, 0], edges[once, 1]

    def hull_volume_after(self, normal: np.ndarray, offset: float) -> float:
        """Return the summed hull volumes of both sides of a plane; infinity if the plane misses the part."""
        return self._hull_volume_after(self.vertices @ normal - offset)

    def _hull_volume_after(self, height: np.ndarray) -> float:
        below = height < 0
        crossing = np.flatnonzero(below.take(self.starts) != below.take(self.ends))
        if not len(crossing):
            return np.inf
        start, end = self.starts.take(crossing), self.ends.take(crossing)
        high, first = height.take(start), self.vertices.take(start, axis=0)
        along = (high / (high - height.take(end)))[:, None]
        section = first + along * (self.vertices.take(end, axis=0) - first)
        sides = (np.concatenate([self.vertices.compress(side, axis=0), section]) for side in (below, ~below))
        # manifold3d's hull is faster; its error of up to some per cent on nearly flat clouds is acceptable for ranking
        return sum(float(manifold3d.Manifold.hull_points(side).volume()) for side in sides)

    def cuts_across(self, normal: np.ndarray, positions: Sequence[float]) -> list[tuple[float, float]]:
        """Return (summed hull volumes after, offset) of cuts at positions in [0, 1] of the part's width."""
        along = self.vertices @ normal
        low, high = float(along.min()), float(along.max())
        offsets = [low + (high - low) * position for position in positions]
        return [(self._hull_volume_after(along - offset), offset) for offset in offsets]


def best_plane(part: CoarsePart, opening: Opening | None) -> tuple[float, np.ndarray, float]:
    """Return the summed hull volumes (m^3) after the best cut, and its plane as normal ``(3,)`` and offset (m).

    The candidates are planes perpendicular to the object's and the part's axes, and planes through the vessel's axis.
    """
    normals = own_and_principal_axes(part.vertices)
    first = [part.cuts_across(normal, _POSITIONS) for normal in normals]
    leading = sorted(range(len(normals)), key=lambda index: (min(first[index])[0], index))[:2]
    axis = np.array([0.0, 0, 1]) if opening is None else opening.axis
    center = part.vertices.mean(0) if opening is None else opening.center_m
    cuts = [(*cut, normal) for normal, tried in zip(normals, first, strict=True) for cut in tried]
    cuts += [(*cut, normals[index]) for index in leading for cut in part.cuts_across(normals[index], _MORE_POSITIONS)]
    for normal in _sector_normals(part.vertices - center, axis):
        offset = float(normal @ center)
        cuts.append((part.hull_volume_after(normal, offset), offset, normal))
    total, offset, normal = min(cuts, key=lambda cut: cut[0])
    return total, normal, offset


def own_and_principal_axes(vertices: np.ndarray) -> list[np.ndarray]:
    """Return the object's axes and the principal axes of vertices ``(V, 3)`` that do not coincide with them, each ``(3,)``."""
    centered = vertices - vertices.mean(0)
    principal = np.linalg.eigh(np.einsum("ni,nj->ij", centered, centered))[1].T
    return [*np.eye(3), *(axis for axis in principal if np.abs(axis).max() < 0.995)]


def _sector_normals(offsets: np.ndarray, axis: np.ndarray) -> list[np.ndarray]:
    """Return normals of planes through the axis that divide the angular span of a part about it into quarters.

    ``offsets (V, 3)`` are the part's vertices relative to a point on the axis. A plane cuts a full ring twice, so that for it
    half a turn is divided.
    """
    first, second = normal_across(axis, np.pi / 2), -normal_across(axis, 0.0)
    angles = np.sort(np.arctan2(offsets @ second, offsets @ first))
    gaps = np.append(np.diff(angles), angles[0] + 2 * np.pi - angles[-1])
    widest = int(gaps.argmax())
    start, span = angles[(widest + 1) % len(angles)], 2 * np.pi - gaps[widest]
    shares = (0.25, 0.5, 0.75) if span < 1.2 * np.pi else (0.125, 0.25, 0.375, 0.5)
    return [normal_across(axis, start + span * share) for share in shares]


def normal_across(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the unit normal of the plane that contains ``axis`` and is rotated by ``angle`` about it."""
    first = np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
    first /= np.linalg.norm(first)
    return -np.sin(angle) * first + np.cos(angle) * np.cross(axis, first)


def surface_of(solid: manifold3d.Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices ``(V, 3)`` and triangles ``(F, 3)`` of a solid's surface."""
    surface = solid.to_mesh64()
    return np.asarray(surface.vert_properties)[:, :3], np.asarray(surface.tri_verts, dtype=np.int64)
