"""Collision worlds: collision tests of a body's configurations, with a collision filter for each phase.

The target is in a world twice, at its standing pose and in the hand, so that the world need not be rebuilt.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from manitwin.episodes.planning.convex_shapes import ShapeStore
from manitwin.episodes.planning.hand_shaping import HandShaping
from manitwin.episodes.planning.joint_paths import JointPath, bisection_places
from manitwin.episodes.planning.kinematic_body import KinematicBody, broad_phase
from manitwin.episodes.planning.libraries import pin
from manitwin.episodes.planning.obstacle_shapes import ObstacleShapes, obstacle_shapes, pose_of
from manitwin.episodes.planning.problem import Grasp, Phase, PickPlaceProblem, PlannerSettings

STANDING = "target"
"""Name of the target's shapes at its standing pose."""
TURNS_M = 0.01  # clearance of a lifted object from the arm, because it turns in the jaws as they take its weight


class FreeSpace(Protocol):
    """Interface for collision tests of free motions, phase by phase: a collision world, or a restriction of one."""

    def enter(self, phase: Phase, margin_m: float | None = None) -> None:
        """Select the phase, and optionally the margin, for the following tests."""
        ...

    def is_free(self, configuration: np.ndarray) -> bool:
        """Tell whether a configuration ``(n,)`` is free."""
        ...


class CollisionWorld:
    """A body among obstacles, with the target twice: at its standing pose, and in the hand.

    Allowed contacts: in phases that hold the target, between hand and target, and between target and its support; in RETREAT,
    between the opening hand and the target. All other pairs keep their clearance, except pairs of the robot's own links,
    which only must not overlap. While jaws hold the target, the whole sweep between their open and closed positions must be
    free of obstacles: their opening is not known to the millimetre, and they open there on release. A lifted object keeps 1
    cm from the arm.

    A broad phase on bounding boxes comes first: with five objects around, the plain loop over all pairs doubles a plan's
    time.
    """

    def __init__(self, body: KinematicBody, obstacles: ObstacleShapes, *, margin_m: float, clearance_m: float):
        """Build all shapes and pairs; ``margin_m`` is kept in REACH and CARRY, ``clearance_m`` on straight lines."""
        self._body, self._obstacles = body, obstacles
        self._margin_m, self._clearance_m = margin_m, clearance_m
        self._model, self._data = body.model, body.model.createData()
        self._geometry = body.geometry.clone()
        robot = range(body.geometry.ngeoms)
        statics = [self._add(s.name, 0, s.pose, s.shape) for s in obstacles.statics]
        standing = [self._add(f"target {i}", 0, obstacles.start, s) for i, s in enumerate(obstacles.target_hulls)]
        whole = self._add(STANDING, 0, obstacles.start, obstacles.target_whole)
        self._standing = [*standing, whole]
        self._held = [self._add(f"held {i}", body.joint, obstacles.start, s) for i, s in enumerate(obstacles.carried)]
        names = [static.name for static in obstacles.statics]
        self._pairs = _Pairs(self._geometry.ngeoms, body, robot, statics, standing, whole, self._held, names)
        self._geometry.setCollisionPairs(self._pairs.ever(), True)
        self._collision = self._geometry.createData()
        self._manager = broad_phase(self._model, self._geometry, self._collision)
        self._entered: tuple[Phase, float, frozenset[str], float] | None = None

    def _add(self, name: str, joint: int, pose: Any, shape: Any) -> int:
        return int(self._geometry.addGeometryObject(pin.GeometryObject(name, joint, pose, shape)))

    def hold(self, gripper_to_object: np.ndarray) -> None:
        """Place the held copy of the target according to a grasp ``(4, 4)``."""
        placement = self._body.gripper_to_joint * pose_of(gripper_to_object).inverse()
        for index in self._held:
            self._geometry.geometryObjects[index].placement = placement

    def shape_hand(self, placements: Mapping[int, Any]) -> None:
        """Set the placements of hand shapes, by index, in the frame of the hand's joint."""
        for index, placement in placements.items():
            self._geometry.geometryObjects[index].placement = placement

    def enter(
        self,
        phase: Phase,
        margin_m: float | None = None,
        meant: frozenset[str] = frozenset(),
        spare_m: float = 0.0,
    ) -> None:
        """Select the collision filter of a phase, with its default margin or ``margin_m``.

        The body keeps an additional ``spare_m`` from static shapes. For bodies named in ``meant`` (``STANDING`` for the
        target at its standing pose) pairs with the held object are not tested, or pairs with the fingers if nothing is held.
        All other pairs keep their clearance.
        """
        if margin_m is None:
            margin_m = self._margin_m if phase in (Phase.REACH, Phase.CARRY) else self._clearance_m
        if self._entered == (phase, margin_m, meant, spare_m):
            return
        self._entered = (phase, margin_m, meant, spare_m)
        stands_at = self._obstacles.goal if phase is Phase.RETREAT else self._obstacles.start
        for index in self._standing:
            self._geometry.geometryObjects[index].placement = stands_at
        active, margins = self._pairs.of(phase, margin_m, self._obstacles)
        if meant:
            active = active & ~self._pairs.meant(meant, empty=phase is Phase.REACH)
        if spare_m:
            margins = margins + spare_m * self._pairs.of_body
        self._collision.setActiveCollisionPairs(self._geometry, active, True)
        self._collision.setSecurityMargins(self._geometry, margins, True, True)

    def is_free(self, configuration: np.ndarray) -> bool:
        """Tell whether a configuration is free of collisions in the selected phase."""
        return not pin.computeCollisions(self._model, self._data, self._manager, configuration, True)

    def touching(self, configuration: np.ndarray) -> list[tuple[str, str]]:
        """Return the names of the shape pairs in collision."""
        pin.computeCollisions(self._model, self._data, self._geometry, self._collision, configuration, False)
        return [
            (self._geometry.geometryObjects[pair.first].name, self._geometry.geometryObjects[pair.second].name)
            for k, pair in enumerate(self._geometry.collisionPairs)
            if self._collision.activeCollisionPairs[k] and self._collision.collisionResults[k].isCollision()
        ]


