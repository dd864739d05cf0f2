"""Frames of edges: the straight line at which a thin plate ends, such as that of a blade or spatula."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from manitwin.geometry.frames.feature import FeatureFrame, Found, FramedMesh, NoFrame, rotation_of

_ANGLE_COSINE = np.cos(np.radians(40))  # outline normals this close to a side's belong to that side
_CELLS = 96  # along the longer side of the plate's outline
_FLAT = 0.28  # largest ratio of thickness to second spread (standard deviations) of a plate
_THIN_FACTOR = 1.6  # times the thickness of the plate at the point; thicker material is another part
_STRAIGHT_SHARE = 0.12  # fraction of the length: tolerated deviation of an edge from its chord
_CLEAR = 1.08  # least ratio of the best side's score to the next
_REACH_SHARES = (0.6, 0.3, 0.18, 0.1)
"""Fractions of the longest side: radii within which a plate is sought around the point; a wedge is flat only nearby."""


def edge_frame(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray) -> Found:
    """Return the edge frame of the thin plate at a surface point: its midpoint, Z outward, X along the edge; ``size_m`` is its
    length.

    The plate is the connected thin material around the point. Of the sides of its outline, the edge is the one that is thin,
    long and near the point.
    """
    plate: tuple[np.ndarray, np.ndarray] | None = None
    for share in _REACH_SHARES:
        plate = _plate(surface, point_m, share)
        if plate is not None:
            break
    if plate is None:
        return NoFrame("the matter around the point is no thin plate")
    points, thickness = plate
    middle = points.mean(0)
    _, vectors = np.linalg.eigh(np.cov((points - middle).T))
    basis = vectors[:, [2, 1]]
    flat = (points - middle) @ basis
    at = (point_m - middle) @ basis
    outline, outward = _outline(flat, surface.spacing_m)
    if len(outline) < 12:
        return NoFrame("the plate around the point has no outline")
    found = _sides(outline, outward, flat, thickness, at, surface.spacing_m)
    if not found:
        return NoFrame("no side of the plate around the point is straight")
    found.sort(key=lambda side: -side[0])
    if len(found) > 1 and found[0][0] < _CLEAR * found[1][0]:
        return NoFrame("two sides of the plate around the point could be the edge")
    _, ends, out = found[0]
    line = basis @ (ends[1] - ends[0])
    length = float(np.linalg.norm(line))
    z = basis @ out
    z = z - (z @ line) * line / length**2
    x = line / length
    x = x if x @ np.array([1.0, 0.1, 0.01]) > 0 else -x
    place = middle + basis @ ends.mean(0)
    height = points[np.linalg.norm(flat - ends.mean(0), axis=1).argsort()[:8]] @ vectors[:, 0]
    place = place + vectors[:, 0] * float(np.median(height) - place @ vectors[:, 0])
    return FeatureFrame("edge", place, rotation_of(z, x), length, False)


def _plate(surface: FramedMesh, point_m: np.ndarray, share: float) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the samples of the connected thin material around a point and its thickness there; None if it is not a plate."""
    positions, normals = surface.samples
    around = surface.near(point_m, share * surface.size_m)
    distance, _ = surface.caster.first_hits(positions[around] - 1e-5 * normals[around], -normals[around])
    thickness = np.where(np.isfinite(distance), distance, 0.0)
    close = np.linalg.norm(positions[around] - point_m, axis=1).argsort()[:25]
    own = float(np.median(thickness[close]))
    thin = thickness <= max(_THIN_FACTOR * own, 0.004, 2 * float(np.quantile(thickness, 0.05)))
    if thin.sum() < 30:
        return None
    chosen, shown = positions[around][thin], thickness[thin]
    linked = _linked(chosen, point_m, 3.0 * surface.spacing_m)
    spread = np.sqrt(np.linalg.eigvalsh(np.cov(chosen[linked].T))) if linked.sum() > 30 else np.ones(3)
    return (chosen[linked], shown[linked]) if spread[0] < _FLAT * spread[1] else None


