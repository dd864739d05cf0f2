"""A robot's TOML file: its URDF, joints, hand, home and speeds; and the files that it names.

They lie below the TOML file's folder and nowhere else, or in an installed distribution.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from importlib import resources
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, Field, ValidationError

from manitwin.errors import ConfigError, Unavailable, UsageError, choose_from
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.toml_file import MAX_TOML_BYTES, parse_toml
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.robots.grippers.box import STRICT
from manitwin.robots.grippers.quantities import Rotation
from manitwin.robots.robot import Workspace

PACKAGE, FILE = "package://", "file://"
MAX_FILE_BYTES = 64 << 20
"""The largest mesh of the shipped robots' 98 files is 1.4 MB."""


class PoseField(BaseModel):
    """A rigid pose."""

    model_config = STRICT
    position_m: tuple[float, float, float]
    quaternion_wxyz: Rotation

    def matrix(self) -> np.ndarray:
        """Return the pose ``(4, 4)``."""
        return transform(rotation_from_quaternion_wxyz(np.array(self.quaternion_wxyz)), np.array(self.position_m))


class UrdfField(BaseModel):
    """The location of a URDF: below the TOML file's folder, or in an installed distribution that an extra of this package brings.

    ``package://name/x`` is ``package_folder/name/x``; that folder is given as ``file`` is.
    """

    model_config = STRICT
    file: str
    package_folder: str = "."
    srdf: str | None = None
    distribution: str | None = None
    extra: str | None = None


class OwnHand(BaseModel):
    """A hand that the arm's URDF has already."""

    model_config = STRICT
    kind: Literal["own"]
    gripper: str
    tip_link: str
    finger_joints: tuple[str, str]
    gripper_to_tip: PoseField


class MergedHand(BaseModel):
    """A hand of another URDF, mounted: the tree below its ``root_link``."""

    model_config = STRICT
    kind: Literal["merged"]
    gripper: str
    urdf: UrdfField
    root_link: str
    mount_link: str
    root_to_mount: PoseField
    tip_link: str
    finger_joints: tuple[str, str]
    gripper_to_tip: PoseField


class GeneratedHand(BaseModel):
    """A hand made of the boxes of the file of a parallel gripper or a suction cup, mounted."""

    model_config = STRICT
    kind: Literal["generated"]
    gripper: str
    mount_link: str
    gripper_to_mount: PoseField
    mass_kg: float = Field(gt=0)


class DescribedHand(BaseModel):
    """A hand with many joints, mounted: the links of the URDF that its gripper's file names."""

    model_config = STRICT
    kind: Literal["described"]
    gripper: str
    mount_link: str
    gripper_to_mount: PoseField


class RobotDefinition(BaseModel):
    """The keys of a robot's file."""

    model_config = STRICT
    name: str
    source: str
    base_link: str
    arm_joints: tuple[str, ...] = Field(min_length=1)
    home_rad: tuple[float, ...]
    velocity_fraction: float = Field(gt=0, le=1)
    acceleration_rad_s2: float = Field(gt=0)
    limits_rad: dict[str, tuple[float, float]] = {}
    fixed_joints: dict[str, float] = {}
    urdf: UrdfField
    hand: Annotated[OwnHand | MergedHand | GeneratedHand | DescribedHand, Field(discriminator="kind")]
    workspace: Workspace


def shipped_robots() -> list[str]:
    """Return the names of the robots that come with the package."""
    return sorted(path.stem for path in _shipped_folder().iterdir() if path.suffix == ".toml")


def shipped_two_arms() -> list[str]:
    """Return the names of the sets of two arms that come with the package."""
    return sorted(path.stem for path in _two_arms_folder().iterdir() if path.suffix == ".toml")


def _shipped_folder() -> Path:
    return Path(str(resources.files("manitwin.robots") / "definitions"))


def _two_arms_folder() -> Path:
    return Path(str(resources.files("manitwin.robots") / "two_arm_definitions"))