class _Pairs:
    """Collision pairs of each phase, as upper triangular matrices over all shapes."""

    def __init__(
        self,
        count: int,
        body: KinematicBody,
        robot: range,
        statics: list[int],
        standing: list[int],
        whole: int,
        held: list[int],
        names: list[str],
    ):
        self._names, self._fingers, self._standing = names, sorted(body.fingers), [*standing, whole]
        joints = [int(shape.parentJoint) for shape in body.geometry.geometryObjects]
        self._statics, self._held = statics, held
        moving = [i for i in robot if joints[i] > 0 and i not in body.sweeps]
        rest = [i for i in robot if i not in body.touching and i not in body.sweeps]
        self._clear_of_held = clear_of_held = [i for i in rest if joints[i] < body.joint]

        def between(first: list[int], second: list[int]) -> np.ndarray:
            result = np.zeros((count, count), dtype=bool)
            result[np.ix_(first, second)] = True
            return result

        self._own = np.zeros((count, count), dtype=bool)
        for pair in body.geometry.collisionPairs:
            self._own[pair.first, pair.second] = True
        self.of_body = robot_statics = between(moving, statics)
        hand_target = between(sorted(body.touching), standing)
        rest_target = between([i for i in rest if joints[i] > 0], [whole])
        held_all = between(statics, held) | between(clear_of_held, held) | between(sorted(body.sweeps), statics)
        common = self._own | robot_statics
        self._of_phase = {
            Phase.REACH: common | hand_target | rest_target,
            Phase.APPROACH: common | between(sorted(body.touching - body.pressed), standing) | rest_target,
            Phase.LIFT: common | held_all,
            Phase.CARRY: common | held_all,
            Phase.LOWER: common | held_all,
            Phase.RETREAT: common | rest_target,
        }
        self._hand_target = hand_target
        self._margins: dict[tuple[Phase, float], np.ndarray] = {}

    def ever(self) -> np.ndarray:
        """Return the pairs that any phase tests."""
        return np.logical_or.reduce(list(self._of_phase.values()))

    def meant(self, names: frozenset[str], *, empty: bool) -> np.ndarray:
        """Return the pairs of the held object, or of the fingers if the hand is ``empty``, with the named bodies."""
        things = [index for index, name in zip(self._statics, self._names, strict=True) if name in names]
        pairs = np.zeros_like(self._own)
        pairs[np.ix_(things, self._held)] = True
        if empty:
            pairs[np.ix_(self._fingers, things + (self._standing if STANDING in names else []))] = True
        return pairs

    def of(self, phase: Phase, margin_m: float, obstacles: ObstacleShapes) -> tuple[np.ndarray, np.ndarray]:
        """Return a phase's pairs and the clearance of each (m)."""
        key = (phase, margin_m)
        if key not in self._margins:
            margins = np.where(self._own, 0.0, margin_m)
            if phase is Phase.APPROACH:
                margins[self._hand_target] = 0.0
            if phase is Phase.LIFT:
                margins[np.ix_(self._clear_of_held, self._held)] = max(margin_m, TURNS_M)
            for index, static in zip(self._statics, obstacles.statics, strict=True):
                allowance = {Phase.LIFT: static.start_allowance_m, Phase.LOWER: static.goal_allowance_m}.get(phase)
                if allowance is not None:
                    margins[index, self._held] = allowance
            self._margins[key] = margins
        return self._of_phase[phase], self._margins[key]


