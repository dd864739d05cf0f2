"""A hand with many joints: its URDF, how its joints are driven, and the postures in which it takes hold."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np

from manitwin.errors import ConfigError
from manitwin.robots.grippers.box import Box, PlacedBox
from manitwin.robots.grippers.quantities import Gap, Length, Name, NotNegative, Positive, Source
from manitwin.robots.links import Link, link_poses

BALL_AS_CUBE = (4 * np.pi / 3) ** (1 / 3) / 2  # half the side of the cube of a ball's volume, in radii
SYMBOL_HALF_WIDTH_M = 0.004
PACKAGE = "package://"


@dataclass(frozen=True)
class Posture:
    """A way to take hold, by its fingertips at several openings; between these it is interpolated.

    ``openings_m (K,)`` ascending are the distances between the pads of thumb and fingers, ``joints_rad (K, J)`` the joints.
    ``depth_m`` is the nearest and the farthest that the middle of what is held may be along +Z of the grasp frame.
    ``grasp_types`` are the twin's types of grasp points that it suits.
    """

    name: str
    grasp_types: tuple[str, ...]
    depth_m: tuple[float, float]
    openings_m: tuple[float, ...]
    joints_rad: tuple[tuple[float, ...], ...]

    def joints_at(self, opening_m: np.ndarray) -> np.ndarray:
        """Return the joints ``(N, J)`` at openings ``(N,)``; beyond the ends, those of the ends."""
        columns = np.array(self.joints_rad).T
        return np.stack([np.interp(opening_m, self.openings_m, column) for column in columns], axis=-1)


@dataclass(frozen=True)
class Drive:
    """The drive of each joint: a spring and damper towards its target, of limited torque.

    A finger's target runs towards the closed posture at ``speed_rad_s``, until a joint of it presses with ``press_nm``.
    """

    stiffness_nm_rad: Positive
    damping_nm_s_rad: NotNegative
    torque_limit_nm: Positive
    press_nm: Positive
    speed_rad_s: Positive
    armature_kg_m2: NotNegative


@dataclass(frozen=True)
class HandNumbers:
    """The part of the gripper's file that is taken as it is."""

    name: Name
    sha256: str
    tip_depth_m: Length
    force_n: Positive
    finger_friction: Positive
    palm_front_m: Gap
    clearance_m: Length
    joints: tuple[str, ...]
    fingers: tuple[tuple[str, ...], ...]
    drive: Drive
    source: Source


@dataclass(frozen=True)
class MultiFingerGripper(HandNumbers):
    """A hand of a thumb and fingers, in the grasp frame: +Z out of the palm, the fingers on +X, the thumb on -X.

    ``joints (J,)`` names the joints in the order of all postures and of a twin's table; ``fingers`` names the links of
    each finger, the thumb first. ``palm_front_m`` is the palm's surface along +Z, ``clearance_m`` how much wider than the
    object it opens on each side.
    """

    kind: ClassVar[str] = "multi_finger"

    postures: tuple[Posture, ...]
    root_to_gripper: np.ndarray
    links: tuple[Link, ...]
    urdf_path: Path
    urdf_root: Path

    def mesh_path(self, name: str) -> Path:
        """Return where a mesh of its URDF is; raises ConfigError where it is not there."""
        return find_mesh(self.urdf_path, self.urdf_root, name)

    @property
    def opening_m(self) -> float:
        """The widest thing that fits between thumb and fingers."""
        return max(posture.openings_m[-1] for posture in self.postures) - 2 * self.clearance_m

    @cached_property
    def finger_of_link(self) -> np.ndarray:
        """The finger that each link belongs to ``(L,)``; -1: the palm."""
        owner = {name: number for number, names in enumerate(self.fingers) for name in names}
        return np.array([owner.get(link.name, -1) for link in self.links])

    def link_poses(self, joints_rad: np.ndarray) -> np.ndarray:
        """Return the poses ``(L, 4, 4)`` of the links in the grasp frame at joints ``(J,)``."""
        poses = link_poses(self.links, dict(zip(self.joints, joints_rad.tolist(), strict=True)))
        return np.asarray(self.root_to_gripper @ poses)

    def boxes_at(self, joints_rad: np.ndarray) -> list[PlacedBox]:
        """Return ``(box_to_gripper, half_extents_m)`` of all shapes at joints ``(J,)``; a ball is a cube of its volume."""
        placed = []
        for pose, link in zip(self.link_poses(joints_rad), self.links, strict=True):
            for shape in link.shapes:
                box_to_link, half_m = shape.bounding_box()
                placed.append((pose @ box_to_link, half_m * (BALL_AS_CUBE if shape.radius_m is not None else 1.0)))
        return placed

    def boxes(self, opening_m: float) -> list[PlacedBox]:
        """Return the boxes in the first posture at an opening."""
        return self.boxes_at(self.postures[0].joints_at(np.array(opening_m)))

    def symbol(self, width_m: float) -> list[PlacedBox]:
        """Return the boxes that stand for the hand in a drawing of many grasps: a palm, a thumb, a finger."""
        half = SYMBOL_HALF_WIDTH_M
        reach = (self.tip_depth_m - self.palm_front_m) / 2
        finger = Box((half, 0, self.palm_front_m + reach), (half, half, reach))
        palm = Box((0, 0, self.palm_front_m / 2), (self.opening_m / 2, half, self.palm_front_m / 2))
        return [palm.placed(), finger.placed(width_m / 2, 1), finger.placed(width_m / 2, -1)]


def find_mesh(path: Path, root: Path, name: str) -> Path:
    """Return where a mesh is: beside the URDF, or for ``package://`` below the nearest folder above it that has it."""
    relative = name.removeprefix(PACKAGE).removeprefix("file://")
    folders = [path.parent, *path.parent.parents] if name.startswith(PACKAGE) else [path.parent]
    for folder in folders:
        try:
            found = (folder / relative).resolve()
            if found.is_relative_to(root.resolve()) and found.is_file():
                return found
        except (OSError, ValueError):  # a name that no file system can hold
            continue
    raise ConfigError(f"{path}: mesh {name[:120]!r} is not below {root}; put it there, or correct its name in the URDF")
