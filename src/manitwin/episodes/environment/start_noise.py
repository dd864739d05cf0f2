"""Start noise of a task: arm joints and objects on surfaces, sampled around their pose in the scene."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from numbers import Real
from typing import Any

import numpy as np

from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Phase, PickPlaceProblem
from manitwin.episodes.planning.two_arms import TwoArmPlanner
from manitwin.episodes.tasks.task_setting import TaskSetting
from manitwin.errors import UsageError
from manitwin.geometry.poses import transform, transform_points
from manitwin.scenes.layouts.placing import Obstacles, in_workspace, is_within

MOST = {"joints_rad": 0.5, "position_m": 0.5, "yaw_rad": np.pi}
"""Largest accepted values; beyond these the start is unrelated to the scene's: objects cross the table, joints leave the
workspace.
"""
DRAWS_TRIED = 200  # for the arm, and for each object
LEAST_GAP_M = 1e-3  # clearance from surrounding objects; the densest layouts are sampled with 3 mm


@dataclass(frozen=True)
class StartNoise:
    """Variation of a task's start with the seed of ``reset``; a value of 0 keeps the scene's state.

    ``joints_rad`` is the standard deviation of a normal distribution for each arm joint around its home (as ManiSkill's
    ``robot_init_qpos_noise``). Objects are translated uniformly by up to ``position_m`` along x and along y, and rotated
    uniformly by up to ``yaw_rad`` about the vertical axis through their centre of mass. Raises UsageError unless the values
    are numbers from 0 to 0.5 rad, 0.5 m and pi.
    """

    joints_rad: float = 0.0
    position_m: float = 0.0
    yaw_rad: float = 0.0

    def __post_init__(self) -> None:
        """Validate the values."""
        for each in fields(self):
            value = getattr(self, each.name)
            if not isinstance(value, Real) or isinstance(value, bool) or not 0 <= float(value) <= MOST[each.name]:
                raise UsageError(
                    f"start_noise: {each.name} is {value!r}; give a number from 0 to {MOST[each.name]:.6g}"
                )


@dataclass(frozen=True)
class DrawnStart:
    """A sampled start: its problem, the arm's joints ``(n,)`` rad, and the offsets of joints and objects.

    ``moves (k, 3)``: for each object, in the order of names, the translation along x and y (m) and the rotation about the
    vertical (rad).
    """

    problem: PickPlaceProblem
    joints_rad: np.ndarray
    joint_offsets_rad: np.ndarray
    moves: np.ndarray

    @property
    def info(self) -> dict[str, Any]:
        """Entry of the start in ``reset``'s ``info``."""
        return {"joint_offsets_rad": self.joint_offsets_rad, "object_moves": self.moves}


def draw_start(
    noise: StartNoise, setting: TaskSetting, planner: PickPlacePlanner, rng: np.random.Generator
) -> DrawnStart:
    """Sample object poses and arm joints without collisions.

    Objects that stand on furniture and support nothing are moved one after the other: each stays on its surface, clear of
    everything else, and in the workspace if it was in it. Joints stay within their limits, and the arm is as clear of
    everything as in free motions. Raises UsageError if ``DRAWS_TRIED`` samples were all rejected.
    """
    problem, moves = _with_objects_moved(noise, setting, planner, rng)
    joints_rad, home_rad = _joints(noise, problem, planner, rng)
    return DrawnStart(problem, joints_rad, joints_rad - home_rad, moves)


