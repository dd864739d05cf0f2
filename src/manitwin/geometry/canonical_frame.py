"""The canonical frame of an object: choice of its up axis, and the object frame.

The up axis is the one that the user states, else that of the file format, adjusted to a pose in which the object really rests.
The object frame is right-handed with +Z up and its origin at the bottom centre. The yaw of the input is kept; if an object is
laid down, the axis that is up in its file is aligned with X or Y.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import trimesh

from manitwin.geometry.cavity import find_opening
from manitwin.geometry.mass_properties import solid_mass_properties
from manitwin.geometry.poses import rotation_between, transform, yaw_onto_axis
from manitwin.geometry.stable_poses import StablePose, stable_poses

_Z = np.array([0.0, 0.0, 1.0])
_FORMAT_TO_Z_UP = {
    "z": np.eye(3),
    "y": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
    "x": np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]]),
}
# scans stand up to 3 degrees off their base (pan, crock); a pose within this angle is the intended one
_NEAR_DEG = 10.0
_TILTED_DEG = 35.0  # generators keep part of the photo's view from above
_LEAST_PROBABILITY = 0.01  # an upright bottle has 0.04, a fork on its tines less than 0.001
_SAME_SIDE_DEG = 20.0  # poses of a round or facetted object that rolls a little count as one side
_NEARLY_AS_LIKELY = 0.6
_ELONGATED = 1.5
_LONGER = 1.2
_LEANING_DEG = 45.0
_LAY = "it lies with {} up, but such a thing stands, and it is round"
_ON_END = "it does not rest with {} up, and such a thing lies; this is its likeliest side"
_OVER = "it stands upside down in its file: it rests with {0} down, and not up"
_EXACTLY_DEG = 1.0  # an object tilted by a generator rests this exactly on an axis of its file only by chance
_ROUND = 0.1  # relative difference of the two moments of inertia across the axis
_TALL = 0.9  # height over width; a lower vessel round about a horizontal axis may be a flask on its edge
_AS_WIDE = 0.05  # relative difference of a round object's widths across its axis
_ROUND_SHARE = 0.6  # fraction of the directions across the axis; the tab of a can widens it in the others
_WIDTHS = 36


@dataclass(frozen=True)
class UpChoice:
    """The chosen up axis of a mesh: ``rotation (3, 3)`` from the file's axes to Z-up.

    ``up`` is the axis of the file from which the choice started ('x' | 'y' | 'z'), ``probability`` that of the resting pose
    (0.0: it does not rest so), ``turned_deg`` the angle between that axis and the chosen up, ``reason`` an explanation in one
    sentence.
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
    opens_up: bool | None = None,
    opens_aside: bool = False,
    level: bool = False,
    said_by: str = "the user",
    by_convention: bool = False,
) -> UpChoice:
    """Choose the canonical pose of a watertight solid, keeping its yaw.

    ``user``: the stated up axis. ``file_up``: the up axis of the file format (None: undefined; Z is tried before Y).
    ``stands``: whether such an object is placed upright (None: unknown). ``opens_up``: whether an opening is the top of such an
    object (False: it may be hollow from below, as hats and toy bricks are). ``opens_aside``: its openings are in its sides and
    give no information. ``level``: it stands with its long axis horizontal, as vehicles do, and never on end. ``said_by``: who
    stated ``user``, for the reason. ``by_convention``: ``user`` is the up axis of its world, not chosen for this object.

    Order of decisions:

    - The stated axis. If stated by convention only, a lying round, long vessel is stood up first (unless ``level``, or if it
      opens along the stated axis), and an object that lies and does not rest with that axis up is laid on its likeliest side.
    - For objects that lie, the likeliest side, or the file's if nearly as likely.
    - The opening upward, unless the file has it underneath for an object that may be hollow from below.
    - For round, long objects that stand and for round vessels, their symmetry axis.
    - The file's up axis.
    - For objects that stand, another axis of the file with a pose at least as likely as those near its up axis, then the up
      axis reversed.
    - The likeliest side.

    Except for a stated axis on which the object is unstable, the result is aligned with the support facet.
    """
    poses = stable_poses(solid.vertices, _center_of_mass(solid))
    if user != "auto":
        upright_vessel = by_convention and bool(opens_up) and not level
        stood = _find_standing_pose(solid, poses, _axis(user), vessel=True) if upright_vessel else None
        if stood is not None and not _opens_along(solid, _axis(user)):
            return _rotate_onto_facet(stood, user, _LAY.format(user))
        if by_convention and stands is False and _likeliest_within(poses, _axis(user), _TILTED_DEG) is None:
            return _rotate_onto_facet(_likeliest_side(poses, _axis(user)), user, _ON_END.format(user))
        return _choose_stated_up(poses, user, said_by)
    axis = file_up or "z"
    if stands is False:
        pose = _likeliest_side(poses, _axis(axis))
        return _rotate_onto_facet(pose, axis, "such a thing lies; this is the side it most likely lies on")
    opening = None if opens_aside else find_opening(solid)
    on_end = bool(stands) and not level
    axes = [axis] if file_up else _undeclared_axes(solid, on_end)
    unnamed = opens_up is None and stands is None
    if opening is not None and (opens_up is False or (unnamed and file_up is not None)):
        kept = _find_inverted_pose(poses, axes, opening.axis)
        if kept is not None:
            return _rotate_onto_facet(
                kept[1], kept[0], f"it rests with {kept[0]} up, and such a thing may be hollow from below"
            )
    if opening is not None:
        pose_up = _nearest(poses, opening.axis, _TILTED_DEG)
        if pose_up is not None:
            return _rotate_onto_facet(pose_up, axis, "its opening points up")
    if on_end:
        pose_up = _find_standing_pose(solid, poses, _axis(axes[0]), vessel=bool(opens_up))
        if pose_up is not None:
            return _rotate_onto_facet(pose_up, axes[0], _LAY.format(axes[0]))
    if on_end and file_up is None:
        pose_up = _find_upside_down_pose(solid, poses, _axis(axes[0]))
        if pose_up is not None:
            return _rotate_onto_facet(pose_up, axes[0], _OVER.format(axes[0]))
    for candidate in axes:
        near = _nearest(poses, _axis(candidate), _NEAR_DEG)
        if near is not None:
            return _rotate_onto_facet(
                near, candidate, f"it rests with the {'format' if file_up else 'file'}'s {candidate} axis up"
            )
    tilted = _likeliest_within(poses, _axis(axis), _TILTED_DEG)
    if on_end:
        turned = _find_pose_on_other_axis(poses, axes)
        if turned is not None and (tilted is None or turned.probability >= tilted.probability):
            return _rotate_onto_facet(
                turned, axis, f"its file has another axis up: it rests so, and not with {' or '.join(axes)} up"
            )
    if tilted is not None:
        return _rotate_onto_facet(tilted, axis, f"tilted to the nearest side that it rests on, from {axis} up")
    if stands:
        over = _nearest(poses, -_axis(axis), _NEAR_DEG)
        if over is not None:
            return _rotate_onto_facet(over, axis, _OVER.format(axis))
    return _rotate_onto_facet(
        _likeliest_side(poses, _axis(axis)), axis, f"it does not rest with {axis} up; this is its likeliest side"
    )


