"""One arm of an episode and its hand: what they are told row by row, which is what is recorded as actions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from manitwin.episodes.joint_targets import JointTargets, hand_share, may_hold
from manitwin.physics.sapien.controls.control import HandControl


@dataclass(eq=False)
class CommandedArm:
    """An arm of the world: where it is told to be at the row's end, its hand, and whether that keeps pressing.

    ``action_rad (n,)`` is what its row says of it. What the hand is told is chosen every ``steps_told`` steps: of jaws and cups
    once a row, as a policy would, of fingers that stop one by one once a frame. ``next_told`` and ``rest_told`` are what it does
    by itself.
    """

    tip_pose: Callable[[np.ndarray], np.ndarray]
    commanded_rad: np.ndarray
    targets: JointTargets
    hand: HandControl
    steps_told: int
    presses: bool = False
    next_told: np.ndarray | None = None
    rest_told: Iterator[np.ndarray] = field(default_factory=lambda: iter(()))

    def __post_init__(self) -> None:
        self.open = self.before = self.told = self.hand.told
        self.action_rad = self.commanded_rad

    @property
    def may_hold(self) -> bool:
        """Whether the hand is told, now or before, anything else than what it began with."""
        return may_hold(self.told, self.before, self.open)

    def tell(self, step: int, steps_per_frame: int) -> None:
        """Tell the hand what it is to do in a step of a row, from 0."""
        number = step % self.steps_told
        if number == 0:
            self.before, told = self.told, self.told
            if self.presses:
                told = self.hand.squeeze()
            elif self.next_told is not None:
                told, self.next_told = self.next_told, next(self.rest_told, None)
            self.told = np.asarray(told, np.float32).astype(float)
        share = hand_share(number + 1, steps_per_frame, self.steps_told)
        self.hand.tell(self.before + share * (self.told - self.before))
