"""Reader of multi-finger gripper files: schema, URDF, and consistency checks of both."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields, replace
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, TypeAdapter

from manitwin.errors import UsageError, unknown_name_message
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.xml_file import MAX_XML_BYTES
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.robots.grippers.box import STRICT
from manitwin.robots.grippers.fingertip_gaps import Fingertips
from manitwin.robots.grippers.mimic_joints import MimicJoint, read_mimic_joints, with_mimic_positions
from manitwin.robots.grippers.multi_finger import HandParameters, MultiFingerGripper, Posture, find_mesh
from manitwin.robots.grippers.posture_checks import check_closing, check_fingers, check_positions, measured_posture
from manitwin.robots.grippers.quantities import Length, Position, Rotation
from manitwin.robots.links import Link, read_links
from manitwin.robots.urdf_reader import HAND, read_urdf
from manitwin.twin.point_records import GraspType

MAX_MESH_BYTES = 64 << 20


class _UrdfField(BaseModel):
    """Location of the URDF: below the gripper file's folder, or in an installed distribution, which an extra installs."""

    model_config = STRICT
    file: str
    distribution: str | None = None
    extra: str | None = None


class _RootField(BaseModel):
    """Pose of the URDF's root link in the grasp frame."""

    model_config = STRICT
    position_m: tuple[Position, Position, Position]
    quaternion_wxyz: Rotation


@dataclass(frozen=True)
class _PostureField:
    """Posture given as joint rows at openings, or as a closed and an open row between which openings are measured."""

    __pydantic_config__ = STRICT
    name: str
    grasp_types: tuple[GraspType, ...]
    depth_m: tuple[Length, Length]
    openings_m: tuple[Position, ...] | None = None
    joints_rad: tuple[tuple[float, ...], ...] | None = None
    closed_rad: tuple[float, ...] | None = None
    open_rad: tuple[float, ...] | None = None


@dataclass(frozen=True)
class _File(HandParameters):
    """Schema of a multi-finger gripper file."""

    __pydantic_config__ = STRICT
    urdf: _UrdfField
    root_to_gripper: _RootField
    postures: tuple[_PostureField, ...]


def load_multi_finger(data: dict[str, Any], folder: Path, checked: bool) -> MultiFingerGripper:
    """Build a hand from its file's content.

    Raises UsageError or ValueError if file and URDF are inconsistent, ConfigError if the URDF cannot be read. With
    ``checked`` False the postures are taken from the file without checks.
    """
    file = TypeAdapter(_File).validate_python(data)
    path, root = _urdf_path(file.name, file.urdf, folder)
    tree, meshes = read_urdf(path, HAND), dict[str, Path]()

    def find(mesh: str) -> Path:
        return meshes.setdefault(mesh, find_mesh(path, root, mesh))

    links, couplings = read_links(tree, find), read_mimic_joints(tree)
    _check_names(file, links, couplings)
    _check_drive(file)
    postures, joints = [], file.joints
    for number, posture in enumerate(file.postures):
        openings_m, rows = _rows(f"postures.{number}", posture, len(file.joints))
        joints, rows = with_mimic_positions(file.joints, rows, links, couplings)
        depth_m = (min(posture.depth_m), max(posture.depth_m))
        if posture.depth_m != depth_m:
            raise ValueError(f"postures.{number}.depth_m: descends; give the nearest depth, then the farthest")
        as_rows = tuple(map(tuple, rows.tolist()))
        postures.append(Posture(posture.name, posture.grasp_types, depth_m, openings_m, as_rows))
    described = {field.name: getattr(file, field.name) for field in fields(HandParameters)}
    described |= {"sha256": _digest(file.sha256, path, meshes), "joints": joints}
    rotation = rotation_from_quaternion_wxyz(np.array(file.root_to_gripper.quaternion_wxyz))
    root_to_gripper = transform(rotation, np.array(file.root_to_gripper.position_m))
    hand = MultiFingerGripper(
        **described,
        postures=tuple(postures),
        root_to_gripper=root_to_gripper,
        links=links,
        urdf_path=path,
        urdf_root=root,
    )
    return _with_checked_postures(hand) if checked else hand


def _with_checked_postures(hand: MultiFingerGripper) -> MultiFingerGripper:
    """Return the hand with all postures checked, and openings measured where the file omits them."""
    check_fingers(hand)
    tips = Fingertips(hand)
    settled = []
    for posture in hand.postures:
        check_positions(hand, tips, posture)
        measured = posture if posture.openings_m else measured_posture(tips, posture)
        check_closing(hand, tips, measured)
        settled.append(measured)
    hand = replace(hand, postures=tuple(settled))
    if hand.opening_m <= 0:
        raise ValueError(
            f"clearance_m: the hand opens {hand.opening_m + 2 * hand.clearance_m:.4g} m, of which a clearance of"
            f" {hand.clearance_m:g} on each side leaves nothing; open it wider, or give less"
        )
    return hand


