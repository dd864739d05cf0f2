"""Episodes of the Panda with a brick of known grasps, and planners that deceive in a known way."""

from __future__ import annotations

import hashlib
from dataclasses import astuple, dataclass, field, replace
from functools import cache

import numpy as np

from manitwin.episodes.episode import EpisodeFacts, run_episode
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Grasp, Motion, PickPlacePlan, PickPlaceProblem, PlanReport
from manitwin.episodes.recording import Recording
from manitwin.episodes.settings import EpisodeSettings
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject, RigidBody, StaticBox
from manitwin.robots.load import load_robot
from manitwin.robots.robot import Robot
from rigid_boxes import above, box

BRICK_M = [0.04, 0.06, 0.1]
TABLE = StaticBox("table", np.array([0.6, 1.0, 0.05]), transform(None, np.array([0.35, 0, -0.05])))
START, GOAL = (transform(None, np.array([x, y, 0.05])) for x, y in ((0.45, -0.15), (0.5, 0.2)))
GRASPS = tuple(Grasp(f"g{i}", above([0, 0.005 * i, 0.03]), 0.04) for i in range(3))


@cache
def panda() -> tuple[Robot, PickPlacePlanner]:
    """The robot and its planner, made once."""
    robot = load_robot("panda")
    return robot, PickPlacePlanner(robot)


def brick(mass_kg: float = 0.3, friction: float = 0.5) -> RigidBody:
    """A brick about its own centre."""
    return box(BRICK_M, mass_kg, friction)


def problem(
    start: np.ndarray = START, target: RigidBody | None = None, obstacles: tuple[PlacedObject, ...] = ()
) -> PickPlaceProblem:
    """Move the brick over the table."""
    placed = PlacedObject("object_01", "brick", target or brick(), start)
    return PickPlaceProblem(placed, GOAL, GRASPS, obstacles, (TABLE,), seed=3)


def standing(name: str, extents_m: list[float], x_m: float, y_m: float, mass_kg: float = 0.05) -> PlacedObject:
    """Another box that stands on the table."""
    return PlacedObject(name, name, box(extents_m, mass_kg), transform(None, np.array([x_m, y_m, extents_m[2] / 2])))


def run(
    asked: PickPlaceProblem, planner: object | None = None, settings: EpisodeSettings | None = None
) -> tuple[EpisodeFacts, Recording | None]:
    """Run an episode with the Panda."""
    robot, own = panda()
    return run_episode(asked, planner or own, robot, settings or EpisodeSettings())


def digest(recording: Recording) -> str:
    """A digest of all that was recorded."""
    arrays = b"".join(np.ascontiguousarray(values).tobytes() for values in astuple(recording) if values is not None)
    return hashlib.sha256(arrays).hexdigest()


@dataclass
class Deceived:
    """The Panda's planner for another goal, blind to the other objects, unable to plan again, or wrong about its grasp."""

    goal_offset_m: tuple[float, float, float] = (0, 0, 0)
    blind: bool = False
    replans: bool = True
    grasp_off_m: float = 0.0
    asked: list[bool] = field(default_factory=list)

    def plan(self, problem: PickPlaceProblem) -> PlanReport:
        report = panda()[1].plan(self._seen(problem))
        if report.plan is not None:
            shifted = report.plan.gripper_to_object @ transform(None, np.array([0, self.grasp_off_m, 0]))
            report.plan = replace(report.plan, gripper_to_object=shifted)
        return report

    def plan_place(
        self, problem: PickPlaceProblem, plan: PickPlacePlan, joint_positions_rad: np.ndarray,
        gripper_to_object: np.ndarray, goal_object_to_world: np.ndarray, with_carry: bool,
    ) -> tuple[Motion | None, Motion, Motion] | None:  # fmt: skip
        self.asked.append(with_carry)
        if not self.replans:
            return None
        seen = self._seen(problem)
        return panda()[1].plan_place(
            seen, plan, joint_positions_rad, gripper_to_object, seen.goal_object_to_world, with_carry
        )

    def tip_pose(self, joint_positions_rad: np.ndarray) -> np.ndarray:
        return panda()[1].tip_pose(joint_positions_rad)

    def _seen(self, problem: PickPlaceProblem) -> PickPlaceProblem:
        goal = problem.goal_object_to_world.copy()
        goal[:3, 3] += self.goal_offset_m
        return replace(problem, goal_object_to_world=goal, obstacles=() if self.blind else problem.obstacles)


if __name__ == "__main__":
    _, recording = run(problem())
    assert recording is not None
    print(digest(recording))
