"""The places of a layout while it is being made: who should be there, and where it was put."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from manitwin.errors import UsageError
from manitwin.geometry.hull_distance import PlacedParts
from manitwin.scenes.layouts.pool import Pool, PoolTwin
from manitwin.scenes.settings import LayoutSettings

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


def draw_slots(pool: Pool, settings: LayoutSettings, rng: np.random.Generator) -> list[Slot]:
    """Return the slots of a layout, those that carry others first, with their twins but for what is stacked or contained.

    Raises UsageError for a category that the pool has not, or where nothing in it is a vessel.
    """
    least = settings.least_standing + settings.stacked + settings.contained
    low, high = settings.objects
    count = int(rng.integers(max(low, least), high + 1))
    standing = count - settings.stacked - settings.contained
    slots = [Slot(i, "stand", category=category) for i, category in enumerate(settings.include)]
    slots += [Slot(i, "stand") for i in range(len(slots), standing)]
    carriers = _carriers(pool, slots, settings)
    for number in range(settings.contained + settings.stacked):
        role: Role = "in" if number < settings.contained else "on"
        parent = carriers[role][number % len(carriers[role])]
        slots.append(Slot(len(slots), role, parent=parent))
    for slot in slots:
        if slot.role == "stand":
            slot.twin = draw_twin(pool, slot, slots, rng)
    return slots


def _carriers(pool: Pool, slots: list[Slot], settings: LayoutSettings) -> dict[Role, list[Slot]]:
    """Choose which slots hold and which carry others: what was asked for by name first, where it can."""
    holding: list[Slot] = []
    if settings.contained:
        named = [s for s in slots if s.category and any(t.vessel for t in pool.of_category(s.category))]
        others = [s for s in slots if s.category is None] or slots
        holding = (named or others[:1])[: settings.contained]
        for slot in holding:
            slot.vessel = True
    carrying: list[Slot] = []
    if settings.stacked:
        free = [s for s in slots if not s.vessel] or slots
        carrying = sorted(free, key=lambda s: s.category is None)[: settings.stacked]
        for slot in carrying:
            slot.base = True
    return {"in": holding, "on": carrying}


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
            raise UsageError("nothing in the data set is a vessel that holds something; ask for contained = 0")
    taken = {other.twin.twin_id for other in slots if other.twin is not None and other is not slot}
    for refused in (taken | but, but, frozenset()):
        free = [twin for twin in fitting if twin.twin_id not in refused]
        if free:
            return free[int(rng.integers(len(free)))]
    raise AssertionError("a pool has twins")
