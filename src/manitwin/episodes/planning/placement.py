"""Placement planning: where to release a held object, and the motions carry, lower and retreat."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.episodes.planning.arm_solutions import ArmSolutions
from manitwin.episodes.planning.collision_world import FreeSpace, ProblemWorld
from manitwin.episodes.planning.level_space import LEVEL_RAD, UPRIGHT_RAD, LevelSpace, tilts_rad
from manitwin.episodes.planning.motions import Motions
from manitwin.episodes.planning.problem import Motion, Phase, PickPlaceProblem, PlanFailure, later_failure
from manitwin.episodes.planning.straight_lines import LineEnds
from manitwin.geometry.poses import transform, transform_points
from manitwin.geometry.rigid_body import RigidBody

Placement = tuple[Motion | None, Motion, Motion]
"""Carry (None if the arm is above the goal already), lower and retreat."""

DROP_M = 0.003  # additional release height
SWAYS_RAD = np.radians(5)
"""Additional tilt beyond that at the start, because a straight joint-space motion does not reduce the tilt monotonically."""
SHARES = (0.5, 0.0)  # shares of the rotation that are corrected if the full correction is infeasible


class PlacementPlanner:
    """Plans a placement backwards: the release first, then the motion there."""

    def __init__(self, arm: ArmKinematics, solutions: ArmSolutions, motions: Motions, ends: LineEnds):
        """Take the planners of single motions."""
        self._arm, self._solutions, self._motions, self._ends = arm, solutions, motions, ends

    def plan(
        self,
        world: ProblemWorld,
        start: np.ndarray,
        gripper_to_world: np.ndarray,
        rng: np.random.Generator,
        *,
        level_only: bool = False,
    ) -> Placement | PlanFailure:
        """Plan from a configuration to the gripper pose at release; or return the latest stage that failed.

        A target to be kept level is carried level if possible, with ``level_only`` in any case.
        """
        solutions, converged = self._solutions.solve(world.arm, Phase.LOWER, gripper_to_world, start)
        failure: PlanFailure = "lower_blocked" if converged else "place_unreachable"
        for space in self._spaces(world, start, gripper_to_world, level_only=level_only):
            for at_goal in solutions:
                outcome = self._plan_to(world, space, start, at_goal, rng)
                if isinstance(outcome, tuple):
                    return outcome
                failure = later_failure(failure, outcome)
        return failure

    def _spaces(
        self, world: ProblemWorld, start: np.ndarray, gripper_to_world: np.ndarray, *, level_only: bool
    ) -> Sequence[FreeSpace]:
        """Return the free spaces to search, in order.

        For a target to be kept level, these are the tilt-constrained space twice, followed by the unconstrained one unless
        ``level_only``. A target that is already tilted at the start, as after use, may keep that tilt.
        """
        if not goes_level(world.problem, world.goal_object_to_world):
            return (world.arm,)
        starts_rad = float(tilts_rad(self._arm.gripper_pose(start)[None, :3, :3], gripper_to_world[:3, :3])[0])
        most_rad = max(LEVEL_RAD, starts_rad + SWAYS_RAD)
        level = LevelSpace(world.arm, self._arm.gripper_pose, gripper_to_world[:3, :3], most_rad)
        return (level, level) if level_only else (level, level, world.arm)

    def plan_from_above(
        self, world: ProblemWorld, start: np.ndarray, gripper_to_world: np.ndarray
    ) -> Placement | PlanFailure:
        """Plan lowering on a straight line from the current joints, and the retreat."""
        lower = self._motions.plan_line(world.arm, Phase.LOWER, start, gripper_to_world)
        if lower is None:
            return "lower_blocked"
        lowered = self._motions.time_path(Phase.LOWER, lower)
        retreat = self._retreat(world, lowered.positions_rad[-1])
        return (None, lowered, retreat) if isinstance(retreat, Motion) else retreat

    def _plan_to(
        self,
        world: ProblemWorld,
        space: FreeSpace,
        start: np.ndarray,
        at_goal: np.ndarray,
        rng: np.random.Generator,
    ) -> Placement | PlanFailure:
        above = self._ends.lift_end(self._arm.gripper_pose(at_goal))
        lower = self._motions.plan_line(world.arm, Phase.LOWER, at_goal, above)
        if lower is None:
            return "lower_blocked"
        retreat = self._retreat(world, at_goal)
        if not isinstance(retreat, Motion):
            return retreat
        lowered = self._motions.time_path(Phase.LOWER, lower, backwards=True)
        carry = self._motions.plan_free(space, Phase.CARRY, start, lowered.positions_rad[0], rng)
        return (carry, lowered, retreat) if isinstance(carry, Motion) else carry

    def _retreat(self, world: ProblemWorld, at_goal: np.ndarray) -> Motion | PlanFailure:
        before = self._ends.approach_start(self._arm.gripper_pose(at_goal))
        retreat = self._motions.plan_line(world.arm, Phase.RETREAT, at_goal, before)
        return "retreat_blocked" if retreat is None else self._motions.time_path(Phase.RETREAT, retreat)


def goes_level(problem: PickPlaceProblem, goal_object_to_world: np.ndarray) -> bool:
    """Tell whether a problem's target should be carried level to a goal ``(4, 4)``, where it is as upright as at its start."""
    level, goal = problem.target.object_to_world[:3, :3], goal_object_to_world[None, :3, :3]
    return problem.target.name in problem.level and bool(tilts_rad(goal, level)[0] <= UPRIGHT_RAD)


def goals_after_slip(
    body: RigidBody, goal_object_to_world: np.ndarray, planned: np.ndarray, measured: np.ndarray
) -> list[np.ndarray]:
    """Return goal poses of the object ``(4, 4)``, best first: exact, slightly higher, half corrected, and without correction.

    ``planned`` and ``measured`` are gripper_to_object. An object released with some tilt is as low as the goal, with its
    centre of mass above the same point, and settles by itself.
    """
    higher = goal_object_to_world.copy()
    higher[2, 3] += DROP_M
    hanging = goal_object_to_world[:3, :3] @ planned[:3, :3] @ measured[:3, :3].T
    slip = Rotation.from_matrix(hanging @ goal_object_to_world[:3, :3].T).as_rotvec()
    goals = [goal_object_to_world, higher]
    for share in SHARES:
        turned = Rotation.from_rotvec((1 - share) * slip).as_matrix() @ goal_object_to_world[:3, :3]
        goals.append(_as_low(body, goal_object_to_world, turned))
    return goals


def _as_low(body: RigidBody, goal_object_to_world: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Return the pose of a rotation with the goal's lowest height and the goal's horizontal position of the centre of mass."""
    points = np.concatenate(body.hulls)
    lowest_m = transform_points(goal_object_to_world, points)[:, 2].min()
    center = transform_points(goal_object_to_world, body.center_of_mass_m[None])[0]
    pose = transform(rotation, center - rotation @ body.center_of_mass_m)
    pose[2, 3] += lowest_m - transform_points(pose, points)[:, 2].min()
    return pose
