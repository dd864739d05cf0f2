"""Skill ``cut_motion``: draw a knife's edge along the middle of a board. Motion only: nothing is divided."""

from __future__ import annotations

from itertools import product

import numpy as np

from manitwin.episodes.fixtures import Fixture
from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.held_skill import HeldSkill, board_in_reach
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.episodes.skills.skill import Surroundings
from manitwin.episodes.tool_watches import CutWatch
from manitwin.geometry.frames.label_keywords import is_cutting_edge
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.world import RobotWorld
from manitwin.scenes.layouts.pool import Pool, PoolTwin
from manitwin.scenes.layouts.twin_frames import TwinFrame

BOARD, LINE = "cutting_board", "line"
# a block, short along the line and high, so that there is room for the hand beside it
BOARD_HALF_M = np.array([0.035, 0.06, 0.05])
LINE_M = 0.06
LEAST_EDGE_M = 0.05
ABOVE_M, FREE_KNOTS, KNOTS = 0.05, 4, 7
NEAR_M = 0.002  # clearance of the edge above the board
# offset of the part of the edge that moves along the line, relative to the edge's length, from its middle
SHARES = (0.0, 0.2, -0.2)
FINGER_M = 0.015  # clearance of the fingers from the edge's ends
LEAN_STEP = 0.25
"""In the cosine of the hand's lean: grasps that differ by less are about equally high above the knife, and count as equal."""


class CutMotion(HeldSkill):
    """Bring the edge down to the line, draw it along, and put the knife back."""

    name, predicate = "cut_motion", "cut_motion"

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept a cutting object with an edge of at least 5 cm."""
        edge = edge_of(target.frames)
        return edge is not None and is_cutting_edge(target.category, edge.label)

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return the goal that the edge moved along the line."""
        return Goal((Literal(self.predicate, target.name, LINE),))

    def fixture(self, around: Surroundings, target: int, rng: np.random.Generator) -> Fixture | None:
        """Draw a board in reach."""
        return board_in_reach(around, BOARD_HALF_M, BOARD, rng)

    def task(self, scene: HeldScene) -> HeldTask:
        """Return the paths along the line: both directions, both sides of the knife, several parts of the edge."""
        target, (under,) = scene.target, scene.fixtures
        edge = edge_of(scene.frames[target.name])
        assert edge is not None, "only what cuts is drawn along a line"
        line = under.frame_to_world
        local = transform_points(inverse(edge.frame_to_object), np.concatenate(target.body.hulls))
        along_m = np.array([*np.full(FREE_KNOTS + 1, -LINE_M / 2), *np.linspace(-LINE_M / 2, LINE_M / 2, KNOTS)[1:]])
        heights_m = np.array([*np.linspace(ABOVE_M, 0.01, FREE_KNOTS), *np.zeros(KNOTS)])
        paths = []
        for share, way, side in product(SHARES, (1.0, -1.0), (1.0, -1.0)):
            over = np.abs(local[:, 0] - share * edge.size_m) < BOARD_HALF_M[0] + LINE_M / 2
            low_m = NEAR_M + float(local[over, 2].max())
            down = np.diag([side, -side, -1.0])
            poses = [
                line @ transform(down, np.array([way * x - side * share * edge.size_m, 0.0, z + low_m]))
                for x, z in zip(along_m, heights_m, strict=True)
            ]
            paths.append(HeldPath(np.array(poses) @ inverse(edge.frame_to_object), frozenset({BOARD}), FREE_KNOTS))

        def rank(grasp: Grasp) -> float | None:
            hand = inverse(edge.frame_to_object) @ grasp.gripper_to_object
            tips = transform_points(hand, np.array([[0.0, 0, scene.tip_depth_m]]))
            beside_m = float(np.abs(tips[0, 0]) - edge.size_m / 2)
            return None if beside_m < FINGER_M else -round(float(hand[2, 2]) / LEAN_STEP)

        def watch(world: RobotWorld) -> CutWatch:
            return CutWatch(
                target.name,
                LINE,
                line,
                LINE_M,
                lambda: world.pose_of(target.name) @ edge.frame_to_object,
                edge.size_m,
            )

        return HeldTask(tuple(paths), rank, as_hulls=True, duration_s=4.0, ending="put_back", rises=True, watch=watch)


def edge_of(frames: tuple[TwinFrame, ...]) -> TwinFrame | None:
    """Return the first edge that is long enough."""
    return next((frame for frame in frames if frame.kind == "edge" and frame.size_m >= LEAST_EDGE_M), None)
