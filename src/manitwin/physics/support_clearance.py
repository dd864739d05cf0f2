"""Grasps of an object that stands on something: which of them leave room for what it stands on, and how to make room.

A grasp that is proven in the air may have its fingertips below the plane that the object will be picked from: of the fork,
the plate and the scissors of the test set every one had. The last millimetres of the pads hold flat things as well.
"""

from __future__ import annotations

import numpy as np

from manitwin.robots.grippers.parallel import ParallelGripper

CLEARANCE_M = 0.002
"""Between the open hand and the plane."""
MIN_DESCENT = 0.5
"""The least cosine between the approach and straight down at which a hand is raised along it."""
CORNERS = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], float)


def lowest_points_m(gripper: ParallelGripper, gripper_to_object: np.ndarray, object_to_plane: np.ndarray) -> np.ndarray:
    """Return the least height ``(N,)`` of the wide open hand above the plane z = 0, for each pose ``(N, 4, 4)``."""
    corners = np.concatenate(
        [
            (CORNERS * half_extents_m) @ box_to_gripper[:3, :3].T + box_to_gripper[:3, 3]
            for box_to_gripper, half_extents_m in gripper.boxes(gripper.opening_m)
        ]
    )
    upwards = object_to_plane[2, :3]
    along = np.einsum("i,nij->nj", upwards, gripper_to_object[:, :3, :3])
    origins = gripper_to_object[:, :3, 3] @ upwards + object_to_plane[2, 3]
    return origins + (along @ corners.T).min(1)


def raised(
    gripper: ParallelGripper, gripper_to_object: np.ndarray, object_to_plane: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the grasps from above whose hand is below the plane, drawn back along their approach until it is clear.

    ``(N, 4, 4)`` to ``(M, 4, 4)``, with the index ``(M,)`` of each in the second value. Not drawn back farther than the pads
    are high: then nothing would be left between them.
    """
    missing_m = CLEARANCE_M - lowest_points_m(gripper, gripper_to_object, object_to_plane)
    descent = -(gripper_to_object[:, :3, 2] @ object_to_plane[2, :3])
    back_m = missing_m / np.maximum(descent, MIN_DESCENT)
    index = np.flatnonzero((missing_m > 0) & (descent >= MIN_DESCENT) & (back_m < 2 * gripper.pad_half_extents_m[1]))
    poses = gripper_to_object[index].copy()
    poses[:, :3, 3] -= back_m[index, None] * poses[:, :3, 2]
    return poses, index