def _with_objects_moved(
    noise: StartNoise, setting: TaskSetting, planner: PickPlacePlanner, rng: np.random.Generator
) -> tuple[PickPlaceProblem, np.ndarray]:
    scene, problem = setting.scene, setting.problem
    moves = np.zeros((len(scene.objects), 3))
    spread = np.array([noise.position_m, noise.position_m, noise.yaw_rad], float)
    if not spread.any():
        return problem, moves
    supports = {support.name: support for support in scene.scene.record.furniture.supports}
    stands_on = {name: supports[surface] for name, surface in _movable(setting).items()}
    bodies = [scene.pool.body(each.twin_id).parts for each in scene.objects]
    poses = [each.object_to_world for each in scene.objects]
    boxes = (*problem.static_boxes, *problem.fixtures)
    for number, each in enumerate(scene.objects):
        if each.name not in stands_on:
            continue
        support, center_m = stands_on[each.name], each.body.center_of_mass_m
        around = Obstacles(boxes, [bodies[k].at(poses[k]) for k in range(len(poses)) if k != number])
        was_in_reach = _in_reach(each.object_to_world, center_m, planner)
        for _ in range(DRAWS_TRIED):
            move = spread * rng.uniform(-1, 1, 3)
            pose = _moved(each.object_to_world, center_m, move)
            parts = bodies[number].at(pose)
            if (
                is_within(parts, support)
                and (not was_in_reach or _in_reach(pose, center_m, planner))
                and around.is_clear(parts, support.height_m, LEAST_GAP_M)
            ):
                break
        else:
            raise UsageError(
                f"start_noise: no free place for {each.name} of task {setting.task.task_id} in {DRAWS_TRIED} draws; "
                f"give another position_m or yaw_rad than {noise.position_m} and {noise.yaw_rad}"
            )
        poses[number], moves[number] = pose, move
    moved = {each.name: replace(each, object_to_world=pose) for each, pose in zip(scene.objects, poses, strict=True)}
    return replace(
        problem,
        target=moved[problem.target.name],
        obstacles=tuple(moved[each.name] for each in problem.obstacles),
    ), moves


def _movable(setting: TaskSetting) -> dict[str, str]:
    """Return the surface name of each object that stands on furniture and supports nothing, by object name."""
    objects = setting.scene.scene.record.objects
    carrying = {each.supported_by for each in objects}
    return {each.name: each.surface for each in objects if each.supported_by is None and each.name not in carrying}


def _moved(object_to_world: np.ndarray, center_of_mass_m: np.ndarray, move: np.ndarray) -> np.ndarray:
    """Return a pose ``(4, 4)`` translated along x and y (m) and rotated (rad) about the vertical through the centre of mass."""
    along_x_m, along_y_m, yaw_rad = move
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    center = transform_points(object_to_world, center_of_mass_m[None])[0]
    to_place = transform(turn, center - turn @ center + [along_x_m, along_y_m, 0.0])
    result: np.ndarray = to_place @ object_to_world
    return result


def _in_reach(object_to_world: np.ndarray, center_of_mass_m: np.ndarray, planner: PickPlacePlanner) -> bool:
    center = transform_points(object_to_world, center_of_mass_m[None])[:, :2]
    return bool(in_workspace(center, planner.robot.workspace)[0])


def _joints(
    noise: StartNoise, problem: PickPlaceProblem, planner: PickPlacePlanner, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return the sampled joints of all arms, and their home positions."""
    if not isinstance(planner, TwoArmPlanner):
        return _of_one_arm(noise, problem, planner, rng), planner.arm.home
    taker = planner.taker
    first = _of_one_arm(noise, planner.with_taker_at(problem, taker.arm.home, None), planner, rng)
    second = _of_one_arm(noise, planner.with_giver_at(problem, first), taker, rng)
    return np.concatenate([first, second]), np.concatenate([planner.arm.home, taker.arm.home])


def _of_one_arm(
    noise: StartNoise, problem: PickPlaceProblem, planner: PickPlacePlanner, rng: np.random.Generator
) -> np.ndarray:
    home_rad, arm = np.array(planner.robot.home_rad, float), planner.arm
    if not noise.joints_rad:
        return home_rad
    world = planner.parts.problem_world(problem, problem.goal_object_to_world).arm
    world.enter(Phase.REACH)
    for _ in range(DRAWS_TRIED):
        drawn = home_rad + noise.joints_rad * rng.standard_normal(len(home_rad))
        if (drawn >= arm.lower).all() and (drawn <= arm.upper).all() and world.is_free(drawn):
            return drawn
    raise UsageError(
        f"start_noise: no free position of the arm in {DRAWS_TRIED} draws; "
        f"give a smaller joints_rad than {noise.joints_rad}"
    )