def _center_of_mass(solid: trimesh.Trimesh) -> np.ndarray:
    if solid.is_watertight and solid.volume > 0:
        return np.asarray(solid_mass_properties(solid, 1.0).center_of_mass_m)
    return np.asarray(solid.convex_hull.center_mass)


def _choose_stated_up(poses: list[StablePose], axis: str, said_by: str) -> UpChoice:
    near = _nearest(poses, _axis(axis), _NEAR_DEG, least=0.0)
    if near is not None:
        return _rotate_onto_facet(near, axis, f"{axis} is up as {said_by} says")
    return UpChoice(
        _FORMAT_TO_Z_UP[axis], axis, 0.0, 0.0, f"{axis} is up as {said_by} says, although it does not rest so"
    )


def _find_inverted_pose(poses: list[StablePose], axes: list[str], opening: np.ndarray) -> tuple[str, StablePose] | None:
    """Return the first of the file's axes on which the object rests with its opening underneath, and that pose."""
    for axis in axes:
        near = _nearest(poses, _axis(axis), _NEAR_DEG)
        if near is not None and float(opening @ near.rotation[2]) < -np.cos(np.radians(_TILTED_DEG)):
            return axis, near
    return None


def _opens_along(solid: trimesh.Trimesh, up: np.ndarray) -> bool:
    opening = find_opening(solid)
    return opening is not None and float(opening.axis @ up) > np.cos(np.radians(_TILTED_DEG))


