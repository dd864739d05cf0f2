"""Trimmed point-to-plane ICP of observed points to a known surface, batched over many starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from manitwin.geometry.poses import inverse

_DAMPING = 1e-6


@dataclass(frozen=True)
class Surface:
    """Points ``(N, 3)`` of a surface, m, their outward unit normals and search tree, and its diameter."""

    points: np.ndarray
    normals: np.ndarray
    tree: cKDTree
    diameter_m: float


def align(
    observed: np.ndarray,
    surface: Surface,
    poses: np.ndarray,
    *,
    iterations: int,
    kept_share: float,
    reach_m: float = np.inf,
    facing: bool = True,
) -> np.ndarray:
    """Return ``object_to_camera (K, 4, 4)`` after ``iterations`` from the starts ``poses``.

    ``observed (N, 3)`` are points in the camera frame. Each step pairs them with the nearest surface points, keeps the closest
    ``kept_share`` of the pairs and those within ``reach_m``, with ``facing`` only pairs whose surface normal points to the
    camera, and takes the linearized point-to-plane step (Chen and Medioni 1992; trimming: Chetverikov et al. 2002).
    """
    for _ in range(iterations):
        back = inverse(poses)
        points = np.einsum("kij,nj->kni", back[:, :3, :3], observed) + back[:, None, :3, 3]
        distance, nearest = surface.tree.query(points.reshape(-1, 3))
        distance, nearest = distance.reshape(len(poses), -1), nearest.reshape(len(poses), -1)
        limit = np.minimum(np.quantile(distance, kept_share, axis=1), reach_m)
        normals = surface.normals[nearest]
        weight = (distance <= limit[:, None]).astype(float)
        if facing:  # visible surfaces face the camera, while the inside of a thin wall is as close as its outside
            weight *= ((back[:, None, :3, 3] - points) * normals).sum(2) > 0
        poses = point_to_plane_step(poses, points, surface.points[nearest], normals, weight, surface.diameter_m)
    return poses


def point_to_plane_step(
    poses: np.ndarray,
    observed: np.ndarray,
    surface: np.ndarray,
    normals: np.ndarray,
    weight: np.ndarray,
    diameter_m: float,
) -> np.ndarray:
    """Return ``object_to_camera (K, 4, 4)`` after one linearized point-to-plane step.

    ``observed`` and ``surface (K, N, 3)`` are paired points in the object frame, with ``normals`` of the surface and the weight
    ``(K, N)`` of each pair. Damping keeps unobservable motions at zero.
    """
    rows = np.concatenate([np.cross(observed, normals), normals], 2)
    gaps = ((surface - observed) * normals).sum(2)
    weighted = rows * weight[:, :, None]
    damping = np.diag(np.repeat([diameter_m**2, 1.0], 3)) * _DAMPING * observed.shape[1]
    normal_matrix = np.einsum("kni,knj->kij", weighted, rows) + damping
    step = np.linalg.solve(normal_matrix, np.einsum("kni,kn->ki", weighted, gaps)[..., None])[..., 0]
    moved = np.broadcast_to(np.eye(4), poses.shape).copy()
    moved[:, :3, :3] = Rotation.from_rotvec(step[:, :3]).as_matrix()
    moved[:, :3, 3] = step[:, 3:]
    return np.asarray(poses @ inverse(moved))
