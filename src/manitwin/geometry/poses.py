"""Rigid transforms as 4x4 matrices, and quaternions in wxyz order.

SciPy's rotations are imported on first use, as they take a third of the start-up time of a program that does not need them.
"""

from __future__ import annotations

import numpy as np

OBJECT_TO_GLTF = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""Z-up object frame to the Y-up frame of glTF 2.0 (section 3.4): (x, y, z) -> (x, z, -y)."""

GLTF_TO_OBJECT = OBJECT_TO_GLTF.T

_ALONG_RAD = 1e-9  # smaller angles count as aligned with the axis
LEAST_LEADING = 1e-3  # least magnitude of the quaternion component that fixes its sign; 0.1 degrees from zero


def quaternion_wxyz(rotation: np.ndarray) -> np.ndarray:
    """Convert rotation matrices ``(..., 3, 3)`` to unit quaternions ``(..., 4)`` wxyz with w >= 0."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(rotation).as_quat(canonical=True, scalar_first=True)


def rotation_from_quaternion_wxyz(quaternion: np.ndarray) -> np.ndarray:
    """Convert quaternions ``(..., 4)`` wxyz to rotation matrices ``(..., 3, 3)``."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(quaternion, scalar_first=True).as_matrix()


def transform(rotation: np.ndarray | None = None, translation: np.ndarray | None = None) -> np.ndarray:
    """Build a 4x4 transform from a rotation ``(3, 3)`` and a translation ``(3,)``; omitted parts are the identity."""
    pose = np.eye(4)
    if rotation is not None:
        pose[:3, :3] = rotation
    if translation is not None:
        pose[:3, 3] = translation
    return pose


def inverse(pose: np.ndarray) -> np.ndarray:
    """Invert rigid transforms ``(..., 4, 4)``."""
    result = np.zeros_like(pose)
    rotation = np.swapaxes(pose[..., :3, :3], -1, -2)
    result[..., :3, :3] = rotation
    result[..., :3, 3] = -np.einsum("...ij,...j->...i", rotation, pose[..., :3, 3])
    result[..., 3, 3] = 1.0
    return result


def transform_points(pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Apply a 4x4 transform to points ``(N, 3)``."""
    return points @ pose[:3, :3].T + pose[:3, 3]


def yaw_onto_axis(direction: np.ndarray) -> np.ndarray:
    """Return the rotation ``(3, 3)`` about Z, by at most 45 degrees, that aligns a direction ``(3,)`` with X or Y seen from
    above.
    """
    angle = float(np.arctan2(direction[1], direction[0]))
    turn = np.round(angle / (np.pi / 2)) * np.pi / 2 - angle
    if abs(turn) < _ALONG_RAD:
        return np.eye(3)
    cosine, sine = np.cos(turn), np.sin(turn)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def rotation_between(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the smallest rotation ``(3, 3)`` that takes direction ``source`` to ``target`` (Rodrigues)."""
    from scipy.spatial.transform import Rotation

    a, b = source / np.linalg.norm(source), target / np.linalg.norm(target)
    axis, cosine = np.cross(a, b), float(a @ b)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        if cosine > 0:
            return np.eye(3)
        other = np.eye(3)[int(np.abs(a).argmin())]
        axis = np.cross(a, other)
        return Rotation.from_rotvec(np.pi * axis / np.linalg.norm(axis)).as_matrix()
    return Rotation.from_rotvec(axis / sine * np.arctan2(sine, cosine)).as_matrix()


def rotation_angle_rad(rotation: np.ndarray) -> float:
    """Return the angle of a rotation ``(3, 3)``, accurate near zero as well: |R - I| = 2 sqrt(2) sin(angle / 2)."""
    half_sine = float(np.linalg.norm(rotation - np.eye(3))) / np.sqrt(8)
    return float(2 * np.arcsin(min(1.0, half_sine)))


def without_sign_changes(quaternions: np.ndarray, before: np.ndarray | None = None) -> np.ndarray:
    """Choose the signs of quaternions ``(T, ..., 4)`` wxyz so that each is closest to its predecessor.

    The first row follows ``before (..., 4)``; without it, w >= 0. If w is nearly zero, as for hands pointing straight down, its
    sign would be noise: then x >= 0, and so on.
    """
    if before is None:
        leading = np.argmax(np.abs(quaternions[:1]) > LEAST_LEADING, axis=-1, keepdims=True)
        before = (quaternions[:1] * np.sign(np.take_along_axis(quaternions[:1], leading, axis=-1)))[0]
    rows = np.concatenate([before[None], quaternions])
    dots = np.sum(rows[1:] * rows[:-1], axis=-1, keepdims=True)
    result: np.ndarray = quaternions * np.cumprod(np.where(dots < 0, -1.0, 1.0), axis=0)
    return result
