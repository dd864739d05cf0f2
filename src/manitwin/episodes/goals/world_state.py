"""World state on which goals are judged: object poses, contacts, and past events."""

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
"""Name of the robot in contacts, for all of its parts."""


@dataclass(frozen=True)
class Hole:
    """A through hole that fits a peg: centre ``(3,)``, axis ``(3,)`` and radius, object frame, m."""

    center_m: np.ndarray
    axis: np.ndarray
    radius_m: float


@dataclass(frozen=True)
class Tip:
    """The end of a slender object that enters a holder first: position ``(3,)`` and direction ``(3,)``, object frame, m."""

    position_m: np.ndarray
    direction: np.ndarray


@dataclass(frozen=True)
class ObjectState:
    """One object: body, pose ``(4, 4)`` now and at the start, whether it is at rest, and its opening, hole and tip."""

    body: RigidBody
    object_to_world: np.ndarray
    start_object_to_world: np.ndarray
    at_rest: bool
    opening: Opening | None = None
    hole: Hole | None = None
    tip: Tip | None = None

    @cached_property
    def points_m(self) -> np.ndarray:
        """Vertices ``(N, 3)`` of its hulls in the world."""
        return transform_points(self.object_to_world, np.concatenate(self.body.hulls))

    @cached_property
    def footprint_m(self) -> np.ndarray:
        """Vertices ``(K, 2)`` of its footprint, seen from above."""
        return footprint(self.points_m)

    @cached_property
    def center_of_mass_m(self) -> np.ndarray:
        """Centre of mass ``(3,)`` in the world."""
        return np.asarray(transform_points(self.object_to_world, self.body.center_of_mass_m[None])[0])


@dataclass(frozen=True)
class Event:
    """An event involving ``subject``, and ``second`` if two objects took part, with its measured values (SI)."""

    kind: str
    subject: str
    second: str | None
    values: Mapping[str, float]


@dataclass(frozen=True)
class Peg:
    """A peg for hanging objects: foot, direction to the tip, length and radius (m, world frame)."""

    foot_m: np.ndarray
    direction: np.ndarray
    length_m: float
    radius_m: float


@dataclass(frozen=True)
class Holder:
    """A bore: pose of its rim's centre with Z pointing out ``(4, 4)``, half widths ``(2,)`` and depth (m), names of its boxes."""

    rim_to_world: np.ndarray
    half_m: np.ndarray
    depth_m: float
    bodies: frozenset[str]


@dataclass(frozen=True)
class Granules:
    """Small spheres that represent poured contents: their centres ``(N, 3)`` in the world and their radius, m."""

    positions_m: np.ndarray
    radius_m: float


@dataclass(frozen=True)
class WorldState:
    """Objects by name, and ``touching``: pairs of names (objects, furniture, fixtures, the robot) in contact.

    ``granules_at_start``: number of granules in each object at the start. ``arms``: the names of two arms, the giving arm
    first; contacts then use the arm's own name.
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

    def object_state(self, name: str) -> ObjectState:
        """Return an object's state; raises UsageError naming the existing objects."""
        return self._named(self.objects, name, "object")

    def place(self, name: str) -> np.ndarray:
        """Return a marked place ``(3,)``; raises UsageError naming the existing places."""
        return self._named(self.places_m, name, "place")

    def peg(self, name: str) -> Peg:
        """Return a peg; raises UsageError naming the existing pegs."""
        return self._named(self.pegs, name, "peg")

    def holder(self, name: str) -> Holder:
        """Return a holder; raises UsageError naming the existing holders."""
        return self._named(self.holders, name, "holder")

    @property
    def robots(self) -> frozenset[str]:
        """Names of robots in contacts: those of two arms, or that of the single robot."""
        return frozenset(self.arms or (ROBOT,))

    def is_handled(self, name: str) -> bool:
        """Tell whether a robot touches an object."""
        return bool(self.neighbours(name) & self.robots)

    def touch(self, first: str, second: str) -> bool:
        """Tell whether two bodies press on each other."""
        return frozenset((first, second)) in self.touching

    def neighbours(self, name: str) -> frozenset[str]:
        """Return the names of all bodies in contact with an object."""
        return frozenset(other for pair in self.touching if name in pair for other in pair if other != name)

    @staticmethod
    def _named(things: Mapping[str, Thing], name: str, kind: str) -> Thing:
        if name not in things:
            raise UsageError(f"no {kind} {name!r} in this scene; there are: {', '.join(sorted(things)) or 'none'}")
        return things[name]
