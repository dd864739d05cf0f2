"""What a skill is: it tells who can take part, and sets a goal in words with the poses that may reach it."""

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
        """Return an object's convex parts where it stands."""
        return self.body(number).parts.at(self.objects[number].object_to_world)

    def obstacles(self, *, without: Sequence[int]) -> list[PlacedParts]:
        """Return the convex parts of furniture and of all objects but some."""
        boxes = [ConvexParts.of_box(box).at(np.eye(4)) for box in self.boxes]
        return boxes + [self.parts(number) for number in range(len(self.objects)) if number not in without]


class FoundPoses(Sequence[np.ndarray]):
    """Poses ``(4, 4)`` that are looked for when they are asked for: most goals are planned for with the first one or two."""

    def __init__(self, poses: Iterator[np.ndarray]):
        """Take what finds them; the length is known once all have been found."""
        self._left, self._found = poses, list[np.ndarray]()

    def __len__(self) -> int:
        """Return how many there are."""
        self._found += self._left
        return len(self._found)

    @overload
    def __getitem__(self, number: int) -> np.ndarray: ...
    @overload
    def __getitem__(self, number: slice) -> Sequence[np.ndarray]: ...
    def __getitem__(self, number: int | slice) -> np.ndarray | Sequence[np.ndarray]:
        """Return one, or some; raises IndexError where there is none."""
        wanted = len(self) if isinstance(number, slice) or number < 0 else number + 1
        self._found += islice(self._left, max(0, wanted - len(self._found)))
        return self._found[number]


@dataclass(frozen=True)
class SkillGoal:
    """A goal, the poses ``object_to_world (4, 4)`` of the target that should reach it, best first, and who takes part.

    ``partner`` is the object that the goal is about beside the target. ``openings``, ``holes`` and ``frames`` are those of the
    objects, by name. Of a skill that moves the target along a held path there is the ``path`` that is made once all has come to
    rest, and its ``fixtures``; the one pose is then that of the beginning. ``granules`` lie in one of the objects;
    ``places_m`` are marked places ``(3,)`` in the world. ``pushes``: the closed hand pushes the target to one of them.
    ``hands_over``: one arm hands the target over to another one. ``lets_fall``: the target is let go in the air. ``ways`` are
    poses at rest in which it may be put down to be taken anew, where no grasp serves both start and goal; None: it is not.
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
    def is_of_a_path(self) -> bool:
        """True where the goal is reached on the way and not by where the target is let go."""
        return self.path is not None or self.pushes or self.hands_over


class Skill(ABC):
    """A skill: ``name`` is that on the command line, ``has_partner`` tells whether a second object takes part.

    ``predicate`` is that of its goal. ``most_poses``: so many goal poses are planned for, one after the other, before a goal
    counts as impossible to plan. ``arms``: how many it takes.
    """

    name: str
    has_partner: bool
    predicate: str
    most_poses: int = 12
    arms: int = 1
    lets_fall: bool = False

    @abstractmethod
    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Tell whether these two can take part, by what is known of them: sizes, openings, placements."""

    @abstractmethod
    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield poses ``(4, 4)`` of the target that reach the goal when it is let go there; none: there is no room."""

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return the goal: the predicate of the target, and of the partner where there is one."""
        return Goal((Literal(self.predicate, target.name, None if partner is None else partner.name),))

    def begins_in(self, target: PoolTwin) -> Sequence[StandingPose]:
        """Return the placements that the target may begin in: its likeliest one, upright where it has such."""
        return [max(target.poses, key=lambda pose: (pose.upright, pose.probability))]

    def ends_in(self, target: PoolTwin) -> Sequence[StandingPose]:
        """Return the placements that the target is to be brought to; none: its goal asks for no placement."""
        return ()

    def set_goal(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> SkillGoal | None:
        """Return the goal in some surroundings with the first poses that are found; None where there is none."""
        return set_goal(self, around, target, partner, rng)


def set_goal(
    skill: Skill, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
) -> SkillGoal | None:
    """Return a skill's goal in some surroundings with the first poses that it finds.

    None where it finds none, and where the goal is true of the beginning.
    """
    second = None if partner is None else around.objects[partner]
    goal = skill.goal(around.objects[target], second)
    if evaluate(state_at_rest(around), goal).reached:
        return None
    own = np.random.default_rng(
        rng.integers(2**63)
    )  # how many poses are asked for changes nothing of what is drawn elsewhere
    poses = FoundPoses(islice(skill.poses(around, target, partner, own), skill.most_poses))
    if next(iter(poses), None) is None:
        return None
    numbers = (target, *([] if partner is None else [partner]))
    name = None if second is None else second.name
    return SkillGoal(goal, poses, name, openings_of(around, numbers), lets_fall=skill.lets_fall)


def openings_of(around: Surroundings, numbers: Sequence[int]) -> dict[str, Opening]:
    """Return the openings of those objects that have one, by name."""
    found = {around.objects[number].name: around.body(number).opening for number in numbers}
    return {name: opening for name, opening in found.items() if opening is not None}


def state_at_rest(around: Surroundings) -> WorldState:
    """Return the state in which nothing happens, as far as poses tell: nothing touches, nothing opens."""
    return WorldState(
        {
            each.name: ObjectState(each.body, each.object_to_world, each.object_to_world, True)
            for each in around.objects
        },
        frozenset(),
    )


def tries(draw: Callable[[], np.ndarray | None], count: int) -> Iterator[np.ndarray]:
    """Yield what ``count`` draws give, without those that give nothing."""
    for _ in range(count):
        drawn = draw()
        if drawn is not None:
            yield drawn
