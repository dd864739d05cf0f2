"""Antipodal contact pairs: two surface points, each on the line of the other's friction cone, for parallel grippers.

Source: Nguyen 1988, "Constructing force-closure grasps"; sampled by rays as in Dex-Net 2.0 (Mahler et al. 2017, appendix).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.geometry.ray_caster import RayCaster

MAX_WALLS = 6  # exits per ray before it is abandoned; a ray through a mug has two
STEP_PAST_M = 1e-6


@dataclass(frozen=True)
class AntipodalPairs:
    """Contact pairs: the two points ``(N, 3)`` m, and ``alignment (N,)``, the smaller cosine between a normal and the closing
    axis.
    """

    first_m: np.ndarray
    second_m: np.ndarray
    alignment: np.ndarray

    def __len__(self) -> int:
        return len(self.first_m)

    @property
    def width_m(self) -> np.ndarray:
        """The distance ``(N,)`` m between the two contacts."""
        return np.linalg.norm(self.second_m - self.first_m, axis=1)

    def take(self, index: np.ndarray) -> AntipodalPairs:
        """Return the pairs at ``index``."""
        return AntipodalPairs(self.first_m[index], self.second_m[index], self.alignment[index])


def tangents(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors ``(N, 3)`` that complete unit directions ``(N, 3)`` to right-handed frames."""
    other = np.where(np.abs(directions[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    first = np.cross(directions, other)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(directions, first)


def antipodal_pairs(
    caster: RayCaster,
    points_m: np.ndarray,
    normals: np.ndarray,
    *,
    friction: float,
    max_width_m: float,
    rng: np.random.Generator,
) -> AntipodalPairs:
    """Sample contact pairs that start at surface points ``(N, 3)`` with outward normals ``(N, 3)``.

    One ray per point is cast inwards in a random direction within the friction cone. Wherever it leaves the solid within the
    friction cone of that surface, the two points form a pair. The first and the last such exit within ``max_width_m`` are kept:
    a grasp of a wall, and one of the whole body.
    """
    cosine = 1 / np.hypot(1, friction)
    angle = np.arctan(friction) * np.sqrt(rng.random(len(points_m)))
    turn = 2 * np.pi * rng.random(len(points_m))
    first, second = tangents(normals)
    sideways = first * np.cos(turn)[:, None] + second * np.sin(turn)[:, None]
    directions = -normals * np.cos(angle)[:, None] + sideways * np.sin(angle)[:, None]
    exits = np.full((MAX_WALLS, len(points_m)), np.nan)
    aligned = np.zeros((MAX_WALLS, len(points_m)))
    going, travelled, walls = np.arange(len(points_m)), np.zeros(len(points_m)), np.zeros(len(points_m), dtype=int)
    while len(going):
        start = travelled[going] + STEP_PAST_M
        distance, face = caster.first_hits(points_m[going] + directions[going] * start[:, None], directions[going])
        travelled[going] = start + distance
        inside = travelled[going] <= max_width_m
        going, face = going[inside], face[inside]
        facing = (caster.face_normals[face] * directions[going]).sum(1)
        leaving = facing > 0
        out = going[leaving]
        exits[walls[out], out] = np.where(facing[leaving] >= cosine, travelled[out], np.nan)
        aligned[walls[out], out] = np.minimum(facing[leaving], np.cos(angle[out]))
        walls[out] += 1
        going = going[walls[going] < MAX_WALLS]
    index, wall = _first_and_last(np.isfinite(exits))
    second_m = points_m[index] + directions[index] * exits[wall, index][:, None]
    return AntipodalPairs(points_m[index], second_m, aligned[wall, index])


def _first_and_last(found: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return column and row of the first and the last True in each column of ``found (rows, columns)``, without duplicates."""
    columns = np.flatnonzero(found.any(0))
    first = found[:, columns].argmax(0)
    last = len(found) - 1 - found[::-1, columns].argmax(0)
    more = last > first
    return np.concatenate([columns, columns[more]]), np.concatenate([first, last[more]])


def grasp_frames(
    pairs: AntipodalPairs, *, rolls: int, tip_depth_m: float, max_depth_offset_m: float, rng: np.random.Generator
) -> np.ndarray:
    """Return grasps ``gripper_to_object (N * rolls, 4, 4)`` that close along each pair, with ``rolls`` approach directions each.

    X is the closing axis. The approach directions (Z) are evenly spaced around it, starting at a random angle. The point
    between the fingertips, ``tip_depth_m`` along the approach, is placed within ``max_depth_offset_m`` before or behind the
    midpoint of the pair.
    """
    closing = np.repeat((pairs.second_m - pairs.first_m) / pairs.width_m[:, None], rolls, axis=0)
    middle = np.repeat((pairs.first_m + pairs.second_m) / 2, rolls, axis=0)
    turn = 2 * np.pi * (np.tile(np.arange(rolls) / rolls, len(pairs)) + np.repeat(rng.random(len(pairs)), rolls))
    first, second = tangents(closing)
    approach = first * np.cos(turn)[:, None] + second * np.sin(turn)[:, None]
    offset = max_depth_offset_m * rng.uniform(-1, 1, len(turn))
    poses = np.zeros((len(turn), 4, 4))
    poses[:, :3, 0], poses[:, :3, 1], poses[:, :3, 2] = closing, np.cross(approach, closing), approach
    poses[:, :3, 3] = middle + approach * (offset - tip_depth_m)[:, None]
    poses[:, 3, 3] = 1
    return poses
