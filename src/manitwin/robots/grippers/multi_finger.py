"""A hand with many joints: its URDF, how its joints are driven, and the postures in which it takes hold."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields
from functools import cached_property
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import BaseModel, TypeAdapter

from manitwin.errors import ConfigError, UsageError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.xml_file import MAX_XML_BYTES
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.robots.grippers.box import STRICT, Box, PlacedBox
from manitwin.robots.links import Link, link_poses, links_of
from manitwin.robots.urdf_reader import HAND, read_urdf

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

    stiffness_nm_rad: float
    damping_nm_s_rad: float
    torque_limit_nm: float
    press_nm: float
    speed_rad_s: float
    armature_kg_m2: float


@dataclass(frozen=True)
class _Described:
    """The part of the gripper's file that is taken as it is."""

    name: str
    sha256: str
    tip_depth_m: float
    force_n: float
    finger_friction: float
    palm_front_m: float
    clearance_m: float
    joints: tuple[str, ...]
    fingers: tuple[tuple[str, ...], ...]
    drive: Drive
    postures: tuple[Posture, ...]
    source: str


@dataclass(frozen=True)
class MultiFingerGripper(_Described):
    """A hand of a thumb and fingers, in the grasp frame: +Z out of the palm, the fingers on +X, the thumb on -X.

    ``joints (J,)`` names the joints in the order of all postures and of a twin's table; ``fingers`` names the links of
    each finger, the thumb first. ``palm_front_m`` is the palm's surface along +Z, ``clearance_m`` how much wider than the
    object it opens on each side.
    """

    kind: ClassVar[str] = "multi_finger"

    root_to_gripper: np.ndarray
    links: tuple[Link, ...]
    urdf_path: Path
    urdf_root: Path

    def mesh_path(self, name: str) -> Path:
        """Return where a mesh of its URDF is; raises ConfigError where it is not there."""
        return _mesh_path(self.urdf_path, self.urdf_root, name)

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


class _UrdfField(BaseModel):
    """The place of the URDF: beside the gripper's file, or in an installed distribution that an extra of this package brings."""

    model_config = STRICT
    file: str
    distribution: str | None = None
    extra: str | None = None


class _RootField(BaseModel):
    """The pose of the URDF's root link in the grasp frame."""

    model_config = STRICT
    position_m: tuple[float, float, float]
    quaternion_wxyz: tuple[float, float, float, float]


@dataclass(frozen=True)
class _File(_Described):
    """The keys of a gripper file of this kind."""

    __pydantic_config__ = STRICT
    urdf: _UrdfField
    root_to_gripper: _RootField


def load_multi_finger(data: dict[str, Any], folder: Path) -> MultiFingerGripper:
    """Make a hand of its file's content; raises UsageError where the URDF is missing, unreadable or has other joints."""
    file = TypeAdapter(_File).validate_python(data)
    path, root = _urdf_path(file.name, file.urdf, folder)
    links = links_of(read_urdf(path, HAND), lambda mesh: _mesh_path(path, root, mesh))
    _check(file, links)
    rotation = rotation_from_quaternion_wxyz(np.array(file.root_to_gripper.quaternion_wxyz))
    described = {field.name: getattr(file, field.name) for field in fields(_Described)}
    content = read_bytes(path, MAX_XML_BYTES, UsageError, name=str(path))
    described["sha256"] = hashlib.sha256(file.sha256.encode() + content).hexdigest()
    root_to_gripper = transform(rotation, np.array(file.root_to_gripper.position_m))
    return MultiFingerGripper(**described, root_to_gripper=root_to_gripper, links=links, urdf_path=path, urdf_root=root)


def _urdf_path(name: str, urdf: _UrdfField, folder: Path) -> tuple[Path, Path]:
    """Return the URDF's path and the folder that its meshes may not leave."""
    if urdf.distribution is None:
        path = (folder / urdf.file).resolve()
        if not path.is_relative_to(folder.resolve()):
            raise UsageError(
                f"gripper {name}: {urdf.file} leaves the folder of the gripper's file; put the URDF beside it"
            )
        if not path.is_file():
            raise UsageError(f"gripper {name}: {path} is not there; put the URDF beside the gripper's file")
        return path, folder
    remedy = f"pip install 'manitwin[{urdf.extra}]'" if urdf.extra else f"pip install {urdf.distribution}"
    try:
        files = distribution(urdf.distribution)
    except PackageNotFoundError as error:
        raise UsageError(f"gripper {name} wants the files of {urdf.distribution}: {remedy}") from error
    path = Path(str(files.locate_file(urdf.file)))
    if not path.is_file():
        raise UsageError(f"gripper {name}: {urdf.distribution} {files.version} has no {urdf.file}: {remedy}")
    return path, path.parent.parent


def _mesh_path(path: Path, root: Path, name: str) -> Path:
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
    raise ConfigError(f"{path}: mesh {name[:120]!r} is not below {root}; put it there")


def _check(file: _File, links: tuple[Link, ...]) -> None:
    """Raise UsageError where names of joints or links are not the URDF's, or a posture has another number of joints."""
    joints = {link.joint for link in links if link.joint_type != "fixed"}
    if set(file.joints) != joints:
        raise UsageError(
            f"gripper {file.name}: joints {sorted(set(file.joints) ^ joints)} are not in both file and URDF; name all joints"
            " of the hand that move"
        )
    unknown = {name for finger in file.fingers for name in finger} - {link.name for link in links}
    if unknown:
        raise UsageError(
            f"gripper {file.name}: the URDF has no links {', '.join(sorted(unknown))}; name links that it has"
        )
    for posture in file.postures:
        rows = {len(row) for row in posture.joints_rad}
        if rows != {len(file.joints)} or len(posture.joints_rad) != len(posture.openings_m):
            raise UsageError(
                f"gripper {file.name}: posture {posture.name} has rows of other lengths; give {len(file.joints)} joint positions"
                f" for each of its {len(posture.openings_m)} openings"
            )
        if not (np.diff(posture.openings_m) > 0).all():
            raise UsageError(
                f"gripper {file.name}: posture {posture.name}: openings_m do not ascend; give them from the narrowest to the"
                " widest"
            )
