"""Interface of hand controllers: shape the hand for a grasp, close it frame by frame until it presses, and open it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np
from sapien import physx

from manitwin.physics.sapien.contacts import TargetContacts
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.trial import TrialSettings
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.suction import SuctionGripper


class HandControl(Protocol):
    """Controller of a robot's hand. ``told (h,)`` are its targets and ``state (h,)`` its positions, in the units of ``Robot``.

    Its methods choose the next targets, one frame of ``TrialSettings`` at a time; nothing moves until ``tell``.
    """

    @property
    def told(self) -> np.ndarray:
        """Current targets ``(h,)``."""
        ...

    @property
    def state(self) -> np.ndarray:
        """Current positions ``(h,)``."""
        ...

    @property
    def presses(self) -> bool:
        """Whether the hand presses on the object with the closing force."""
        ...

    def tell(self, told: np.ndarray) -> None:
        """Set the targets ``(h,)``, as a policy does; targets that open the hand release the object."""
        ...

    def shaping(self, grasp_joints_rad: np.ndarray | None, opening_m: float | None = None) -> Iterator[np.ndarray]:
        """Yield targets that prepare for a grasp, and remember the opening to which the hand releases.

        A multi-finger hand moves to the first row of the grasp's joints ``(2, J)``, which are those before closing and the
        closing goal. Jaws move to ``opening_m`` (None: fully open). A cup does nothing.
        """
        ...

    def squeeze(self) -> np.ndarray:
        """Return the targets that close the hand by one frame; once it presses, targets that keep pressing."""
        ...

    def closing_empty(self) -> Iterator[np.ndarray]:
        """Yield the targets ``(h,)``, one per frame, that close the empty hand."""
        ...

    def opening(self) -> Iterator[np.ndarray]:
        """Yield the targets ``(h,)``, one per frame, that release the object."""
        ...

    def look(self, contacts: Sequence[physx.PhysxContact]) -> None:
        """Process the contacts of the last step."""
        ...

    def touches(self, touches: TargetContacts) -> TargetContacts:
        """Return the forces on the target, given those from its contacts."""
        ...


def create_hand_control(world: RobotWorld, settings: TrialSettings) -> HandControl:
    """Return the controller of the world's current robot."""
    from manitwin.physics.sapien.controls.cup import CupControl
    from manitwin.physics.sapien.controls.fingers import FingersControl
    from manitwin.physics.sapien.controls.jaws import JawsControl

    gripper = world.robot.robot.gripper
    if isinstance(gripper, SuctionGripper):
        return CupControl(world, gripper, settings)
    if isinstance(gripper, MultiFingerGripper):
        return FingersControl(world, gripper, settings)
    return JawsControl(world, settings)
