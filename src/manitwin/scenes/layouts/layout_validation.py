"""Validation of layouts: settling in simulation, measurement, and detection of misplaced objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from manitwin.geometry.hull_distance import ConvexParts, PlacedParts, least_distance, overlap_depth
from manitwin.geometry.poses import rotation_angle_rad, transform_points
from manitwin.geometry.rigid_body import PlacedObject, StaticBox
from manitwin.physics.sapien.settle import SettledScene, settle_scene
from manitwin.scenes.layouts.pool import Pool
from manitwin.scenes.layouts.slots import Slot
from manitwin.scenes.layouts.stacking import container_opening
from manitwin.scenes.scene import SceneMeasures
from manitwin.scenes.settings import LayoutSettings

LOADED_S = 1.0  # how long a scene must stay as recorded after loading
GIVE_UP = 3.0  # multiple of the motion limit beyond which the simulation is stopped


@dataclass(frozen=True)
class LayoutValidation:
    """A settled layout: poses ``(N, 4, 4)`` by slot, measures if they could be taken, and the defect of each bad slot."""

    object_to_world: np.ndarray
    measures: SceneMeasures | None
    wrong: dict[int, str]


def validate_layout(
    pool: Pool, slots: Sequence[Slot], boxes: Sequence[StaticBox], settings: LayoutSettings
) -> LayoutValidation:
    """Settle all objects together in simulation, and check each against its limits."""
    objects = []
    for slot in slots:
        assert slot.twin is not None and slot.put is not None
        body = pool.body(slot.twin.twin_id).body
        objects.append(PlacedObject(slot.name, slot.twin.twin_id, body, slot.put.object_to_world))
    give_up_m = [np.inf if slot.role == "in" else GIVE_UP * settings.max_moved_m for slot in slots]
    settled = settle_scene(objects, boxes, seconds=settings.settle_s, give_up_m=give_up_m)
    if settled.lost.any():
        lost = {slot.number: "it does not stay" for slot, gone in zip(slots, settled.lost, strict=True) if gone}
        return LayoutValidation(settled.object_to_world, None, lost)
    placed = [
        slot.put.parts.body.at(pose) for slot, pose in zip(slots, settled.object_to_world, strict=True) if slot.put
    ]
    moved, turned = _motions(objects, settled)
    wrong: dict[int, str] = {}
    for i, slot in enumerate(slots):
        found = None if settled.at_rest[i] else "it does not come to rest"
        found = found or _misplaced(pool, slots, slot, placed, settled)
        if slot.role != "in" and moved[i] > settings.max_moved_m:
            found = found or f"it moved by {1000 * moved[i]:.1f} mm"
        if slot.role != "in" and turned[i] > np.radians(settings.max_turned_deg):
            found = found or f"it turned by {np.degrees(turned[i]):.1f} degrees"
        if found:
            wrong[slot.number] = found
    if wrong:
        return LayoutValidation(settled.object_to_world, None, wrong)
    depths = penetrations_m(slots, placed, boxes, settled)
    wrong = {
        number: f"it is {1000 * depth:.1f} mm deep in another"
        for number, depth in depths.items()
        if depth > settings.max_penetration_m
    }
    wrong = wrong or _unstable_on_reload(objects, settled, boxes, settings, slots)
    stays = [i for i, slot in enumerate(slots) if slot.role != "in"]
    gap_m = _least_gap(slots, placed)
    measures = SceneMeasures(
        max_moved_m=float(moved[stays].max()),
        max_turned_rad=float(turned[stays].max()),
        max_penetration_m=max(depths.values()),
        min_gap_m=gap_m if np.isfinite(gap_m) else None,
    )
    return LayoutValidation(settled.object_to_world, measures, wrong)


def _unstable_on_reload(
    objects: Sequence[PlacedObject],
    settled: SettledScene,
    boxes: Sequence[StaticBox],
    settings: LayoutSettings,
    slots: Sequence[Slot],
) -> dict[int, str]:
    """Reload the settled scene, and report which objects move.

    A solver uses contacts of the previous step; without them, PhysX may take thin objects a few millimetres apart for deeply
    penetrating, and ejects them (in 1 of 60 layouts with an object in a mug).
    """
    at_rest = [replace(o, object_to_world=pose) for o, pose in zip(objects, settled.object_to_world, strict=True)]
    give_up_m = [GIVE_UP * settings.max_moved_m] * len(objects)
    again = settle_scene(at_rest, boxes, seconds=LOADED_S, at_least_s=LOADED_S, give_up_m=give_up_m)
    moved, turned = _motions(at_rest, again)
    gone = again.lost | (moved > settings.max_moved_m) | (turned > np.radians(settings.max_turned_deg))
    return {slot.number: "it leaves its rest when loaded" for slot, far in zip(slots, gone, strict=True) if far}


def _motions(objects: Sequence[PlacedObject], settled: SettledScene) -> tuple[np.ndarray, np.ndarray]:
    """Return the displacement of each centre of mass (m) and the rotation of each body (rad)."""
    moved, turned = [], []
    for placed, end in zip(objects, settled.object_to_world, strict=True):
        start, center = placed.object_to_world, placed.body.center_of_mass_m[None]
        moved.append(float(np.linalg.norm(transform_points(end, center) - transform_points(start, center))))
        turned.append(rotation_angle_rad(end[:3, :3] @ start[:3, :3].T))
    return np.array(moved), np.array(turned)


def _misplaced(
    pool: Pool, slots: Sequence[Slot], slot: Slot, placed: Sequence[PlacedParts], settled: SettledScene
) -> str | None:
    """Report a wrong contact or containment of an object; it must touch its parent, and nothing unrelated."""
    touched = settled.neighbours(slot.name)
    names = {each.name: each for each in slots}
    if slot.role == "stand":
        strange = {name for name in touched & names.keys() if not names[name].related(slot)}
        return f"it touches {min(strange)}" if strange else None
    parent = slot.parent
    assert parent is not None and parent.twin is not None and slot.twin is not None
    beside = {
        each.name for each in slots if each is not slot and each.role == slot.role == "in" and each.parent is parent
    }
    if not touched & ({parent.name} | beside):
        return f"it does not touch {parent.name}"
    strange = touched - {parent.name} - beside - {each.name for each in slots if each.parent is slot}
    if strange:
        return f"it touches {min(strange)}"
    if slot.role == "on":
        return None
    at = {each.number: i for i, each in enumerate(slots)}
    mouth = container_opening(pool.body(parent.twin.twin_id), placed[at[parent.number]].pose)
    if mouth is None:
        return f"{parent.name} does not open upward"
    own = placed[at[slot.number]]
    center = transform_points(own.pose, pool.body(slot.twin.twin_id).body.center_of_mass_m[None])[0]
    if np.linalg.norm(center[:2] - mouth.center_m[:2]) > mouth.radius_m:
        return f"its centre of mass is beside the opening of {parent.name}"
    if own.bounds[0][2] > mouth.center_m[2] - mouth.depth_m / 4:
        return f"it lies on the rim of {parent.name}"
    return None


def penetrations_m(
    slots: Sequence[Slot], placed: Sequence[PlacedParts], boxes: Sequence[StaticBox], settled: SettledScene
) -> dict[int, float]:
    """Return the penetration (m) of each object into others or the furniture: the larger of hull overlap and solver depth.

    For a pair of objects, it is attributed to the one that was placed later.
    """
    furniture = [ConvexParts.of_box(box).at(box.box_to_world) for box in boxes]
    depths = {
        slot.number: max(overlap_depth(parts, box) for box in furniture)
        for slot, parts in zip(slots, placed, strict=True)
    }
    for i, j in combinations(range(len(slots)), 2):
        later = slots[j].number
        depths[later] = max(depths[later], overlap_depth(placed[i], placed[j]))
    numbers = {slot.name: slot.number for slot in slots}
    for (_, second), depth in settled.touching.items():
        if second in numbers:
            depths[numbers[second]] = max(depths[numbers[second]], depth)
    return depths


def _least_gap(slots: Sequence[Slot], placed: Sequence[PlacedParts]) -> float:
    """Return the least distance (m) between objects that are not related by support or containment; infinite for one object."""
    every = combinations(range(len(slots)), 2)
    return least_distance([(placed[i], placed[j]) for i, j in every if not slots[i].related(slots[j])])
