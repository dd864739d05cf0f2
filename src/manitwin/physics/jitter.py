"""Negative controls: grasps that held, moved at random, so that about two of three fail."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.geometry.poses import transform


def jittered(
    gripper_to_object: np.ndarray, depth_m: np.ndarray, rng: np.random.Generator, *, sigma_deg: float, sigma_m: float
) -> np.ndarray:
    """Return grasps ``(N, 4, 4)``, each turned about its fingertips' centre and moved, all six by a normal deviate.

    ``sigma_deg`` is per axis of the gripper's frame, ``sigma_m`` per axis of the object's. About the fingertips: turned
    about the wrist, the same angles would carry most fingers off the object.
    """
    turns = Rotation.from_euler(
        "xyz", rng.normal(0.0, sigma_deg, (len(gripper_to_object), 3)), degrees=True
    ).as_matrix()
    moves = rng.normal(0.0, sigma_m, (len(gripper_to_object), 3))
    result = np.empty_like(gripper_to_object)
    for number, (pose, depth) in enumerate(zip(gripper_to_object, depth_m, strict=True)):
        tip = pose[:3, 3] + depth * pose[:3, 2]
        rotation = pose[:3, :3] @ turns[number]
        result[number] = transform(rotation, tip - depth * rotation[:, 2] + moves[number])
    return result
