"""Residual between a drawn solid and a photo: silhouette, inner edges, shading and part colours."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from manitwin.models.generators.templates.fitting.drawing import silhouette, to_pixels, visible_faces
from manitwin.models.generators.templates.fitting.evidence import (
    BOX_SHARE,
    OVERSAMPLING,
    REACH,
    SIDE_PX,
    Evidence,
    signed_distance,
)
from manitwin.models.generators.templates.fitting.shape import CoarseSolid
from manitwin.models.generators.templates.fitting.view import View

_CREASE_COSINE = 0.82  # neighbouring pixels with normals more than 35 degrees apart form an edge
_LEAST_EDGE_PX = 12
_LEAST_SEEN_PX = 4
_INWARD = frozenset({"inside", "base", "underside", "foot", "holes"})  # parts that are usually hidden
_RIDGE = 2.0
_LIGHTNESS_SHARE = 0.7


@dataclass(frozen=True)
class Residual:
    """Residual between a solid and a photo.

    - ``iou`` and ``outline``: silhouette overlap, and mean distance of both contours over the object's longer side.
    - ``edges``: share of the solid's inner edges without an edge in the photo.
    - ``shading``: share of the colour variation not explained by normals and parts.
    - ``hidden``: share of the surface in invisible parts, since a part without any trace in the photo is less likely.
    - ``edge_px``: number of inner edge pixels.
    """

    iou: float
    outline: float
    edges: float
    shading: float
    hidden: float
    edge_px: int

    @property
    def outline_cost(self) -> float:
        """The silhouette and edge terms of ``cost``."""
        return (1 - self.iou) + 6.0 * self.outline + 0.10 * self.edges

    @property
    def cost(self) -> float:
        """The weighted sum by which fits are compared."""
        return self.outline_cost + 0.15 * self.shading + 0.15 * self.hidden


def outline_difference(solid: CoarseSolid, view: View, evidence: Evidence) -> np.ndarray:
    """Return the differences ``(N,)`` of the signed distances to both contours, the residual vector of the fit."""
    flat, _ = view.project(solid.vertices)
    drawn = silhouette(
        to_pixels(flat, OVERSAMPLING * SIDE_PX, BOX_SHARE), solid.faces, solid.edges, OVERSAMPLING * SIDE_PX
    )
    seen = evidence.for_comparison(perforated=solid.perforated)
    return np.asarray((signed_distance(drawn) - seen.outline).ravel())


def iou(mask: np.ndarray, evidence: Evidence) -> float:
    """Return the intersection over union of a mask and the photo's."""
    drawn = mask > 0
    return float((drawn & evidence.mask).sum() / max(1, (drawn | evidence.mask).sum()))


def residual(solid: CoarseSolid, view: View, evidence: Evidence) -> Residual:
    """Return the residual of a solid under a view."""
    evidence = evidence.for_comparison(perforated=solid.perforated)
    flat, distance = view.project(solid.vertices)
    pixels = to_pixels(flat, OVERSAMPLING * SIDE_PX, BOX_SHARE)
    face = visible_faces(pixels, distance, solid.faces, OVERSAMPLING * SIDE_PX)[::OVERSAMPLING, ::OVERSAMPLING]
    drawn = silhouette(to_pixels(flat, SIDE_PX, BOX_SHARE), solid.faces, solid.edges, SIDE_PX)
    normals = (solid.normals @ view.object_to_camera.T).astype(np.float32)[face]
    part = np.where(face >= 0, solid.part[face], -1)
    edges, count = _edges(normals, part, drawn, evidence)
    return Residual(
        iou=iou(drawn, evidence),
        outline=_outline_distance(drawn, evidence),
        edges=edges,
        shading=_unexplained_shading(normals, part, drawn, evidence),
        hidden=_hidden(solid, part),
        edge_px=count,
    )


def _hidden(solid: CoarseSolid, part: np.ndarray) -> float:
    seen = np.bincount(part[part >= 0], minlength=len(solid.names)) >= _LEAST_SEEN_PX
    inward = np.array([name in _INWARD for name in solid.names])
    return float(solid.areas[~(seen | inward)[solid.part]].sum() / solid.areas.sum())


def _outline_distance(drawn: np.ndarray, evidence: Evidence) -> float:
    """Return the mean symmetric distance of the contours, truncated at the reach, over the object's longer side."""
    inside = evidence.mask.astype(np.uint8)
    cross = np.ones((3, 3), np.uint8)
    here, there = drawn - cv2.erode(drawn, cross), inside - cv2.erode(inside, cross)
    if not here.any():
        return 1.0
    away_here, away_there = (cv2.distanceTransform(1 - rim, cv2.DIST_L2, 3) for rim in (here, there))
    limit = REACH * SIDE_PX
    mean = np.minimum(away_there[here > 0], limit).mean() + np.minimum(away_here[there > 0], limit).mean()
    return float(mean / 2 / (BOX_SHARE * SIDE_PX))


def _edges(normals: np.ndarray, part: np.ndarray, drawn: np.ndarray, evidence: Evidence) -> tuple[float, int]:
    """Return the share of inner edges without an edge in the photo, and the number of edge pixels."""
    inner = (cv2.erode(drawn, np.ones((5, 5), np.uint8)) > 0) & evidence.inner
    edge = np.zeros(drawn.shape, bool)
    for axis in (0, 1):
        here, there = (slice(None, -1), slice(None)), (slice(1, None), slice(None))
        if axis == 1:
            here, there = here[::-1], there[::-1]
        crease = (normals[here] * normals[there]).sum(axis=-1) < _CREASE_COSINE
        edge[here] |= crease | (part[here] != part[there])
    edge &= inner
    count = int(edge.sum())
    missing = float(1 - evidence.edge[edge].mean()) if count else 1.0
    # Regularize: few pixels are weak evidence and are mixed with neutral ones.
    return (count * missing + _LEAST_EDGE_PX * 0.7) / (count + _LEAST_EDGE_PX), count


def _unexplained_shading(normals: np.ndarray, part: np.ndarray, drawn: np.ndarray, evidence: Evidence) -> float:
    """Return the share of the colour variation that remains after a linear model of the normals per part."""
    both = ((drawn > 0) & evidence.inner)[::2, ::2]
    colours = evidence.lab[::2, ::2][both].astype(np.float64) * (_LIGHTNESS_SHARE, 1.0, 1.0)
    if len(colours) < 30:
        return 1.0
    colours -= np.median(colours, axis=0)
    parts, shading = part[::2, ::2][both], normals[::2, ::2][both].astype(np.float64)
    left = 0.0
    for one in np.unique(parts):
        own = parts == one
        some, count = colours[own], int(own.sum())
        features = np.column_stack([np.ones(count), shading[own], shading[own, 0] ** 2, shading[own, 1] ** 2])
        gram = features.T @ features + _RIDGE * np.diag([0.0, 1, 1, 1, 1, 1]) + 1e-6 * np.eye(6)
        fitted = features @ np.linalg.solve(gram, features.T @ some)
        left += float(np.abs(some - fitted).sum())
    # Absolute rather than squared differences, so that printed labels do not dominate.
    return min(1.0, left / max(float(np.abs(colours).sum()), 2.0 * len(colours)))
