"""Several configurations of an arm for one pose of its gripper."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.episodes.planning.collision_world import CollisionWorld
from manitwin.episodes.planning.known_poses import KnownPoses
from manitwin.episodes.planning.problem import Phase
from manitwin.episodes.planning.settings import PlannerSettings

SAME_SOLUTION_RAD = 0.05


class ArmSolutions:
    """Inverse kinematics from where the arm is, then from known configurations whose poses are near."""

    def __init__(self, arm: ArmKinematics, known: KnownPoses, settings: PlannerSettings):
        """Take the arm and what is known of it."""
        self._arm, self._known, self._settings = arm, known, settings

    def of(
        self, world: CollisionWorld, phase: Phase, gripper_to_world: np.ndarray, near: np.ndarray
    ) -> tuple[list[np.ndarray], bool]:
        """Return free configurations of a pose, nearest to ``near`` first, and whether any at all was found."""
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
