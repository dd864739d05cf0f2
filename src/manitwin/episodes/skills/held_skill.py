"""Base of skills that use a held object: placement of fixtures, and the held path, built once all objects are at rest."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence

import numpy as np

from manitwin.episodes.fixtures import Fixture, board
from manitwin.episodes.goals.world_state import Hole, Tip
from manitwin.episodes.pick_place_tasks import MIN_GAP_M, footprint_at
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.episodes.skills.skill import Skill, SkillGoal, Surroundings, openings_of
from manitwin.geometry.boxes import separation_m
from manitwin.geometry.frames.feature import rotation_of
from manitwin.geometry.poses import transform
from manitwin.scenes.layouts.pool import PoolTwin
from manitwin.scenes.layouts.twin_frames import TwinFrame

FIXTURES_TRIED = 60


class HeldSkill(Skill):
    """A skill with a held path; a subclass defines ``suits`` (with ``frames_of``), ``task``, ``goal``, and maybe ``fixture``."""

    has_partner = False

    @abstractmethod
    def task(self, scene: HeldScene) -> HeldTask:
        """Return the task, given where everything has come to rest."""

    def fixture(self, around: Surroundings, target: int, rng: np.random.Generator) -> Fixture | None:
        """Draw a fixture in reach; it is accepted if it is clear of all objects. None: the skill has no fixture."""
        return None

    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield the target's current pose, because the goal depends on the path."""
        yield around.objects[target].object_to_world

    def sample_goal(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> SkillGoal | None:
        """Return the goal with its fixtures; None if there is no room for them."""
        fixtures = self._fixtures(around, target, rng)
        if fixtures is None:
            return None
        numbers = (target, *([] if partner is None else [partner]))
        frames = {around.objects[number].name: around.twin(number).frames for number in numbers}
        holes = {name: hole for name, of_it in frames.items() if (hole := hole_of(of_it)) is not None}
        second = None if partner is None else around.objects[partner]
        return SkillGoal(
            self.goal(around.objects[target], second),
            tuple(self.poses(around, target, partner, rng)),
            None if second is None else second.name,
            openings_of(around, numbers),
            holes,
            frames,
            fixtures,
            self.task,
        )

    def _fixtures(self, around: Surroundings, target: int, rng: np.random.Generator) -> tuple[Fixture, ...] | None:
        taken = [footprint_at(each.body, each.object_to_world) for each in around.objects]
        for _ in range(FIXTURES_TRIED):
            drawn = self.fixture(around, target, rng)
            if drawn is None:
                return ()
            clear = all(separation_m(drawn.footprint_m, each) >= MIN_GAP_M for each in taken)
            if clear and around.area.widened().contains_footprint(drawn.footprint_m):
                return (drawn,)
        return None


def board_in_reach(around: Surroundings, half_m: np.ndarray, name: str, rng: np.random.Generator) -> Fixture | None:
    """Draw a board with half extents ``(3,)`` m in reach on the furniture; None if none fits."""
    place = around.area.sample_pose(board(np.zeros(3), 0.0, half_m).footprint_m, [], rng)
    if place is None:
        return None
    position_m = place[:3, 3] + [0.0, 0, around.area.support.height_m]
    return board(position_m, float(np.arctan2(place[1, 0], place[0, 0])), half_m, name=name)


def frames_of(twin: PoolTwin, *kinds: str) -> tuple[TwinFrame, ...]:
    """Return a twin's frames of the given kinds, in their order."""
    return tuple(frame for frame in twin.frames if frame.kind in kinds)


def hole_frame_of(frames: tuple[TwinFrame, ...]) -> TwinFrame | None:
    """Return the widest hole's frame."""
    return max((frame for frame in frames if frame.kind == "hole"), key=lambda frame: frame.size_m, default=None)


def hole_of(frames: tuple[TwinFrame, ...]) -> Hole | None:
    """Return the widest hole of an object, in the object frame."""
    frame = hole_frame_of(frames)
    if frame is None:
        return None
    return Hole(frame.frame_to_object[:3, 3], frame.frame_to_object[:3, 2], frame.size_m)


def tip_of(frames: tuple[TwinFrame, ...], hulls: Sequence[np.ndarray]) -> Tip | None:
    """Return the first tip of a slender object, with the direction of its length, out of the tip; None if it has no tip."""
    frame = next((frame for frame in frames if frame.kind == "tip"), None)
    if frame is None:
        return None
    points = np.concatenate(hulls)
    middle = (points.max(0) + points.min(0)) / 2
    along = np.linalg.eigh(np.cov(points.T))[1][:, 2]
    place = frame.frame_to_object[:3, 3]
    return Tip(place, along if (place - middle) @ along >= 0 else -along)


def stick_frame(points_m: np.ndarray, frames: tuple[TwinFrame, ...], up: np.ndarray) -> np.ndarray:
    """Return the frame ``(4, 4)`` of the working end: origin at the outermost vertex, Z outwards, X near ``up (3,)``.

    Z is along the length. The working end is the one away from the handle if a frame marks it (an axis whose label contains
    "handle"), otherwise the broader one.
    """
    middle = points_m.mean(0)
    axis = np.linalg.eigh(np.cov(points_m.T))[1][:, 2]
    along, across = (points_m - middle) @ axis, np.linalg.norm(np.cross(points_m - middle, axis), axis=1)
    handle = next((f for f in frames if f.kind == "axis" and "handle" in f.label), None)
    if handle is not None:
        outward = -float((handle.frame_to_object[:3, 3] - middle) @ axis)
    else:
        outward = float(across[along > 0].max(initial=0.0) - across[along < 0].max(initial=0.0))
    axis = axis if outward >= 0 else -axis
    along = (points_m - middle) @ axis
    return transform(rotation_of(axis, up), points_m[int(along.argmax())])
