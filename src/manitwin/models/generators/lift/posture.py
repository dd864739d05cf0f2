"""The rest of a lifted thing: standing on a flat base, or lying on a flat back."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from manitwin.models.generators.lift.surface import LiftedSurface, cut_below, to_manifold

UPRIGHT_TIP_ANGLE_DEG = 8.0  # what stands in the photo and would not fall at this slope
TILTED_TIP_ANGLE_DEG = 15.0  # what does not stand in the photo must be steadier to be set upright
_CUTS = (0.015, 0.03, 0.05, 0.08)  # shares of the height tried for a flat base
_LYING_CUTS = (0.03, 0.06, 0.1, 0.15, 0.2, 0.25, 0.3)  # a thick head of a thin thing is cut down to where both touch
LYING = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
"""Turns the direction towards the camera up: (x, y, z) -> (x, z, -y)."""


def tip_angle_deg(surface: LiftedSurface) -> float:
    """Return the slope at which a solid standing on its lowest face (along y) tips over; 0 where it does not stand."""
    low = surface.vertices[:, 1].min()
    height = float(np.ptp(surface.vertices[:, 1]))
    feet = surface.vertices[surface.vertices[:, 1] < low + 1e-3 * height][:, [0, 2]]
    center = center_of_volume(surface)
    try:
        support = ConvexHull(feet)
    except (QhullError, ValueError):  # fewer than three feet, or all on a line
        return 0.0
    margin = -(support.equations[:, :2] @ center[[0, 2]] + support.equations[:, 2]).max()
    return float(np.degrees(np.arctan2(margin, center[1] - low)))


def center_of_volume(surface: LiftedSurface) -> np.ndarray:
    """Return the centroid (3,) of the solid."""
    corners = surface.vertices[surface.faces]
    volumes = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return (corners.sum(axis=1) * volumes[:, None]).sum(axis=0) / (4 * volumes.sum())


def stood(surface: LiftedSurface, least_angle_deg: float, cuts: tuple[float, ...] = _CUTS) -> LiftedSurface | None:
    """Cut a flat base just as high as the solid needs to stand (along y); None where it would tip all the same."""
    low, height = surface.vertices[:, 1].min(), float(np.ptp(surface.vertices[:, 1]))
    for share in cuts:
        cut = cut_below(surface, 1, low + share * height)
        if tip_angle_deg(cut) >= least_angle_deg:
            return cut
    return None


def laid(surface: LiftedSurface) -> LiftedSurface:
    """Turn a relief with a flat back so that it lies on it, its front upward."""
    return surface.moved(LYING, np.zeros(3))


def laid_round(surface: LiftedSurface) -> LiftedSurface:
    """Lay a round solid down, front upward, with a facet along its underside: it does not roll."""
    lying = laid(surface)
    flattened = stood(lying, UPRIGHT_TIP_ANGLE_DEG, _LYING_CUTS)
    if flattened is not None:
        return flattened
    low, height = lying.vertices[:, 1].min(), float(np.ptp(lying.vertices[:, 1]))
    return cut_below(lying, 1, low + _LYING_CUTS[-1] * height)


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
