"""The arms of an environment's world, one or two: what a policy's actions tell their joints and hands at every timestep."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from sapien import physx

from manitwin.episodes.joint_targets import JointTargets, hand_share, may_hold
from manitwin.physics.sapien.controls.control import control_of
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.trial import TrialSettings

ROUNDING = 1.001  # recorded actions are float32, and those of a plan at the limit are within it but for that


class Arms:
    """All arms of a world and their hands; joints ``(n,)`` and what hands are told ``(h,)`` are in the arms' order."""

    def __init__(self, world: RobotWorld, closing: TrialSettings, joints_rad: np.ndarray, fastest_rad_s: np.ndarray):
        """Take a world whose hands are open, its joints at ``joints_rad``; ``fastest_rad_s``: as fast as joints may be told."""
        self._world = world
        self._hands = []
        for number in range(len(world.robots)):
            world.use(number)
            self._hands.append(control_of(world, closing))
        world.use(0)
        self._told = self._open = np.concatenate([hand.told for hand in self._hands])
        lowest_rad, highest_rad = zip(*(arm.limits_rad for arm in world.robots), strict=True)
        self._last_rad, self._fastest_rad_s = np.asarray(joints_rad, float), fastest_rad_s
        self._targets = JointTargets(joints_rad, np.concatenate(lowest_rad), np.concatenate(highest_rad))
        self._per_frame = closing.steps_per_frame  # hands are told anew so often, as in episodes
        self.feel = any(not arm.robot.has_jaws for arm in world.robots)

    def may_hold(self, hand: np.ndarray) -> bool:
        """Tell whether a hand is told, now or before, anything else than what it began with."""
        return may_hold(hand, self._told, self._open)

    def towards(self, joints_rad: np.ndarray, hand: np.ndarray, count: int) -> Iterator[int]:
        """Tell joints and hands what they are to do timestep by timestep; yields the number, from 1, of each to be simulated.

        A joint is told no more than its fastest speed allows: the drives would follow a jump as no motor can.
        """
        before, dt = self._told, self._world.timestep_s
        most_rad = ROUNDING * self._fastest_rad_s * count * dt
        joints_rad = np.clip(joints_rad, self._last_rad - most_rad, self._last_rad + most_rad)
        self._last_rad = joints_rad
        for number, (target, speed) in enumerate(zip(*self._targets.towards(joints_rad, count), strict=True), start=1):
            velocities = speed / (count * dt)
            # as episodes do: the drives pull to where the arm is to be in the middle of the step
            positions = by_arm(self._world, target - velocities * (dt / 2))
            for arm, there, speeds in zip(self._world.robots, positions, by_arm(self._world, velocities), strict=True):
                arm.set_targets(there, speeds)
            told = before + hand_share(number, self._per_frame, count) * (hand - before)
            for control, part in zip(self._hands, np.split(told, len(self._hands)), strict=True):
                control.tell(part)
            yield number
        self._told = hand

    def look(self, contacts: Sequence[physx.PhysxContact]) -> None:
        """Let hands that feel see the contacts of the last step."""
        for hand in self._hands:
            hand.look(contacts)

    def joint_positions(self) -> np.ndarray:
        """Return the joints of all arms ``(n,)``, rad."""
        return np.concatenate([arm.joint_positions() for arm in self._world.robots])

    def hands(self) -> np.ndarray:
        """Return the state of all hands ``(h,)``."""
        return np.concatenate([hand.state for hand in self._hands])


def by_arm(world: RobotWorld, joints: np.ndarray) -> list[np.ndarray]:
    """Return what is of each arm of numbers of all joints ``(n,)``."""
    return np.split(joints, np.cumsum([len(arm.robot.arm_joints) for arm in world.robots])[:-1])
