"""Functional frames and resting poses of a twin, transformed to the pose in which it was located."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import ConvexHull

from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform, transform_points
from manitwin.scenes.locate.depth_view import DepthView
from manitwin.scenes.locate.proposals import Plane
from manitwin.scenes.locate.recognition import ViewedObject
from manitwin.scenes.locate.transferred_grasps import ALIKE_M, CLEARANCE_M, visible_neighbour_points
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.point_records import FunctionalPoint

_EDGE_PX = 7
"""Dilation of a mask in pixels, so that edge pixels of the object that the mask missed do not count as neighbours."""
STANDS_RAD = np.deg2rad(10.0)
"""An object that leans by less stands in that resting pose."""


@dataclass(frozen=True)
class TransferredFrame:
    """A functional point of a twin in the camera's frame: ``frame_to_camera (4, 4)``, m.

    Z is its direction. If the point has no frame (``kind`` is None), +Z is along its normal, and X is arbitrary. ``certain``:
    it, or another point of the same label, is at this position in all poses of the answer and under all symmetries of the
    shape; depth cannot distinguish the lid of a can from its base.
    """

    point_id: str
    label: str
    kind: str | None
    frame_to_camera: np.ndarray
    size_m: float | None
    certain: bool


@dataclass(frozen=True)
class TransferredPlacement:
    """A resting pose of a twin on the observed table at the object's location: ``object_to_camera (4, 4)``, m.

    Its rotation about the table's normal is the closest to the observed pose. ``stands``: it is the current resting pose.
    ``free``: nothing visible beside the object is within its convex hull at this pose.
    """

    number: int
    probability: float
    upright: bool
    object_to_camera: np.ndarray
    stands: bool
    free: bool


def transfer_frames(thing: ViewedObject, twin: Twin, factor: float = 1.0) -> tuple[TransferredFrame, ...]:
    """Return a twin's functional points at its best pose, scaled by ``factor``; empty if it was not found."""
    poses = [pose.object_to_camera for pose in thing.location.poses]
    points = twin.record.points
    if not poses or points is None or not points.functional:
        return ()
    owns = [_own_frame(point, factor) for point in points.functional]
    places_m = np.array([own[:3, 3] for own in owns])
    labels = np.array([point.label for point in points.functional])
    there_m = np.array(
        [transform_points(pose @ same, places_m) for pose in poses for same in thing.model.symmetry_poses]
    )
    found = []
    for point, own in zip(points.functional, owns, strict=True):
        apart_m = np.linalg.norm(there_m[:, labels == point.label] - (poses[0] @ own)[:3, 3], axis=2)
        found.append(
            TransferredFrame(
                point.id,
                point.label,
                None if point.frame is None else point.frame.kind,
                poses[0] @ own,
                None if point.frame is None else factor * point.frame.size_m,
                bool(apart_m.min(1).max() < ALIKE_M),
            )
        )
    return tuple(found)


def _own_frame(point: FunctionalPoint, factor: float) -> np.ndarray:
    """Return a point's frame ``(4, 4)`` in the object frame, scaled by ``factor``."""
    frame = point.frame
    if frame is None:
        own = transform(_with_z(np.array(point.normal)), np.array(point.position_m))
    else:
        own = transform(rotation_from_quaternion_wxyz(np.array(frame.quaternion_wxyz)), np.array(frame.position_m))
    own[:3, 3] *= factor
    return own


def transfer_placements(
    thing: ViewedObject, twin: Twin, view: DepthView, plane: Plane, noise_m: float
) -> tuple[TransferredPlacement, ...]:
    """Return a twin's settled resting poses on the observed table at its location; empty if it was not found."""
    poses = [pose.object_to_camera for pose in thing.location.poses]
    if not poses:
        return ()
    up = plane.normal
    middle = transform_points(poses[0], thing.model.center[None])[0]
    below = middle - plane.height_m(middle) * up
    plane_to_camera = _with_z(up)
    own = cv2.dilate(thing.mask.astype(np.uint8), np.ones((_EDGE_PX, _EDGE_PX), np.uint8)).astype(bool)
    obstacles = visible_neighbour_points(view, own, poses[0][:3, 3])
    obstacles = obstacles[plane.height_m(obstacles) > CLEARANCE_M + 2 * noise_m]  # the table supports it
    found = []
    for number, each in enumerate(twin.record.placements or []):
        if not each.settled:
            continue
        to_plane = rotation_from_quaternion_wxyz(np.array(each.quaternion_wxyz))
        turned = plane_to_camera @ _nearest_turn(plane_to_camera.T @ poses[0][:3, :3] @ to_plane.T) @ to_plane
        lowest_m = float((thing.model.points @ (turned.T @ up)).min())
        center = turned @ thing.model.center
        pose = transform(turned, below - center + (center @ up) * up - lowest_m * up)
        leans_rad = float(np.arccos(np.clip((to_plane[2] @ (poses[0][:3, :3].T @ up)), -1, 1)))
        hull = ConvexHull(transform_points(pose, thing.model.points)).equations
        inside = (hull[:, :3] @ obstacles.T + hull[:, 3:] <= CLEARANCE_M + 2 * noise_m).all(0)
        found.append(
            TransferredPlacement(
                number, each.probability, each.upright, pose, bool(leans_rad < STANDS_RAD), not bool(inside.any())
            )
        )
    return tuple(found)


def _nearest_turn(rotation: np.ndarray) -> np.ndarray:
    """Return the rotation about Z ``(3, 3)`` that is closest to a rotation."""
    angle = np.arctan2(rotation[1, 0] - rotation[0, 1], rotation[0, 0] + rotation[1, 1])
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _with_z(axis: np.ndarray) -> np.ndarray:
    """Return a rotation ``(3, 3)`` with the given Z axis, and X perpendicular to it and to its smallest component."""
    z = axis / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[int(np.abs(z).argmin())], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
