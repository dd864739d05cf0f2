"""Inverse kinematics with several solutions per gripper pose, and a reach test, from sampled configurations."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.episodes.planning.collision_world import CollisionWorld
from manitwin.episodes.planning.kinematic_body import KinematicBody, broad_phase
from manitwin.episodes.planning.libraries import pin
from manitwin.episodes.planning.problem import Phase, PlannerSettings

SAMPLES = 4000
NEAR_HOME_SHARE = 0.5
NEAR_HOME_RAD = 0.8
ROTATION_SCALE_M = 0.3  # length equivalent of a rotation by one radian
REACH_SLACK_M = 0.03
SEED = 0

SAME_SOLUTION_RAD = 0.05


class SampledPoses:
    """Sampled configurations of an arm without self-collision, half of them near home, with their gripper poses."""

    def __init__(self, arm: ArmKinematics):
        """Sample configurations; deterministic for an arm."""
        rng = np.random.default_rng(SEED)
        uniform = rng.uniform(arm.lower, arm.upper, (SAMPLES, arm.joints))
        near_home = np.clip(arm.home + rng.normal(0, NEAR_HOME_RAD, uniform.shape), arm.lower, arm.upper)
        samples = np.where(rng.random((SAMPLES, 1)) < NEAR_HOME_SHARE, near_home, uniform)
        poses = np.array([arm.gripper_pose(sample) for sample in samples])
        self._shoulder = _fixed_joint_position(arm, samples[:50])
        self._reach_m = float(np.linalg.norm(poses[:, :3, 3] - self._shoulder, axis=1).max()) + REACH_SLACK_M
        free = _without_self_collision(arm.body, samples)
        self._samples, self._features = samples[free], _features(poses[free])

    def is_out_of_reach(self, gripper_to_world: np.ndarray) -> bool:
        """Tell whether a pose is farther from the shoulder than any sample."""
        return float(np.linalg.norm(gripper_to_world[:3, 3] - self._shoulder)) > self._reach_m

    def nearest(self, gripper_to_world: np.ndarray, count: int) -> np.ndarray:
        """Return the ``count`` configurations with the nearest gripper poses, ``(count, n)``."""
        distances = ((self._features - _features(gripper_to_world[None])) ** 2).sum(1)
        nearest = np.argpartition(distances, count)[:count]
        return self._samples[nearest[np.argsort(distances[nearest], kind="stable")]]


def _features(poses: np.ndarray) -> np.ndarray:
    """Return pose features ``(N, 12)`` whose Euclidean distance (m) combines translation and rotation."""
    rotations = poses[:, :3, :3].reshape(-1, 9) * (ROTATION_SCALE_M / np.sqrt(2))
    return np.concatenate([poses[:, :3, 3], rotations], axis=1)


def _fixed_joint_position(arm: ArmKinematics, samples: np.ndarray) -> np.ndarray:
    """Return the position of the last joint that no configuration moves."""
    model, data = arm.body.model, arm.body.model.createData()
    positions = []
    for sample in samples:
        pin.forwardKinematics(model, data, sample)
        positions.append([np.array(data.oMi[j].translation) for j in range(1, model.njoints)])
    spread = np.ptp(np.array(positions), axis=0).max(1)
    return np.array(positions[0][int(np.flatnonzero(spread < 1e-6).max())])


def _without_self_collision(body: KinematicBody, samples: np.ndarray) -> np.ndarray:
    """Tell which samples ``(N, n)`` have no self-collision."""
    data, geometry = body.model.createData(), body.geometry.createData()
    manager = broad_phase(body.model, body.geometry, geometry)
    return np.array([not pin.computeCollisions(body.model, data, manager, sample, True) for sample in samples])


class ArmSolutions:
    """Inverse kinematics started from a given configuration, then from known configurations with nearby poses."""

    def __init__(self, arm: ArmKinematics, known: SampledPoses, settings: PlannerSettings):
        """Take the arm, its known poses and the settings."""
        self._arm, self._known, self._settings = arm, known, settings

    def solve(
        self, world: CollisionWorld, phase: Phase, gripper_to_world: np.ndarray, near: np.ndarray
    ) -> tuple[list[np.ndarray], bool]:
        """Return collision-free configurations of a pose, nearest to ``near`` first, and whether any solution converged."""
        found: list[np.ndarray] = []
        converged = False
        world.enter(phase)
        for start in (near, *self._known.nearest(gripper_to_world, self._settings.starts)):
            solution = self._arm.inverse(gripper_to_world, start)
            if solution is None:
                continue
            converged = True
            is_new = all(np.abs(solution - other).max() > SAME_SOLUTION_RAD for other in found)
            if is_new and world.is_free(solution):
                found.append(solution)
                if len(found) == self._settings.solutions:
                    break
        return sorted(found, key=lambda solution: float(np.abs(solution - near).sum())), converged
