"""Where to let go of an object that has turned in the hand, when the hand has no room to make up for all of it."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.geometry.poses import transform, transform_points
from manitwin.geometry.rigid_body import RigidBody

DROP_M = 0.003  # so much higher an object may be let go
SHARES = (0.5, 0.0)  # of the turn that are made up for, where all of it cannot be


def goals_after_slip(
    body: RigidBody, goal_object_to_world: np.ndarray, planned: np.ndarray, measured: np.ndarray
) -> list[np.ndarray]:
    """Return goal poses of the object ``(4, 4)``, the best first: as asked, a little higher, half upright, as it hangs.

    ``planned`` and ``measured`` are gripper_to_object. An object that is let go with some tilt is as low as the goal, its
    centre of mass above the same place: it tips the rest of the way by itself.
    """
    higher = goal_object_to_world.copy()
    higher[2, 3] += DROP_M
    hanging = goal_object_to_world[:3, :3] @ planned[:3, :3] @ measured[:3, :3].T
    slip = Rotation.from_matrix(hanging @ goal_object_to_world[:3, :3].T).as_rotvec()
    goals = [goal_object_to_world, higher]
    for share in SHARES:
        turned = Rotation.from_rotvec((1 - share) * slip).as_matrix() @ goal_object_to_world[:3, :3]
        goals.append(_as_low(body, goal_object_to_world, turned))
    return goals


def _as_low(body: RigidBody, goal_object_to_world: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Return a pose of a rotation whose lowest point and whose centre of mass's place are those of the goal."""
    points = np.concatenate(body.hulls)
    lowest_m = transform_points(goal_object_to_world, points)[:, 2].min()
    center = transform_points(goal_object_to_world, body.center_of_mass_m[None])[0]
    pose = transform(rotation, center - rotation @ body.center_of_mass_m)
    pose[2, 3] += lowest_m - transform_points(pose, points)[:, 2].min()
    return pose
