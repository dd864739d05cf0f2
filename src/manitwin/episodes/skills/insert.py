"""``insert``: put a slender thing into an upright holder, its tip first: a marker, a screwdriver, a spoon."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.fixtures import Fixture, holder
from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.skills.held_skill import HeldSkill, tip_of
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.episodes.skills.skill import Surroundings
from manitwin.geometry.frames.feature import rotation_of
from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.scenes.layouts.pool import Pool, PoolTwin

HOLDER = "holder"
LEAST_LENGTH_M, MOST_RADIUS_M = 0.10, 0.03
DEPTH_SHARE, DEPTHS_M = 0.4, (0.05, 0.08)  # of the length: as deep as utensils stand in a cup
ROOM_M = 0.003  # between the thing and each wall, as in ManiSkill's PegInsertionSide
ABOVE_M, LET_GO_M = 0.04, 0.008  # the tip above the rim before, and above the floor when it is let go
FREE_KNOTS, KNOTS = 4, 9
TURNS = 12
FINGER_M = 0.012  # half of what a finger is wide: it stays out of the holder
FAR_STEP_M = 0.02  # grasps that are less apart along the thing count as equal


class Insert(HeldSkill):
    """Turn the thing upright above the holder, its tip down, lower it, and let go just above the floor."""

    name, predicate = "insert", "inserted"

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept a thing 10 cm long or more with a tip, no thicker than 6 cm where it goes in."""
        points = pool.body(target.twin_id).parts.whole
        stick = _stick(points, target)
        if stick is None:
            return False
        return _length_m(points, stick) >= LEAST_LENGTH_M and _radius_m(points, stick) <= MOST_RADIUS_M

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return: inserted into the holder."""
        return Goal((Literal(self.predicate, target.name, HOLDER),))

    def fixture(self, around: Surroundings, target: int, rng: np.random.Generator) -> Fixture | None:
        """Draw a holder in reach whose bore the thing passes with 3 mm of room."""
        points = around.body(target).parts.whole
        stick = _stick(points, around.twin(target))
        assert stick is not None, "only things with a tip are inserted"
        bore_m, depth_m = _radius_m(points, stick) + ROOM_M, _depth_m(points, stick)
        place = around.area.draw(holder(np.zeros(3), 0.0, bore_m, depth_m).footprint_m, [], rng)
        if place is None:
            return None
        position_m = place[:3, 3] + [0.0, 0, around.area.support.height_m]
        return holder(position_m, float(np.arctan2(place[1, 0], place[0, 0])), bore_m, depth_m, name=HOLDER)

    def task(self, scene: HeldScene) -> HeldTask:
        """Return the ways down into the holder, the thing turned about its own length by twelfths."""
        target, (into,) = scene.target, scene.fixtures
        bore = into.holder
        assert bore is not None, "things are inserted into holders"
        points = np.concatenate(target.body.hulls)
        tip = tip_of(scene.frames[target.name], target.body.hulls)
        assert tip is not None, "only things with a tip are inserted"
        stick = transform(rotation_of(tip.direction), tip.position_m)
        local = transform_points(inverse(stick), points)
        entering = local[local[:, 2] > -bore.depth_m]
        middle = (entering[:, :2].max(0) + entering[:, :2].min(0)) / 2
        stick = stick @ transform(None, np.array([*middle, entering[:, 2].max()]))
        rim = into.frame_to_world
        bodies = frozenset(box.name for box in into.boxes)
        low_m = LET_GO_M - bore.depth_m
        heights_m = np.array(
            [*np.linspace(ABOVE_M, 0.004, FREE_KNOTS), *np.linspace(-0.006, low_m, KNOTS - FREE_KNOTS)]
        )
        paths, first_rad = [], scene.rng.uniform(-np.pi, np.pi)
        for turn in range(TURNS):
            about = Rotation.from_euler("z", first_rad + turn * 2 * np.pi / TURNS).as_matrix()
            down = about @ np.diag([1.0, -1, -1])
            poses = [transform(down, rim[:3, 3] + [0.0, 0, each]) for each in heights_m]
            paths.append(HeldPath(np.array(poses) @ inverse(stick), bodies, FREE_KNOTS))

        def rank(grasp: Grasp) -> float | None:
            tips = transform_points(grasp.gripper_to_object, np.array([[0.0, 0, scene.tip_depth_m]]))
            from_tip_m = float(-transform_points(inverse(stick), tips)[0, 2])
            return None if from_tip_m < bore.depth_m + FINGER_M else -round(from_tip_m / FAR_STEP_M)

        return HeldTask(tuple(paths), rank, as_hulls=True, duration_s=3.0)


def _stick(points: np.ndarray, twin: PoolTwin) -> np.ndarray | None:
    """Return the tip's frame ``(4, 4)``, Z out of the tip along the length; None for a thing without a tip."""
    tip = tip_of(twin.frames, (points,))
    return None if tip is None else transform(rotation_of(tip.direction), tip.position_m)


def _length_m(points: np.ndarray, stick: np.ndarray) -> float:
    return float(np.ptp(points @ stick[:3, 2]))


def _depth_m(points: np.ndarray, stick: np.ndarray) -> float:
    """Return how deep a holder is for a thing: a long one falls out of a shallow bore."""
    return float(np.clip(DEPTH_SHARE * _length_m(points, stick), *DEPTHS_M))


def _radius_m(points: np.ndarray, stick: np.ndarray) -> float:
    """Return the radius of the part that goes in, about the middle of its box, as any turn passes a square bore."""
    local = transform_points(inverse(stick), points)
    entering = local[local[:, 2] > local[:, 2].max() - _depth_m(points, stick), :2]
    middle = (entering.max(0) + entering.min(0)) / 2
    return float(np.linalg.norm(entering - middle, axis=1).max())
