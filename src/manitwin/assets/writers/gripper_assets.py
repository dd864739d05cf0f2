"""The robot models behind grippers' names: by which link and joints other tools know them, and how that link is turned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.errors import UsageError
from manitwin.geometry.poses import transform
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.parallel import ParallelGripper

_HALF = 0.5**0.5


@dataclass(frozen=True)
class GripperAsset:
    """A parallel gripper as GraspGen and GraspDataGen name it.

    ``base_link`` is the frame that grasps are poses of, ``base_to_grasp_xyzw`` its rotation to the grasp frame (+Z approach, X
    closing), as GraspGen's configuration has it. Each of ``finger_joints`` is the way (m) of one finger from closed, the first
    that of ``finger_links[0]``, on the closing axis' side ``bite_axis (3,)``. ``open_limit``: at which limit of the joints it
    is open.
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
        angle = -2 * np.arctan2(z, w)  # all of them are turns about the approach direction
        assert x == y == 0
        cosine, sine = np.round([np.cos(angle), np.sin(angle)], 15)
        return transform(np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]))


ASSETS: dict[str, GripperAsset] = {
    # GraspGen config/grippers/franka_panda.yaml; GraspDataGen scripts/graspgen/gripper_configurations.py; the public URDF:
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
    """Return the dimensions of a gripper that comes with the package; None for another, or one of another kind."""
    try:
        gripper = load_gripper(name) if not name.endswith(".toml") else None
    except UsageError:  # a person's own: the table has its name, not its file
        return None
    return gripper if isinstance(gripper, ParallelGripper) else None