def _find_standing_pose(
    solid: trimesh.Trimesh, poses: list[StablePose], up: np.ndarray, *, vessel: bool
) -> StablePose | None:
    """Return the end on which a lying round, long object or short round vessel stands; None if it already stands along ``up``.

    The more likely end is chosen. For a short vessel with two nearly equally likely ends, it is the one with the file's axis
    upward.
    """
    along = _round_long_axis(solid)
    short = along is None and vessel
    if short:
        along = _round_axis(solid)
    if along is None or _along(along, up):
        return None
    found = [_nearest(poses, end, _NEAR_DEG) for end in (along, -along)]
    ends = [pose for pose in found if pose is not None]
    if short and ends and ends[0].probability >= _NEARLY_AS_LIKELY * ends[-1].probability:
        return ends[0]
    return max(ends, key=lambda pose: pose.probability, default=None)


def _find_upside_down_pose(solid: trimesh.Trimesh, poses: list[StablePose], up: np.ndarray) -> StablePose | None:
    """Return the pose upside down of a round, long object that rests on that end only, e.g. a pump bottle inverted in its
    file.
    """
    along = _round_long_axis(solid)
    if along is None or not _along(along, up) or _likeliest_within(poses, up, _TILTED_DEG) is not None:
        return None
    return _nearest(poses, -up, _NEAR_DEG)


def _along(axis: np.ndarray, up: np.ndarray) -> bool:
    return abs(float(axis @ up)) > np.cos(np.radians(_LEANING_DEG))


def _round_long_axis(solid: trimesh.Trimesh) -> np.ndarray | None:
    """Return the long axis ``(3,)`` of a round, long object; None for other objects.

    The long axis is that of least moment of inertia of the hull; the object is round if the other two moments are nearly equal.
    Cans, bottles and cartons with square section qualify, a pan with its handle does not.
    """
    hull = solid.convex_hull
    moments, directions = np.linalg.eigh(np.asarray(hull.moment_inertia))
    reach = np.ptp(hull.vertices @ directions, axis=0)
    if moments[2] - moments[1] > _ROUND * moments[2] or reach[0] < _LONGER * reach[1:].max():
        return None
    return np.asarray(directions[:, 0])


def _round_axis(solid: trimesh.Trimesh) -> np.ndarray | None:
    """Return the axis ``(3,)`` of the file about which an object is round and no lower than wide; None for other objects.

    Round means equally wide in most directions across the axis. A ball is round about all axes and returns None.
    """
    corners = solid.convex_hull.vertices
    found = [axis for axis in map(_axis, _FORMAT_TO_Z_UP) if _is_round_about(corners, axis)]
    return found[0] if len(found) == 1 else None


def _is_round_about(corners: np.ndarray, axis: np.ndarray) -> bool:
    angles = np.pi * np.arange(_WIDTHS) / _WIDTHS
    across = [each for each in np.eye(3) if abs(float(each @ axis)) < 0.5]
    widths = np.ptp(corners @ (np.cos(angles) * across[0][:, None] + np.sin(angles) * across[1][:, None]), axis=0)
    usual = float(np.median(widths))
    alike = np.abs(widths - usual) < _AS_WIDE * usual
    return bool(alike.mean() >= _ROUND_SHARE and np.ptp(corners @ axis) >= _TALL * usual)


