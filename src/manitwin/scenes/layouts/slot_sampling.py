"""Drawing of the slots of a layout: their number, which of them are containers or bases, and their twins."""

from __future__ import annotations

import numpy as np

from manitwin.errors import UsageError
from manitwin.scenes.layouts.pool import Pool
from manitwin.scenes.layouts.slots import Role, Slot, sample_twin
from manitwin.scenes.layouts.stacking import level_poses
from manitwin.scenes.settings import LayoutSettings


def sample_slots(pool: Pool, settings: LayoutSettings, rng: np.random.Generator) -> list[Slot]:
    """Return the slots of a layout, parents first, with twins except for stacked or contained objects.

    Raises UsageError for a category that the pool lacks, if the pool has no container, or if no required object can support the
    stacked ones and there is no room for another.
    """
    least, high = least_objects(pool, settings), settings.objects[1]
    count = int(rng.integers(max(settings.objects[0], least), high + 1))
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
            slot.twin = sample_twin(pool, slot, slots, rng)
    return slots


def least_objects(pool: Pool, settings: LayoutSettings) -> int:
    """Return the least number of objects: one more than requested if none of the required ones can support the stacked ones.

    Raises UsageError like ``sample_slots``.
    """
    for category in settings.include:
        pool.of_category(category)
    if settings.contained and not any(twin.vessel for twin in pool.twins):
        raise UsageError("no twin in the data set is a container that can hold another; use contained = 0")
    spare = bool(settings.stacked) and not any(_can_support(pool, category) for category in settings.include)
    standing = max(settings.least_standing, len(settings.include) + spare)
    least = standing + settings.stacked + settings.contained
    if least > settings.objects[1]:
        asked = ", ".join(dict.fromkeys(settings.include))
        raise UsageError(
            f"none of {asked} has a level top that another object can stand on; allow {least} objects or more"
        )
    return least


def _can_support(pool: Pool, category: str) -> bool:
    """Return whether an object can stand on a twin of a category, in one of its placements."""
    return any(level_poses(twin, pool.body(twin.twin_id)) for twin in pool.of_category(category))


def _carriers(pool: Pool, slots: list[Slot], settings: LayoutSettings) -> dict[Role, list[Slot]]:
    """Choose the slots that are containers and bases, preferring required categories that are suitable."""
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
        able = [s for s in free if s.category is None or _can_support(pool, s.category)]
        carrying = sorted(able, key=lambda s: s.category is None)[: settings.stacked]
        for slot in carrying:
            slot.base = True
    return {"in": holding, "on": carrying}
