"""Skills that set an object down, tried on things of known shape by the Panda: surroundings, goals and episodes of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from brick_episodes import TABLE, panda

from manitwin.episodes.episode import EpisodeFacts, run_episode
from manitwin.episodes.pick_place_tasks import PlacingArea
from manitwin.episodes.planning.problem import Grasp, PickPlaceProblem
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.registry import SKILLS
from manitwin.episodes.skills.skill import SkillGoal, Surroundings, sample_skill_goal
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.scenes.layouts.pool import Pool, StandingPose
from manitwin.scenes.scene import SupportRegion
from rigid_boxes import above
from scene_twins import THINGS, pool_of_things
from twin_folders import twin_id

NUMBERS = {thing.category: number for number, thing in enumerate(THINGS)}
LYING = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
POOL = pool_of_things()
GRASPS = {"dice": Grasp("g0", above([0, 0, 0.02]), 0.03), "can": Grasp("g0", above([0, 0, 0.08]), 0.07)}
AREA = PlacingArea(
    panda()[0].workspace,
    SupportRegion(name="table", center_m=(0.35, 0.0), half_extents_m=(0.6, 1.0), height_m=0.0),
)


def placed(
    number: int, category: str, x_m: float, y_m: float, turn: np.ndarray | None = None, z_m: float = 0.0
) -> PlacedObject:
    """A thing on the table."""
    name = twin_id(NUMBERS[category])
    return PlacedObject(f"object_{number:02d}", name, POOL.body(name).body, transform(turn, np.array([x_m, y_m, z_m])))


def around(*objects: PlacedObject, pool: Pool = POOL) -> Surroundings:
    """Surroundings on the test's table."""
    return Surroundings(objects, pool, AREA, (TABLE,))


def goal_of(skill: str, surroundings: Surroundings, seed: int = 1) -> SkillGoal | None:
    """The skill's goal for the first object, and the second where it has a partner."""
    chosen = SKILLS[skill]
    return sample_skill_goal(chosen, surroundings, 0, 1 if chosen.has_partner else None, np.random.default_rng(seed))


def attempt(
    surroundings: Surroundings,
    goal: SkillGoal,
    grasps: tuple[Grasp, ...],
    off_m: tuple[float, float, float] = (0, 0, 0),
) -> EpisodeFacts:
    """Run the episode; ``off_m`` shifts where the object is let go, not what is asked for."""
    poses = tuple(transform(None, np.array(off_m)) @ pose for pose in goal.poses)
    robot, planner = panda()
    problem = PickPlaceProblem(
        surroundings.objects[0], poses[0], grasps, surroundings.objects[1:], surroundings.boxes, seed=3
    )
    return run_episode(problem, planner, robot, EpisodeSettings(), replace(goal, poses=poses))[0]


def pool_with_lying_can() -> Pool:
    """The things, of which the can also stays on its side."""
    lying = StandingPose(1, transform(LYING, np.array([0, 0.05, 0.035])), 0.4, 0.06)
    standing = StandingPose(0, np.eye(4), 0.6, 0.04, upright=True)
    twins = [replace(twin, poses=(standing, lying)) if twin.category == "can" else twin for twin in POOL.twins]
    return Pool(twins, lambda name: POOL.body(name).body)
