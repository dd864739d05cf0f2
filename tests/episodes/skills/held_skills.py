"""Things that are used, of known shape and with known frames, and episodes of the skills that use them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from brick_episodes import TABLE, panda

from manitwin.episodes.episode import run_episode
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.pick_place_tasks import PlacingArea
from manitwin.episodes.planning.problem import Grasp, PickPlaceProblem
from manitwin.episodes.recording import Recording
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.registry import SKILLS
from manitwin.episodes.skills.skill import SkillGoal, Surroundings
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject, RigidBody
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose
from manitwin.scenes.layouts.twin_frames import TwinFrame
from manitwin.scenes.scene import SupportRegion
from rigid_boxes import above, block, box
from twin_folders import twin_id

AREA = PlacingArea(
    panda()[0].workspace,
    SupportRegion(name="table", center_m=(0.35, 0.0), half_extents_m=(0.6, 1.0), height_m=0.0),
)
HOLE_M, TAG_M = 0.012, np.array([0.04, 0.13, 0.03])
"""A tag that lies: 4 x 13 x 3 cm, with a square hole of 2.4 cm whose middle is 2 cm from one end, its axis upward."""
X_TO_Z = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])


def tag() -> tuple[RigidBody, tuple[TwinFrame, ...], tuple[Grasp, ...]]:
    """The tag, its hole, and grasps from above across its other end."""
    x, y, z = TAG_M / 2
    middle = y - 0.02
    pieces = [
        ([-x, -y, 0], [x, middle - HOLE_M, 2 * z]),
        ([-x, middle - HOLE_M, 0], [-HOLE_M, y, 2 * z]),
        ([HOLE_M, middle - HOLE_M, 0], [x, y, 2 * z]),
        ([-HOLE_M, middle + HOLE_M, 0], [HOLE_M, y, 2 * z]),
    ]
    body = replace(
        box(list(TAG_M), 0.15, center_m=(0, -0.005, z)), hulls=tuple(block(low, high) for low, high in pieces)
    )
    frame = TwinFrame("hole", "hole", transform(None, np.array([0, middle, z])), HOLE_M, False)
    grasps = tuple(Grasp(f"g{i}", above([0, -0.03 - 0.005 * i, 0.015]), 0.04) for i in range(3))
    return body, (frame,), grasps


def mallet() -> tuple[RigidBody, tuple[TwinFrame, ...], tuple[Grasp, ...]]:
    """A mallet that lies: a handle 20 cm long along Y, a head 9 x 4 x 4 cm along X whose +X end strikes; held near the head."""
    pieces = [([-0.012, -0.12, 0.008], [0.012, 0.08, 0.032]), ([-0.045, 0.08, 0], [0.045, 0.12, 0.04])]
    body = replace(
        box([0.05, 0.2, 0.03], 0.3, center_m=(0, 0.06, 0.02)), hulls=tuple(block(low, high) for low, high in pieces)
    )
    frame = TwinFrame("striking face", "face", transform(X_TO_Z, np.array([0.045, 0.1, 0.02])), 0.0226, True)
    grasps = tuple(Grasp(f"g{i}", above([0, 0.03 - 0.01 * i, 0.02]), 0.024) for i in range(3))
    return body, (frame,), grasps


def remote() -> tuple[RigidBody, tuple[TwinFrame, ...]]:
    """A flat box 5 x 16 x 3 cm with a button on its top, 3 cm from the middle."""
    body = replace(
        box([0.05, 0.16, 0.03], 0.2, center_m=(0, 0, 0.015)), hulls=(block([-0.025, -0.08, 0], [0.025, 0.08, 0.03]),)
    )
    return body, (TwinFrame("button", "button", transform(None, np.array([0, 0.03, 0.03])), 0.005, True),)


def around(body: RigidBody, frames: tuple[TwinFrame, ...], x_m: float, y_m: float) -> Surroundings:
    """One thing on the test's table."""
    twin = PoolTwin(twin_id(0), "0", "thing", (StandingPose(0, np.eye(4), 1.0, 0.1, True),), False, frames)
    placed = PlacedObject("object_00", twin.twin_id, body, transform(None, np.array([x_m, y_m, 0.0])))
    return Surroundings((placed,), Pool([twin], lambda _: body), AREA, (TABLE,))


def goal_of(skill: str, surroundings: Surroundings, seed: int = 1) -> SkillGoal:
    """The skill's goal, its fixtures standing where the seed has them."""
    goal = SKILLS[skill].sample_goal(surroundings, 0, None, np.random.default_rng(seed))
    assert goal is not None
    return goal


def attempt(
    surroundings: Surroundings,
    goal: SkillGoal,
    grasps: tuple[Grasp, ...],
    off: np.ndarray | None = None,
) -> tuple[EpisodeFacts, Recording | None]:
    """Run the episode; ``off (4, 4)`` moves the path in the world, not what is asked for."""
    make = goal.path
    assert make is not None
    if off is not None:

        def moved(scene: object) -> object:
            task = make(scene)
            paths, otherwise = (
                tuple(replace(path, poses=off @ path.poses) for path in each) for each in (task.paths, task.otherwise)
            )
            return replace(task, paths=paths, otherwise=otherwise)

        goal = replace(goal, path=moved)
    robot, planner = panda()
    problem = PickPlaceProblem(
        surroundings.objects[0], goal.poses[0], grasps, surroundings.objects[1:], surroundings.boxes, seed=3,
        fixtures=tuple(each for fixture in goal.fixtures for each in fixture.boxes),
    )  # fmt: skip
    return run_episode(problem, planner, robot, EpisodeSettings(), goal)


def beside(x_m: float, y_m: float) -> np.ndarray:
    """A shift in the world."""
    return transform(None, np.array([x_m, y_m, 0.0]))
