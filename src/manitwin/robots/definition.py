"""A robot's TOML file: which URDF, which joints and hand, where home is, how fast it may move."""

from __future__ import annotations

import hashlib
import tomllib
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, Field, ValidationError, field_validator

from manitwin.errors import UsageError, choose_from
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.robots.grippers.fields import STRICT

UNIT_TOLERANCE = 1e-6


class PoseField(BaseModel):
    """A rigid pose."""

    model_config = STRICT
    position_m: tuple[float, float, float]
    quaternion_wxyz: tuple[float, float, float, float]

    @field_validator("quaternion_wxyz")
    @classmethod
    def _unit(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if abs(np.linalg.norm(value) - 1) > UNIT_TOLERANCE:
            raise ValueError("a rotation is a quaternion wxyz of length 1")
        return value

    def matrix(self) -> np.ndarray:
        """Return the pose ``(4, 4)``."""
        return transform(rotation_from_quaternion_wxyz(np.array(self.quaternion_wxyz)), np.array(self.position_m))


class UrdfField(BaseModel):
    """Where a URDF is: below the TOML file's folder, or in an installed distribution that an extra of this package brings.

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
    """A hand made of the boxes of a parallel gripper's file, mounted."""

    model_config = STRICT
    kind: Literal["generated"]
    gripper: str
    mount_link: str
    gripper_to_mount: PoseField
    mass_kg: float = Field(gt=0)


class WorkspaceField(BaseModel):
    """Where an object on the table can be reached from above."""

    model_config = STRICT
    min_radius_m: float = Field(ge=0)
    max_radius_m: float = Field(gt=0)
    half_angle_rad: float = Field(gt=0, le=float(np.pi))


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
    hand: Annotated[OwnHand | MergedHand | GeneratedHand, Field(discriminator="kind")]
    workspace: WorkspaceField


def shipped_robots() -> list[str]:
    """Return the names of the robots that come with the package."""
    return sorted(path.stem for path in _shipped_folder().iterdir() if path.suffix == ".toml")


def _shipped_folder() -> Path:
    return Path(str(resources.files("manitwin.robots") / "definitions"))


def definition_path(name_or_path: str) -> Path:
    """Return the file of a robot given by its shipped name or by path; raises UsageError naming what would be valid."""
    if name_or_path.endswith(".toml"):
        path = Path(name_or_path)
        if not path.is_file():
            raise UsageError(
                f"robot file {name_or_path} is not there; give a .toml file or one of {', '.join(shipped_robots())}"
            )
        return path
    if name_or_path not in shipped_robots():
        raise UsageError(choose_from("robot", name_or_path, shipped_robots()) + ", or a .toml file")
    return _shipped_folder() / f"{name_or_path}.toml"


def read_definition(path: Path) -> tuple[RobotDefinition, str]:
    """Read a robot's file and its SHA-256; raises UsageError naming the file and the key that is wrong."""
    content = path.read_bytes()
    try:
        definition = RobotDefinition.model_validate(tomllib.loads(content.decode()))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UsageError(f"robot file {path}: not TOML: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise UsageError(f"robot file {path}: {where}: {first['msg']}") from error
    if len(definition.home_rad) != len(definition.arm_joints):
        raise UsageError(
            f"robot file {path}: home_rad wants {len(definition.arm_joints)} values, one for each arm joint"
        )
    return definition, hashlib.sha256(content).hexdigest()
