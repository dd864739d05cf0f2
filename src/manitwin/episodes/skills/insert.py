"""Skill ``insert``: put a slender object tip first into an upright holder, such as a marker, a screwdriver, a spoon, a knife."""

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
# share of the object's length, and limits: as deep as utensils stand in a cup
DEPTH_SHARE, DEPTHS_M = 0.4, (0.05, 0.08)
ROOM_M = 0.003  # clearance to each wall, as in ManiSkill's PegInsertionSide
ABOVE_M, LET_GO_M = 0.04, 0.008  # tip above the rim at the start, and above the floor at release
FREE_KNOTS, KNOTS = 4, 9
TURNS = 12
FLAT = 2.0  # ratio of the broad to the narrow side of the inserted part
FINGER_M = 0.012  # half width of a finger, which stays out of the holder
FAR_STEP_M = 0.02  # grasps whose positions along the object differ by less count as equal


class Insert(HeldSkill):
    """Turn the object upright above the holder, tip down, lower it, and release it just above the floor."""

    name, predicate = "insert", "inserted"

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept an object at least 10 cm long with a tip, whose inserted part is at most 6 cm thick."""
        points = pool.body(target.twin_id).parts.whole
        stick = _stick(points, target)
        if stick is None:
            return False
        return _length_m(points, stick) >= LEAST_LENGTH_M and _radius_m(points, stick) <= MOST_RADIUS_M

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return the goal that the target is inserted into the holder."""
        return Goal((Literal(self.predicate, target.name, HOLDER),))

    def fixture(self, around: Surroundings, target: int, rng: np.random.Generator) -> Fixture | None:
        """Draw a holder in reach whose bore leaves 3 mm of clearance."""
        points = around.body(target).parts.whole
        stick = _stick(points, around.twin(target))
        assert stick is not None, "only things with a tip are inserted"
        depth_m = _depth_m(points, stick)
        bore_m = _section(points, stick, depth_m).bore_half_m
        place = around.area.sample_pose(holder(np.zeros(3), 0.0, bore_m, depth_m).footprint_m, [], rng)
        if place is None:
            return None
        position_m = place[:3, 3] + [0.0, 0, around.area.support.height_m]
        return holder(position_m, float(np.arctan2(place[1, 0], place[0, 0])), bore_m, depth_m, name=HOLDER)

    def task(self, scene: HeldScene) -> HeldTask:
        """Return the paths down into the holder, with the object rotated about its length by steps of 30 degrees.

        A flat object fits in two rotations only.
        """
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
    """Return the tip's frame ``(4, 4)``, Z out of the tip along the length; None for an object without a tip."""
    tip = tip_of(twin.frames, (points,))
    return None if tip is None else transform(rotation_of(tip.direction), tip.position_m)


def _length_m(points: np.ndarray, stick: np.ndarray) -> float:
    return float(np.ptp(points @ stick[:3, 2]))


def _depth_m(points: np.ndarray, stick: np.ndarray) -> float:
    """Return the depth of a holder for an object: a long one falls out of a shallow bore."""
    return float(np.clip(DEPTH_SHARE * _length_m(points, stick), *DEPTHS_M))


def _radius_m(points: np.ndarray, stick: np.ndarray) -> float:
    """Return the radius of the inserted part, about the centre of its bounding box."""
    return _section(points, stick, _depth_m(points, stick)).radius_m


@dataclass(frozen=True)
class _Section:
    """Cross-section of the inserted part, seen along the stick.

    ``to_stick (4, 4)``: origin at the centre of its bounding rectangle, at the outermost point, X along the broad side.
    ``half_m (2,)`` are the half sides of the rectangle, ``radius_m`` the radius about its centre.
    """

    to_stick: np.ndarray
    half_m: np.ndarray
    radius_m: float

    @property
    def is_flat(self) -> bool:
        """Whether it is so flat that it would balance on its edge in a square bore or fall over, such as a blade or a ruler."""
        return bool(self.half_m[0] > FLAT * self.half_m[1])

    @property
    def bore_half_m(self) -> np.ndarray:
        """Half widths ``(2,)`` of a bore: a slot for a flat part, otherwise a square that it passes at any rotation."""
        return np.asarray((self.half_m if self.is_flat else np.full(2, self.radius_m)) + ROOM_M)


def _section(points: np.ndarray, stick: np.ndarray, depth_m: float) -> _Section:
    """Return the cross-section of the part inserted to a depth; its bounding rectangle is found by steps of one degree."""
    local = transform_points(inverse(stick), points)
    entering = local[local[:, 2] > local[:, 2].max() - depth_m, :2]
    turns = [Rotation.from_euler("z", each, degrees=True).as_matrix() for each in range(180)]
    spans = np.array([np.ptp(entering @ turn[:2, :2], axis=0) for turn in turns])
    spans[spans[:, 0] < spans[:, 1] - 1e-9] = np.inf  # keeps X along the broad side
    best = int(spans.prod(1).argmin())
    turned = entering @ turns[best][:2, :2]
    middle = turns[best][:2, :2] @ ((turned.max(0) + turned.min(0)) / 2)
    to_stick = transform(turns[best], np.array([*middle, local[:, 2].max()]))
    return _Section(to_stick, spans[best] / 2, float(np.linalg.norm(entering - middle, axis=1).max()))
