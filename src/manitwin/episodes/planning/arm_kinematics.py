"""Forward and inverse kinematics of an arm, for the grasp frame in the world."""

from __future__ import annotations

from typing import Any

import numpy as np

from manitwin.episodes.planning.kinematic_body import KinematicBody, arm_of
from manitwin.episodes.planning.libraries import eigenpy, pin
from manitwin.episodes.planning.obstacle_shapes import pose_of
from manitwin.robots.robot import Robot

LIMIT_MARGIN_RAD = 1e-3
TOLERANCE = 5e-5  # of the norm of the error twist, in metres and radians alike
DAMPING = 1e-3  # factor of the squared error (Sugihara 2011), so that damping vanishes near the solution
LEAST_DAMPING = 1e-8
LARGEST_STEP_RAD = 0.5
ITERATIONS = 30
STALLED_AFTER = 6
"""Iterations without halving the squared error; measured: from a known pose nearby, 98 per cent converge."""


class ArmKinematics:
    """Kinematics of an arm of n joints within ``lower`` and ``upper (n,)`` rad.

    These are the URDF's limits ``limits_rad`` less a margin. A joint with a range of more than one revolution is limited to
    one revolution about its home.
    """

    def __init__(self, robot: Robot, opening_m: float | None = None):
        """Build the model of ``robot``'s arm with the hand open, or with the distance ``opening_m`` between the pads."""
        self.body: KinematicBody = arm_of(robot, opening_m)
        self.home = np.asarray(robot.home_rad, float)
        model = self.body.model
        lower, upper = np.array(model.lowerPositionLimit), np.array(model.upperPositionLimit)
        self.limits_rad = lower.copy(), upper.copy()
        more_than_once = upper - lower > 2 * np.pi + 1e-6
        lower[more_than_once] = np.maximum(lower, self.home - np.pi)[more_than_once]
        upper[more_than_once] = np.minimum(upper, self.home + np.pi)[more_than_once]
        self.lower, self.upper = lower + LIMIT_MARGIN_RAD, upper - LIMIT_MARGIN_RAD
        self._model, self._data, self._joint = model, model.createData(), self.body.joint
        self._joint_to_gripper = self.body.gripper_to_joint.inverse()

    @property
    def joints(self) -> int:
        """The number of joints."""
        return len(self.home)

    def gripper_pose(self, configuration: np.ndarray) -> np.ndarray:
        """Return the grasp frame in the world ``(4, 4)``."""
        return np.array(self._gripper(configuration).homogeneous)

    def _gripper(self, configuration: np.ndarray) -> Any:
        pin.forwardKinematics(self._model, self._data, configuration)
        return self._data.oMi[self._joint] * self.body.gripper_to_joint

    def within_limits(self, configurations: np.ndarray) -> bool:
        """Tell whether configurations ``(..., n)`` are within the joint limits."""
        slack = LIMIT_MARGIN_RAD / 2
        return bool(((configurations >= self.lower - slack) & (configurations <= self.upper + slack)).all())

    def inverse(
        self, gripper_to_world: np.ndarray, start: np.ndarray, iterations: int = ITERATIONS
    ) -> np.ndarray | None:
        """Return joint positions ``(n,)`` for a grasp frame pose ``(4, 4)``, by damped least squares from ``start``; or None.

        Levenberg-Marquardt with the damping of Sugihara (2011, IEEE T-RO 27:5); steps are capped and clipped to the limits.
        """
        model, data, joint = self._model, self._data, self._joint
        goal = pose_of(gripper_to_world) * self._joint_to_gripper
        configuration, best, since = start, np.inf, 0
        for _ in range(iterations):
            jacobian = pin.computeJointJacobian(model, data, configuration, joint)
            pin.forwardKinematics(model, data, configuration)
            error = pin.log6(data.oMi[joint].actInv(goal)).vector
            square = float(error.dot(error))
            if square < TOLERANCE**2:
                return configuration
            if square < best / 2:
                best, since = square, 0
            else:
                since += 1
                if since > STALLED_AFTER:
                    return None
            normal = jacobian.dot(jacobian.T)
            normal.flat[::7] += DAMPING * square + LEAST_DAMPING
            step = jacobian.T.dot(eigenpy.LLT(normal).solve(error))
            largest = max(step.max(), -step.min())
            if largest > LARGEST_STEP_RAD:
                step *= LARGEST_STEP_RAD / largest
            configuration = np.minimum(np.maximum(configuration + step, self.lower), self.upper)
        return None
