"""Multi-finger hand: its URDF, joint drives, and grasp postures."""

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

BALL_AS_CUBE = (4 * np.pi / 3) ** (1 / 3) / 2  # half side, in radii, of the cube with a ball's volume
SYMBOL_HALF_WIDTH_M = 0.004
PACKAGE = "package://"


@dataclass(frozen=True)
class Posture:
    """Grasp posture: joint positions at several openings, with linear interpolation between them.

    ``openings_m (K,)`` is increasing and gives the gap between the pads of thumb and fingers; ``joints_rad (K, J)`` are the
    joint positions. ``depth_m`` is the smallest and largest coordinate along +Z of the grasp frame for the centre of the held
    object. ``grasp_types`` are the types of grasp points of a twin that the posture suits.
    """

    name: str
    grasp_types: tuple[str, ...]
    depth_m: tuple[float, float]
    openings_m: tuple[float, ...]
    joints_rad: tuple[tuple[float, ...], ...]

    def joints_at(self, opening_m: np.ndarray) -> np.ndarray:
        """Return the joint positions ``(N, J)`` at openings ``(N,)``, clamped at both ends."""
        columns = np.array(self.joints_rad).T
        return np.stack([np.interp(opening_m, self.openings_m, column) for column in columns], axis=-1)


@dataclass(frozen=True)
class Drive:
    """Joint drive: spring and damper towards the target, with limited torque.

    A finger's target moves towards the closed posture at ``speed_rad_s`` until one of its joints presses with ``press_nm``.
    """

    stiffness_nm_rad: Positive
    damping_nm_s_rad: NotNegative
    torque_limit_nm: Positive
    press_nm: Positive
    speed_rad_s: Positive
    armature_kg_m2: NotNegative


@dataclass(frozen=True)
class HandParameters:
    """Fields of the gripper file that are used unchanged."""

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
class MultiFingerGripper(HandParameters):
    """Hand with a thumb and fingers. Grasp frame: +Z out of the palm, the fingers on +X, the thumb on -X.

    ``joints (J,)`` names the joints in the order of all postures and of a twin's grasp table. ``fingers`` names the links of
    each finger, thumb first. ``palm_front_m`` is the palm's surface along +Z; ``clearance_m`` is the extra opening on each
    side of the object.
    """

    kind: ClassVar[str] = "multi_finger"

    postures: tuple[Posture, ...]
    root_to_gripper: np.ndarray
    links: tuple[Link, ...]
    urdf_path: Path
    urdf_root: Path

    def mesh_path(self, name: str) -> Path:
        """Return the path of a mesh of the URDF; raises ConfigError if it does not exist."""
        return find_mesh(self.urdf_path, self.urdf_root, name)

    @property
    def opening_m(self) -> float:
        """The largest width that fits between thumb and fingers."""
        return max(posture.openings_m[-1] for posture in self.postures) - 2 * self.clearance_m

    @cached_property
    def finger_of_link(self) -> np.ndarray:
        """The finger index of each link, ``(L,)``; -1 for the palm."""
        owner = {name: number for number, names in enumerate(self.fingers) for name in names}
        return np.array([owner.get(link.name, -1) for link in self.links])

    def link_poses(self, joints_rad: np.ndarray) -> np.ndarray:
        """Return the poses ``(L, 4, 4)`` of the links in the grasp frame at joint positions ``(J,)``."""
        poses = link_poses(self.links, dict(zip(self.joints, joints_rad.tolist(), strict=True)))
        return np.asarray(self.root_to_gripper @ poses)

    def boxes_at(self, joints_rad: np.ndarray) -> list[PlacedBox]:
        """Return ``(box_to_gripper, half_extents_m)`` of all shapes at joints ``(J,)``; balls become cubes of equal volume."""
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
        """Return the boxes that represent the hand in drawings of many grasps: a palm, a thumb, a finger."""
        half = SYMBOL_HALF_WIDTH_M
        reach = (self.tip_depth_m - self.palm_front_m) / 2
        finger = Box((half, 0, self.palm_front_m + reach), (half, half, reach))
        palm = Box((0, 0, self.palm_front_m / 2), (self.opening_m / 2, half, self.palm_front_m / 2))
        return [palm.placed(), finger.placed(width_m / 2, 1), finger.placed(width_m / 2, -1)]


def find_mesh(path: Path, root: Path, name: str) -> Path:
    """Return the path of a mesh: relative to the URDF, or for ``package://`` to the nearest parent folder that contains it.

    Raises ConfigError if the mesh does not exist below ``root``.
    """
    relative = name.removeprefix(PACKAGE).removeprefix("file://")
    folders = [path.parent, *path.parent.parents] if name.startswith(PACKAGE) else [path.parent]
    for folder in folders:
        try:
            found = (folder / relative).resolve()
            if found.is_relative_to(root.resolve()) and found.is_file():
                return found
        except (OSError, ValueError):  # invalid file name
            continue
    raise ConfigError(f"{path}: mesh {name[:120]!r} is not below {root}; put it there, or correct its name in the URDF")
