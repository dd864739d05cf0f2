"""The places of a layout while it is being made: who should be there, and where it was put."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from manitwin.errors import UsageError
from manitwin.geometry.hull_distance import PlacedParts
from manitwin.scenes.layouts.pool import Pool, PoolTwin

Role = Literal["stand", "on", "in"]


@dataclass(frozen=True)
class Put:
    """An object's place: the support's name, the placement it is in, its pose and its parts there."""

    surface: str
    placement: int | None
    parts: PlacedParts

    @property
    def object_to_world(self) -> np.ndarray:
        """The pose ``(4, 4)``."""
        return self.parts.pose


@dataclass
class Slot:
    """A place for one object.

    ``role``: it stands on the furniture, on another slot or in it (``parent``). ``category`` is asked for, None for a
    distractor; ``vessel``: something will lie in it, ``base``: something will stand on it.
    """

    number: int
    role: Role
    category: str | None = None
    parent: Slot | None = None
    vessel: bool = False
    base: bool = False
    twin: PoolTwin | None = None
    put: Put | None = None
    failures: int = 0

    @property
    def name(self) -> str:
        """Its name in the scene."""
        return f"object_{self.number:02d}"

    @property
    def needed(self) -> bool:
        """True where the layout would not be what was asked for without it."""
        return self.category is not None or self.role != "stand" or self.vessel or self.base

    def related(self, other: Slot) -> bool:
        """Tell whether one carries or holds the other, or both are in the same vessel."""
        same = self.role == other.role == "in" and self.parent is other.parent
        return self.parent is other or other.parent is self or same


def draw_twin(
    pool: Pool, slot: Slot, slots: list[Slot], rng: np.random.Generator, but: frozenset[str] = frozenset()
) -> PoolTwin:
    """Draw a twin for a slot, of its category; one again only when all that will do are in the layout already.

    ``but`` are ids that were tried in vain; they come again when nothing else is left.
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
