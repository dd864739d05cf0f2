"""Single motions: the gripper along a straight line, or the arm between two configurations around obstacles."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.episodes.planning.collision_world import CollisionWorld, FreeSpace, is_path_free
from manitwin.episodes.planning.joint_paths import JointPath, JointSegment, is_segment_free, round_corners, shortcut
from manitwin.episodes.planning.problem import Motion, Phase, PlanFailure, PlannerSettings
from manitwin.episodes.planning.rrt_connect import rrt_connect
from manitwin.episodes.planning.straight_lines import straight_line
from manitwin.episodes.planning.timing import time_optimal, time_rest_to_rest
from manitwin.robots.robot import Robot

CORNER_RADII_RAD = (0.4, 0.2, 0.1, 0.03)


class Motions:
    """Plans and times single motions of an arm; each is checked as finely as it is executed."""

    def __init__(self, robot: Robot, arm: ArmKinematics, timestep_s: float, settings: PlannerSettings):
        """Take the limits of ``robot``."""
        self._arm, self._timestep_s, self._settings = arm, timestep_s, settings
        self._velocity_limits = np.asarray(robot.velocity_limits_rad_s, float)
        self._acceleration_limits = np.asarray(robot.acceleration_limits_rad_s2, float)
        self.limits = self._velocity_limits, self._acceleration_limits

    def plan_line(
        self, world: CollisionWorld, phase: Phase, start: np.ndarray, end_to_world: np.ndarray
    ) -> CubicSpline | None:
        """Return the joint path of a straight line of the gripper that is free in a phase, or None."""
        path = straight_line(self._arm, start, end_to_world)
        if path is None:
            return None
        world.enter(phase)
        way_m = float(np.linalg.norm(end_to_world[:3, 3] - self._arm.gripper_pose(start)[:3, 3]))
        knots = path(path.x)
        turned_rad = float(np.linalg.norm(np.diff(knots, axis=0), axis=1).sum())
        steps = max(way_m / self._settings.check_step_m, turned_rad / self._settings.check_step_rad, 1.0)
        return path if is_path_free(world, path, int(np.ceil(steps))) else None

    def time_path(self, phase: Phase, path: JointPath, *, backwards: bool = False) -> Motion:
        """Time a path from rest to rest; reversed in time if it was planned ``backwards``."""
        positions, velocities = time_rest_to_rest(
            path, self._velocity_limits, self._acceleration_limits, self._timestep_s
        )
        if backwards:
            positions, velocities = positions[::-1].copy(), -velocities[::-1]
        return Motion(phase, positions, velocities)

    def plan_free(
        self, world: FreeSpace, phase: Phase, start: np.ndarray, goal: np.ndarray, rng: np.random.Generator
    ) -> Motion | PlanFailure:
        """Return a collision-free motion with the largest margin that start and goal allow, or the failure."""
        margin_m = self._largest_margin_m(world, phase, start, goal)
        if margin_m is None:
            return "no_path"
        world.enter(phase, margin_m)
        if is_segment_free(start, goal, world.is_free, self._settings.check_step_rad):
            return self.time_path(phase, JointSegment(start, goal))
        waypoints = rrt_connect(
            start,
            goal,
            world.is_free,
            (self._arm.lower, self._arm.upper),
            rng,
            extension_rad=self._settings.extension_rad,
            check_step_rad=self._settings.search_step_rad,
            iterations=self._settings.iterations,
        )
        if waypoints is None:
            return "no_path"
        waypoints = shortcut(
            waypoints,
            world.is_free,
            rng,
            tries=self._settings.shortcuts,
            check_step_rad=self._settings.search_step_rad,
        )
        world.enter(phase, max(margin_m / 2, min(margin_m, self._settings.clearance_m)))
        return self._smooth(world, phase, waypoints) or "no_time_parameterization"

    def _largest_margin_m(self, world: FreeSpace, phase: Phase, start: np.ndarray, goal: np.ndarray) -> float | None:
        clearance_m = self._settings.clearance_m
        for margin_m in (self._settings.margin_m, (self._settings.margin_m + clearance_m) / 2, clearance_m, 0.0):
            world.enter(phase, margin_m)
            if world.is_free(start) and world.is_free(goal):
                return margin_m
        return None

    def _smooth(self, world: FreeSpace, phase: Phase, waypoints: np.ndarray) -> Motion | None:
        """Return the free motion with the largest corner radius, or one that stops at the waypoints; None if none is free."""
        step_rad = self._settings.check_step_rad
        for radius_rad in CORNER_RADII_RAD if len(waypoints) > 2 else ():
            timed = time_optimal(
                round_corners(waypoints, radius_rad), self._velocity_limits, self._acceleration_limits, self._timestep_s
            )
            if timed is not None and self._arm.within_limits(timed[0]) and _is_free(world, timed[0], step_rad):
                return Motion(phase, *timed)
        pieces = []
        for start, end in pairwise(waypoints):
            if not is_segment_free(start, end, world.is_free, step_rad):
                return None
            pieces.append(self.time_path(phase, JointSegment(start, end)))
        positions = [pieces[0].positions_rad[:1], *(piece.positions_rad[1:] for piece in pieces)]
        velocities = [pieces[0].velocities_rad_s[:1], *(piece.velocities_rad_s[1:] for piece in pieces)]
        return Motion(phase, np.concatenate(positions), np.concatenate(velocities))


def _is_free(world: FreeSpace, positions: np.ndarray, step_rad: float) -> bool:
    """Tell whether a sampled motion ``(T, n)`` is free, checked every ``step_rad`` of its length."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    looked_at = np.unique(np.searchsorted(way, np.arange(0, way[-1] + step_rad, step_rad)).clip(max=len(way) - 1))
    return all(world.is_free(position) for position in positions[looked_at])
