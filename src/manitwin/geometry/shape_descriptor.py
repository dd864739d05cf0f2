"""Shape descriptors invariant to scale, position and orientation, for similarity search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from manitwin.geometry.sampling import sample_surface

if TYPE_CHECKING:
    import trimesh

QUANTILES = 32
_PAIRS = 1 << 15  # two draws differ by 0.005, at most 0.011, over 25 real objects; different objects by 0.047 or more
_LEVELS = (np.arange(QUANTILES) + 0.5) / QUANTILES


@dataclass(frozen=True)
class ShapeDescriptor:
    """``values (66,) float32``, to be compared by Euclidean distance, and the size ``radius_of_gyration_m``.

    ``values`` consist of 32 quantiles of the distance between two surface points over its root mean square; 32 quantiles of the
    distance of a point from the surface's centroid over its root mean square (both divided by the root of 32, so that the
    Euclidean distance is the Wasserstein distance of the distributions); and the middle and smallest principal radii of
    gyration of the surface over the largest.
    """

    values: np.ndarray
    radius_of_gyration_m: float


def shape_descriptor(mesh: trimesh.Trimesh, *, seed: int) -> ShapeDescriptor:
    """Compute the descriptor of a surface, invariant to scale, position, orientation, mirroring and tessellation.

    Deterministic for a seed; another seed changes ``values`` by sampling noise only. Raises ValueError for a surface whose area
    is zero or not finite.

    Source: Osada, Funkhouser, Chazelle, Dobkin 2002, "Shape distributions": D2 from 32,768 pairs of points uniform by area, and
    D1 about the centroid from the same points. Both are scaled by the trace of the surface's covariance, which is exactly the
    mean square of D1 and half that of D2, and compared by quantiles, which need no bin width.
    """
    with np.errstate(all="ignore"):
        area = float(mesh.area)
    if not 0 < area < np.inf:
        raise ValueError(f"a surface of {area:g} m2 has no shape")
    centroid, covariance = surface_moments(mesh)
    rng = np.random.default_rng(seed)
    first, second = (sample_surface(mesh, _PAIRS, rng)[0] for _ in range(2))
    radius_of_gyration_m = float(np.sqrt(np.trace(covariance)))
    between = np.linalg.norm(first - second, axis=1) / (np.sqrt(2) * radius_of_gyration_m)
    outwards = np.linalg.norm(np.vstack([first, second]) - centroid, axis=1) / radius_of_gyration_m
    quantiles = np.concatenate([np.quantile(distances, _LEVELS) for distances in (between, outwards)])
    radii = np.sqrt(np.maximum(np.linalg.eigvalsh(covariance), 0.0))
    values = np.concatenate([quantiles / np.sqrt(QUANTILES), radii[1::-1] / radii[2]])
    return ShapeDescriptor(values.astype(np.float32), radius_of_gyration_m)


def surface_moments(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the exact mean ``(3,)`` m and covariance ``(3, 3)`` m² of a point uniform on a surface.

    The second moment of a triangle a, b, c with centroid g is (9 g gᵀ + a aᵀ + b bᵀ + c cᵀ) / 12 of its area (exact for degree
    two).
    """
    middle = mesh.triangles.mean((0, 1))
    corners = mesh.triangles - middle  # an origin near the mesh avoids cancellation
    shares = mesh.area_faces / mesh.area_faces.sum()
    centroids = corners.mean(1)
    mean = shares @ centroids
    second = 9 * np.einsum("f,fi,fj->ij", shares, centroids, centroids)
    second += np.einsum("f,fki,fkj->ij", shares, corners, corners)
    return middle + mean, second / 12 - np.outer(mean, mean)
