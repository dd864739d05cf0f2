"""What an object meets when it is slid level, without turning: convex hulls swept along the way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.geometry.hull_distance import ConvexParts, PlacedParts, overlap_depth
from manitwin.geometry.hull_sweep import first_contacts
from manitwin.scenes.loaded_scene import furniture_boxes
from manitwin.scenes.scene import SceneRecord
from manitwin.scenes.vqa.things import Thing

TOUCH_M = 0.0005
"""Two bodies nearer than this touch."""
DEEP_M = 0.002
"""How deep one body must have come into the other, soon after they touched."""
MARGIN_M = 0.020
"""What misses by less, or is met in less before the end of the way, is not asked: the eye does not tell it from a hit."""
FURTHER_M = 0.010
"""How much farther than where they touch the depth of a hit is measured."""
LEVEL_M = 0.010
"""How far from a piece of furniture's top the foot of what stands on it is, at most."""
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
        """Return what is hit first and where; None where nothing surely is, or something else may be grazed before."""
        hits = sorted((meeting.touch_m, name) for name, meeting in self.meetings.items())
        if not hits or hits[0][0] > length_m - MARGIN_M:
            return None
        grazed = (each for each in self.meetings.values() if np.isinf(each.touch_m))
        if any(each.near_m <= hits[0][0] for each in grazed):
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
        if box.box_to_world[2, 3] + box.half_extents_m[2] > foot + LEVEL_M / 2:
            found[box.name] = ConvexParts.of_box(box).at(box.box_to_world)
    return found


def sweep(
    thing: Thing,
    record: SceneRecord,
    obstacles: Mapping[str, PlacedParts],
    start_m: np.ndarray,
    directions: Sequence[tuple[float, float]],
    length_m: float = LONGEST_M,
) -> list[Way]:
    """Slide an object level from its place moved by ``start_m (2,)``, along each of some unit directions; nothing else moves.

    Each convex part against each of the others that the box of its way touches, by ray casts against their difference.
    """
    start = np.array([*start_m, 0.0])
    moving = thing.placed.parts + start
    low, high = moving.min(1), moving.max(1)
    pairs: list[tuple[int, str, int, np.ndarray, np.ndarray, np.ndarray]] = []
    for place, direction in enumerate(directions):
        way = np.array([*direction, 0.0]) * length_m
        swept_low, swept_high = np.minimum(low, low + way) - MARGIN_M, np.maximum(high, high + way) + MARGIN_M
        for name, obstacle in obstacles.items():
            other_low, other_high = obstacle.part_bounds
            near = (other_low[None] <= swept_high[:, None]).all(-1) & (other_high[None] >= swept_low[:, None]).all(-1)
            rows, columns = np.nonzero(near)
            if len(rows):
                unit = np.broadcast_to(way / length_m, (len(rows), 3))
                pairs.append((place, name, len(rows), moving[rows], obstacle.parts[columns], unit))
    meetings: list[dict[str, Meeting]] = [{} for _ in directions]
    if pairs:
        most = max(each[4].shape[1] for each in pairs)
        first = np.concatenate([each[3] for each in pairs])
        second = np.concatenate([_padded(each[4], most) for each in pairs])
        units = np.concatenate([each[5] for each in pairs])
        near_m = first_contacts(first, second, units, length_m, MARGIN_M)
        touch_m = np.full(len(near_m), np.inf)
        at = np.isfinite(near_m)
        touch_m[at] = first_contacts(first[at], second[at], units[at], length_m, TOUCH_M)
        end = 0
        for place, name, count, *_ in pairs:
            begin, end = end, end + count
            met = Meeting(float(near_m[begin:end].min()), float(touch_m[begin:end].min()))
            if not _is_deep(thing, obstacles[name], start, directions[place], met):
                met = Meeting(met.near_m, np.inf)
            meetings[place][name] = met
    return [
        Way(met, _leaves(thing, record, start, np.array([*direction, 0.0])))
        for met, direction in zip(meetings, directions, strict=True)
    ]


def _is_deep(
    thing: Thing, obstacle: PlacedParts, start: np.ndarray, direction: tuple[float, float], met: Meeting
) -> bool:
    """Whether an object is well inside of another soon after they touch: what only grazes is not sure to be hit."""
    if not np.isfinite(met.touch_m):
        return False
    pose = thing.pose.copy()
    pose[:3, 3] += start + (met.touch_m + FURTHER_M) * np.array([*direction, 0.0])
    return overlap_depth(thing.shape.hulls.at(pose), obstacle) >= DEEP_M


def _padded(parts: np.ndarray, most: int) -> np.ndarray:
    """Repeat the first corner of parts ``(P, B, 3)`` until there are ``most``."""
    return np.concatenate([parts, np.repeat(parts[:, :1], most - parts.shape[1], axis=1)], axis=1)


def _leaves(thing: Thing, record: SceneRecord, start: np.ndarray, unit: np.ndarray) -> float:
    """Return how far the middle of an object's foot goes before the furniture below it ends."""
    middle = (thing.center_m + start)[:2]
    foot = thing.placed.bounds[0][2]
    ends = [0.0]
    for box in record.furniture.boxes:
        center, half = np.array(box.center_m), np.array(box.half_extents_m)
        if abs(center[2] + half[2] - foot) > LEVEL_M or (np.abs(middle - center[:2]) > half[:2]).any():
            continue
        way = np.inf
        for axis in range(2):
            if abs(unit[axis]) > 1e-9:
                edge = center[axis] + np.sign(unit[axis]) * half[axis]
                way = min(way, (edge - middle[axis]) / unit[axis])
        ends.append(float(way))
    return max(ends)