def _linked(points: np.ndarray, start_m: np.ndarray, step_m: float) -> np.ndarray:
    """Return which points are connected to the one nearest to a position by steps of at most ``step_m``."""
    tree = cKDTree(points)
    pairs = tree.query_pairs(step_m, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    labels = connected_components(graph, directed=False)[1]
    return np.asarray(labels == labels[int(tree.query(start_m)[1])])


def _outline(flat: np.ndarray, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the outline of points in a plane ``(N, 2)`` as evenly spaced positions and outward normals."""
    low, span = flat.min(0), float(np.ptp(flat, axis=0).max())
    cell = max(span / _CELLS, 0.35 * spacing_m)
    size = np.ceil(np.ptp(flat, axis=0) / cell).astype(int) + 13
    picture = np.zeros((size[1], size[0]), dtype=np.uint8)
    at = np.round((flat - low) / cell).astype(int) + 6
    picture[at[:, 1], at[:, 0]] = 1
    closing = 2 * int(np.ceil(1.3 * spacing_m / cell)) + 1
    picture = cv2.morphologyEx(
        picture, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (closing, closing))
    )
    contours, _ = cv2.findContours(picture, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return np.zeros((0, 2)), np.zeros((0, 2))
    line = max(contours, key=cv2.contourArea)[:, 0].astype(float)
    if len(line) < 12:
        return np.zeros((0, 2)), np.zeros((0, 2))
    kernel = 4
    ahead, behind = np.roll(line, -kernel, axis=0), np.roll(line, kernel, axis=0)
    tangent = ahead - behind
    outward = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    area = 0.5 * float(np.sum(line[:, 0] * np.roll(line[:, 1], -1) - np.roll(line[:, 0], -1) * line[:, 1]))
    outward = outward * (1 if area > 0 else -1)
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    return (line - 6) * cell + low, outward


def _sides(
    outline: np.ndarray,
    outward: np.ndarray,
    flat: np.ndarray,
    thickness: np.ndarray,
    at: np.ndarray,
    spacing_m: float,
) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Return score, both ends ``(2, 2)`` and outward direction of each straight side of an outline."""
    (_, (wide, high), turn) = cv2.minAreaRect(flat.astype(np.float32))
    angle = np.radians(turn)
    first = np.array([np.cos(angle), np.sin(angle)])
    second = np.array([-first[1], first[0]])
    longest, typical = max(wide, high), float(np.median(thickness))
    found = []
    for out in (first, -first, second, -second):
        mine = outline[outward @ out > _ANGLE_COSINE]
        if len(mine) < 6:
            continue
        middle = mine.mean(0)
        _, _, vectors = np.linalg.svd(mine - middle, full_matrices=False)
        along = (mine - middle) @ vectors[0]
        low, top = np.quantile(along, [0.01, 0.99])
        length = float(top - low)
        off = np.abs((mine - middle) @ vectors[1])
        if length < 4 * spacing_m or np.quantile(off, 0.9) > _STRAIGHT_SHARE * length:
            continue
        ends = middle + np.array([low, top])[:, None] * vectors[0]
        across = (flat - middle) @ out
        within = np.abs((flat - middle) @ vectors[0]) < length / 2
        depth = float(-across[within].min()) if within.any() else longest
        band = within & (across > -max(0.12 * depth, 1.5 * spacing_m))
        thin = float(np.median(thickness[band])) if band.sum() > 3 else typical
        share = np.clip((at - ends[0]) @ (ends[1] - ends[0]) / length**2, 0, 1)
        away = float(np.linalg.norm(ends[0] + share * (ends[1] - ends[0]) - at))
        sharp = typical / max(thin, 0.25 * typical, 1e-6)
        score = sharp * (0.5 + 0.5 * length / longest) / (0.35 + away / longest)
        found.append((score, ends, out))
    return found
