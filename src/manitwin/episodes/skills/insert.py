"""``insert``: put a slender thing into an upright holder, its tip first: a marker, a screwdriver, a spoon, a knife."""

from __future__ import annotations

from dataclasses import dataclass

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
FLAT = 2.0  # broad by narrow side of what goes in
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
        depth_m = _depth_m(points, stick)
        bore_m = _section(points, stick, depth_m).bore_half_m
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
        section = _section(points, stick, bore.depth_m)
        stick = stick @ section.to_stick
        rim = into.frame_to_world
        bodies = frozenset(box.name for box in into.boxes)
        low_m = LET_GO_M - bore.depth_m
        heights_m = np.array(
            [*np.linspace(ABOVE_M, 0.004, FREE_KNOTS), *np.linspace(-0.006, low_m, KNOTS - FREE_KNOTS)]
        )
        paths, first_rad = [], scene.rng.uniform(-np.pi, np.pi)
        if section.is_flat:
            first_rad = float(np.arctan2(rim[1, 0], rim[0, 0])) + np.pi * scene.rng.integers(2)
        turns = 2 if section.is_flat else TURNS
        for turn in range(turns):
            about = Rotation.from_euler("z", first_rad + turn * 2 * np.pi / turns).as_matrix()
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
    """Return the radius of the part that goes in, about the middle of its box."""
    return _section(points, stick, _depth_m(points, stick)).radius_m


@dataclass(frozen=True)
class _Section:
    """What goes in as seen along the stick: ``to_stick (4, 4)`` is its box's middle at the outermost point, X its broad side.

    ``half_m (2,)`` of that box, and the radius about its middle.
    """

    to_stick: np.ndarray
    half_m: np.ndarray
    radius_m: float

    @property
    def is_flat(self) -> bool:
        """Whether it is so flat that it would balance in a square bore on its edge, or fall over in it: a blade, a ruler."""
        return bool(self.half_m[0] > FLAT * self.half_m[1])

    @property
    def bore_half_m(self) -> np.ndarray:
        """The half widths ``(2,)`` of a bore for it: a slot for what is flat, else a square one that it passes in any turn."""
        return np.asarray((self.half_m if self.is_flat else np.full(2, self.radius_m)) + ROOM_M)


def _section(points: np.ndarray, stick: np.ndarray, depth_m: float) -> _Section:
    """Return the section of what goes in by a depth: the smallest box about it, by turns of a degree."""
    local = transform_points(inverse(stick), points)
    entering = local[local[:, 2] > local[:, 2].max() - depth_m, :2]
    turns = [Rotation.from_euler("z", each, degrees=True).as_matrix() for each in range(180)]
    spans = np.array([np.ptp(entering @ turn[:2, :2], axis=0) for turn in turns])
    spans[spans[:, 0] < spans[:, 1] - 1e-9] = np.inf  # X is along the broad side
    best = int(spans.prod(1).argmin())
    turned = entering @ turns[best][:2, :2]
    middle = turns[best][:2, :2] @ ((turned.max(0) + turned.min(0)) / 2)
    to_stick = transform(turns[best], np.array([*middle, local[:, 2].max()]))
    return _Section(to_stick, spans[best] / 2, float(np.linalg.norm(entering - middle, axis=1).max()))
