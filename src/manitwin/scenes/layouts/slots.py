"""Slots of a layout during sampling: the requirements of an object, its twin and its pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from manitwin.errors import UsageError
from manitwin.geometry.hull_distance import PlacedParts
from manitwin.scenes.layouts.pool import Pool, PoolTwin

Role = Literal["stand", "on", "in"]


@dataclass(frozen=True)
class SupportedPose:
    """An object's position: the support's name, its placement, and its parts at its pose."""

    surface: str
    placement: int | None
    parts: PlacedParts

    @property
    def object_to_world(self) -> np.ndarray:
        """The pose ``(4, 4)``."""
        return self.parts.pose


@dataclass
class Slot:
    """A slot for one object.

    ``role``: it stands on the furniture, or on or in another slot (``parent``). ``category`` is required, None for a
    distractor. ``vessel``: something will lie in it; ``base``: something will stand on it.
    """

    number: int
    role: Role
    category: str | None = None
    parent: Slot | None = None
    vessel: bool = False
    base: bool = False
    twin: PoolTwin | None = None
    put: SupportedPose | None = None
    failures: int = 0

    @property
    def name(self) -> str:
        """Its name in the scene."""
        return f"object_{self.number:02d}"

    @property
    def needed(self) -> bool:
        """True if the layout would not meet the request without it."""
        return self.category is not None or self.role != "stand" or self.vessel or self.base

    def related(self, other: Slot) -> bool:
        """Return whether one supports or contains the other, or both are in the same container."""
        same = self.role == other.role == "in" and self.parent is other.parent
        return self.parent is other or other.parent is self or same


def sample_twin(
    pool: Pool, slot: Slot, slots: list[Slot], rng: np.random.Generator, but: frozenset[str] = frozenset()
) -> PoolTwin:
    """Draw a twin for a slot, of its category; one already in the layout only if no other is suitable.

    ``but`` are ids that were tried without success; they are drawn again only if no other is left.
    """
    fitting = pool.twins if slot.category is None else pool.of_category(slot.category)
    if slot.vessel:
        fitting = tuple(twin for twin in fitting if twin.vessel)
        if not fitting:
            raise UsageError("no twin in the data set is a container that can hold another; use contained = 0")
    taken = {other.twin.twin_id for other in slots if other.twin is not None and other is not slot}
    for refused in (taken | but, but, frozenset()):
        free = [twin for twin in fitting if twin.twin_id not in refused]
        if free:
            return free[int(rng.integers(len(free)))]
    raise AssertionError("a pool has twins")
