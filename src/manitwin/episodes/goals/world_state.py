"""The state of a world as goals are judged on it: objects at their poses, what touches what, and what has happened."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

import numpy as np

from manitwin.errors import UsageError
from manitwin.geometry.boxes import footprint
from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import transform_points
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.sapien.contacts import ROBOT_NAME

Thing = TypeVar("Thing")

ROBOT = ROBOT_NAME
"""The name of the robot, whichever of its parts touches."""


@dataclass(frozen=True)
class Hole:
    """A hole through an object that a peg fits: its middle ``(3,)``, its axis ``(3,)`` and its radius, object frame, m."""

    center_m: np.ndarray
    axis: np.ndarray
    radius_m: float


@dataclass(frozen=True)
class Tip:
    """The end of a slender object that goes into a holder first: its place ``(3,)`` and direction ``(3,)``, object frame, m."""

    position_m: np.ndarray
    direction: np.ndarray


@dataclass(frozen=True)
class ObjectState:
    """One object: its body, its pose ``(4, 4)`` now and at the beginning, whether it rests, its opening, hole and tip."""

    body: RigidBody
    object_to_world: np.ndarray
    start_object_to_world: np.ndarray
    at_rest: bool
    opening: Opening | None = None
    hole: Hole | None = None
    tip: Tip | None = None

    @cached_property
    def points_m(self) -> np.ndarray:
        """The corners ``(N, 3)`` of its hulls in the world."""
        return transform_points(self.object_to_world, np.concatenate(self.body.hulls))

    @cached_property
    def footprint_m(self) -> np.ndarray:
        """The corners ``(K, 2)`` of what it covers, seen from above."""
        return footprint(self.points_m)

    @cached_property
    def center_of_mass_m(self) -> np.ndarray:
        """Its centre of mass ``(3,)`` in the world."""
        return np.asarray(transform_points(self.object_to_world, self.body.center_of_mass_m[None])[0])


@dataclass(frozen=True)
class Event:
    """Something that happened to ``subject``, with ``second`` where two took part, and its measured values (SI)."""

    kind: str
    subject: str
    second: str | None
    values: Mapping[str, float]


@dataclass(frozen=True)
class Peg:
    """A peg that things hang on: its foot, the direction to its tip, its length and radius (m, world frame)."""

    foot_m: np.ndarray
    direction: np.ndarray
    length_m: float
    radius_m: float


@dataclass(frozen=True)
class Holder:
    """A bore: its rim's middle with Z out of it ``(4, 4)``, its half widths ``(2,)`` and depth (m), the names of its boxes."""

    rim_to_world: np.ndarray
    half_m: np.ndarray
    depth_m: float
    bodies: frozenset[str]


@dataclass(frozen=True)
class Granules:
    """Small spheres that stand for what is poured: their middles ``(N, 3)`` in the world and their radius, m."""

    positions_m: np.ndarray
    radius_m: float


@dataclass(frozen=True)
class WorldState:
    """Objects by name; ``touching``: pairs of names (objects, furniture, fixtures, the robot) that press on each other.

    ``granules_at_start``: how many granules each object held at the beginning. ``arms``: the names of two arms, the
    one that gives first; each then touches under its own name.
    """

    objects: Mapping[str, ObjectState]
    touching: frozenset[frozenset[str]]
    furniture: frozenset[str] = frozenset()
    events: tuple[Event, ...] = ()
    places_m: Mapping[str, np.ndarray] = field(default_factory=dict)
    pegs: Mapping[str, Peg] = field(default_factory=dict)
    granules: Granules | None = None
    granules_at_start: Mapping[str, int] = field(default_factory=dict)
    holders: Mapping[str, Holder] = field(default_factory=dict)
    arms: tuple[str, ...] = ()

    def of(self, name: str) -> ObjectState:
        """Return an object's state; raises UsageError naming those that there are."""
        return self._named(self.objects, name, "object")

    def place(self, name: str) -> np.ndarray:
        """Return a marked place ``(3,)``; raises UsageError naming those that there are."""
        return self._named(self.places_m, name, "place")

    def peg(self, name: str) -> Peg:
        """Return a peg; raises UsageError naming those that there are."""
        return self._named(self.pegs, name, "peg")

    def holder(self, name: str) -> Holder:
        """Return a holder; raises UsageError naming those that there are."""
        return self._named(self.holders, name, "holder")

    @property
    def robots(self) -> frozenset[str]:
        """The names that robots touch under: those of two arms, or that of the only one."""
        return frozenset(self.arms or (ROBOT,))

    def is_handled(self, name: str) -> bool:
        """Tell whether a robot touches an object."""
        return bool(self.neighbours(name) & self.robots)

    def touch(self, first: str, second: str) -> bool:
        """Tell whether two bodies press on each other."""
        return frozenset((first, second)) in self.touching

    def neighbours(self, name: str) -> frozenset[str]:
        """Return the names of all that press on an object."""
        return frozenset(other for pair in self.touching if name in pair for other in pair if other != name)

    @staticmethod
    def _named(things: Mapping[str, Thing], name: str, kind: str) -> Thing:
        if name not in things:
            raise UsageError(f"no {kind} {name!r} in this scene; there are: {', '.join(sorted(things)) or 'none'}")
        return things[name]
