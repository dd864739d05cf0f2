"""What an object meets when it is slid level, without turning: distances of convex hulls along the way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.geometry.hull_distance import ConvexParts, PlacedParts, distance
from manitwin.scenes.loaded_scene import furniture_boxes
from manitwin.scenes.scene import SceneRecord
from manitwin.scenes.vqa.things import Thing

TOUCH_M = 0.0005
"""Two bodies nearer than this touch."""
MARGIN_M = 0.010
"""What misses by less, or is met in less before the end of the way, is not asked."""
STEP_M = 0.002
"""How far an object is moved at once where it is within the margin."""
LONGEST_M = 0.20


@dataclass(frozen=True)
class Meeting:
    """Where along a way (m) an object comes within the margin of another, and where it touches it; infinite: nowhere."""

    near_m: float
    touch_m: float


@dataclass(frozen=True)
class Way:
    """All meetings along a straight way, by the other's name; ``leaves_m`` is where the object's middle leaves its support."""

    meetings: Mapping[str, Meeting]
    leaves_m: float

    def first_hit(self, length_m: float) -> tuple[str, float] | None:
        """Return what is met first and where, if it is surely met before any other; else None."""
        hits = sorted((meeting.touch_m, name) for name, meeting in self.meetings.items())
        if not hits or hits[0][0] > length_m - MARGIN_M:
            return None
        return hits[0][1], hits[0][0]

    def order_is_sure(self) -> bool:
        """Whether what is met first is met clearly before the next."""
        touches = sorted(meeting.touch_m for meeting in self.meetings.values())
        return len(touches) < 2 or touches[1] - touches[0] > MARGIN_M

    def is_free(self, length_m: float) -> bool:
        """Whether nothing comes within the margin."""
        return all(meeting.near_m > length_m for meeting in self.meetings.values())

    def verdict(self, length_m: float) -> bool | None:
        """Tell whether something is hit on the first ``length_m``; None where that is a matter of millimetres."""
        if self.first_hit(length_m) is not None:
            return True
        return False if self.is_free(length_m) else None


def can_be_slid(thing: Thing, record: SceneRecord) -> bool:
    """Whether it stands on the furniture with nothing on or in it: sliding moves it alone."""
    return thing.placed_as.supported_by is None and all(each.supported_by != thing.name for each in record.objects)


def obstacles_of(thing: Thing, things: Sequence[Thing], record: SceneRecord) -> dict[str, PlacedParts]:
    """Return by name what an object may run into: the other objects, and furniture that rises above its foot."""
    foot = thing.placed.bounds[0][2]
    found = {other.name: other.placed for other in things if other is not thing}
    for box in furniture_boxes(record.furniture):
        if box.box_to_world[2, 3] + box.half_extents_m[2] > foot + MARGIN_M / 2:
            found[box.name] = ConvexParts.of_box(box).at(box.box_to_world)
    return found


def sweep(
    thing: Thing,
    record: SceneRecord,
    obstacles: Mapping[str, PlacedParts],
    start_m: np.ndarray,
    direction: tuple[float, float],
    length_m: float = LONGEST_M,
) -> Way:
    """Slide an object level from its place moved by ``start_m (2,)``, along a unit ``direction``; nothing else moves.

    A body that is ``gap`` away cannot be met on the next ``gap`` of the way (conservative advancement), so few places are looked at.
    """
    meetings = {}
    unit = np.array([*direction, 0.0])
    start = np.array([*start_m, 0.0])
    low, high = (bound + start for bound in thing.placed.bounds)
    swept_low = np.minimum(low, low + unit * length_m) - MARGIN_M
    swept_high = np.maximum(high, high + unit * length_m) + MARGIN_M
    for name, obstacle in obstacles.items():
        other_low, other_high = obstacle.bounds
        if (other_low <= swept_high).all() and (other_high >= swept_low).all():
            meetings[name] = _meeting(thing, obstacle, start, unit, length_m)
    return Way(meetings, _leaves(thing, record, start, unit, length_m))


def _meeting(thing: Thing, obstacle: PlacedParts, start: np.ndarray, unit: np.ndarray, length_m: float) -> Meeting:
    near, along = np.inf, 0.0
    while along <= length_m:
        pose = thing.pose.copy()
        pose[:3, 3] += start + along * unit
        gap = distance(thing.shape.hulls.at(pose), obstacle)
        if gap <= MARGIN_M:
            near = min(near, along)
        if gap <= TOUCH_M:
            return Meeting(near, along)
        along += max(gap - MARGIN_M, STEP_M)
    return Meeting(near, np.inf)


def _leaves(thing: Thing, record: SceneRecord, start: np.ndarray, unit: np.ndarray, length_m: float) -> float:
    """Return how far the middle of an object's foot goes before the furniture below it ends."""
    middle = (thing.center_m + start)[:2]
    foot = thing.placed.bounds[0][2]
    ends = [0.0]
    for box in record.furniture.boxes:
        center, half = np.array(box.center_m), np.array(box.half_extents_m)
        if abs(center[2] + half[2] - foot) > MARGIN_M or (np.abs(middle - center[:2]) > half[:2]).any():
            continue
        way = np.inf
        for axis in range(2):
            if abs(unit[axis]) > 1e-9:
                edge = center[axis] + np.sign(unit[axis]) * half[axis]
                way = min(way, (edge - middle[axis]) / unit[axis])
        ends.append(float(way))
    return max(ends)
