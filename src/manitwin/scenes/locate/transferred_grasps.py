"""Verified grasps of a twin, transformed to its located pose and filtered by visible obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from manitwin.geometry.poses import inverse, rotation_angle_rad, transform_points
from manitwin.robots.grippers.box import PlacedBox
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.grippers.twin_grippers import find_gripper
from manitwin.scenes.locate.depth_view import DepthView, known_depth
from manitwin.scenes.locate.proposals import Plane
from manitwin.scenes.locate.recognition import ViewedObject
from manitwin.twin.loaded_twin import Grasps, Twin

CLEARANCE_M = 0.004
"""Clearance between the hand and visible neighbours, in addition to twice the noise."""
OPEN_M = 0.02
"""Total extra opening of the hand beyond the grasp width, where possible."""
APPROACH_M = (0.0, 0.03, 0.06, 0.1)
"""Distances back along the approach direction at which the hand must be free too."""
ALIKE_M, ALIKE_RAD = 0.01, np.deg2rad(12)
"""Tolerances for ambiguous poses: a grasp counts if it is this close to a verified one in each of the poses."""
_AROUND_M = 0.35
_MOST_POINTS = 6000
_MOST_TURNS = 12
_SIGNS = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T


@dataclass(frozen=True)
class TransferredGrasp:
    """A verified grasp in the camera's frame: ``gripper_to_camera (4, 4)``, m; ``value`` (0 to 1) is its expected quality.

    ``reached``: whether a robot's arm reaches it; None if no robot was considered.
    """

    grasp_id: str
    gripper_to_camera: np.ndarray
    width_m: float
    value: float
    reached: bool | None = None


@dataclass(frozen=True)
class TransferredGrasps:
    """The usable grasps, best first, and the counts of verified, obstructed and uncertain ones.

    ``robot`` is the one whose reach was tested; grasps that it reaches come first.
    """

    gripper: str
    verified: int
    obstructed: int
    uncertain: int
    grasps: tuple[TransferredGrasp, ...]
    robot: str | None = None


def transfer_grasps(
    thing: ViewedObject, twin: Twin, view: DepthView, plane: Plane, noise_m: float, grippers: Sequence[Gripper] = ()
) -> TransferredGrasps | None:
    """Return a twin's verified grasps at its best pose that are free of the observed table and neighbours.

    If the pose is ambiguous, a grasp counts if it is one of the twin's in every pose. Poses that are equivalent by symmetry of
    the shape are tried in turn, since any of them may be the true one. The open hand is tested at the grasp and over the last
    10 cm of its approach, against visible neighbours and the whole plane of the table, but not against other hidden space.
    ``grippers`` are user-defined grippers with which twins were built. None if nothing was found, or the twin has no grasps of
    a parallel gripper.
    """
    location = thing.location
    if not location.poses or twin.record.grasps is None:
        return None
    gripper = find_gripper(twin.record.grasps.gripper, twin.record.grasps.gripper_sha256, grippers)
    if not isinstance(gripper, ParallelGripper):
        return None
    grasps = twin.grasps()
    poses = [pose.object_to_camera for pose in location.poses]
    certain = np.ones(len(grasps), bool)
    for other in poses[1:]:
        certain &= _verified_in_other_pose(grasps, poses[0], other)
    turns = thing.model.symmetry_poses[:: max(1, len(thing.model.symmetry_poses) // _MOST_TURNS)]
    obstacles = visible_neighbour_points(view, thing.mask, poses[0][:3, 3])
    clearance_m = CLEARANCE_M + 2 * noise_m
    found: list[TransferredGrasp] = []
    for place in np.flatnonzero(certain):
        width_m = float(grasps.width_m[place])
        boxes = gripper.boxes(min(gripper.opening_m, width_m + OPEN_M))
        tried = (poses[0] @ turn @ grasps.gripper_to_object[place] for turn in turns)
        at = next((each for each in tried if _is_free(each, boxes, obstacles, plane, clearance_m)), None)
        if at is not None:
            found.append(TransferredGrasp(grasps.columns["grasp_id"][place], at, width_m, _value(grasps, int(place))))
    found.sort(key=lambda each: (-each.value, each.grasp_id))
    return TransferredGrasps(
        gripper.name,
        len(grasps),
        int(certain.sum()) - len(found),
        len(grasps) - int(certain.sum()),
        tuple(found),
    )


def _verified_in_other_pose(grasps: Grasps, pose: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return which grasps at one pose are also close to one of the twin's in another pose, ``(N,) bool``."""
    known = grasps.gripper_to_object
    if not len(known):
        return np.zeros(len(grasps), bool)
    there = (inverse(other) @ pose) @ grasps.gripper_to_object
    tree = cKDTree(known[:, :3, 3])
    return np.array(
        [
            any(rotation_angle_rad(known[k, :3, :3].T @ each[:3, :3]) < ALIKE_RAD for k in near)
            for each, near in zip(there, tree.query_ball_point(there[:, :3, 3], ALIKE_M), strict=True)
        ]
    )


def visible_neighbour_points(view: DepthView, mask: np.ndarray, center: np.ndarray) -> np.ndarray:
    """Return points ``(N, 3)`` of visible surfaces near the object that do not belong to it."""
    points = view.points(np.flatnonzero(known_depth(view) & ~mask))
    points = points[np.linalg.norm(points - center, axis=1) < _AROUND_M]
    return points[:: max(1, len(points) // _MOST_POINTS)]


def _is_free(
    gripper_to_camera: np.ndarray, boxes: list[PlacedBox], obstacles: np.ndarray, plane: Plane, clearance_m: float
) -> bool:
    """Return whether the hand's boxes contain no obstacle point and do not cross the table, over the whole approach."""
    local = transform_points(inverse(gripper_to_camera), obstacles)
    for box_to_gripper, half_m in boxes:
        in_box = transform_points(inverse(box_to_gripper), local)
        back = box_to_gripper[:3, :3].T @ np.array([0.0, 0.0, 1.0])
        for step_m in APPROACH_M:
            if (np.abs(in_box + step_m * back) < half_m + clearance_m).all(1).any():
                return False
        corners = transform_points(gripper_to_camera @ box_to_gripper, _SIGNS * half_m)
        if plane.height_m(corners).min() < 0:
            return False
    return True


def _value(grasps: Grasps, place: int) -> float:
    """Return the posterior mean of the success rate in perturbed trials, if there were any, else the score."""
    share, trials = (grasps.columns[name][place] for name in ("robustness", "robustness_trials"))
    return float((share * trials + 1) / (trials + 2)) if trials else float(grasps.score[place])
