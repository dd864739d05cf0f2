"""Grasps of a parallel jaw at a point cloud: pairs of points that face away from each other, with nothing in the way.

Made of the cloud alone, in GraspGen's convention: origin at the hand's base, +Z approach, closing along X.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

NEIGHBOURS = 12  # of the plane through a point
LEAST_FACING = 0.94  # cosine of 20 degrees
BESIDE_M = 0.005  # how far beside a point's normal its partner may lie
THINNEST_M = 0.001
BLOCK = 256


@dataclass(frozen=True)
class Jaw:
    """A parallel jaw: opening, depth of the fingertips' centre, and half of the pads' width and height, in m."""

    opening_m: float
    tip_depth_m: float
    pad_m: tuple[float, float]


FRANKA_PANDA = Jaw(0.080, 0.1034, (0.00875, 0.00925))


def cloud_grasps(cloud: np.ndarray, count: int, jaw: Jaw) -> tuple[np.ndarray, np.ndarray]:
    """Return poses ``(M, 4, 4) float32`` and scores ``(M,) float32`` in [0, 1], best first, at most ``count``.

    The same cloud gives the same grasps.
    """
    points = np.asarray(cloud, float)
    if len(points) < NEIGHBOURS:
        return np.empty((0, 4, 4), np.float32), np.empty(0, np.float32)
    rng = np.random.default_rng(zlib.crc32(np.ascontiguousarray(cloud).tobytes()))
    normals = _normals(points)
    first, width_m, facing = _pairs(points, normals, jaw)
    if not len(first):
        return np.empty((0, 4, 4), np.float32), np.empty(0, np.float32)
    drawn = rng.integers(len(first), size=2 * count)
    first, width_m, facing = first[drawn], width_m[drawn], facing[drawn]
    poses = _poses(points[first], normals[first], width_m, jaw, rng)
    blocked = np.concatenate([_blocked(points, poses[i : i + BLOCK], jaw) for i in range(0, len(poses), BLOCK)])
    score = np.where(blocked, 0.4, 1.0) * (0.5 + 0.5 * (facing - LEAST_FACING) / (1 - LEAST_FACING))
    best = np.argsort(-score, kind="stable")[:count]
    return poses[best].astype(np.float32), score[best].astype(np.float32)


def _normals(points: np.ndarray) -> np.ndarray:
    """Return unit normals ``(N, 3)``, of either sign: the least principal axis of each point's neighbours."""
    around = points[cKDTree(points).query(points, NEIGHBOURS)[1]]
    centered = around - around.mean(1, keepdims=True)
    return np.linalg.svd(centered, full_matrices=False)[2][:, 2]


def _pairs(points: np.ndarray, normals: np.ndarray, jaw: Jaw) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return indices of first points, the signed distance of their partner along the normal, and how well both face."""
    centered = points - points.mean(0)  # for the squares below
    square, found = (centered**2).sum(1), []
    for start in range(0, len(points), BLOCK):
        some, normal = centered[start : start + BLOCK], normals[start : start + BLOCK]
        along = normal @ centered.T - (normal * some).sum(1)[:, None]
        beside = square[start : start + BLOCK, None] + square - 2 * some @ centered.T - along**2
        facing = np.abs(normal @ normals.T)
        fits = (np.abs(along) > THINNEST_M) & (np.abs(along) < jaw.opening_m - 0.002)
        i, j = np.nonzero(fits & (beside < BESIDE_M**2) & (facing > LEAST_FACING))
        found.append((i + start, along[i, j], facing[i, j]))
    first, width_m, facing = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return first, width_m, facing


def _poses(
    first_m: np.ndarray, normals: np.ndarray, width_m: np.ndarray, jaw: Jaw, rng: np.random.Generator
) -> np.ndarray:
    """Return poses that close along the normal, their tips between both points, from any side."""
    count = len(first_m)
    x = normals * np.sign(width_m)[:, None]
    z = rng.normal(size=(count, 3))
    z -= (z * x).sum(1, keepdims=True) * x
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, 0], poses[:, :3, 1], poses[:, :3, 2] = x, np.cross(z, x), z
    depth_m = jaw.tip_depth_m + rng.uniform(-0.005, 0.005, count)
    poses[:, :3, 3] = first_m + normals * width_m[:, None] / 2 - depth_m[:, None] * z
    return poses


def _blocked(points: np.ndarray, poses: np.ndarray, jaw: Jaw) -> np.ndarray:
    """Tell of each pose whether points lie where the open fingers or the palm are."""
    rotation, origin = poses[:, :3, :3], poses[:, :3, 3]
    x, y, z = np.moveaxis(np.einsum("nki,npk->inp", rotation, points[None] - origin[:, None]), 0, 0)
    half_y, half_z = jaw.pad_m
    top = jaw.tip_depth_m + half_z
    beside = np.abs(np.abs(x) - jaw.opening_m / 2 - 0.012) < 0.014
    finger = beside & (np.abs(y) < half_y + 0.003) & (z > 0) & (z < top)
    palm = (z < jaw.tip_depth_m - 0.035) & (z > -0.05) & (np.abs(x) < 0.11) & (np.abs(y) < 0.034)
    return (finger | palm).any(1)
