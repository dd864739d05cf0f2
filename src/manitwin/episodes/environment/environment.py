"""Gymnasium environment of a task: the physics of episodes, actions at a fixed rate, and success by the goal evaluator."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from pickle import PicklingError
from typing import Any, Protocol

import gymnasium
import numpy as np
from gymnasium import spaces

from manitwin.episodes.cameras import named_cameras
from manitwin.episodes.courses.course import EpisodeStart
from manitwin.episodes.downsampling import rows_per_frame
from manitwin.episodes.environment.action_limits import action_limits, checked_action
from manitwin.episodes.environment.arms import Arms, split_by_arm
from manitwin.episodes.environment.observed_poses import ObservedPoses
from manitwin.episodes.environment.start_noise import DrawnStart, StartNoise, draw_start
from manitwin.episodes.episode import closing_of, create_world, settle_start
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.events import EventWatch
from manitwin.episodes.execution import REST_ROWS, STILL_ROWS, WATCH_S
from manitwin.episodes.fixtures import to_json
from manitwin.episodes.goals.evaluation import Evaluation, evaluate
from manitwin.episodes.judging import is_reached_already, state_of
from manitwin.episodes.outcome import is_at_rest
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import PickPlaceProblem
from manitwin.episodes.recording import RATE_HZ
from manitwin.episodes.sequence import create_course, problem_of
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.tasks.task_setting import TaskSetting
from manitwin.errors import UsageError
from manitwin.physics.sapien.world import RobotWorld
from manitwin.robots.robot import Robot

MOST_METRES, MOST_SPEED = 10.0, 100.0
STARTS_TRIED = 8  # with noise: a start is settled, and rejected if something falls or the goal is already true


class StateRenderer(Protocol):
    """Interface for rendering an environment's state: ``(size, size, 3) uint8`` for each camera."""

    def paint(self, world: RobotWorld) -> dict[str, np.ndarray]:
        """Return the pictures by camera name."""
        ...

    def close(self) -> None:
        """Release the driver's resources."""
        ...


