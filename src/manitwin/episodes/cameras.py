"""Named cameras around a robot's workspace, and one on its hand."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from manitwin.errors import UsageError, unknown_name_message
from manitwin.geometry.poses import transform
from manitwin.render.cameras import OPENGL_TO_OPENCV, Camera, look_at
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.robot import Robot
from manitwin.robots.two_arms import base_to_world

FOV_Y_RAD = 0.75
WRIST_FOV_Y_RAD = 1.2  # about that of small cameras mounted on hands (69 degrees)
BESIDE_M = 0.1  # margin beside the bases of two arms in the picture
WRIST_CLEARANCE_M = 0.045  # distance of the camera from the palm


@dataclass(frozen=True)
class NamedCamera:
    """A pinhole camera, fixed in the world or mounted on the hand (``on_hand``).

    ``camera_to_mount (4, 4)``, with OpenGL axes, is its pose in the world, or in the grasp frame (+Z approach, X closing).
    """

    name: str
    camera_to_mount: np.ndarray
    fov_y_rad: float
    on_hand: bool = False

    def placed(self, gripper_to_world: np.ndarray, width_px: int, height_px: int) -> Camera:
        """Return the camera in the world, for a hand at ``gripper_to_world (4, 4)``."""
        pose = gripper_to_world @ self.camera_to_mount if self.on_hand else self.camera_to_mount
        return Camera(pose, self.fov_y_rad, width_px, height_px)

    def to_json(self, width_px: int, height_px: int) -> dict[str, Any]:
        """Return intrinsics and pose with OpenCV axes, as stored in LeRobot sets.

        The pose is in the frame ``world``, or ``tip`` (the first arm's) for a camera on the hand. The centre of the upper
        left pixel is (0.5, 0.5).
        """
        focal_px = self.placed(np.eye(4), width_px, height_px).focal_px
        return {
            "camera.intrinsics_px": [[focal_px, 0.0, width_px / 2], [0.0, focal_px, height_px / 2], [0.0, 0.0, 1.0]],
            "camera.frame": "tip" if self.on_hand else "world",
            "camera.camera_to_frame": (self.camera_to_mount @ OPENGL_TO_OPENCV).tolist(),
        }


def named_cameras(names: Iterable[str], robot: Robot) -> list[NamedCamera]:
    """Return cameras by name: ``front``, ``side``, ``top`` or ``wrist``, positioned by the robot's workspace and hand.

    ``front`` looks at the robot from beyond its workspace, ``side`` from its right, ``top`` straight down (the robot at the
    left), ``wrist`` along the approach, past the fingers. For two arms, ``front`` looks across the line between them, from
    the first arm's left. Raises UsageError for another name.
    """
    makers = {"front": _front, "side": _side, "top": _top, "wrist": _wrist}
    cameras = []
    for name in names:
        if name not in makers:
            raise UsageError(unknown_name_message("camera", name, makers))
        cameras.append(makers[name](robot))
    return cameras


def _front(robot: Robot) -> NamedCamera:
    if robot.arms:
        return _front_of_two(robot)
    reach = robot.workspace.max_radius_m
    return _standing("front", np.array([0.62 * reach + 1.15, 0.0, 0.95]), np.array([0.45 * reach, 0.0, 0.22]))


def _front_of_two(robot: Robot) -> NamedCamera:
    """Return a camera that looks across the line between the bases; beyond the workspace the second arm would block the view."""
    first, second = (base_to_world(arm)[:3, 3] for arm in robot.arms)
    middle, along = (first + second) / 2, (second - first)[:2]
    apart_m = float(np.hypot(*along))
    left = np.array([-along[1], along[0], 0.0]) / apart_m
    away_m = (apart_m / 2 + BESIDE_M) / np.tan(FOV_Y_RAD / 2)
    above = middle + np.array([0.0, 0.0, 0.22])
    return _standing("front", above + away_m * left + np.array([0.0, 0.0, 0.73]), above)


def _side(robot: Robot) -> NamedCamera:
    reach = robot.workspace.max_radius_m
    return _standing("side", np.array([0.55 * reach, -1.5, 0.65]), np.array([0.5 * reach, 0.0, 0.22]))


def _top(robot: Robot) -> NamedCamera:
    middle = (robot.workspace.min_radius_m + robot.workspace.max_radius_m) / 2
    return _standing("top", np.array([middle, 0.0, 1.75]), np.array([middle, 0.0, 0.0]))


def _standing(name: str, eye: np.ndarray, target: np.ndarray) -> NamedCamera:
    return NamedCamera(name, look_at(eye, target), FOV_Y_RAD)


def _wrist(robot: Robot) -> NamedCamera:
    """Return a camera beside the palm, off the closing plane, directed at the fingertips."""
    gripper = robot.gripper
    palm = gripper.boxes(gripper.opening_m)
    if isinstance(gripper, ParallelGripper):
        palm = [box.placed() for box in gripper.palm_boxes]
    thick = max((float(pose[1, 3] + np.abs(pose[1, :3]) @ half) for pose, half in palm), default=0.0)
    eye = np.array([0.0, thick + WRIST_CLEARANCE_M, 0.45 * robot.gripper.tip_depth_m])
    target = np.array([0.0, 0.02, robot.gripper.tip_depth_m + 0.03])
    backward = (eye - target) / np.linalg.norm(eye - target)
    right = np.array([1.0, 0.0, 0.0])
    return NamedCamera(
        "wrist",
        transform(np.stack([right, np.cross(backward, right), backward], 1), eye),
        WRIST_FOV_Y_RAD,
        on_hand=True,
    )
