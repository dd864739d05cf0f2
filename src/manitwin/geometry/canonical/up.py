"""Which way up a thing goes: as the user or the format says, snapped onto a pose in which it really rests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import trimesh

from manitwin.geometry.cavity import find_opening
from manitwin.geometry.mass_properties import solid_mass_properties
from manitwin.geometry.poses import rotation_between
from manitwin.geometry.stable_poses import StablePose, stable_poses

_Z = np.array([0.0, 0.0, 1.0])
_FORMAT_TO_Z_UP = {
    "z": np.eye(3),
    "y": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
    "x": np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]]),
}
_NEAR_DEG = 10.0  # scans stand up to 3 degrees off their base (pan, crock); a pose this near is the one meant
_TILTED_DEG = 35.0  # generators keep some of the photo's view from above
_LEAST_PROBABILITY = 0.01  # an upright bottle has 0.04, a fork on its tines less than 0.001
_SAME_SIDE_DEG = 20.0  # a round or facetted thing that rolls a little lies on the same side
_NEARLY_AS_LIKELY = 0.6
_ELONGATED = 1.5
_ROUND = 0.1  # relative difference of the two moments across the axis


@dataclass(frozen=True)
class UpChoice:
    """How a mesh is turned: ``rotation (3, 3)`` from its own axes to Z-up.

    ``up`` names the axis of the file it started from ('x' | 'y' | 'z'), ``probability`` is that of the resting pose
    (0.0: it does not rest so), ``turned_deg`` the angle between that axis and the chosen up, ``reason`` one sentence
    for a person.
    """

    rotation: np.ndarray
    up: str
    probability: float
    turned_deg: float
    reason: str


def choose_up(
    solid: trimesh.Trimesh,
    *,
    user: Literal["y", "z", "auto"] = "auto",
    file_up: str | None = None,
    stands: bool | None = None,
) -> UpChoice:
    """Choose the canonical pose of a watertight solid; its yaw is kept.

    ``file_up`` is the up axis that the format declares (None: no rule; Z is tried before Y). ``stands``: whether such a
    thing is put down upright (None: unknown). In order: the user's axis; for things that lie, their likeliest side, the
    file's if nearly as likely; an opening upward; the file's axis; the likeliest side. All but an unstable user's axis
    are snapped onto the support facet.
    """
    poses = stable_poses(solid.vertices, _center_of_mass(solid))
    if user != "auto":
        return _as_told(poses, user)
    axis = file_up or "z"
    if stands is False:
        pose = _likeliest_side(poses, _axis(axis))
        return _turned(pose, axis, "such a thing lies; this is the side it most likely lies on")
    opening = find_opening(solid)
    if opening is not None:
        pose_up = _nearest(poses, opening.axis, _TILTED_DEG)
        if pose_up is not None:
            return _turned(pose_up, axis, "its opening points up")
    axes = [axis] if file_up else _undeclared_axes(solid, stands)
    for candidate in axes:
        near = _nearest(poses, _axis(candidate), _NEAR_DEG)
        if near is not None:
            return _turned(
                near, candidate, f"it rests with the {'format' if file_up else 'file'}'s {candidate} axis up"
            )
    tilted = _likeliest_within(poses, _axis(axis), _TILTED_DEG)
    if tilted is not None:
        return _turned(tilted, axis, f"tilted to the nearest side that it rests on, from {axis} up")
    return _turned(
        _likeliest_side(poses, _axis(axis)), axis, f"it does not rest with {axis} up; this is its likeliest side"
    )


def _center_of_mass(solid: trimesh.Trimesh) -> np.ndarray:
    if solid.is_watertight and solid.volume > 0:
        return np.asarray(solid_mass_properties(solid, 1.0).center_of_mass_m)
    return np.asarray(solid.convex_hull.center_mass)


def _as_told(poses: list[StablePose], axis: str) -> UpChoice:
    near = _nearest(poses, _axis(axis), _NEAR_DEG, least=0.0)
    if near is not None:
        return _turned(near, axis, f"{axis} is up as the user says")
    return UpChoice(
        _FORMAT_TO_Z_UP[axis], axis, 0.0, 0.0, f"{axis} is up as the user says, although it does not rest so"
    )


def _undeclared_axes(solid: trimesh.Trimesh, stands: bool | None) -> list[str]:
    """Return Z and Y in the order to try: a round, long thing that stands has its axis up."""
    x, y, z = solid.extents
    moments = np.diag(np.asarray(solid.convex_hull.moment_inertia))
    round_about_y = abs(moments[0] - moments[2]) < _ROUND * max(moments[0], moments[2])
    if stands and y > _ELONGATED * max(x, z) and round_about_y:
        return ["y", "z"]
    return ["z", "y"]


def _nearest(
    poses: list[StablePose], up: np.ndarray, within_deg: float, least: float = _LEAST_PROBABILITY
) -> StablePose | None:
    """Return the pose nearest to having ``up`` upward, of those at least so likely, if within an angle."""
    likely = [pose for pose in poses if pose.probability >= least and _angle_deg(pose, up) <= within_deg]
    return min(likely, key=lambda pose: (round(_angle_deg(pose, up), 3), -pose.probability), default=None)


def _likeliest_within(poses: list[StablePose], up: np.ndarray, within_deg: float) -> StablePose | None:
    likely = [pose for pose in poses if pose.probability >= _LEAST_PROBABILITY and _angle_deg(pose, up) <= within_deg]
    return max(likely, key=lambda pose: pose.probability, default=None)


def _likeliest_side(poses: list[StablePose], up: np.ndarray) -> StablePose:
    """Return the likeliest pose of the likeliest side; of sides nearly as likely the one nearest to ``up``.

    A side is a pose with all others within 20 degrees of it.
    """
    sides: list[list[StablePose]] = []
    for pose in poses:
        side = next((s for s in sides if _angle_deg(s[0], pose.rotation[2]) < _SAME_SIDE_DEG), None)
        if side is None:
            sides.append([pose])
        else:
            side.append(pose)
    shares = [sum(pose.probability for pose in side) for side in sides]
    nearly = [side for side, share in zip(sides, shares, strict=True) if share >= _NEARLY_AS_LIKELY * max(shares)]
    return min(nearly, key=lambda side: round(_angle_deg(side[0], up), 3))[0]


def _turned(pose: StablePose, axis: str, reason: str) -> UpChoice:
    """Return the smallest turn from the file's axis onto the pose's support facet."""
    basis = _FORMAT_TO_Z_UP[axis]
    rotation = rotation_between(basis @ pose.rotation[2], _Z) @ basis
    return UpChoice(rotation, axis, pose.probability, _angle_deg(pose, _axis(axis)), reason)


def _axis(name: str) -> np.ndarray:
    return _FORMAT_TO_Z_UP[name][2]


def _angle_deg(pose: StablePose, up: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(pose.rotation[2] @ up, -1.0, 1.0))))
