"""Collisions of an object that is slid horizontally without rotation, by swept convex hulls."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.geometry.hull_distance import ConvexParts, PlacedParts, overlap_depth
from manitwin.geometry.hull_sweep import least_contacts
from manitwin.scenes.loaded_scene import furniture_boxes
from manitwin.scenes.scene import SceneRecord
from manitwin.scenes.vqa.posed_objects import PosedObject

TOUCH_M = 0.0005
"""Two bodies nearer than this touch."""
DEEP_M = 0.002
"""Least penetration depth, shortly after contact, that counts as a hit."""
MARGIN_M = 0.020
"""Near misses, and hits this close to the end of the way, are not asked about, since a reader cannot tell them apart."""
FURTHER_M = 0.010
"""Distance beyond the contact at which the depth of a hit is measured."""
LEVEL_M = 0.010
"""Maximal height difference between the top of a piece of furniture and the foot of an object that stands on it."""
LONGEST_M = 0.20


@dataclass(frozen=True)
class ObstacleContact:
    """The distances (m) at which an object comes within the margin of another, and touches it; infinite for never."""

    near_m: float
    touch_m: float


@dataclass(frozen=True)
class SweptPath:
    """All meetings along a straight way, by obstacle name; ``leaves_m`` is where the object's centre leaves its support."""

    meetings: Mapping[str, ObstacleContact]
    leaves_m: float

    def first_hit(self, length_m: float) -> tuple[str, float] | None:
        """Return the name and distance of the first hit; None if no hit is certain, or another obstacle may be grazed before."""
        hits = sorted((meeting.touch_m, name) for name, meeting in self.meetings.items())
        if not hits or hits[0][0] > length_m - MARGIN_M:
            return None
        grazed = (each for each in self.meetings.values() if np.isinf(each.touch_m))
        if any(each.near_m <= hits[0][0] for each in grazed):
            return None
        return hits[0][1], hits[0][0]

    def is_order_certain(self) -> bool:
        """Return whether the first contact clearly precedes the second."""
        touches = sorted(meeting.touch_m for meeting in self.meetings.values())
        return len(touches) < 2 or touches[1] - touches[0] > MARGIN_M

    def is_free(self, length_m: float) -> bool:
        """Return whether no obstacle comes within the margin."""
        return all(meeting.near_m > length_m for meeting in self.meetings.values())

    def is_hit_within(self, length_m: float) -> bool | None:
        """Return whether the first ``length_m`` of the way contain a hit; None if that is uncertain."""
        if self.first_hit(length_m) is not None:
            return True
        return False if self.is_free(length_m) else None


def can_be_slid(thing: PosedObject, record: SceneRecord) -> bool:
    """Return whether an object stands on the furniture with nothing on or in it, so that it can be slid alone."""
    return thing.placed_as.supported_by is None and all(each.supported_by != thing.name for each in record.objects)


def obstacles_of(thing: PosedObject, things: Sequence[PosedObject], record: SceneRecord) -> dict[str, PlacedParts]:
    """Return the possible obstacles of an object by name: the other objects, and furniture that rises above its foot."""
    foot = thing.placed_hulls.bounds[0][2]
    found = {other.name: other.placed_hulls for other in things if other is not thing}
    for box in furniture_boxes(record.furniture):
        if box.box_to_world[2, 3] + box.half_extents_m[2] > foot + LEVEL_M / 2:
            found[box.name] = ConvexParts.of_box(box).at(box.box_to_world)
    return found


@dataclass(frozen=True)
class Slide:
    """A horizontal slide of an object along a unit direction, from its place moved by ``start_m (x, y)``; nothing else moves."""

    thing: PosedObject
    start_m: tuple[float, float]
    direction: tuple[float, float]

    @property
    def unit(self) -> np.ndarray:
        """The direction ``(3,)`` in the world."""
        return np.array([*self.direction, 0.0])

    @property
    def start_offset_m(self) -> np.ndarray:
        """The offset ``(3,)`` of the start from the object's place, m."""
        return np.array([*self.start_m, 0.0])


def sweep(
    slides: Sequence[Slide], things: Sequence[PosedObject], record: SceneRecord, length_m: float = LONGEST_M
) -> list[SweptPath]:
    """Return what each slide meets among all ``things`` of the scene.

    Convex parts are tested against those of obstacles whose boxes meet the swept box, by ray casts against their Minkowski
    difference, nearest first; all slides are processed at once.
    """
    obstacles = {each.thing.name: obstacles_of(each.thing, things, record) for each in slides}
    groups = [
        (place, name, pairs)
        for place, slide in enumerate(slides)
        for name, pairs in _candidate_pairs(slide, obstacles[slide.thing.name], length_m)
    ]
    meetings: list[dict[str, ObstacleContact]] = [{} for _ in slides]
    for (place, name, _), met in zip(groups, _meetings([pairs for *_, pairs in groups], length_m), strict=True):
        slide = slides[place]
        if not _is_deep(slide, obstacles[slide.thing.name][name], met):
            met = ObstacleContact(met.near_m, np.inf)
        meetings[place][name] = met
    return [SweptPath(met, _leaves(slide, record)) for met, slide in zip(meetings, slides, strict=True)]


