"""FRM rules: validity of annotated frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.fix import orthonormalise_frames
from manitwin.assets.audit.measured import MeasuredAsset

NOT_ORTHONORMAL = 1e-3
"""Largest entry of R^T R - I that rounding explains: files hold four to seven digits."""

SAME_POSE = 1e-6
"""Entries of two matrices of the same frame may differ by this, in metres or cosines."""

AWAY_M, AWAY_SHARE = 0.03, 0.2
"""Largest distance of a functional or target frame from the surface, in metres and as share of the longest side."""


@dataclass(frozen=True)
class FrameChecks:
    """Checks of all matrices of an asset (annotations, rests and grasps), each ``(N,)``.

    ``finite``: it is an affine transform of finite numbers. ``left_handed``: its axes are mirrored. ``off``: the largest entry
    of R^T R - I. The latter two are False and 0 for matrices that are not finite.
    """

    names: tuple[str, ...]
    finite: np.ndarray
    left_handed: np.ndarray
    off: np.ndarray

    @property
    def is_rigid(self) -> np.ndarray:
        """The frames that are rigid transforms."""
        return self.finite & ~self.left_handed & (self.off <= NOT_ORTHONORMAL)


def check_frames(matrices: Sequence[np.ndarray], names: Sequence[str] = ()) -> FrameChecks:
    """Check matrices, which should be ``(4, 4)``."""
    poses = np.full((len(matrices), 4, 4), np.nan)
    for index, matrix in enumerate(matrices):
        if np.shape(matrix) == (4, 4):
            poses[index] = matrix
    with np.errstate(invalid="ignore"):
        finite = np.isfinite(poses).all((1, 2)) & (np.abs(poses[:, 3] - [0, 0, 0, 1]).max(1, initial=0) < 1e-6)
    axes = np.where(finite[:, None, None], poses[:, :3, :3], np.eye(3))
    off = np.abs(np.swapaxes(axes, 1, 2) @ axes - np.eye(3)).max((1, 2), initial=0)
    return FrameChecks(tuple(names), finite, np.linalg.det(axes) < 0, off)


def all_frames(measured: MeasuredAsset) -> FrameChecks:
    """Check all matrices of an asset, with a readable name for each."""
    asset = measured.asset
    matrices = [frame.frame_to_asset for frame in asset.frames] + list(asset.rests)
    names = [f"{frame.kind} {frame.number}" for frame in asset.frames]
    names += [f"rest {number}" for number in range(len(asset.rests))]
    for grasps in asset.grasps:
        matrices += list(grasps.gripper_to_asset)
        names += [f"{grasps.gripper} grasp {number}" for number in range(len(grasps.gripper_to_asset))]
    return check_frames(matrices, names)


def is_rigid_transform(pose: np.ndarray) -> bool:
    """Return whether a pose is a rigid transform."""
    return bool(check_frames([pose]).is_rigid[0])


def not_finite(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report matrices that are not transforms."""
    frames = measured.measure_once(all_frames)
    yield from _complain(_names(frames, ~frames.finite), "no 4x4 transform of finite numbers")


def left_handed(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report mirrored frames."""
    frames = measured.measure_once(all_frames)
    yield from _complain(_names(frames, frames.left_handed), "left-handed: the axes are mirrored")


def not_orthonormal(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report axes that are not of unit length or not perpendicular."""
    frames = measured.measure_once(all_frames)
    wrong = ~frames.left_handed & (frames.off > NOT_ORTHONORMAL)
    yield from _complain(
        _names(frames, wrong), f"axes are not unit and perpendicular, by up to {frames.off.max(initial=0):.2g}"
    )


def _names(frames: FrameChecks, which: np.ndarray) -> list[str]:
    return [frames.names[index] for index in np.flatnonzero(which)]


def duplicates(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report annotations of one kind with the same frame."""
    seen: dict[tuple[str, bytes], str] = {}
    twice = []
    for frame in measured.asset.frames:
        pose = np.asarray(frame.frame_to_asset, float)
        if not check_frames([pose]).finite[0]:
            continue
        key = (frame.kind, (np.round(pose / SAME_POSE) + 0.0).tobytes())
        name = f"{frame.kind} {frame.number}"
        if key in seen:
            twice.append(f"{name} (as {seen[key]})")
        seen.setdefault(key, name)
    yield from _complain(twice, "the same frame twice")


def far_from_object(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report functional and target frames far from the object."""
    frames = [frame for frame in measured.asset.frames if frame.kind in ("functional", "target")]
    finite = check_frames([frame.frame_to_asset for frame in frames]).finite
    frames = [frame for frame, is_finite in zip(frames, finite, strict=True) if is_finite]
    if not frames or not len(measured.samples):
        return
    limit = max(AWAY_M, AWAY_SHARE * measured.longest_m)
    points = np.array([frame.frame_to_asset[:3, 3] for frame in frames], float)
    distance = measured.distance_m(points, limit)
    # a frame in the middle of a bowl or its opening is far from the wall, and correct
    if len(measured.hull):
        distance = np.where(measured.hull.is_within(points, limit), 0.0, distance)
    far = [f"{f.kind} {f.number}" for f, away in zip(frames, distance, strict=True) if away > limit]
    yield from _complain(far, f"up to {1000 * float(distance.max()):.3g} mm away from the object's surface")


def _complain(names: list[str], what: str) -> Iterator[Complaint]:
    if names:
        more = f" and {len(names) - 4} more" if len(names) > 4 else ""
        yield Complaint(f"{', '.join(names[:4])}{more}: {what}", values={"frames": names[:50], "count": len(names)})


RULES = (
    Rule(
        "FRM001",
        "frame-not-finite",
        "error",
        why="A NaN in one annotation makes every pose that is computed with it NaN, and the task fails without a word.",
        remedy="Annotate it again, or take it out.",
        check=not_finite,
    ),
    Rule(
        "FRM002",
        "frame-left-handed",
        "error",
        why="A mirrored frame has no quaternion: loaders turn it into some rotation, and the gripper comes from the wrong side"
        " (RoboTwin #7, #8: what do these matrices mean?). Y-up to Z-up by exchanging two axes makes one.",
        remedy="Rotate instead of exchanging axes: (x, y, z) becomes (x, -z, y).",
        check=left_handed,
    ),
    Rule(
        "FRM003",
        "frame-not-orthonormal",
        "error",
        why="A scale left in a rotation moves every point that goes through it, and quaternions made of it are wrong"
        " (scene_synthesizer #11: placed objects smashed by a scaled node).",
        remedy="Keep scale out of frames. `--fix` takes the nearest rotation where the axes are nearly right (RoboTwin).",
        check=not_orthonormal,
        fix=orthonormalise_frames,
    ),
    Rule(
        "FRM004",
        "frame-duplicate",
        "warning",
        why="The same frame twice is most often a copy that was meant to be edited: one side of the object has no annotation.",
        remedy="Delete it, or annotate what it was meant for.",
        check=duplicates,
    ),
    Rule(
        "FRM005",
        "frame-far-from-object",
        "error",
        why="Functional and target points that float beside the object come from another scale than the mesh (RoboTwin #7).",
        remedy="Multiply the translations by the mesh's scale, or annotate again.",
        check=far_from_object,
    ),
)