def _undeclared_axes(solid: trimesh.Trimesh, on_end: bool) -> list[str]:
    """Return Z and Y in the order to try: Y first for a round object that is long along Y and stands on end."""
    x, y, z = solid.extents
    moments = np.diag(np.asarray(solid.convex_hull.moment_inertia))
    round_about_y = abs(moments[0] - moments[2]) < _ROUND * max(moments[0], moments[2])
    if on_end and y > _ELONGATED * max(x, z) and round_about_y:
        return ["y", "z"]
    return ["z", "y"]


def _find_pose_on_other_axis(poses: list[StablePose], axes: list[str]) -> StablePose | None:
    """Return the likeliest pose with exactly another of the file's axes upward, or one of ``axes`` downward."""
    others = [sign * _axis(axis) for axis in _FORMAT_TO_Z_UP for sign in (1, -1) if sign < 0 or axis not in axes]
    found = [_nearest(poses, up, _EXACTLY_DEG) for up in others]
    return max((pose for pose in found if pose is not None), key=lambda pose: pose.probability, default=None)


def _nearest(
    poses: list[StablePose], up: np.ndarray, within_deg: float, least: float = _LEAST_PROBABILITY
) -> StablePose | None:
    """Return the pose closest to ``up`` upward within an angle, among poses with at least the probability ``least``."""
    likely = [pose for pose in poses if pose.probability >= least and _angle_deg(pose, up) <= within_deg]
    return min(likely, key=lambda pose: (round(_angle_deg(pose, up), 3), -pose.probability), default=None)


def _likeliest_within(poses: list[StablePose], up: np.ndarray, within_deg: float) -> StablePose | None:
    likely = [pose for pose in poses if pose.probability >= _LEAST_PROBABILITY and _angle_deg(pose, up) <= within_deg]
    return max(likely, key=lambda pose: pose.probability, default=None)


def _likeliest_side(poses: list[StablePose], up: np.ndarray) -> StablePose:
    """Return the likeliest pose of the likeliest side; among sides nearly as likely, of the one nearest to ``up``.

    A side is a pose together with all others within 20 degrees of it.
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


def _rotate_onto_facet(pose: StablePose, axis: str, reason: str) -> UpChoice:
    """Return the smallest rotation that brings the file's axis onto the pose's support facet.

    If the object is laid down, the axis that was up is then rotated about the vertical onto the nearest of X and Y: a round
    object may lie on any side, so that its yaw is arbitrary.
    """
    basis = _FORMAT_TO_Z_UP[axis]
    rotation = rotation_between(basis @ pose.rotation[2], _Z) @ basis
    lying = rotation @ _axis(axis)
    if float(np.hypot(lying[0], lying[1])) > np.cos(np.radians(_LEANING_DEG)):
        rotation = yaw_onto_axis(lying) @ rotation
    return UpChoice(rotation, axis, pose.probability, _angle_deg(pose, _axis(axis)), reason)


def _axis(name: str) -> np.ndarray:
    return _FORMAT_TO_Z_UP[name][2]


def _angle_deg(pose: StablePose, up: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(pose.rotation[2] @ up, -1.0, 1.0))))


def object_frame(vertices: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Return the transform ``(4, 4)`` from a mesh's frame to the object frame.

    ``rotation (3, 3)`` turns it upright. The translation puts the lowest of ``vertices (V, 3)`` at z = 0, and the centre of the
    axis-aligned box at x = y = 0.
    """
    turned = vertices @ rotation.T
    low, high = turned.min(0), turned.max(0)
    return transform(rotation, np.array([-(low[0] + high[0]) / 2, -(low[1] + high[1]) / 2, -low[2]]))
