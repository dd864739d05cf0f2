"""Robot definition files (TOML): URDF, joints, hand, home position and speeds, and the files they refer to.

Referenced files must lie below the folder of the TOML file, or in an installed distribution.
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

from manitwin.errors import ConfigError, Unavailable, UsageError, unknown_name_message
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.toml_file import MAX_TOML_BYTES, parse_toml
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.robots.grippers.box import STRICT
from manitwin.robots.grippers.quantities import Rotation
from manitwin.robots.robot import Workspace

PACKAGE, FILE = "package://", "file://"
MAX_FILE_BYTES = 64 << 20
"""Size limit of a mesh file; the largest of the 98 meshes of the shipped robots has 1.4 MB."""


class PoseField(BaseModel):
    """Rigid pose: position (m) and unit quaternion wxyz."""

    model_config = STRICT
    position_m: tuple[float, float, float]
    quaternion_wxyz: Rotation

    def matrix(self) -> np.ndarray:
        """Return the pose as a homogeneous matrix ``(4, 4)``."""
        return transform(rotation_from_quaternion_wxyz(np.array(self.quaternion_wxyz)), np.array(self.position_m))


class UrdfField(BaseModel):
    """Location of a URDF: below the TOML file's folder, or in an installed ``distribution``, which an ``extra`` installs.

    ``package://name/x`` resolves to ``package_folder/name/x``; ``package_folder`` and ``srdf`` are relative to the same root
    as ``file``. ``extra`` is one of this package.
    """

    model_config = STRICT
    file: str
    package_folder: str = "."
    srdf: str | None = None
    distribution: str | None = None
    extra: str | None = None


class OwnHand(BaseModel):
    """A parallel hand that is part of the arm's URDF."""

    model_config = STRICT
    kind: Literal["own"]
    gripper: str
    tip_link: str
    finger_joints: tuple[str, str]
    gripper_to_tip: PoseField


class MergedHand(BaseModel):
    """A hand from another URDF, mounted on the arm: the tree below its ``root_link``."""

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
    """A hand generated from the boxes of a parallel gripper's or suction cup's file, mounted on the arm."""

    model_config = STRICT
    kind: Literal["generated"]
    gripper: str
    mount_link: str
    gripper_to_mount: PoseField
    mass_kg: float = Field(gt=0)


class DescribedHand(BaseModel):
    """A multi-finger hand mounted on the arm, with the links of the URDF that its gripper file names."""

    model_config = STRICT
    kind: Literal["described"]
    gripper: str
    mount_link: str
    gripper_to_mount: PoseField


class RobotDefinition(BaseModel):
    """Schema of a robot definition file."""

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
    """Return the names of the single-arm robots in the package."""
    return sorted(path.stem for path in _shipped_folder().iterdir() if path.suffix == ".toml")


def shipped_two_arms() -> list[str]:
    """Return the names of the two-arm robots in the package."""
    return sorted(path.stem for path in _two_arms_folder().iterdir() if path.suffix == ".toml")


def _shipped_folder() -> Path:
    return Path(str(resources.files("manitwin.robots") / "definitions"))


def _two_arms_folder() -> Path:
    return Path(str(resources.files("manitwin.robots") / "two_arm_definitions"))


def definition_path(name_or_path: str) -> Path:
    """Return the definition file of a robot given by shipped name or path; raises UsageError naming valid values."""
    shipped = [*shipped_robots(), *shipped_two_arms()]
    if name_or_path.endswith(".toml"):
        path = Path(name_or_path)
        if not path.is_file():
            raise UsageError(
                f"robot file {name_or_path} does not exist; give a .toml file or one of {', '.join(shipped)}"
            )
        return path
    if name_or_path not in shipped:
        raise UsageError(unknown_name_message("robot", name_or_path, shipped) + ", or a .toml file")
    folder = _shipped_folder() if name_or_path in shipped_robots() else _two_arms_folder()
    return folder / f"{name_or_path}.toml"


def read_definition(path: Path) -> tuple[RobotDefinition, str]:
    """Read a robot definition file and return it with its SHA-256; raises ConfigError naming the file and the invalid key."""
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
    """Resolved paths: the URDF, its SRDF, the folder of its packages, and the boundary folder of all referenced files.

    Files of an ``installed`` distribution may be symbolic links into the installer's cache.
    """

    urdf: Path
    srdf: Path | None
    package_folder: Path
    boundary: Path
    installed: bool

    def mesh(self, name: str) -> Path:
        """Return the path of a mesh of the URDF; raises ConfigError if it is missing, too large or outside the boundary."""
        if name.startswith(PACKAGE):
            wanted = self.package_folder / name.removeprefix(PACKAGE).lstrip("/")
        else:
            wanted = self.urdf.parent / name.removeprefix(FILE)
        return _inside(wanted, self.boundary, self.installed, f"{self.urdf.name}: mesh {name[:120]!r}")


def urdf_files(field: UrdfField, folder: Path, robot: str) -> UrdfFiles:
    """Resolve the paths in a URDF field of a robot file.

    Raises Unavailable if the distribution is not installed, ConfigError if a file is missing or outside its folder.
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
    """Return the absolute path if it lies below the boundary, also after resolving links unless ``links_allowed``.

    Raises ConfigError if it does not, or if the file or ``directory`` is missing or too large.
    """
    try:
        plain, limit = (Path(os.path.normpath(one.absolute())) for one in (path, boundary))
        inside = plain.is_relative_to(limit)
        inside = inside and (links_allowed or path.resolve().is_relative_to(boundary.resolve()))
        there = inside and (plain.is_dir() if directory else plain.is_file())
        too_large = there and plain.stat().st_size > MAX_FILE_BYTES
    except (OSError, ValueError, RuntimeError) as error:  # invalid file name, or a cycle of symbolic links
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
