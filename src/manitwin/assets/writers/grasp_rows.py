"""Grasps of a twin as arrays, selected by gripper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.assets.writers.exporter import TwinContent
from manitwin.errors import UsageError
from manitwin.geometry.grasp_diversity import farthest_grasps
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.twin.grasp_table import JITTERED, JOINTS

CONTROLS = (":unfiltered", JITTERED)
"""Suffixes of proposers whose grasps are controls, excluded from summaries: an unfiltered sample, and jittered held grasps."""


_HALF = 0.5**0.5


@dataclass(frozen=True)
class GraspRows:
    """Grasps of one gripper in table order: ``gripper_to_object (N, 4, 4)``, ``depth_m (N,)``, ``width_m (N,)``.

    ``held (N,)`` is the outcome of the trial. ``quality (N,)`` in 0..1 is the measured robustness, or the proposer's score
    where robustness was not measured.
    """

    gripper: str
    ids: tuple[str, ...]
    gripper_to_object: np.ndarray
    depth_m: np.ndarray
    width_m: np.ndarray
    quality: np.ndarray
    held: np.ndarray
    point_ids: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.ids)

    def take(self, index: np.ndarray) -> GraspRows:
        """Select the rows ``index``."""
        chosen = [int(i) for i in index]
        return GraspRows(
            self.gripper,
            tuple(self.ids[i] for i in chosen),
            self.gripper_to_object[chosen],
            self.depth_m[chosen],
            self.width_m[chosen],
            self.quality[chosen],
            self.held[chosen],
            tuple(self.point_ids[i] for i in chosen),
        )


def grippers_of(twin: TwinContent) -> list[str]:
    """Return the grippers in the grasp table, first the one with which the twin was verified."""
    first = twin.record.grasps.gripper if twin.record.grasps is not None else ""
    return sorted(set(twin.grasps["gripper"]), key=lambda name: (name != first, name))


def parallel_grippers_of(twin: TwinContent) -> list[str]:
    """Return the parallel grippers: other kinds have joint values in the table, or no width."""
    table = twin.grasps
    others = {
        name
        for name, width_m, joints in zip(table["gripper"], table["width_m"], table[JOINTS[-1]], strict=True)
        if joints is not None or not width_m
    }
    return [name for name in grippers_of(twin) if name not in others]


def grasp_rows(twin: TwinContent, gripper: str, *, controls: bool) -> GraspRows:
    """Return the grasps of a gripper that are not retired, both held and failed.

    With ``controls``, also the unfiltered and the jittered sample, whose trial outcomes are equally valid.
    """
    table = twin.grasps
    rows = [
        i
        for i, (name, proposer, retired) in enumerate(
            zip(table["gripper"], table["proposer"], table["retired"], strict=True)
        )
        if name == gripper and not retired and (controls or not proposer.endswith(CONTROLS))
    ]
    column = {name: [table[name][i] for i in rows] for name in table}
    quality = [
        score if robustness is None else robustness
        for score, robustness in zip(column["score"], column["robustness"], strict=True)
    ]
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3, :3] = rotation_from_quaternion_wxyz(np.array(column["quaternion_wxyz"], float).reshape(-1, 4))
    poses[:, :3, 3] = np.array(column["position_m"], float).reshape(-1, 3)
    return GraspRows(
        gripper,
        tuple(column["grasp_id"]),
        poses,
        np.array(column["depth_m"], float),
        np.array(column["width_m"], float),
        np.array(quality, float),
        np.array(column["verified"], bool),
        tuple(point or "" for point in column["grasp_point_id"]),
    )


def best_and_diverse(rows: GraspRows, count: int) -> GraspRows:
    """Return at most ``count`` held grasps, best first.

    They are chosen by farthest point sampling among the best four times ``count``, since an arm that cannot reach one grasp may
    reach another.
    """
    held = np.flatnonzero(rows.held)
    best = held[np.argsort(-rows.quality[held], kind="stable")][: 4 * count]
    pool = rows.take(best)
    return pool.take(np.sort(farthest_grasps(pool.gripper_to_object, pool.depth_m, count)))


@dataclass(frozen=True)
class GripperAsset:
    """A parallel gripper as GraspGen and GraspDataGen define it.

    ``base_link`` is the link of ``usd`` in whose frame isaac_grasp states poses, and ``base_to_grasp_xyzw`` the rotation from
    it to the grasp frame (+Z approach, X closing). Each of ``finger_joints`` measures the travel (m) of one finger from the
    closed position; the first belongs to ``finger_links[0]``, on the side ``bite_axis (3,)`` of the closing axis.
    ``open_limit`` says at which joint limit the gripper is open.
    """

    name: str
    usd: str
    base_link: str
    base_to_grasp_xyzw: tuple[float, float, float, float]
    finger_links: tuple[str, str]
    finger_joints: tuple[str, ...]
    bite_axis: tuple[float, float, float]
    open_limit: str

    @property
    def grasp_to_base(self) -> np.ndarray:
        """The pose ``(4, 4)`` of the base link in the grasp frame."""
        x, y, z, w = self.base_to_grasp_xyzw
        angle = -2 * np.arctan2(z, w)  # all of them are rotations about the approach direction
        assert x == y == 0
        cosine, sine = np.round([np.cos(angle), np.sin(angle)], 15)
        return transform(np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]))


ASSETS: dict[str, GripperAsset] = {
    # GraspDataGen scripts/graspgen/gripper_configurations.py; the public URDF:
    # panda_hand closes along its Y, panda_leftfinger on the side of +Y
    "panda": GripperAsset(
        name="franka_panda",
        usd="bots/franka_panda.usd",
        base_link="panda_hand",
        base_to_grasp_xyzw=(0.0, 0.0, -_HALF, _HALF),
        finger_links=("panda_leftfinger", "panda_rightfinger"),
        finger_joints=("panda_finger_joint1", "panda_finger_joint2"),
        bite_axis=(0.0, 1.0, 0.0),
        open_limit="upper",
    ),
}


def parallel_gripper(name: str) -> ParallelGripper | None:
    """Return the dimensions of a parallel gripper that comes with the package; None for others."""
    try:
        gripper = load_gripper(name) if not name.endswith(".toml") else None
    except UsageError:  # a gripper defined by the user: the table has its name, but not its file
        return None
    return gripper if isinstance(gripper, ParallelGripper) else None