class TaskEnvironment(gymnasium.Env[dict[str, Any], np.ndarray]):
    """A task in physics: joint and hand targets as actions, states as observations, reward 1 for success.

    ``action (n + h,) float32``: targets of the arm's n joints at the end of the step, rad, in the order of
    ``robot.arm_joints``, followed by the hand commands, named by ``robot.hand_action_names``: the distance between jaws (m),
    above 0.5 for a cup's vacuum, or the targets of a hand's joints (rad). For two arms, the joints of both precede the
    commands of both hands. Values beyond the limits are clipped, and no joint moves faster than ``robot.fastest_rad_s``.
    Within a step joints move as ``JointTargets`` specifies, and hand commands are interpolated linearly. Closed jaws press
    harder the smaller their target is (``FINGER_STIFFNESS_N_M``).

    ``observation``: see docs/policies.md. ``info``: ``success``, ``failure`` (the first literal that is not true, and why),
    ``literals`` (each with whether it holds).

    Pickling and copying recreate the environment by ``made_by``, in its state before ``reset``, because a simulation cannot
    be sent to another process.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": RATE_HZ}  # noqa: RUF012 (Gymnasium declares it so)

    def __init__(
        self,
        setting: TaskSetting,
        robot: Robot,
        planner: PickPlacePlanner,
        settings: EpisodeSettings,
        *,
        max_steps: int,
        rate_hz: int = RATE_HZ,
        painter: StateRenderer | None = None,
        cameras: Sequence[str] = (),
        picture_px: int = 128,
        start_noise: StartNoise | None = None,
        made_by: Callable[[], TaskEnvironment] | None = None,
    ):
        """Take a task's setting and the number of actions per second; nothing is simulated before ``reset``."""
        self._made_by = made_by
        self.task, self.instructions = setting.task, setting.task.instructions
        self.render_mode = "rgb_array" if painter is not None else None
        self._setting, self._planner, self._settings, self._painter = setting, planner, settings, painter
        self._robot, self._max_steps, self._noise = robot, max_steps, start_noise
        self._camera_names, self._picture_px = tuple(cameras), picture_px
        self._closing = closing_of(self._robot, settings)
        self.metadata = {**type(self).metadata, "render_fps": rate_hz}
        self._rate_hz, self._rows = rate_hz, rows_per_frame(rate_hz)
        self._row_substeps = round(1 / RATE_HZ / settings.timestep_s)
        self._per_look = max(1, int(WATCH_S / settings.timestep_s + 1e-9))
        self._world: RobotWorld | None = None
        arms, things = len(robot.arms) or 1, len(setting.scene.objects)
        self._lowest, self._highest = action_limits(robot, planner)
        self.action_space = spaces.Box(self._lowest, self._highest)
        joints = len(robot.arm_joints)
        seen: dict[str, spaces.Space[Any]] = {
            "joint_positions_rad": _box(2 * np.pi, joints),
            "joint_velocities_rad_s": _box(MOST_SPEED, joints),
            self._hand_name: _box(2 * np.pi, len(robot.hand_state_names)),
            "tip_pose": _box(MOST_METRES, 7 * arms),
            "object_poses": _box(MOST_METRES, things, 7),
        }
        if cameras:
            picture = spaces.Box(0, 255, (picture_px, picture_px, 3), np.uint8)
            seen["pictures"] = spaces.Dict(dict.fromkeys(cameras, picture))
        self._seen = seen
        self.observation_space = spaces.Dict(seen)

    def __reduce__(self) -> tuple[Callable[[], TaskEnvironment], tuple[()]]:
        """Return the function that recreates the environment; raises PicklingError if it was not made by ``make_env``."""
        if self._made_by is None:
            raise PicklingError(
                "an environment that was not made by make_env cannot be pickled; make one in each process"
            )
        return self._made_by, ()

    @property
    def _hand_name(self) -> str:
        """Name of the hand's state in observations."""
        return "gripper_opening_m" if self._robot.has_jaws else "hand"

    @property
    def object_names(self) -> tuple[str, ...]:
        """Names of the objects in the order of ``object_poses``."""
        return self._setting.scene.names

    @property
    def fixtures(self) -> tuple[dict[str, Any], ...]:
        """Static fixtures of the scene (pegs, holders, boards), in the format of an episode's facts."""
        return tuple(to_json(fixture) for fixture in self._setting.goal.fixtures)

    @property
    def cameras(self) -> dict[str, dict[str, Any]]:
        """Intrinsics and pose of each camera of ``pictures``, by name: ``NamedCamera.to_json``."""
        size = self._picture_px
        return {each.name: each.to_json(size, size) for each in named_cameras(self._camera_names, self._robot)}

    @property
    def places_m(self) -> dict[str, np.ndarray]:
        """Marked places ``(3,)`` m of the goal in the world, by name."""
        return {name: np.array(place_m) for name, place_m in self._setting.goal.places_m.items()}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Place everything as in the scene, let it settle, and return the first observation.

        The start of a task is deterministic: ``seed`` only affects ``np_random``. With start noise, ``np_random`` draws a new
        start each time, described in ``info["start_noise"]``. Raises UsageError if the scene is not stable, if no start is
        found, or if the cameras were released by ``close``.
        """
        if self._camera_names and self._painter is None:
            raise UsageError("reset after close; make the environment again")
        super().reset(seed=seed)
        start, world, drawn = self._begun()
        start.moved, start.partners = self._setting.sequence.moved, self._setting.sequence.partners
        self._start, self._steps = start, 0
        start_rad = np.array(self._robot.home_rad if drawn is None else drawn.joints_rad, float)
        self._arms = Arms(world, self._closing, start_rad, self._robot.fastest_rad_s)
        self._velocities = np.zeros(len(start_rad))
        self._watches = self._event_watches(start, world)
        self._poses = deque([self._object_poses()], maxlen=REST_ROWS)
        self._pressing = deque([self._pairs()], maxlen=STILL_ROWS)
        info = self._info(self._evaluation())
        return self._observation(), info if drawn is None else info | {"start_noise": drawn.info}

    def step(self, action: np.ndarray) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Execute an action for ``1 / rate_hz`` s; the episode terminates with success, or is truncated after ``max_steps``.

        Raises UsageError before ``reset``, and for an action of another shape or with non-finite values; nothing moves in
        that case.
        """
        world = self._world
        if world is None:
            raise UsageError("step before reset; call reset first")
        names = (*self._robot.arm_joints, *self._robot.hand_action_names)
        told = np.clip(checked_action(action, names), self._lowest, self._highest)
        joints = len(self._robot.arm_joints)
        self._move(world, told[:joints], told[joints:])
        self._steps += 1
        evaluation = self._evaluation()
        success = len(self._poses) == REST_ROWS and evaluation.reached
        truncated = self._steps >= self._max_steps and not success
        return self._observation(), float(success), success, truncated, self._info(evaluation, success)

    def render(self) -> np.ndarray | None:
        """Return the first camera's picture ``(size, size, 3) uint8``; None without cameras."""
        if self._painter is None or self._world is None:
            return None
        return next(iter(self._painter.paint(self._world).values()))

    def close(self) -> None:
        """Release simulation and renderer."""
        self._leave()
        if self._painter is not None:
            self._painter.close()
            self._painter = None

    def _begun(self) -> tuple[EpisodeStart, RobotWorld, DrawnStart | None]:
        """Return a settled start; with noise the first drawn one that is stable and whose goal is not true yet."""
        if self._noise is None:
            start, world = self._settle_world(self._setting.problem, None)
            if start is None:
                raise UsageError(f"task {self.task.task_id}: its scene is not stable; make the layouts again")
            return start, world, None
        for _ in range(STARTS_TRIED):
            drawn = draw_start(self._noise, self._setting, self._planner, self.np_random)
            start, world = self._settle_world(drawn.problem, drawn.joints_rad)
            if start is not None and not is_reached_already(start, world):
                return start, world, drawn
        self._leave()
        raise UsageError(
            f"task {self.task.task_id}: of {STARTS_TRIED} starts with {self._noise} none is stable with the goal"
            f" not yet reached; give less start_noise"
        )

    def _settle_world(
        self, problem: PickPlaceProblem, joints_rad: np.ndarray | None
    ) -> tuple[EpisodeStart | None, RobotWorld]:
        """Replace the world by one of this problem and let it settle, with the arm at home or at ``joints_rad``."""
        self._leave()
        self._world = world = create_world(problem, self._robot, self._settings, self._closing.force_n)
        self._observed = ObservedPoses(world)
        if joints_rad is not None:
            for arm, part in zip(world.robots, split_by_arm(world, joints_rad), strict=True):
                arm.put(part, arm.robot.open_hand)
        world.set_held_objects(self._setting.sequence.moved)
        return settle_start(problem, self._planner, self._settings, self._setting.goal, world), world

    def _leave(self) -> None:
        if self._world is not None:
            self._watches = []
            world, self._world = self._world, None
            world.__exit__(None, None, None)

    def _move(self, world: RobotWorld, joints_rad: np.ndarray, hand: np.ndarray) -> None:
        arms, dt, count = self._arms, self._settings.timestep_s, self._row_substeps * self._rows
        world.expect_load(arms.may_hold(hand))
        for number in arms.apply_action(joints_rad, hand, count):
            last = arms.joint_positions() if number == count else None
            world.step()
            if number % self._per_look == 0 and (self._watches or arms.feel):
                contacts = world.contacts.read()
                arms.look(contacts)
                for watch in self._watches:
                    watch.look(world.contacts, contacts, self._steps / self._rate_hz + number * dt)
            if number % self._row_substeps == 0:  # rest is judged at the recording rate, whatever the rate of actions
                self._poses.append(self._object_poses())
                self._pressing.append(self._pairs())
            if last is not None:
                self._velocities = (arms.joint_positions() - last) / dt

    def _event_watches(self, start: EpisodeStart, world: RobotWorld) -> list[EventWatch]:
        """Return the watches for the events of every step's goal, as its course in an episode uses them."""
        watches: list[EventWatch] = []
        for step in self._setting.sequence.steps:
            if not step.goal.has_path:
                continue
            number = [each.name for each in start.objects].index(step.target)
            problem = problem_of(start.problem, start.objects, number, step.grasps)
            own = EpisodeStart(problem, start.objects, self._planner, self._settings, step.goal, start.granules_in)
            watches += create_course(own, EpisodeFacts()).watches(world)
        return watches

    def _object_poses(self) -> list[np.ndarray]:
        assert self._world is not None
        return [self._world.object_to_world(number) for number in range(len(self._world.placed))]

    def _pairs(self) -> frozenset[frozenset[str]]:
        assert self._world is not None
        return frozenset(self._world.contacts.pressing_pairs(self._world.contacts.read()))

    def _evaluation(self) -> Evaluation:
        assert self._world is not None
        rows = list(self._poses)
        at_rest = [
            is_at_rest([row[number] for row in rows], placed.body.center_of_mass_m, self._settings)
            for number, placed in enumerate(self._world.placed)
        ]
        events = tuple(event for watch in self._watches for event in watch.events)
        pressing = frozenset().union(*self._pressing)
        return evaluate(state_of(self._start, self._world, rows[-1], pressing, at_rest, events), self.task.parsed_goal)

    def _info(self, evaluation: Evaluation, success: bool = False) -> dict[str, Any]:
        holds = {str(literal): judged.holds for literal, judged in zip(
            (*evaluation.goal.literals, *evaluation.goal.stays), (*evaluation.literals, *evaluation.stays), strict=True
        )}  # fmt: skip
        return {"success": success, "failure": None if success else evaluation.failure, "literals": holds}

    def _observation(self) -> dict[str, Any]:
        world = self._world
        assert world is not None
        tips, objects = self._observed.read(world)
        seen: dict[str, Any] = {
            "joint_positions_rad": self._arms.joint_positions(),
            "joint_velocities_rad_s": self._velocities,
            self._hand_name: self._arms.hands(),
            "tip_pose": tips.ravel(),
            "object_poses": objects,
        }
        found: dict[str, Any] = {}
        for name, value in seen.items():
            space = self._seen[name]
            assert isinstance(space, spaces.Box)
            found[name] = np.clip(value, space.low, space.high).astype(np.float32)
        if self._painter is not None:
            found["pictures"] = self._painter.paint(world)
        return found


def _box(most: float, *shape: int) -> spaces.Box:
    return spaces.Box(-most, most, shape, np.float32)
