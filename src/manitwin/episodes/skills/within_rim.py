"""Poses of an object within a vessel's rim: on end, in its present orientation, or in between; optionally lowered to contact."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.geometry.boxes import smallest_enclosing_circle
from manitwin.geometry.hull_distance import PlacedParts
from manitwin.geometry.poses import rotation_between, transform, transform_points
from manitwin.scenes.layouts.pool import PoolBody
from manitwin.scenes.layouts.stacking import RIM_SLACK, ContainerOpening, lower_to_contact

LET_GO_M = 0.04  # depth of the lower end below the rim: a hand that goes deeper collides with the rim
LEAST_ROOM_M = 0.004  # clearance around an object on end
FREE_FALL_M = 0.002  # height above the geometric resting pose
ABOVE_RIM_M = 0.02  # start height of lowering
END_M = 0.01  # of a leaning object, everything within this height of its lowest point is its lower end


def pose_on_end(
    body: PoolBody, vessel: PlacedParts, mouth: ContainerOpening, rng: np.random.Generator, *, deep: bool
) -> np.ndarray | None:
    """Draw a pose ``(4, 4)`` on end, its lower end below the rim, or ``deep``, just above contact, which shortens the fall.

    None if the rim is too narrow.
    """
    longest = _axes(body.parts.whole)[:, 2] * rng.choice([-1.0, 1.0])
    rotation = _yaw(rng) @ rotation_between(longest, np.array([0.0, 0, 1]))
    pose = _within(body, rotation, mouth, min(LET_GO_M, 0.8 * mouth.depth_m), rng)
    lowered = _lowered(body, pose, vessel, mouth) if deep and pose is not None else None
    return pose if lowered is None else lowered


def pose_in_orientation(
    body: PoolBody, rotation: np.ndarray, vessel: PlacedParts, mouth: ContainerOpening, rng: np.random.Generator
) -> np.ndarray | None:
    """Draw a pose ``(4, 4)`` with ``rotation (3, 3)`` and a random heading, so that a present grasp remains usable.

    None if the rim is too narrow, or if the object would lie on it.
    """
    pose = _within(body, _yaw(rng) @ rotation, mouth, -ABOVE_RIM_M, rng)
    return None if pose is None else _lowered_below_rim(body, pose, vessel, mouth)


def leaning_pose(
    body: PoolBody, rotation: np.ndarray, vessel: PlacedParts, mouth: ContainerOpening, rng: np.random.Generator
) -> np.ndarray | None:
    """Draw a pose ``(4, 4)`` with ``rotation (3, 3)`` tilted by up to 90 degrees, one end of its longer side below the rim.

    Its present upper side still faces upwards, so that a hand that grasps from above is above the rim, beside the higher end.
    None if the object would lie on the rim, or if its centre of mass were outside the vessel.
    """
    side = rng.choice([-1.0, 1.0]) * _longer_side(body.parts.whole @ rotation.T)
    tilt = Rotation.from_rotvec(rng.uniform(0, np.pi / 2) * np.cross([0.0, 0, 1], side)).as_matrix()
    turned = _yaw(rng) @ tilt @ rotation
    points, center = body.parts.whole @ turned.T, turned @ body.body.center_of_mass_m
    lowest_m = points[:, 2].min()
    end = points[points[:, 2] < lowest_m + END_M].mean(0)
    around, out_m = rng.uniform(-np.pi, np.pi), RIM_SLACK * mouth.radius_m * np.sqrt(rng.random())
    at = mouth.center_m[:2] - end[:2] + out_m * np.array([np.cos(around), np.sin(around)])
    if np.linalg.norm(at + center[:2] - mouth.center_m[:2]) > mouth.radius_m:
        return None
    above = transform(turned, np.array([*at, mouth.center_m[2] + ABOVE_RIM_M - lowest_m]))
    return _lowered_below_rim(body, above, vessel, mouth)


def _within(
    body: PoolBody, rotation: np.ndarray, mouth: ContainerOpening, depth_m: float, rng: np.random.Generator
) -> np.ndarray | None:
    """Draw a pose within the rim with the lower end ``depth_m`` below it; None if the object is too wide."""
    turned = body.parts.whole @ rotation.T
    middle, radius_m = smallest_enclosing_circle(turned[:, :2])
    spare_m = RIM_SLACK * mouth.radius_m - radius_m - LEAST_ROOM_M
    if spare_m < 0:
        return None
    around, out_m = rng.uniform(-np.pi, np.pi), 0.5 * spare_m * np.sqrt(rng.random())
    at = mouth.center_m[:2] - middle + out_m * np.array([np.cos(around), np.sin(around)])
    return transform(rotation, np.array([*at, mouth.center_m[2] - depth_m - turned[:, 2].min()]))


def _lowered(body: PoolBody, pose: np.ndarray, vessel: PlacedParts, mouth: ContainerOpening) -> np.ndarray | None:
    lowered = lower_to_contact(body, pose, [vessel], mouth.center_m[2] - 2 * mouth.depth_m)
    return None if lowered is None else transform(translation=np.array([0.0, 0, FREE_FALL_M])) @ lowered.pose


def _lowered_below_rim(
    body: PoolBody, pose: np.ndarray, vessel: PlacedParts, mouth: ContainerOpening
) -> np.ndarray | None:
    lowered = _lowered(body, pose, vessel, mouth)
    if lowered is None or transform_points(lowered, body.parts.whole)[:, 2].min() > mouth.center_m[2]:
        return None
    return lowered


def _longer_side(points: np.ndarray) -> np.ndarray:
    """Return the horizontal direction ``(3,)`` in which points ``(N, 3)`` extend farthest."""
    return np.array([*np.linalg.eigh(np.cov(points[:, :2].T))[1][:, 1], 0.0])


def _yaw(rng: np.random.Generator) -> np.ndarray:
    return np.asarray(Rotation.from_euler("z", rng.uniform(-np.pi, np.pi)).as_matrix())


def _axes(points: np.ndarray) -> np.ndarray:
    """Return the principal axes ``(3, 3)``, the longest last."""
    return np.asarray(np.linalg.eigh(np.cov(points.T))[1])


def radius_on_end(points: np.ndarray) -> float:
    """Return the radius, with clearance, of the circle that an object with vertices ``(N, 3)`` passes on end."""
    flat = points @ _axes(points)[:, :2]
    return float(smallest_enclosing_circle(flat)[1]) + LEAST_ROOM_M
