"""Execution of plans in physics, step by step, with recording at 20 Hz."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from sapien import physx

from manitwin.episodes.commanded_arm import CommandedArm
from manitwin.episodes.events import EventWatch
from manitwin.episodes.goals.world_state import Event
from manitwin.episodes.joint_targets import JointTargets, hand_share
from manitwin.episodes.planning.problem import Grasp, Motion, Phase
from manitwin.episodes.recorder import Recorder
from manitwin.episodes.recording import RATE_HZ, Recording
from manitwin.episodes.step_speeds import StepSpeeds
from manitwin.geometry.poses import inverse
from manitwin.physics.sapien.contacts import NONE_MEANT, ROBOT_NAME, AllowedContacts, TargetContacts
from manitwin.physics.sapien.controls.control import create_hand_control
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.trial import TrialSettings
from manitwin.robots.robot import Robot

IN_HAND = frozenset(
    {Phase.CLOSE, Phase.LIFT, Phase.CARRY, Phase.LOWER, Phase.OPEN, Phase.ACT, Phase.HOLD, Phase.RETURN}
)
STILL_ROWS, REST_ROWS = 5, 10  # 0.25 s and 0.5 s
FRAME_S = 1 / 60  # interval between updates of the hand's target
STEADY_ROWS = 2  # the hand must press for this long before the arm moves on
OPENING_S = 0.1  # wait after opening, before the hand withdraws
# Nine contacts of fingers and table lasted 12 to 25 ms; checking only the recorded rows, every 50 ms, missed 4 of them.
WATCH_S = 0.0125
TRACKING_S = 0.05  # wait after a motion for the arm to come to rest


class Execution:
    """Moves the robot of a world and records the states.

    It acts like a policy: commands of arms and hands are chosen at the beginning of a row, and applied within the row as a
    task's environment applies them. Replaying the recorded actions therefore reproduces the recorded states bit for bit. Of
    two arms one moves at a time; the other holds its commanded joints, and continues to press.
    """

    def __init__(
        self, world: RobotWorld, robot: Robot, closing: TrialSettings, *tip_poses: Callable[[np.ndarray], np.ndarray]
    ):
        """Record the first state; ``tip_poses`` are the forward kinematics of each arm for commanded joints.

        Raises ValueError if the time step does not divide the recording interval.
        """
        self._world, self._closing = world, closing
        self._steps_per_row = round(1 / RATE_HZ / closing.timestep_s)
        if abs(self._steps_per_row * closing.timestep_s * RATE_HZ - 1) > 1e-9:
            raise ValueError(
                f"a timestep of {closing.timestep_s:g} s does not divide the {1 / RATE_HZ:g} s between two rows"
            )
        self._steps_per_look = max(1, int(WATCH_S / closing.timestep_s + 1e-9))
        self._arms = list[CommandedArm]()
        for number, (arm, tip_pose) in enumerate(zip(robot.arms or (robot,), tip_poses, strict=True)):
            world.select_arm(number)
            home_rad = np.array(arm.home_rad, float)
            told = replace(closing, steps_per_frame=self._steps_per_row)
            targets = JointTargets(home_rad, *world.robot.limits_rad)
            self._arms.append(CommandedArm(tip_pose, home_rad, targets, create_hand_control(world, told)))
        world.select_arm(0)
        self._arm = self._arms[0]
        self.meant: AllowedContacts = NONE_MEANT
        self.watches: list[EventWatch] = []
        self.literal: int | None = None
        self.steps = 0
        self.unplanned: set[tuple[str, str]] = set()
        self._unplanned_since_row = False
        self._last_poses = deque([self._poses()], maxlen=REST_ROWS)
        self._last_pressing = deque[frozenset[frozenset[str]]](maxlen=STILL_ROWS)
        touches = self._take_touches(world.contacts.read())
        self._speeds = StepSpeeds(world, closing.timestep_s)
        self._recorder = Recorder(world, touches, self._hands_state)

    def use(self, arm: int) -> None:
        """Switch to another arm, by number; ``touches`` are then those of its fingers."""
        self._world.select_arm(arm)
        self._arm = self._arms[arm]
        self._take_touches(self._world.contacts.read())

    @property
    def selected_arm(self) -> int:
        """Number of the current arm."""
        return self._arms.index(self._arm)

    @property
    def commanded_rad(self) -> np.ndarray:
        """Commanded joints ``(n,)`` of the current arm."""
        return self._arm.commanded_rad

    @property
    def length_s(self) -> float:
        """Time since the first state."""
        return self.steps * self._closing.timestep_s

    def recording(self) -> Recording:
        """Return the recording so far."""
        ends = np.cumsum([len(arm.commanded_rad) for arm in self._arms])[:-1]
        return self._recorder.recording(
            lambda told: np.array(
                [arm.tip_pose(part) for arm, part in zip(self._arms, np.split(told, ends), strict=True)]
            )
        )

    @property
    def events(self) -> tuple[Event, ...]:
        """Events recorded by the ``watches``."""
        return tuple(event for watch in self.watches for event in watch.events)

    def follow(
        self,
        motion: Motion,
        until: Callable[[], bool] | None = None,
        adjusted: Callable[[int], np.ndarray] | None = None,
        *,
        until_row: Callable[[], bool] | None = None,
        pace: Callable[[int], float] | None = None,
        yields: bool = False,
    ) -> bool:
        """Move the arm along a motion and wait until it has come to rest; return whether it was completed.

        A guarded move ends with the row in which ``until`` becomes true, which is checked after every step; the arm then
        holds its commanded joints, or its actual ones if it ``yields``. ``until_row`` is checked at the end of each row.
        ``adjusted`` returns the offset of a sample's positions ``(n,)``; it is called for all samples of a row at its
        beginning. ``pace`` returns the share of a row by which the arm advances from a sample, given its number; at least one
        sample.
        """
        samples = motion.positions_rad
        first = 0
        while first < len(samples):
            share = 1.0 if pace is None else pace(first)
            last = min(first + max(1, round(share * self._steps_per_row)), len(samples)) - 1
            target_rad = samples[last]
            if adjusted is not None:
                target_rad = target_rad + [adjusted(sample) for sample in range(first, last + 1)][-1]
            first = last + 1
            self._arm.commanded_rad = target_rad
            if not self._carry_out_row(motion.phase, until):
                if yields:
                    self.adopt_actual_joints()
                return False
            if until_row is not None and until_row():
                return False
        self.wait_s(motion.phase, TRACKING_S)
        return True

    def delayed(self, motion: Motion, sample: int) -> Motion:
        """Return the motion with a wait of less than a row at its beginning, such that the given sample ends a row."""
        waits = -(sample + 1) % self._steps_per_row
        positions_rad, velocities_rad_s = motion.positions_rad, motion.velocities_rad_s
        return replace(
            motion,
            positions_rad=np.concatenate([np.repeat(positions_rad[:1], waits, axis=0), positions_rad]),
            velocities_rad_s=np.concatenate([np.zeros((waits, positions_rad.shape[1])), velocities_rad_s]),
        )

    def adopt_actual_joints(self) -> None:
        """Make the actual joints the commanded ones, which releases forces on the arm."""
        self._arm.commanded_rad = self._world.robot.joint_positions()

    def wait_s(self, phase: Phase, time_s: float) -> None:
        """Wait for a time, rounded up to whole rows."""
        self.wait(phase, int(np.ceil(time_s * RATE_HZ - 1e-9)))

    def wait(self, phase: Phase, rows: int) -> None:
        """Wait for a number of rows at the commanded joints."""
        for _ in range(rows):
            self._carry_out_row(phase)

    def shape_hand(self, grasp: Grasp | None) -> None:
        """Prepare the hand for a grasp; cups do nothing."""
        joints_rad, opening_m = (None, None) if grasp is None else (grasp.joints_rad, grasp.opening_m)
        self._send_hand_commands(Phase.REACH, self._arm.hand.shaping(joints_rad, opening_m))

    def close_hand(self) -> None:
        """Close the hand until it presses; it then keeps pressing with the closing force."""
        self._arm.presses, steady = True, 0
        for _ in range(round(self._closing.close_time_s * RATE_HZ)):
            self._carry_out_row(Phase.CLOSE)
            steady = steady + 1 if self._arm.hand.presses else 0
            if steady > STEADY_ROWS:
                break

    def close_empty_hand(self) -> None:
        """Close the empty hand at the closing speed, without pressing."""
        self._send_hand_commands(Phase.CLOSE, self._arm.hand.closing_empty())
        self.wait_s(Phase.CLOSE, OPENING_S)

    def open_hand(self) -> None:
        """Open the hand at the closing speed."""
        self._arm.presses = False
        self._send_hand_commands(Phase.OPEN, self._arm.hand.opening())
        self.wait_s(Phase.OPEN, OPENING_S)

    @property
    def touches_target(self) -> bool:
        """Whether any part of a robot presses on the target."""
        robots = {ROBOT_NAME, *(robot.robot.name for robot in self._world.robots)}
        pressing = self._world.contacts.pressing_pairs(self._world.contacts.read())
        name = self._world.placed[self._world.target].name
        return any(name in pair and pair & robots for pair in pressing)

    def target_to_world(self) -> np.ndarray:
        """Return the target's pose ``(4, 4)``."""
        return self._world.object_to_world(self._world.target)

    def gripper_to_object(self) -> np.ndarray:
        """Return the commanded hand pose in the object frame; the arm's tracking error counts as a pose change in the hand."""
        return inverse(self.target_to_world()) @ self._arm.tip_pose(self.commanded_rad)

    def wait_for_rest(self, max_steps: int, still_rows: int = STILL_ROWS) -> list[list[np.ndarray]]:
        """Wait until nothing has moved for some rows; return the poses ``(4, 4)`` of all objects in the last rows."""
        watch = self._world.rest_watch(still_rows)
        for _ in range(max_steps // self._steps_per_row):
            self.wait(Phase.REST, 1)
            watch.look()
            if watch.all_rest:
                break
        return list(self._last_poses)

    @property
    def pressing(self) -> frozenset[frozenset[str]]:
        """Pairs of names that pressed on each other in any of the last rows."""
        return frozenset().union(*self._last_pressing)

    def _poses(self) -> list[np.ndarray]:
        return [self._world.object_to_world(number) for number in range(len(self._world.placed))]

    def _send_hand_commands(self, phase: Phase, told: Iterator[np.ndarray]) -> None:
        """Apply queued hand commands until none is left and the row ends."""
        arm = self._arm
        arm.next_told = next(told, None)
        arm.rest_told = told
        while arm.next_told is not None:
            self._carry_out_row(phase)

    def _carry_out_row(self, phase: Phase, until: Callable[[], bool] | None = None) -> bool:
        """Advance to the next recorded row, as an environment does for one action; return False if ``until`` became true."""
        count, dt, goes_on = self._steps_per_row, self._closing.timestep_s, True
        ways = []
        for arm in self._arms:
            arm.commanded_rad = np.asarray(arm.commanded_rad, np.float32).astype(float)  # as recorded
            arm.update_hand_command()
            ways.append(arm.targets.interpolate_to(arm.commanded_rad, count))
        self._world.expect_load(any(arm.may_hold for arm in self._arms))
        for step in range(count):
            for arm, robot, (positions, steps) in zip(self._arms, self._world.robots, ways, strict=True):
                # targets at the middle of the step; otherwise the arm would run ahead of them
                velocities = steps[step] / (count * dt)
                robot.set_targets(positions[step] - velocities * (dt / 2), velocities)
                arm.set_hand_target(hand_share(step + 1, self._closing.steps_per_frame, count))
            self._advance(phase)
            if goes_on and until is not None and until():
                goes_on = False
        return goes_on

    def _advance(self, phase: Phase) -> None:
        ends_row = (self.steps + 1) % self._steps_per_row == 0
        if ends_row:
            self._speeds.begin()
        self._world.step()
        self.steps += 1
        if ends_row or self.steps % self._steps_per_look == 0:
            contacts = self._world.contacts.read()
            self._watch(phase, contacts)
            if ends_row:
                self._record(phase, contacts)

    def _watch(self, phase: Phase, contacts: Sequence[physx.PhysxContact]) -> None:
        for arm in self._arms:
            arm.hand.look(contacts)
        in_hand = phase in IN_HAND or self.meant.palm or (len(self._arms) > 1 and self._is_held)
        unplanned = self._world.contacts.unplanned(contacts, in_hand=in_hand, meant=self.meant)
        for watch in self.watches:
            watch.look(self._world.contacts, contacts, self.length_s)
        self.unplanned.update(unplanned)
        self._unplanned_since_row = self._unplanned_since_row or bool(unplanned)

    def _record(self, phase: Phase, contacts: Sequence[physx.PhysxContact]) -> None:
        """Append a row; speeds are those of the last step."""
        self._recorder.add(
            np.concatenate([arm.commanded_rad for arm in self._arms]),
            np.concatenate([arm.told for arm in self._arms]),
            self._hands_state,
            phase,
            self._speeds.end(),
            self._take_touches(contacts),
            unplanned=self._unplanned_since_row,
            literal=self.literal,
        )
        self._unplanned_since_row = False
        self._last_poses.append(self._poses())
        self._last_pressing.append(frozenset(self._world.contacts.pressing_pairs(contacts)))

    @property
    def _is_held(self) -> bool:
        return any(arm.presses for arm in self._arms)

    @property
    def _hands_state(self) -> np.ndarray:
        return np.concatenate([arm.hand.state for arm in self._arms])

    def _take_touches(self, contacts: Sequence[physx.PhysxContact]) -> TargetContacts:
        """Store the current arm's contact forces, and return those of all arms."""
        of_arms = [
            arm.hand.touches(reader.touches(contacts))
            for arm, reader in zip(self._arms, self._world.readers, strict=True)
        ]
        self.touches = of_arms[self.selected_arm]
        forces_n = tuple(force for touches in of_arms for force in touches.finger_forces_n)
        return replace(self.touches, finger_forces_n=forces_n)
