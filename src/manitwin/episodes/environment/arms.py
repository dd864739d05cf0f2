"""The arms of an environment's world, one or two: what a policy's actions tell their joints and hands at every timestep."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from sapien import physx

from manitwin.physics.sapien.controls.control import control_of
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.trial import TrialSettings

ORDER = 3  # of the polynomial between actions
HELD = 1e-3  # m or rad, or of 1: a hand that is told so much else than it began with holds something, or is about to


class JointTargets:
    """Where an arm is told to be within a step: on the cubic through the targets ``(n,)`` rad at the ends of the last four.

    An episode follows smooth motions at every timestep, of which actions are samples; between four samples of such a motion a
    cubic is off by a term of fourth order (Newton's backward differences), and so little beside its speed, which the drives'
    dampers follow. It passes through the targets, and goes beyond them by about a quarter of a jump at most.
    """

    def __init__(self, start_rad: np.ndarray, lowest_rad: np.ndarray, highest_rad: np.ndarray):
        """Begin at rest; what would be beyond the joints' limits is clipped."""
        self._last = np.repeat(np.asarray(start_rad, float)[None], ORDER, axis=0)
        self._lowest, self._highest = lowest_rad, highest_rad

    def towards(self, target_rad: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the targets ``(count, n)`` at even times until the end of the step, which is ``target_rad (n,)``, and speeds.

        Speeds ``(count, n)`` are those there, rad a step; of joints at their limits 0.
        """
        samples = np.concatenate([self._last, np.asarray(target_rad, float)[None]])
        self._last = samples[1:]
        left = np.arange(1 - count, 1) / count
        rows = _polynomial(samples, left)
        speeds = count * (_polynomial(samples, left + 0.5 / count) - _polynomial(samples, left - 0.5 / count))
        clipped = np.clip(rows, self._lowest, self._highest)
        return clipped, np.where(rows == clipped, speeds, 0.0)


def _polynomial(samples: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Return the polynomial through ``samples (K, n)``, a step apart, at times ``(T,)`` in steps from the last: ``(T, n)``."""
    factor, rows = np.ones((len(left), 1)), np.repeat(samples[-1:], len(left), axis=0)
    for order in range(1, len(samples)):
        factor = factor * (left[:, None] + order - 1) / order
        rows = rows + factor * np.diff(samples, n=order, axis=0)[-1]
    return rows


class Arms:
    """All arms of a world and their hands; joints ``(n,)`` and what hands are told ``(h,)`` are in the arms' order."""

    def __init__(
        self, world: RobotWorld, closing: TrialSettings, joints_rad: np.ndarray, limits: tuple[np.ndarray, np.ndarray]
    ):
        """Take a world whose hands are open; ``limits (n + h,)`` are those of actions."""
        self._world, joints = world, len(joints_rad)
        self._hands = []
        for number in range(len(world.robots)):
            world.use(number)
            self._hands.append(control_of(world, closing))
        world.use(0)
        self._told = self._open = np.concatenate([hand.told for hand in self._hands])
        self._targets = JointTargets(joints_rad, limits[0][:joints], limits[1][:joints])
        self._per_frame = closing.steps_per_frame  # hands are told anew so often, as in episodes
        self.feel = any(not arm.robot.has_jaws for arm in world.robots)

    def may_hold(self, hand: np.ndarray) -> bool:
        """Tell whether a hand is told, now or before, anything else than what it began with."""
        return bool((np.abs(np.array([hand, self._told]) - self._open) > HELD).any())

    def towards(self, joints_rad: np.ndarray, hand: np.ndarray, count: int) -> Iterator[int]:
        """Tell joints and hands what they are to do timestep by timestep; yields the number, from 1, of each to be simulated."""
        before, dt = self._told, self._world.timestep_s
        for number, (target, speed) in enumerate(zip(*self._targets.towards(joints_rad, count), strict=True), start=1):
            velocities = speed / (count * dt)
            # as episodes do: the drives pull to where the arm is to be in the middle of the step
            positions = by_arm(self._world, target - velocities * (dt / 2))
            for arm, there, speeds in zip(self._world.robots, positions, by_arm(self._world, velocities), strict=True):
                arm.set_targets(there, speeds)
            told = before + min(1.0, np.ceil(number / self._per_frame) * self._per_frame / count) * (hand - before)
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
