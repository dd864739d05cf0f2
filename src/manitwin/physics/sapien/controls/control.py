"""What the hands of robots have in common: frame by frame they are shaped for a grasp, closed until they press, and opened."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np
from sapien import physx

from manitwin.physics.sapien.contacts import Touches
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.trial import TrialSettings
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.suction import SuctionGripper


class HandControl(Protocol):
    """A robot's hand. ``told (h,)`` are its targets and ``state (h,)`` its positions, in the units of ``Robot``.

    What it is to be told next is chosen here, one frame of ``TrialSettings`` at a time; nothing moves before ``tell``.
    """

    @property
    def told(self) -> np.ndarray:
        """The present targets ``(h,)``."""
        ...

    @property
    def state(self) -> np.ndarray:
        """The present positions ``(h,)``."""
        ...

    @property
    def presses(self) -> bool:
        """Whether it holds what it closes on as hard as it should."""
        ...

    def tell(self, told: np.ndarray) -> None:
        """Tell it ``(h,)``, as a policy does; what it held it lets go of where that says so."""
        ...

    def shaping(self, grasp_joints_rad: np.ndarray | None, opening_m: float | None = None) -> Iterator[np.ndarray]:
        """Get ready for a grasp, and let go so wide from then on.

        Fingers take the first of a grasp's joints ``(2, J)``, those before closing and those to close to; jaws its opening
        (None: as wide as they go); a cup does nothing.
        """
        ...

    def squeeze(self) -> np.ndarray:
        """Choose what closes it by one frame; once it presses, what goes on pressing."""
        ...

    def closing_empty(self) -> Iterator[np.ndarray]:
        """Yield the targets ``(h,)``, one a frame, that close it on nothing."""
        ...

    def opening(self) -> Iterator[np.ndarray]:
        """Yield the targets ``(h,)``, one a frame, that let go."""
        ...

    def look(self, contacts: Sequence[physx.PhysxContact]) -> None:
        """See what the last step has done."""
        ...

    def touches(self, touches: Touches) -> Touches:
        """Return what presses on the target, given what its contacts tell."""
        ...


def control_of(world: RobotWorld, settings: TrialSettings) -> HandControl:
    """Return the control of a world's robot."""
    from manitwin.physics.sapien.controls.cup import CupControl
    from manitwin.physics.sapien.controls.fingers import FingersControl
    from manitwin.physics.sapien.controls.jaws import JawsControl

    gripper = world.robot.robot.gripper
    if isinstance(gripper, SuctionGripper):
        return CupControl(world, gripper, settings)
    if isinstance(gripper, MultiFingerGripper):
        return FingersControl(world, gripper, settings)
    return JawsControl(world, settings)
