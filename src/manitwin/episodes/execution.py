"""Carrying out a plan in physics, step by step, with the recorder looking on 20 times a second."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from sapien import physx

from manitwin.episodes.events import EventWatch
from manitwin.episodes.goals.world_state import Event
from manitwin.episodes.planning.problem import Grasp, Motion, Phase
from manitwin.episodes.recorder import Recorder
from manitwin.episodes.recording import RATE_HZ, Recording
from manitwin.geometry.poses import inverse
from manitwin.physics.sapien.contacts import NONE_MEANT, MeantContacts, Touches
from manitwin.physics.sapien.controls.control import HandControl, control_of
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.trial import TrialSettings
from manitwin.robots.robot import Robot

IN_HAND = frozenset(
    {Phase.CLOSE, Phase.LIFT, Phase.CARRY, Phase.LOWER, Phase.OPEN, Phase.ACT, Phase.HOLD, Phase.RETURN}
)
STILL_ROWS, REST_ROWS = 5, 10  # 0.25 s and 0.5 s
FRAME_S = 1 / 60  # between two looks at how hard the hand presses
STEADY_FRAMES = 6  # the hand presses for so long before it moves on
OPENING_S = 0.1  # after the hand has let go, before the hand withdraws
# Nine touches of fingers and table lasted 12 to 25 ms: looking at the recorded rows alone, every 50 ms, missed 4 of them.
WATCH_S = 0.0125
TRACKING_S = 0.05  # after a motion, for the arm to come to rest


@dataclass(eq=False)
class _Arm:
    """Where an arm of the world is told to be, its hand, and whether that keeps pressing."""

    tip_pose: Callable[[np.ndarray], np.ndarray]
    commanded_rad: np.ndarray
    hand: HandControl
    presses: bool = False


class Execution:
    """Moves the robot of a world and records what happens.

    Of two arms one moves at a time, the one that is used; the other stays where it is told to be, and goes on pressing.
    """

    def __init__(
        self, world: RobotWorld, robot: Robot, closing: TrialSettings, *tip_poses: Callable[[np.ndarray], np.ndarray]
    ):
        """Record the first state; ``tip_poses`` is the forward kinematics of each arm's commanded joints.

        Raises ValueError where the timestep does not fit the rate of recording.
        """
        self._world, self._closing = world, closing
        self._steps_per_row = round(1 / RATE_HZ / closing.timestep_s)
        if abs(self._steps_per_row * closing.timestep_s * RATE_HZ - 1) > 1e-9:
            raise ValueError(
                f"a timestep of {closing.timestep_s:g} s does not divide the {1 / RATE_HZ:g} s between two rows"
            )
        self._steps_per_look = max(1, int(WATCH_S / closing.timestep_s + 1e-9))
        self._arms = list[_Arm]()
        for number, (arm, tip_pose) in enumerate(zip(robot.arms or (robot,), tip_poses, strict=True)):
            world.use(number)
            home_rad = np.array(arm.home_rad, float)
            self._arms.append(_Arm(tip_pose, home_rad, control_of(world, closing)))
        world.use(0)
        self._arm = self._arms[0]
        self.meant: MeantContacts = NONE_MEANT
        self.watches: list[EventWatch] = []
        self.literal: int | None = None
        self.steps = 0
        self.unplanned: set[tuple[str, str]] = set()
        self.pressing: frozenset[frozenset[str]] = frozenset()
        self._unplanned_since_row = False
        touches = self._take_touches(world.contacts.read())
        self._recorder = Recorder(world, touches, self._hands_state)

    def use(self, arm: int) -> None:
        """Move another arm from now on, by its number; ``touches`` are those of its fingers."""
        self._world.use(arm)
        self._arm = self._arms[arm]
        self._take_touches(self._world.contacts.read())

    @property
    def used(self) -> int:
        """The number of the arm that is used."""
        return self._arms.index(self._arm)

    @property
    def commanded_rad(self) -> np.ndarray:
        """The joints ``(n,)`` that the arm is told."""
        return self._arm.commanded_rad

    @property
    def length_s(self) -> float:
        """The time since the first state."""
        return self.steps * self._closing.timestep_s

    def recording(self) -> Recording:
        """Return what was recorded so far."""
        ends = np.cumsum([len(arm.commanded_rad) for arm in self._arms])[:-1]
        return self._recorder.recording(
            lambda told: np.array(
                [arm.tip_pose(part) for arm, part in zip(self._arms, np.split(told, ends), strict=True)]
            )
        )

    @property
    def events(self) -> tuple[Event, ...]:
        """What the ``watches`` have latched."""
        return tuple(event for watch in self.watches for event in watch.events)

    def follow(
        self,
        motion: Motion,
        until: Callable[[], bool] | None = None,
        adjusted: Callable[[int], tuple[np.ndarray, np.ndarray]] | None = None,
    ) -> bool:
        """Move the arm along a motion and wait until it has come to rest.

        A guarded move ends as soon as ``until`` is true, which is asked after every step, and the arm stays where it then is
        told to be. ``adjusted`` gives what is added to a row's positions and velocities ``(n,)`` as it is reached. Returns
        whether it went all the way.
        """
        robot = self._world.robot
        for row, (positions, velocities) in enumerate(zip(motion.positions_rad, motion.velocities_rad_s, strict=True)):
            if adjusted is not None:
                more_rad, faster_rad_s = adjusted(row)
                positions, velocities = positions + more_rad, velocities + faster_rad_s
            # the drives pull to where the arm is to be in the middle of the step, or it would run ahead of its targets
            robot.set_targets(positions - velocities * (self._closing.timestep_s / 2), velocities)
            self._arm.commanded_rad = positions
            self._advance(motion.phase)
            if until is not None and until():
                robot.set_targets(self.commanded_rad, np.zeros_like(self.commanded_rad))
                return False
        robot.set_targets(self.commanded_rad, np.zeros_like(self.commanded_rad))
        self.wait(motion.phase, self._steps(TRACKING_S))
        return True

    def yield_here(self) -> None:
        """Take the joints as they are for those that they are told to be: what presses against the arm presses no more."""
        self._arm.commanded_rad = self._world.robot.joint_positions()
        self._world.robot.set_targets(self.commanded_rad, np.zeros_like(self.commanded_rad))

    def wait_s(self, phase: Phase, time_s: float) -> None:
        """Stay for a while."""
        self.wait(phase, self._steps(time_s))

    def wait(self, phase: Phase, steps: int) -> None:
        """Stay where the robot is told to be."""
        for _ in range(steps):
            self._advance(phase)

    def shape(self, grasp: Grasp | None) -> None:
        """Shape the hand for a grasp; jaws and cups stay as they are."""
        for _ in self._arm.hand.shaping(None if grasp is None else grasp.joints_rad):
            self.wait(Phase.REACH, self._closing.steps_per_frame)

    def close(self) -> None:
        """Close the hand until it presses; from then on it keeps pressing with the closing force, whatever gives way."""
        self._world.expect_load(True)
        self._arm.presses, closing, steady = True, self._closing, 0
        for _ in range(round(closing.close_time_s / closing.frame_s)):
            self.wait(Phase.CLOSE, closing.steps_per_frame)
            steady = steady + 1 if self._arm.hand.presses else 0
            if steady > STEADY_FRAMES:
                break

    def close_empty(self) -> None:
        """Close the hand on nothing, at the closing speed; it does not press."""
        for _ in self._arm.hand.closing_empty():
            self.wait(Phase.CLOSE, self._closing.steps_per_frame)
        self.wait(Phase.CLOSE, self._steps(OPENING_S))

    def open(self) -> None:
        """Let go, at the closing speed."""
        self._arm.presses = False
        for _ in self._arm.hand.opening():
            self.wait(Phase.OPEN, self._closing.steps_per_frame)
        self.wait(Phase.OPEN, self._steps(OPENING_S))
        self._world.expect_load(self._is_held)

    def target_to_world(self) -> np.ndarray:
        """Return the target's pose ``(4, 4)``."""
        return self._world.object_to_world(self._world.target)

    def gripper_to_object(self) -> np.ndarray:
        """Return the hand where the joints are told to be, in the object's frame: what the arm sags by counts as in the hand."""
        return inverse(self.target_to_world()) @ self._arm.tip_pose(self.commanded_rad)

    def rest(self, max_steps: int, still_rows: int = STILL_ROWS) -> list[list[np.ndarray]]:
        """Stay until nothing has moved for some rows; returns the poses ``(4, 4)`` of all objects at the last rows.

        ``pressing`` then has the pairs of names of what pressed on each other at any of them.
        """
        watch, poses = self._world.rest_watch(still_rows), deque([self._poses()], maxlen=REST_ROWS)
        pressing = deque([self._world.contacts.pressing(self._world.contacts.read())], maxlen=STILL_ROWS)
        for _ in range(max_steps // self._steps_per_row):
            self.wait(Phase.REST, self._steps_per_row - self.steps % self._steps_per_row)
            poses.append(self._poses())
            pressing.append(self._world.contacts.pressing(self._world.contacts.read()))
            watch.look()
            if watch.all_rest:
                break
        self.pressing = frozenset().union(*pressing)
        return list(poses)

    def _poses(self) -> list[np.ndarray]:
        return [self._world.object_to_world(number) for number in range(len(self._world.placed))]

    def _steps(self, time_s: float) -> int:
        return round(time_s / self._closing.timestep_s)

    def _advance(self, phase: Phase) -> None:
        if self.steps % self._closing.steps_per_frame == 0:
            for arm in self._arms:
                if arm.presses:
                    arm.hand.squeeze()
        ends_row = (self.steps + 1) % self._steps_per_row == 0
        before = self._joint_positions() if ends_row else None
        self._world.step()
        self.steps += 1
        if before is not None or self.steps % self._steps_per_look == 0:
            contacts = self._world.contacts.read()
            self._watch(phase, contacts)
            if before is not None:
                self._record(phase, before, contacts)

    def _watch(self, phase: Phase, contacts: Sequence[physx.PhysxContact]) -> None:
        for arm in self._arms:
            arm.hand.look(contacts)
        in_hand = phase in IN_HAND or (len(self._arms) > 1 and self._is_held)
        unplanned = self._world.contacts.unplanned(contacts, in_hand=in_hand, meant=self.meant)
        for watch in self.watches:
            watch.look(self._world.contacts, contacts, self.length_s)
        self.unplanned.update(unplanned)
        self._unplanned_since_row = self._unplanned_since_row or bool(unplanned)

    def _record(
        self, phase: Phase, joint_positions_before_rad: np.ndarray, contacts: Sequence[physx.PhysxContact]
    ) -> None:
        """Add a row. Speeds are those of the last step: PhysX's are those at its end, where stiff drives have slowed down."""
        velocities = (self._joint_positions() - joint_positions_before_rad) / self._closing.timestep_s
        self._recorder.add(
            np.concatenate([arm.commanded_rad for arm in self._arms]),
            np.concatenate([arm.hand.told for arm in self._arms]),
            self._hands_state,
            phase,
            velocities,
            self._take_touches(contacts),
            unplanned=self._unplanned_since_row,
            literal=self.literal,
        )
        self._unplanned_since_row = False

    @property
    def _is_held(self) -> bool:
        return any(arm.presses for arm in self._arms)

    @property
    def _hands_state(self) -> np.ndarray:
        return np.concatenate([arm.hand.state for arm in self._arms])

    def _joint_positions(self) -> np.ndarray:
        return np.concatenate([robot.joint_positions() for robot in self._world.robots])

    def _take_touches(self, contacts: Sequence[physx.PhysxContact]) -> Touches:
        """Take down what the fingers of the arm that is used touch; return what those of all do."""
        of_arms = [
            arm.hand.touches(reader.touches(contacts))
            for arm, reader in zip(self._arms, self._world.readers, strict=True)
        ]
        self.touches = of_arms[self.used]
        forces_n = tuple(force for touches in of_arms for force in touches.finger_forces_n)
        return replace(self.touches, finger_forces_n=forces_n)
