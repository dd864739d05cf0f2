"""Who touches whom in an episode: the fingers the target, the target its support, and the robot what it should not."""

from __future__ import annotations

from collections.abc import Iterable
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
    """How hard each finger presses on the target, whether something else carries it, and the unplanned contacts by name."""

    finger_forces_n: tuple[float, float]
    on_support: bool
    unplanned: tuple[tuple[str, str], ...]


class ContactReader:
    """Reads the contacts of the last step."""

    def __init__(
        self, system: physx.PhysxCpuSystem, bodies: Iterable[tuple[physx.PhysxBaseComponent, str, Role]],
        max_contact_force_n: float,
    ):  # fmt: skip
        """Take every body with its name and role."""
        self._system, self._max_n = system, max_contact_force_n
        self._known = {component: (role, name) for component, name, role in bodies}

    def read(self, phase: Phase) -> Touches:
        """Return what touches in ``phase``: unplanned is more than the allowed force between what should keep apart."""
        impulses: dict[tuple[tuple[Role, str], tuple[Role, str]], np.ndarray] = {}
        on_support = False
        for contact in self._system.get_contacts():
            first, second = (self._known[body] for body in contact.bodies)
            swapped = first[0] > second[0]
            if swapped:
                first, second = second, first
            if first[0] == Role.TARGET:
                on_support = on_support or any(point.impulse.any() for point in contact.points)
            elif first[0] < Role.TARGET <= second[0]:
                impulse = sum((point.impulse for point in contact.points), start=np.zeros(3))
                impulses[first, second] = impulses.get((first, second), 0.0) + (-impulse if swapped else impulse)
        fingers, unplanned = [0.0, 0.0], []
        for (part, other), impulse in impulses.items():
            force_n = float(np.linalg.norm(impulse)) / self._system.timestep
            if other[0] == Role.TARGET and part[0] <= Role.MINUS_FINGER:
                fingers[part[0]] += force_n
            elif force_n > self._max_n and (other[0] > Role.TARGET or part[0] == Role.ARM or phase not in IN_HAND):
                unplanned.append((part[1], other[1]))
        return Touches((fingers[0], fingers[1]), on_support, tuple(sorted(unplanned)))
