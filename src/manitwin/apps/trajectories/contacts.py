"""Who touches whom in an episode: the fingers the target, the target its support, and the robot what it should not."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from sapien import physx

from manitwin.planning.problem import Phase

IN_HAND = frozenset({Phase.CLOSE, Phase.LIFT, Phase.CARRY, Phase.LOWER, Phase.OPEN})


class Role(IntEnum):
    """What a body is in an episode; the robot's parts come first."""

    PLUS_FINGER = 0
    MINUS_FINGER = 1
    HAND = 2
    ARM = 3
    TARGET = 4
    OTHER = 5
    FURNITURE = 6


@dataclass(frozen=True)
class Touches:
    """How hard each finger presses on the target, and whether something else carries it."""

    finger_forces_n: tuple[float, float]
    on_support: bool


class ContactReader:
    """Reads the contacts of the last step."""

    def __init__(
        self,
        system: physx.PhysxCpuSystem,
        bodies: Iterable[tuple[physx.PhysxBaseComponent, str, Role]],
        max_contact_force_n: float,
    ):
        """Take every body with its name and role."""
        self._system, self._max_impulse = system, max_contact_force_n * system.timestep
        self._known = {component: (role, name) for component, name, role in bodies}

    def touches(self) -> Touches:
        """Return what touches the target."""
        impulses = [np.zeros(3), np.zeros(3)]
        on_support = False
        for first, second, contact, sign in self._contacts():
            if first[0] == Role.TARGET:
                on_support = on_support or any(point.impulse.any() for point in contact.points)
            elif second[0] == Role.TARGET and first[0] <= Role.MINUS_FINGER:
                impulses[first[0]] += sign * _impulse(contact)
        plus_n, minus_n = (float(np.linalg.norm(impulse)) / self._system.timestep for impulse in impulses)
        return Touches((plus_n, minus_n), on_support)

    def unplanned(self, phase: Phase) -> set[tuple[str, str]]:
        """Return the names of what touches with more than the allowed force and should not, the robot's part first."""
        impulses: dict[tuple[str, str], np.ndarray] = {}
        for (part, part_name), (other, other_name), contact, sign in self._contacts():
            if part >= Role.TARGET or other < Role.TARGET:
                continue
            if other > Role.TARGET or part == Role.ARM or (part == Role.HAND and phase not in IN_HAND):
                pair = part_name, other_name
                impulses[pair] = impulses.get(pair, 0.0) + sign * _impulse(contact)
        return {pair for pair, impulse in impulses.items() if np.linalg.norm(impulse) > self._max_impulse}

    def _contacts(self) -> Iterator[tuple[tuple[Role, str], tuple[Role, str], physx.PhysxContact, int]]:
        """Yield role and name of both bodies, the lower role first, their contact, and 1 where that has them in this order."""
        for contact in self._system.get_contacts():
            first, second = (self._known[body] for body in contact.bodies)
            yield (first, second, contact, 1) if first <= second else (second, first, contact, -1)


def _impulse(contact: physx.PhysxContact) -> np.ndarray:
    """Return the impulse ``(3,)`` on the contact's first body."""
    return sum((point.impulse for point in contact.points), start=np.zeros(3))
