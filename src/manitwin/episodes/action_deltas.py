"""Actions told as differences from the state that they were given in."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.recording import Recording


def joint_delta(recording: Recording) -> np.ndarray:
    """Return ``(T, n + 1) float32``: the arm's targets less its positions, rad, and the target opening itself, m."""
    moved = recording.action_joint_positions_rad - recording.joint_positions_rad[:-1]
    return _with_opening(moved, recording)


def tip_delta(recording: Recording) -> np.ndarray:
    """Return ``(T, 7) float32``: how the tip's target differs from its pose, and the target opening itself.

    Three metres and a rotation vector of three radians, both along the axes of the world, which are those of the robot's
    base: ``p_target = p + d[:3]``, ``R_target = exp(d[3:6]) R``. This is the frame of ManiSkill's ``pd_ee_delta_pose``
    (``root_translation:root_aligned_body_rotation``), not scaled to [-1, 1].
    """
    moved = recording.action_tip_position_m - recording.tip_position_m[:-1]
    before = Rotation.from_quat(recording.tip_quaternion_wxyz[:-1], scalar_first=True)
    after = Rotation.from_quat(recording.action_tip_quaternion_wxyz, scalar_first=True)
    return _with_opening(np.hstack([moved, (after * before.inv()).as_rotvec()]), recording)


def _with_opening(delta: np.ndarray, recording: Recording) -> np.ndarray:
    return np.hstack([delta, recording.action_gripper_opening_m[:, None]]).astype(np.float32)
