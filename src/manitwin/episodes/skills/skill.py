"""Skill interface: selection of participants, and the goal with the target's poses that may reach it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import overload

import numpy as np

from manitwin.episodes.fixtures import Fixture
from manitwin.episodes.goals.evaluation import evaluate
from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.goals.world_state import Hole, ObjectState, WorldState
from manitwin.episodes.pick_place_tasks import PlacingArea
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.geometry.cavity import Opening
from manitwin.geometry.hull_distance import ConvexParts, PlacedParts
from manitwin.geometry.rigid_body import PlacedObject, StaticBox
from manitwin.physics.sapien.granules import GranuleFill
from manitwin.scenes.layouts.pool import Pool, PoolBody, PoolTwin, StandingPose
from manitwin.scenes.layouts.twin_frames import TwinFrame


@dataclass(frozen=True)
class Surroundings:
    """Objects at rest on furniture, and the part of the target's surface that the robot reaches."""

    objects: tuple[PlacedObject, ...]
    pool: Pool
    area: PlacingArea
    boxes: tuple[StaticBox, ...] = ()

    def body(self, number: int) -> PoolBody:
        """Return an object's body with its opening."""
        return self.pool.body(self.objects[number].twin_id)

    def twin(self, number: int) -> PoolTwin:
        """Return an object's twin with its placements."""
        return self.pool.twin(self.objects[number].twin_id)

    def parts(self, number: int) -> PlacedParts:
        """Return an object's convex parts at its pose."""
        return self.body(number).parts.at(self.objects[number].object_to_world)

    def obstacles(self, *, without: Sequence[int]) -> list[PlacedParts]:
        """Return the convex parts of furniture and of all objects except ``without``."""
        boxes = [ConvexParts.of_box(box).at(np.eye(4)) for box in self.boxes]
        return boxes + [self.parts(number) for number in range(len(self.objects)) if number not in without]


class LazyPoses(Sequence[np.ndarray]):
    """Lazy sequence of poses ``(4, 4)``: most goals are planned with the first one or two."""

    def __init__(self, poses: Iterator[np.ndarray]):
        """Take the iterator of poses; the length requires all of them."""
        self._left, self._found = poses, list[np.ndarray]()

    def __len__(self) -> int:
        """Return the number of poses."""
        self._found += self._left
        return len(self._found)

    @overload
    def __getitem__(self, number: int) -> np.ndarray: ...
    @overload
    def __getitem__(self, number: slice) -> Sequence[np.ndarray]: ...
    def __getitem__(self, number: int | slice) -> np.ndarray | Sequence[np.ndarray]:
        """Return one pose or several; raises IndexError out of range."""
        wanted = len(self) if isinstance(number, slice) or number < 0 else number + 1
        self._found += islice(self._left, max(0, wanted - len(self._found)))
        return self._found[number]


@dataclass(frozen=True)
class SkillGoal:
    """A goal, the target's poses ``object_to_world (4, 4)`` that should reach it, best first, and the participants.

    ``partner`` is the goal's second object. ``openings``, ``holes`` and ``frames`` are those of the objects, by name. A skill
    with a held path has a ``path``, which is built once all objects are at rest, and ``fixtures``; its single pose is the
    initial one. ``granules`` fill one of the objects. ``places_m`` are marked places ``(3,)`` in the world. ``pushes``: the
    closed hand pushes the target to one of them. ``hands_over``: one arm hands the target to another one. ``lets_fall``: the
    target is released in the air. ``ways`` are intermediate resting poses for a regrasp, used if no grasp serves both start
    and goal; None: no regrasp.
    """

    goal: Goal
    poses: Sequence[np.ndarray]
    partner: str | None
    openings: Mapping[str, Opening]
    holes: Mapping[str, Hole] = field(default_factory=dict)
    frames: Mapping[str, tuple[TwinFrame, ...]] = field(default_factory=dict)
    fixtures: tuple[Fixture, ...] = ()
    path: Callable[[HeldScene], HeldTask] | None = None
    granules: GranuleFill | None = None
    places_m: Mapping[str, np.ndarray] = field(default_factory=dict)
    pushes: bool = False
    hands_over: bool = False
    lets_fall: bool = False
    ways: Sequence[np.ndarray] | None = None

    @property
    def has_path(self) -> bool:
        """Whether the goal is reached along a path instead of by the release pose."""
        return self.path is not None or self.pushes or self.hands_over


class Skill(ABC):
    """A skill: ``name`` on the command line; ``has_partner``: whether a second object takes part.

    ``predicate`` is that of its goal. ``most_poses`` is the number of goal poses tried before the goal counts as infeasible.
    ``arms`` is the number of arms required.
    """

    name: str
    has_partner: bool
    predicate: str
    most_poses: int = 12
    arms: int = 1
    lets_fall: bool = False

    @abstractmethod
    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Tell whether the two twins can take part, by sizes, openings and placements."""

    @abstractmethod
    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield release poses ``(4, 4)`` of the target that reach the goal; none if there is no room."""

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return the goal: the predicate of the target, and of the partner if there is one."""
        return Goal((Literal(self.predicate, target.name, None if partner is None else partner.name),))

    def begins_in(self, target: PoolTwin) -> Sequence[StandingPose]:
        """Return the placements in which the target may start: the likeliest, preferably upright."""
        return [max(target.poses, key=lambda pose: (pose.upright, pose.probability))]

    def ends_in(self, target: PoolTwin) -> Sequence[StandingPose]:
        """Return the placements in which the target should end; empty if the goal requires none."""
        return ()

    def sample_goal(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> SkillGoal | None:
        """Return the goal in the given surroundings with its poses; None if there is none."""
        return sample_skill_goal(self, around, target, partner, rng)


def sample_skill_goal(
    skill: Skill, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
) -> SkillGoal | None:
    """Return a skill's goal in the given surroundings with its poses.

    None if no pose is found, or if the goal is already true.
    """
    second = None if partner is None else around.objects[partner]
    goal = skill.goal(around.objects[target], second)
    if evaluate(state_at_rest(around), goal).reached:
        return None
    own = np.random.default_rng(
        rng.integers(2**63)
    )  # own generator: the number of poses consumed does not affect other random draws
    poses = LazyPoses(islice(skill.poses(around, target, partner, own), skill.most_poses))
    if next(iter(poses), None) is None:
        return None
    numbers = (target, *([] if partner is None else [partner]))
    name = None if second is None else second.name
    return SkillGoal(goal, poses, name, openings_of(around, numbers), lets_fall=skill.lets_fall)


def openings_of(around: Surroundings, numbers: Sequence[int]) -> dict[str, Opening]:
    """Return the openings, by name, of those objects that have one."""
    found = {around.objects[number].name: around.body(number).opening for number in numbers}
    return {name: opening for name, opening in found.items() if opening is not None}


def state_at_rest(around: Surroundings) -> WorldState:
    """Return the world state of the objects at rest, without contacts and openings."""
    return WorldState(
        {
            each.name: ObjectState(each.body, each.object_to_world, each.object_to_world, True)
            for each in around.objects
        },
        frozenset(),
    )


def successful_draws(draw: Callable[[], np.ndarray | None], count: int) -> Iterator[np.ndarray]:
    """Yield the results of ``count`` draws, without failed ones."""
    for _ in range(count):
        drawn = draw()
        if drawn is not None:
            yield drawn
