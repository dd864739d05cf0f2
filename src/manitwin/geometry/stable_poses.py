"""Quasi-static stable poses of a rigid body on a plane, with their probabilities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from manitwin.geometry.poses import rotation_between

_MERGE_COSINE = np.cos(np.radians(1.0))  # merges the facets of one flat side of a scan or hull
_TILT_DIRECTIONS = 36
_ON_EDGE_M = 1e-12


@dataclass(frozen=True)
class StablePose:
    """``rotation (3, 3)`` from object to plane (z up), and the ``probability`` that a tumbling object comes to rest in it."""

    rotation: np.ndarray
    probability: float


def stable_poses(points: np.ndarray, center_of_mass: np.ndarray) -> list[StablePose]:
    """Return the stable poses of the convex hull of ``points (N, 3)`` about ``center_of_mass (3,)``, most likely first.

    The body lands on a hull facet with a probability proportional to the solid angle of the facet seen from the centre of mass.
    If the centre of mass does not project into the facet, the body rolls over the edge that it exceeds most, and the
    probability moves to the neighbouring facet.

    Source: Goldberg, Mirtich, Zhuang, Craig, Carlisle and Canny 1999, Part pose statistics, the quasi-static estimator.
    """
    center = np.asarray(center_of_mass, dtype=float)
    hull = ConvexHull(np.asarray(points, dtype=float))
    corners = hull.points[hull.simplices] - center
    normals, heights = hull.equations[:, :3], -(hull.equations[:, :3] @ center + hull.equations[:, 3])
    share = _solid_angles(corners) / (4 * np.pi)
    rolls_to = _rolls_to(hull, normals, center + normals * heights[:, None])
    rest = np.arange(len(share))
    for _ in range(len(share)):  # each roll lowers the centre of mass, so this ends; only coplanar facets could cycle
        rolled, rest = rest, rolls_to[rest]
        if (rolled == rest).all():
            break
    share = np.bincount(rest, share, len(share)) / share.sum()
    resting = np.unique(rest)
    resting = resting[np.argsort(-share[resting], kind="stable")]
    kept, probabilities = np.empty((0, 3)), np.empty(0)
    for facet in resting:
        alignment = kept @ normals[facet]
        if len(kept) and alignment.max() > _MERGE_COSINE:
            probabilities[int(alignment.argmax())] += share[facet]
        else:
            kept, probabilities = np.vstack([kept, normals[facet]]), np.append(probabilities, share[facet])
    down = np.array([0.0, 0, -1])
    order = np.argsort(-probabilities, kind="stable")
    return [StablePose(rotation_between(kept[index], down), float(probabilities[index])) for index in order]


def easiest_tilt(
    points: np.ndarray, center_of_mass: np.ndarray, rotations: np.ndarray, tilt_rad: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the least rise (m) of the centre of mass for a tilt, over all tilt directions, and the tilted rotations.

    ``rotations (N, 3, 3)`` turn the object onto the plane, ``points`` are the vertices of its hull, ``tilt_rad`` is the tilt
    angle. Returns ``(N,)`` and ``(N, 3, 3)``. If the rise is small or negative, the body rocks or rolls on. The height of the
    centre of mass above the plane is the hull's support function.
    """
    coarse = np.linspace(0, 2 * np.pi, _TILT_DIRECTIONS, endpoint=False)
    # an elongated object rolls in one direction only
    fine = np.linspace(-1, 1, _TILT_DIRECTIONS + 1) * (coarse[1] - coarse[0])
    offsets = points - center_of_mass
    rises, tilted = np.empty(len(rotations)), np.empty_like(rotations)
    for index, rotation in enumerate(rotations):
        azimuths = coarse
        for _ in range(2):
            down = _tilted_down(azimuths, tilt_rad)
            heights = (offsets @ (down @ rotation).T).max(0)
            easiest = int(heights.argmin())
            azimuths = azimuths[easiest] + fine
        rises[index] = heights[easiest] + (offsets @ rotation[2]).min()
        tilted[index] = rotation_between(down[easiest], np.array([0.0, 0, -1])) @ rotation
    return rises, tilted


def _tilted_down(azimuths: np.ndarray, tilt_rad: float) -> np.ndarray:
    """Return the directions ``(N, 3)`` at the angle ``tilt_rad`` from straight down, towards the azimuths."""
    across = np.sin(tilt_rad)
    return np.stack(
        [across * np.cos(azimuths), across * np.sin(azimuths), np.full(len(azimuths), -np.cos(tilt_rad))], 1
    )


def _solid_angles(corners: np.ndarray) -> np.ndarray:
    """Return the solid angles of triangles ``(N, 3, 3)`` seen from the origin (Van Oosterom and Strackee 1983)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    na, nb, nc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    volume = np.abs(np.einsum("ij,ij->i", a, np.cross(b, c)))
    ab, bc, ca = (np.einsum("ij,ij->i", x, y) for x, y in ((a, b), (b, c), (c, a)))
    return np.abs(2 * np.arctan2(volume, na * nb * nc + ab * nc + bc * na + ca * nb))


def _rolls_to(hull: ConvexHull, normals: np.ndarray, feet: np.ndarray) -> np.ndarray:
    """Return for every facet the neighbour that the body rolls onto, or the facet itself if it rests.

    ``feet (N, 3)`` are the projections of the centre of mass onto the facets' planes.
    """
    corners = hull.points[hull.simplices]
    beyond = np.empty((len(corners), 3))
    for k in range(3):  # the edge opposite corner k, and neighbour k across it (Qhull's order)
        i, j = (k + 1) % 3, (k + 2) % 3
        edge = corners[:, j] - corners[:, i]
        outward = np.cross(edge, normals)
        outward *= np.where(np.einsum("ij,ij->i", outward, corners[:, k] - corners[:, i]) > 0, -1.0, 1.0)[:, None]
        outward /= np.linalg.norm(outward, axis=1, keepdims=True) + 1e-300
        beyond[:, k] = np.einsum("ij,ij->i", feet - corners[:, i], outward)
    farthest = beyond.argmax(1)
    rows = np.arange(len(corners))
    return np.where(beyond[rows, farthest] > _ON_EDGE_M, hull.neighbors[rows, farthest], rows)