def _rows(where: str, posture: _PostureField, joints: int) -> tuple[tuple[float, ...], np.ndarray]:
    """Return a posture's openings ``(K,)``, empty if they are to be measured, and its joint positions ``(K, N)``."""
    listed = posture.openings_m, posture.joints_rad
    ends = posture.closed_rad, posture.open_rad
    if posture.openings_m is not None and posture.joints_rad is not None and ends == (None, None):
        openings_m, rows = posture.openings_m, posture.joints_rad
        if len(openings_m) < 2 or not (np.diff(openings_m) > 0).all():
            raise ValueError(
                f"{where}: openings_m do not ascend; give at least two, from the narrowest to the widest, with a row of"
                " joints_rad each"
            )
    elif posture.closed_rad is not None and posture.open_rad is not None and listed == (None, None):
        openings_m, rows = (), (posture.closed_rad, posture.open_rad)
    else:
        raise ValueError(
            f"{where}: give openings_m with joints_rad, a row for each opening; or closed_rad and open_rad, two rows between"
            " which the openings are measured"
        )
    if {len(row) for row in rows} != {joints} or (openings_m and len(openings_m) != len(rows)):
        raise ValueError(
            f"{where}: posture {posture.name} has rows of other lengths; give {joints} joint positions, in the order of"
            f" joints,{f' for each of its {len(openings_m)} openings' if openings_m else ' in both rows'}"
        )
    return openings_m, np.array(rows)


def _digest(file_sha256: str, urdf: Path, meshes: dict[str, Path]) -> str:
    """Return the digest of the gripper file, its URDF and its meshes: any change makes a different gripper."""
    digest = hashlib.sha256(file_sha256.encode())
    digest.update(read_bytes(urdf, MAX_XML_BYTES, UsageError, name=str(urdf)))
    for name in sorted(meshes):
        digest.update(read_bytes(meshes[name], MAX_MESH_BYTES, UsageError, name=str(meshes[name])))
    return digest.hexdigest()


def _urdf_path(name: str, urdf: _UrdfField, folder: Path) -> tuple[Path, Path]:
    """Return the URDF's path and the boundary folder of its meshes."""
    if urdf.distribution is None:
        path = (folder / urdf.file).resolve()
        if not path.is_relative_to(folder.resolve()):
            raise UsageError(
                f"gripper {name}: {urdf.file} lies outside the folder of the gripper file; put the gripper's file"
                f" into a folder"
                " that has the URDF and its meshes below it"
            )
        if not path.is_file():
            raise UsageError(
                f"gripper {name}: {path} does not exist; [urdf] file is a path below the folder of the gripper's file"
            )
        return path, folder
    remedy = f"pip install 'manitwin[{urdf.extra}]'" if urdf.extra else f"pip install {urdf.distribution}"
    try:
        files = distribution(urdf.distribution)
    except PackageNotFoundError as error:
        raise UsageError(f"gripper {name} needs the files of {urdf.distribution}: {remedy}") from error
    path = Path(str(files.locate_file(urdf.file)))
    if not path.is_file():
        raise UsageError(f"gripper {name}: {urdf.distribution} {files.version} has no {urdf.file}: {remedy}")
    return path, path.parent.parent


def _check_names(file: _File, links: tuple[Link, ...], couplings: dict[str, MimicJoint]) -> None:
    """Raise ValueError if a joint or link name is not in the URDF, or if a movable joint is missing."""
    moving = [link.joint for link in links if link.joint_type != "fixed"]
    for name in file.joints:
        if name not in moving:
            raise ValueError(f"joints: {unknown_name_message('joint', name, moving)}")
    if len(set(file.joints)) < len(file.joints):
        raise ValueError("joints: a joint is listed twice; list each once")
    left_out = [name for name in moving if name not in file.joints and name not in couplings]
    if left_out:
        raise ValueError(
            f"joints: {', '.join(left_out)} move in the URDF but are not listed; list all movable joints of the"
            f" hand except those that <mimic> another"
        )
    names = [link.name for link in links]
    for name in (name for finger in file.fingers for name in finger):
        if name not in names:
            raise ValueError(f"fingers: {unknown_name_message('link', name, names)}")
    if not file.postures:
        raise ValueError("postures: the list is empty; give at least one")


def _check_drive(file: _File) -> None:
    if file.drive.press_nm > file.drive.torque_limit_nm:
        raise ValueError(
            f"drive.press_nm: is {file.drive.press_nm:g}, above torque_limit_nm = {file.drive.torque_limit_nm:g},"
            f" the limit of every joint; give less"
        )