@dataclass(frozen=True)
class _Pairs:
    """Pairs of moving parts ``(P, A, 3)`` and others ``(P, B, 3)`` whose boxes meet when the first move along ``unit (3,)``.

    ``gap_m (P,)`` is the distance that the box around the moving part and its margin moves until they meet.
    """

    moving: np.ndarray
    others: np.ndarray
    unit: np.ndarray
    gap_m: np.ndarray


def _candidate_pairs(
    slide: Slide, obstacles: Mapping[str, PlacedParts], length_m: float
) -> Iterator[tuple[str, _Pairs]]:
    """Yield by obstacle the pairs of parts that may come within the margin, from boxes aligned with the direction."""
    parts = slide.thing.placed_hulls.parts + slide.start_offset_m
    way = slide.unit * length_m
    swept_low = np.minimum(parts.min((0, 1)), (parts + way).min((0, 1))) - MARGIN_M
    swept_high = np.maximum(parts.max((0, 1)), (parts + way).max((0, 1))) + MARGIN_M
    axes = np.stack([slide.unit, [-slide.direction[1], slide.direction[0], 0.0], [0.0, 0.0, 1.0]], axis=1)
    turned = parts @ axes
    low, high = turned.min(1)[:, None] - MARGIN_M, turned.max(1)[:, None] + MARGIN_M
    for name, obstacle in obstacles.items():
        if (obstacle.bounds[0] > swept_high).any() or (obstacle.bounds[1] < swept_low).any():
            continue
        its = obstacle.parts @ axes
        its_low, its_high = its.min(1)[None], its.max(1)[None]
        meet = (its_low[..., 1:] <= high[..., 1:]).all(-1) & (its_high[..., 1:] >= low[..., 1:]).all(-1)
        meet &= (its_low[..., 0] <= high[..., 0] + length_m) & (its_high[..., 0] >= low[..., 0])
        rows, columns = np.nonzero(meet)
        if len(rows):
            gap_m = np.maximum(its_low[0, columns, 0] - high[rows, 0, 0], 0.0)
            yield name, _Pairs(parts[rows], obstacle.parts[columns], slide.unit, gap_m)


def _meetings(groups: Sequence[_Pairs], length_m: float) -> list[ObstacleContact]:
    """Return for each group of pairs the first distance within the margin, and the first contact."""
    if not groups:
        return []
    first, second = _padded([each.moving for each in groups]), _padded([each.others for each in groups])
    units = np.concatenate([np.broadcast_to(each.unit, (len(each.gap_m), 3)) for each in groups])
    group = np.repeat(np.arange(len(groups)), [len(each.gap_m) for each in groups])
    gap_m = np.concatenate([each.gap_m for each in groups])
    near_m, at_least_m = least_contacts(first, second, units, group, gap_m, length_m, MARGIN_M)
    touch_m, _ = least_contacts(first, second, units, group, at_least_m, length_m, TOUCH_M)
    return [ObstacleContact(float(near), float(touch)) for near, touch in zip(near_m, touch_m, strict=True)]


def _is_deep(slide: Slide, obstacle: PlacedParts, met: ObstacleContact) -> bool:
    """Return whether an object penetrates an obstacle deeply shortly after contact; otherwise it may only graze it."""
    if not np.isfinite(met.touch_m):
        return False
    pose = slide.thing.pose.copy()
    pose[:3, 3] += slide.start_offset_m + (met.touch_m + FURTHER_M) * slide.unit
    return overlap_depth(slide.thing.shape.hulls.at(pose), obstacle) >= DEEP_M


def _padded(groups: Sequence[np.ndarray]) -> np.ndarray:
    """Concatenate parts ``(P, A, 3)``, padded to the same number of corners by repeating the first corner."""
    most = max(parts.shape[1] for parts in groups)
    return np.concatenate(
        [np.concatenate([parts, np.repeat(parts[:, :1], most - parts.shape[1], axis=1)], axis=1) for parts in groups]
    )


def _leaves(slide: Slide, record: SceneRecord) -> float:
    """Return how far the centre of an object moves before the furniture below it ends."""
    middle = (slide.thing.center_m + slide.start_offset_m)[:2]
    foot = slide.thing.placed_hulls.bounds[0][2]
    unit = slide.unit
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