def definition_path(name_or_path: str) -> Path:
    """Return the file of a robot given by its shipped name or by path; raises UsageError naming what would be valid."""
    shipped = [*shipped_robots(), *shipped_two_arms()]
    if name_or_path.endswith(".toml"):
        path = Path(name_or_path)
        if not path.is_file():
            raise UsageError(
                f"robot file {name_or_path} does not exist; give a .toml file or one of {', '.join(shipped)}"
            )
        return path
    if name_or_path not in shipped:
        raise UsageError(choose_from("robot", name_or_path, shipped) + ", or a .toml file")
    folder = _shipped_folder() if name_or_path in shipped_robots() else _two_arms_folder()
    return folder / f"{name_or_path}.toml"


def read_definition(path: Path) -> tuple[RobotDefinition, str]:
    """Read a robot's file and its SHA-256; raises ConfigError naming the file and the key that is wrong."""
    content = read_bytes(path, MAX_TOML_BYTES, ConfigError, name=f"robot file {path}")
    try:
        definition = RobotDefinition.model_validate(parse_toml(content, f"robot file {path}", ConfigError))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ConfigError(f"robot file {path}: {where}: {first['msg']}") from error
    if len(definition.home_rad) != len(definition.arm_joints):
        raise ConfigError(f"robot file {path}: home_rad needs {len(definition.arm_joints)} values, one per arm joint")
    return definition, hashlib.sha256(content).hexdigest()


@dataclass(frozen=True)
class UrdfFiles:
    """A URDF's own path, its SRDF's, the folder of its packages, and the folder that none of its files may leave.

    The files of an ``installed`` distribution may be links into the installer's cache.
    """

    urdf: Path
    srdf: Path | None
    package_folder: Path
    boundary: Path
    installed: bool

    def mesh(self, name: str) -> Path:
        """Return where a mesh of the URDF is; raises ConfigError where it is missing, too large or outside."""
        if name.startswith(PACKAGE):
            wanted = self.package_folder / name.removeprefix(PACKAGE).lstrip("/")
        else:
            wanted = self.urdf.parent / name.removeprefix(FILE)
        return _inside(wanted, self.boundary, self.installed, f"{self.urdf.name}: mesh {name[:120]!r}")


def urdf_files(field: UrdfField, folder: Path, robot: str) -> UrdfFiles:
    """Return the places that a robot's file names.

    Raises Unavailable where the distribution is not installed, ConfigError where a file is not there or leaves its folder.
    """
    installed = field.distribution is not None
    root = _distribution_folder(field, robot) if installed else folder
    packages = _inside(root / field.package_folder, root, installed, f"robot {robot}: package_folder", directory=True)
    urdf = _inside(root / field.file, root, installed, f"robot {robot}: URDF {field.file!r}")
    srdf = None
    if field.srdf is not None:
        srdf = _inside(root / field.srdf, root, installed, f"robot {robot}: SRDF {field.srdf!r}")
    return UrdfFiles(urdf, srdf, packages, packages if installed else root, installed)


def _distribution_folder(field: UrdfField, robot: str) -> Path:
    remedy = f"pip install 'manitwin[{field.extra}]'" if field.extra else f"pip install {field.distribution}"
    try:
        return Path(str(distribution(str(field.distribution)).locate_file("")))
    except PackageNotFoundError as error:
        raise Unavailable(f"robot {robot} needs the files of {field.distribution}: {remedy}") from error


def _inside(path: Path, boundary: Path, links_allowed: bool, what: str, directory: bool = False) -> Path:
    """Return an absolute path below the boundary, where its links lead too unless they are allowed to; else raise ConfigError."""
    try:
        plain, limit = (Path(os.path.normpath(one.absolute())) for one in (path, boundary))
        inside = plain.is_relative_to(limit)
        inside = inside and (links_allowed or path.resolve().is_relative_to(boundary.resolve()))
        there = inside and (plain.is_dir() if directory else plain.is_file())
        too_large = there and plain.stat().st_size > MAX_FILE_BYTES
    except (OSError, ValueError, RuntimeError) as error:  # a name that no file system can hold, or links in a circle
        raise ConfigError(f"{what} is not a valid file name: {error}; correct the name") from error
    if not inside:
        raise ConfigError(f"{what} lies outside {boundary}; put it below that folder")
    if not there:
        raise ConfigError(f"{what} is not there: looked for {plain}; put it there, or correct the name")
    if too_large:
        raise ConfigError(
            f"{what} is larger than {MAX_FILE_BYTES >> 20} MiB, which is too large for a robot file; make it smaller"
        )
    return plain