def is_path_free(world: CollisionWorld, path: JointPath, count: int) -> bool:
    """Tell whether a path over [0, 1] is free at ``count + 1`` uniform parameters; ends and middle are tested first."""
    places = np.array((0.0, *bisection_places(count)))
    return all(world.is_free(configuration) for configuration in path(places))


class ProblemWorld:
    """Collision worlds of a problem, for the whole arm and for the hand alone."""

    def __init__(
        self,
        problem: PickPlaceProblem,
        goal_object_to_world: np.ndarray,
        arm: KinematicBody,
        hand: KinematicBody,
        store: ShapeStore,
        settings: PlannerSettings,
        *,
        shaping: tuple[HandShaping, HandShaping] | None = None,
        as_hulls: bool = False,
    ):
        """Build both worlds; ``as_hulls``: the held target consists of its own hulls, so that its holes and cavities are free."""
        self.problem, self.goal_object_to_world, self._as_hulls = problem, goal_object_to_world, as_hulls
        shapes = obstacle_shapes(problem, goal_object_to_world, store, settings.margin_m, as_hulls=as_hulls)
        self.arm = CollisionWorld(arm, shapes, margin_m=settings.margin_m, clearance_m=settings.clearance_m)
        self._hand = CollisionWorld(hand, shapes, margin_m=settings.margin_m, clearance_m=settings.clearance_m)
        self._shapings = shaping

    def is_built_for(
        self, problem: PickPlaceProblem, goal_object_to_world: np.ndarray, *, as_hulls: bool = False
    ) -> bool:
        """Tell whether this world was built for this problem object, goal and ``as_hulls``."""
        same = self.problem is problem and self._as_hulls == as_hulls
        return same and np.array_equal(self.goal_object_to_world, goal_object_to_world)

    def shape_hand(self, grasp: Grasp, closed: float = 0.0) -> None:
        """Set the fingers to the grasp's joints before closing, or to a fraction ``closed`` of the way to its closing goal.

        Does nothing for a hand without finger joints.
        """
        if self._shapings is not None and grasp.joints_rad is not None:
            before, to = grasp.joints_rad
            for world, shaping in zip((self.arm, self._hand), self._shapings, strict=True):
                world.shape_hand(shaping.placements(before + closed * (to - before)))

    def hold(self, gripper_to_object: np.ndarray) -> None:
        """Place the held target according to a grasp ``(4, 4)``."""
        self.arm.hold(gripper_to_object)
        self._hand.hold(gripper_to_object)

    def is_hand_free(
        self,
        phase: Phase,
        *grippers_to_world: np.ndarray,
        margin_m: float | None = None,
        meant: frozenset[str] = frozenset(),
        spare_m: float = 0.0,
    ) -> bool:
        """Tell whether the hand alone is free at gripper poses in a phase; other arguments as for ``CollisionWorld.enter``."""
        self._hand.enter(phase, margin_m, meant, spare_m)
        return all(self._hand.is_free(pin.SE3ToXYZQUAT(pose_of(pose))) for pose in grippers_to_world)
