"""One arm of an episode with its hand, and their commands per row, which are recorded as actions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from manitwin.episodes.joint_targets import JointTargets, may_hold
from manitwin.physics.sapien.controls.control import HandControl


@dataclass(eq=False)
class CommandedArm:
    """An arm of the world: its commanded joints at the end of the row, its hand, and whether the hand keeps pressing.

    The hand command is chosen once per row, as by a policy. ``next_told`` and ``rest_told`` are queued hand commands.
    """

    tip_pose: Callable[[np.ndarray], np.ndarray]
    commanded_rad: np.ndarray
    targets: JointTargets
    hand: HandControl
    presses: bool = False
    next_told: np.ndarray | None = None
    rest_told: Iterator[np.ndarray] = field(default_factory=lambda: iter(()))

    def __post_init__(self) -> None:
        self.open = self.before = self.told = self.hand.told

    @property
    def may_hold(self) -> bool:
        """Whether the current or previous hand command differs from the initial one."""
        return may_hold(self.told, self.before, self.open)

    def update_hand_command(self) -> None:
        """Choose the hand command for the end of the row that begins."""
        self.before, told = self.told, self.told
        if self.presses:
            told = self.hand.squeeze()
        elif self.next_told is not None:
            told, self.next_told = self.next_told, next(self.rest_told, None)
        self.told = np.asarray(told, np.float32).astype(float)

    def set_hand_target(self, share: float) -> None:
        """Set the hand's target at a ``share`` of its motion in the row."""
        self.hand.tell(self.before + share * (self.told - self.before))
