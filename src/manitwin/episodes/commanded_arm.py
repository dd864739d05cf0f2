"""One arm of an episode and its hand: what they are told row by row, which is what is recorded as actions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from manitwin.episodes.joint_targets import JointTargets, may_hold
from manitwin.physics.sapien.controls.control import HandControl


@dataclass(eq=False)
class CommandedArm:
    """An arm of the world: where it is told to be at the row's end, its hand, and whether that keeps pressing.

    What the hand is told is chosen once a row, as a policy would. ``next_told`` and ``rest_told`` are what it does by itself.
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
        """Whether the hand is told, now or before, anything else than what it began with."""
        return may_hold(self.told, self.before, self.open)

    def choose(self) -> None:
        """Choose what the hand is told by the end of the row that begins."""
        self.before, told = self.told, self.told
        if self.presses:
            told = self.hand.squeeze()
        elif self.next_told is not None:
            told, self.next_told = self.next_told, next(self.rest_told, None)
        self.told = np.asarray(told, np.float32).astype(float)

    def tell(self, share: float) -> None:
        """Tell the hand what it is to do when it has gone a ``share`` of its way in a row."""
        self.hand.tell(self.before + share * (self.told - self.before))
