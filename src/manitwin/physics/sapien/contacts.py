"""Contact reading in a robot world: finger forces on the target, support of the target, unplanned contacts of the robot."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from sapien import physx


class Role(IntEnum):
    """Role of a body in a task; the robot's parts come first."""

    PLUS_FINGER = 0
    MINUS_FINGER = 1
    HAND = 2
    ARM = 3
    TARGET = 4
    OTHER = 5
    FURNITURE = 6
    FIXTURE = 7


ROBOT_NAME = "robot"


@dataclass(frozen=True)
class AllowedContacts:
    """Contacts that are allowed during a phase, by names of bodies: of the fingers, and of the target in the hand.

    ``target`` None: contacts of the target are not checked, as in pick-and-place. ``palm``: the target may touch the palm
    although it is no longer in the hand, because an object released in the air may fall to either side.
    """

    fingers: frozenset[str] = frozenset()
    target: frozenset[str] | None = None
    palm: bool = False


NONE_MEANT = AllowedContacts()


@dataclass(frozen=True)
class ResultantForce:
    """Resultant contact force ``(3,)`` N on a body, along the contact normals, and its mean point ``(3,)`` m; world frame."""

    force_n: np.ndarray
    at_m: np.ndarray


@dataclass(frozen=True)
class TargetContacts:
    """Force (N) of each finger on the target, the first arm's before the second's; ``on_support``: something else supports it."""

    finger_forces_n: tuple[float, ...]
    on_support: bool


