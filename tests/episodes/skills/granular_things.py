"""Vessels of known shape with a handle, a lip and grasps, and surroundings of two things, for skills with granules."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from brick_episodes import TABLE
from held_skills import AREA

from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.skill import SkillGoal, Surroundings
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject, RigidBody
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose
from manitwin.scenes.layouts.twin_frames import TwinFrame
from rigid_boxes import above, block, box
from scene_twins import bowl
from twin_folders import twin_id

CUP_RADIUS_M, CUP_HEIGHT_M = 0.035, 0.08


def cup() -> tuple[RigidBody, tuple[TwinFrame, ...], tuple[Grasp, ...]]:
    """A cup of twelve walls 4 mm thick with a plate as handle at -X, so that it pours over +X; grasps of the plate from above."""
    around = np.linspace(0, 2 * np.pi, 13)
    rings = {r: np.column_stack([r * np.cos(around), r * np.sin(around)]) for r in (CUP_RADIUS_M - 0.004, CUP_RADIUS_M)}
    floor = np.array([[x, y, z] for x, y in rings[CUP_RADIUS_M][:12] for z in (0, 0.004)])
    walls = [
        np.array([[*rings[r][i], z] for i in pair for r in rings for z in (0.004, CUP_HEIGHT_M)])
        for pair in pairwise(range(13))
    ]
    handle = block([-0.065, -0.006, 0.01], [-CUP_RADIUS_M + 0.002, 0.006, CUP_HEIGHT_M - 0.005])
    body = replace(box([0.07, 0.07, 0.08], 0.15, center_m=(-0.005, 0, 0.035)), hulls=(floor, *walls, handle))
    opening = TwinFrame("opening", "opening", transform(None, np.array([0, 0, CUP_HEIGHT_M])), 0.031, False)
    grasps = tuple(Grasp(f"g{i}", above([-0.05, 0, 0.055 - 0.004 * i], _quarter_turn()), 0.012) for i in range(2))
    return body, (opening,), grasps


def _quarter_turn() -> np.ndarray:
    """From above, closing across the handle, along Y."""
    return np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])


def two_things(
    first: tuple[RigidBody, tuple[TwinFrame, ...]],
    second: tuple[RigidBody, tuple[TwinFrame, ...]],
    at: tuple[tuple[float, float], tuple[float, float]],
    *,
    vessels: tuple[bool, bool] = (True, True),
    turn: np.ndarray | None = None,
) -> Surroundings:
    """Two things on the test's table, the first of them turned."""
    bodies = {twin_id(number): body for number, (body, _) in enumerate((first, second))}
    twins = [
        PoolTwin(twin_id(i), str(i), f"thing {i}", (StandingPose(0, np.eye(4), 1.0, 0.1, True),), vessel, frames)
        for i, ((_, frames), vessel) in enumerate(zip((first, second), vessels, strict=True))
    ]
    placed = tuple(
        PlacedObject(
            f"object_{i:02d}", twin.twin_id, bodies[twin.twin_id], transform(rotation, np.array([*place, 0.0]))
        )
        for i, (twin, place, rotation) in enumerate(zip(twins, at, (turn, None), strict=True))
    )
    return Surroundings(placed, Pool(twins, bodies.__getitem__), AREA, (TABLE,))


def mixing_bowl() -> tuple[RigidBody, tuple[TwinFrame, ...]]:
    """A bowl 18 cm wide without frames."""
    return bowl().body(), ()


def plate() -> tuple[RigidBody, tuple[TwinFrame, ...]]:
    """The bowl pressed flat: as wide, and 2 cm high."""
    body = bowl().body()
    flat = np.array([1.0, 1.0, 0.02 / np.concatenate(body.hulls)[:, 2].max()])
    return replace(body, hulls=tuple(hull * flat for hull in body.hulls)), ()


def deep_pot(depth_m: float, radius_m: float) -> tuple[RigidBody, tuple[TwinFrame, ...]]:
    """A pot of twelve upright walls 4 mm thick on a floor as thick."""
    around = np.linspace(0, 2 * np.pi, 13)
    rings = {r: np.column_stack([r * np.cos(around), r * np.sin(around)]) for r in (radius_m, radius_m + 0.004)}
    floor = np.array([[x, y, z] for x, y in rings[radius_m + 0.004][:12] for z in (0, 0.004)])
    walls = [
        np.array([[*rings[r][i], z] for i in pair for r in rings for z in (0.004, depth_m + 0.004)])
        for pair in pairwise(range(13))
    ]
    body = box([2 * radius_m, 2 * radius_m, depth_m], 0.6, center_m=(0, 0, depth_m / 2))
    return replace(body, hulls=(floor, *walls)), ()


def with_fewer(goal: SkillGoal, count: int = 20) -> SkillGoal:
    """The goal with the first granules alone: a step costs what there is."""
    assert goal.granules is not None
    return replace(goal, granules=replace(goal.granules, centers_m=goal.granules.centers_m[:count]))
