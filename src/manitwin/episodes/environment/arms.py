"""Arms of an environment's world, one or two: conversion of a policy's actions to targets of joints and hands per time step."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from sapien import physx

from manitwin.episodes.joint_targets import JointTargets, hand_share, may_hold
from manitwin.physics.sapien.controls.control import create_hand_control
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.trial import TrialSettings

ROUNDING = 1.001  # tolerance for float32 rounding of recorded actions at the speed limit


class Arms:
    """All arms of a world with their hands; joints ``(n,)`` and hand commands ``(h,)`` are concatenated in the arms' order."""

    def __init__(self, world: RobotWorld, closing: TrialSettings, joints_rad: np.ndarray, fastest_rad_s: np.ndarray):
        """Take a world with open hands and joints at ``joints_rad``; ``fastest_rad_s (n,)`` are the speed limits of commands."""
        self._world = world
        self._hands = []
        for number in range(len(world.robots)):
            world.select_arm(number)
            self._hands.append(create_hand_control(world, closing))
        world.select_arm(0)
        self._told = self._open = np.concatenate([hand.told for hand in self._hands])
        lowest_rad, highest_rad = zip(*(arm.limits_rad for arm in world.robots), strict=True)
        self._last_rad, self._fastest_rad_s = np.asarray(joints_rad, float), fastest_rad_s
        self._targets = JointTargets(joints_rad, np.concatenate(lowest_rad), np.concatenate(highest_rad))
        self._per_frame = closing.steps_per_frame  # the interval of hand commands, as in episodes
        self.feel = any(not arm.robot.has_jaws for arm in world.robots)

    def may_hold(self, hand: np.ndarray) -> bool:
        """Tell whether the current or previous hand command differs from the initial one."""
        return may_hold(hand, self._told, self._open)

    def apply_action(self, joints_rad: np.ndarray, hand: np.ndarray, count: int) -> Iterator[int]:
        """Set joint and hand targets for each time step; yields the number, from 1, of each step to simulate.

        Joint commands are limited to the fastest joint speed, because the drives would follow a jump faster than a motor can.
        """
        before, dt = self._told, self._world.timestep_s
        most_rad = ROUNDING * self._fastest_rad_s * count * dt
        joints_rad = np.clip(joints_rad, self._last_rad - most_rad, self._last_rad + most_rad)
        self._last_rad = joints_rad
        for number, (target, speed) in enumerate(
            zip(*self._targets.interpolate_to(joints_rad, count), strict=True), start=1
        ):
            velocities = speed / (count * dt)
            # as in episodes: the drives' targets are those of the middle of the step
            positions = split_by_arm(self._world, target - velocities * (dt / 2))
            for arm, there, speeds in zip(
                self._world.robots, positions, split_by_arm(self._world, velocities), strict=True
            ):
                arm.set_targets(there, speeds)
            told = before + hand_share(number, self._per_frame, count) * (hand - before)
            for control, part in zip(self._hands, np.split(told, len(self._hands)), strict=True):
                control.tell(part)
            yield number
        self._told = hand

    def look(self, contacts: Sequence[physx.PhysxContact]) -> None:
        """Pass the contacts of the last step to the hands."""
        for hand in self._hands:
            hand.look(contacts)

    def joint_positions(self) -> np.ndarray:
        """Return the joints of all arms ``(n,)`` rad."""
        return np.concatenate([arm.joint_positions() for arm in self._world.robots])

    def hands(self) -> np.ndarray:
        """Return the states of all hands ``(h,)``."""
        return np.concatenate([hand.state for hand in self._hands])


def split_by_arm(world: RobotWorld, joints: np.ndarray) -> list[np.ndarray]:
    """Split values of all joints ``(n,)`` by arm."""
    return np.split(joints, np.cumsum([len(arm.robot.arm_joints) for arm in world.robots])[:-1])