class ContactReader:
    """Reads and classifies the contacts of the last step."""

    def __init__(
        self,
        system: physx.PhysxCpuSystem,
        bodies: Iterable[tuple[physx.PhysxBaseComponent, str, Role]],
        max_contact_force_n: float,
        arms: Mapping[str, str] | None = None,
    ):
        """Take every body with its name and role; for two arms, ``arms`` maps each link name to its arm.

        Roles are then as seen by one of the arms: the other arm's hand is a HAND, the rest of it an ARM. Set
        ``has_strangers`` if the scene has bodies without a role (granules). Their contacts are then left out, which takes
        time if there are many.
        """
        self.has_strangers = False
        self._arms = arms or {}
        self._system, self._max_impulse = system, max_contact_force_n * system.timestep
        self._roles: dict[physx.PhysxBaseComponent, Role] = {}
        self._names: dict[physx.PhysxBaseComponent, str] = {}
        for component, name, role in bodies:
            self._roles[component], self._names[component] = role, name

    @property
    def names(self) -> frozenset[str]:
        """Names of all bodies."""
        return frozenset(self._names.values())

    def read(self) -> Sequence[physx.PhysxContact]:
        """Return the contacts of the last step, for the other methods; expensive if many hulls stand on a table."""
        contacts: Sequence[physx.PhysxContact] = self._system.get_contacts()
        if self.has_strangers:
            known = self._roles
            return [
                each for each in contacts for one, two in (each.bodies,) if one in known and two in known
            ]  # SAPIEN creates the list of bodies anew on each access
        return contacts

    def resultant_force(
        self, contacts: Iterable[physx.PhysxContact], on: str, by: frozenset[str]
    ) -> ResultantForce | None:
        """Return the resultant force of the bodies ``by`` on the body ``on``, all by name; None without contact."""
        impulse, places, weights = np.zeros(3), list[np.ndarray](), list[float]()
        for contact in contacts:
            first, second = (self._names[body] for body in contact.bodies)
            if not ((first == on and second in by) or (second == on and first in by)):
                continue
            sign = 1.0 if first == on else -1.0
            for point in contact.points:
                if point.impulse.any():
                    impulse = impulse + sign * point.impulse
                    places.append(point.position)
                    weights.append(float(np.linalg.norm(point.impulse)))
        if not places:
            return None
        return ResultantForce(impulse / self._system.timestep, np.average(places, axis=0, weights=weights))

    def touches(self, contacts: Iterable[physx.PhysxContact]) -> TargetContacts:
        """Return the finger forces on the target and whether it is supported."""
        impulses = [np.zeros(3), np.zeros(3)]
        on_support = False
        for contact in contacts:
            one, two = contact.bodies
            first, second = self._roles[one], self._roles[two]
            if first != Role.TARGET and second != Role.TARGET:
                continue
            if first > Role.TARGET or second > Role.TARGET:
                on_support = on_support or any(point.impulse.any() for point in contact.points)
            elif first <= Role.MINUS_FINGER:
                impulses[first] += _impulse(contact)
            elif second <= Role.MINUS_FINGER:
                impulses[second] -= _impulse(contact)
        plus_n, minus_n = (float(np.linalg.norm(impulse)) / self._system.timestep for impulse in impulses)
        return TargetContacts((plus_n, minus_n), on_support)

    def pressing_pairs(self, contacts: Iterable[physx.PhysxContact]) -> set[frozenset[str]]:
        """Return the pairs of names of bodies that press on each other.

        All parts of a robot are named ``ROBOT_NAME``; for two arms each part has its arm's name.
        """
        pairs = set()
        for contact in contacts:
            if any(point.impulse.any() for point in contact.points):
                pairs.add(frozenset(self._public_name(body) for body in contact.bodies))
        return {pair for pair in pairs if len(pair) == 2}

    def _between_arms(self, first: physx.PhysxBaseComponent, second: physx.PhysxBaseComponent) -> bool:
        of = [self._arms.get(self._names[body]) for body in (first, second)] if self._arms else [None]
        return None not in of and of[0] != of[1]

    def _public_name(self, body: physx.PhysxBaseComponent) -> str:
        name = self._names[body]
        return self._arms.get(name, ROBOT_NAME) if self._roles[body] < Role.TARGET else name

    def unplanned(
        self, contacts: Iterable[physx.PhysxContact], *, in_hand: bool, meant: AllowedContacts = NONE_MEANT
    ) -> set[tuple[str, str]]:
        """Return the pairs of names in unplanned contact with more than the allowed force, the robot's part first.

        While the target is ``in_hand``, the palm may touch it. ``meant`` contacts are allowed pair by pair. Contacts between
        two arms are always unplanned.
        """
        impulses: dict[tuple[str, str], np.ndarray] = {}
        forbidden = _FORBIDDEN_IN_HAND if in_hand else _FORBIDDEN
        for contact in contacts:
            first, second = contact.bodies
            one, other = self._roles[first], self._roles[second]
            if self._between_arms(first, second):
                turned = self._names[first] > self._names[second]
                pair = (
                    (self._names[second], self._names[first]) if turned else (self._names[first], self._names[second])
                )
                impulses[pair] = impulses.get(pair, 0.0) + (-1.0 if turned else 1.0) * _impulse(contact)
                continue
            if not forbidden[one][other] and (meant.target is None or not _is_of_target(one, other)):
                continue
            sign = 1.0
            if one > other:
                first, second, sign, one = second, first, -1.0, other
            if self._names[second] in ((meant.target or ()) if one == Role.TARGET else _fingers(one, meant)):
                continue
            pair = self._names[first], self._names[second]
            impulses[pair] = impulses.get(pair, 0.0) + sign * _impulse(contact)
        return {pair for pair, impulse in impulses.items() if np.linalg.norm(impulse) > self._max_impulse}


def _forbidden(in_hand: bool) -> list[list[bool]]:
    """Return a table over two roles in either order: whether they must not touch; precomputed, as every contact needs it."""

    def is_forbidden(part: Role, other: Role) -> bool:
        if part >= Role.TARGET or other < Role.TARGET:
            return False
        return other > Role.TARGET or part == Role.ARM or (part == Role.HAND and not in_hand)

    return [[is_forbidden(min(one, two), max(one, two)) for two in Role] for one in Role]


def _is_of_target(one: Role, other: Role) -> bool:
    """Tell whether the pair is the target with a body that is not part of the robot."""
    return min(one, other) == Role.TARGET


def _fingers(part: Role, meant: AllowedContacts) -> frozenset[str]:
    return meant.fingers if part <= Role.MINUS_FINGER else frozenset()


_FORBIDDEN, _FORBIDDEN_IN_HAND = _forbidden(False), _forbidden(True)


def _impulse(contact: physx.PhysxContact) -> np.ndarray:
    """Return the impulse ``(3,)`` N s on the contact's first body."""
    return sum((point.impulse for point in contact.points), start=np.zeros(3))
