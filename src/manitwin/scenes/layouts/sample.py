"""Sampling of a layout: draw objects, place them, settle them in simulation, and resample those that did not stay.

Source: paper, "Scene Layout Generation": placements and collision radii of twins, sampled without collision.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manitwin.errors import Rejected, UsageError
from manitwin.geometry.poses import quaternion_wxyz, transform_points
from manitwin.scenes.layouts.layout_validation import LayoutValidation, validate_layout
from manitwin.scenes.layouts.placing import Obstacles, Patch, clutter_of, place_on_surface, workspace_of
from manitwin.scenes.layouts.pool import Pool, PoolBody, PoolTwin, StandingPose
from manitwin.scenes.layouts.slot_sampling import sample_slots
from manitwin.scenes.layouts.slots import Slot, SupportedPose, sample_twin
from manitwin.scenes.layouts.stacking import (
    container_opening,
    level_poses,
    open_poses,
    place_in_container,
    place_on_object,
)
from manitwin.scenes.layouts.surroundings import make_cameras, make_furniture, make_lights
from manitwin.scenes.loaded_scene import furniture_boxes
from manitwin.scenes.scene import SCENE_SCHEMA_VERSION, Furniture, SceneObject, SceneRecord
from manitwin.scenes.settings import LayoutSettings

LAYOUT = "layout"
"""The stage of rejections.

Reasons are ``no_room`` for objects on the surface, ``nothing_fits`` in or on a container or base, and ``unstable``, for objects
that did not stay after repeated resampling.
"""
TWINS_TRIED, NEEDED_TWINS_TRIED = 4, 40  # for a distractor; for a required object
CARRIERS_TRIED = 8  # how often a container or base is redrawn if nothing fits
PLACES_A_TWIN = 3  # shares of the positions tried
SAME_TWIN_FAILURES = 2  # after these another twin is drawn


def sample_layout(pool: Pool, settings: LayoutSettings, seed: int, number: int) -> SceneRecord:
    """Return the layout of a number, determined by pool, settings and seed alone.

    Every object has the pose in which it came to rest in simulation. Raises Rejected (stage ``layout``) if no layout was found,
    UsageError for settings that the pool cannot satisfy, Unavailable for a robot without ``manitwin[robots]``.
    """
    rng = np.random.default_rng([seed, number])
    pool = pool.upright if settings.upright else pool
    furniture = make_furniture(settings.surface, rng)
    ambient, lights = make_lights(rng)
    making = _LayoutSampler(pool, settings, furniture, rng)
    making.place(making.slots)
    judgement, repairs = making.validate(), 0
    while judgement.wrong:
        repairs += len(judgement.wrong)
        if repairs > settings.repairs:
            worst = min(judgement.wrong)
            raise Rejected(
                "unstable",
                f"after {repairs - len(judgement.wrong)} repairs, object {worst}: {judgement.wrong[worst]}",
                LAYOUT,
            )
        making.repair(judgement.wrong)
        judgement = making.validate()
    assert judgement.measures is not None
    return SceneRecord(
        schema_version=SCENE_SCHEMA_VERSION,
        scene_id=f"layout_{seed}_{number:06d}",
        seed=seed,
        number=number,
        robot=settings.robot,
        clutter=settings.clutter,
        furniture=furniture,
        objects=_objects(making.slots, judgement),
        ambient=ambient,
        lights=lights,
        cameras=make_cameras(
            settings.surface, *_extent(pool, making.slots, judgement), np.random.default_rng([seed, number, 1])
        ),
        measures=judgement.measures,
        repairs=repairs,
    )


class _LayoutSampler:
    """A layout during sampling."""

    def __init__(self, pool: Pool, settings: LayoutSettings, furniture: Furniture, rng: np.random.Generator):
        self.pool, self.settings, self.rng = pool, settings, rng
        self.boxes = furniture_boxes(furniture)
        self.level = clutter_of(settings)
        self.crowded, self.spare_carriers = False, CARRIERS_TRIED
        self.slots = sample_slots(pool, settings, rng)
        workspace = workspace_of(settings)
        standing = [slot for slot in self.slots if slot.role == "stand"]
        areas = np.array([np.prod(support.half_extents_m) for support in furniture.supports])
        shelf_of = rng.choice(len(areas), len(standing), p=areas / areas.sum())
        self.patches: dict[int, Patch] = {}
        for index, support in enumerate(furniture.supports):
            mine = [slot for slot, chosen in zip(standing, shelf_of, strict=True) if chosen == index]
            patch = Patch.draw(support, workspace, [_radius(slot) for slot in mine] or [0.1], self.level, rng)
            if patch is None:
                raise UsageError(f"the {support.name} lies outside the workspace; give another workspace or surface")
            self.patches |= {slot.number: patch for slot in mine}

    def validate(self) -> LayoutValidation:
        return validate_layout(self.pool, self.slots, self.boxes, self.settings)

    def place(self, slots: list[Slot]) -> None:
        """Place the objects of slots, large ones and bases first; one without room is left out.

        Raises Rejected if the layout would lack a required object.
        """
        for slot in slots:
            slot.put = None
        first = sorted((s for s in slots if s.role == "stand"), key=lambda s: (not s.needed, -_radius(s), s.number))
        for slot in [*first, *(s for s in slots if s.role != "stand")]:
            if slot not in self.slots:
                continue
            slot.put = self._place_standing(slot) if slot.role == "stand" else self._place_on_or_in(slot)
            if slot.put is None and slot.parent is not None and self.spare_carriers:
                self.spare_carriers -= 1
                self._another_twin(slot.parent, frozenset())
                family = [slot.parent, *(each for each in self.slots if each.parent is slot.parent)]
                self.place([*family, *(each for each in slots if each.put is None and each not in family)])
                return
            if slot.put is None:
                self._leave_out(slot)

    def repair(self, wrong: dict[int, str]) -> None:
        """Resample wrong objects, and those on or in them."""
        again = [slot for slot in self.slots if slot.number in wrong]
        for slot in again:
            slot.failures += 1
        again += [
            slot.parent for slot in again
            if slot.parent is not None and slot.parent not in again and slot.failures % SAME_TWIN_FAILURES == 0
        ]  # fmt: skip
        again += [slot for slot in self.slots if slot.parent in again and slot not in again]
        for slot in again:
            if slot.role == "stand" and slot.failures >= SAME_TWIN_FAILURES:
                self._another_twin(slot, frozenset())
        self.place(again)

    def _another_twin(self, slot: Slot, tried: frozenset[str]) -> None:
        but = tried | ({slot.twin.twin_id} if slot.twin is not None else frozenset())
        slot.twin, slot.failures = sample_twin(self.pool, slot, self.slots, self.rng, but), 0

    def _leave_out(self, slot: Slot) -> None:
        if slot.needed or len(self.slots) <= self.settings.objects[0]:
            reason = "no_room" if slot.role == "stand" else "nothing_fits"
            what = slot.category or (
                "an object"
                if slot.role == "stand"
                else f"something {slot.role} object {slot.parent and slot.parent.number}"
            )
            raise Rejected(reason, f"no place was found for {what} among {len(self.slots)} objects", LAYOUT)
        self.slots.remove(slot)
        self.crowded = True

    def _place_standing(self, slot: Slot) -> SupportedPose | None:
        others = [each.put.parts for each in self.slots if each is not slot and each.put is not None]
        obstacles = Obstacles(self.boxes, others)
        tried: frozenset[str] = frozenset()
        twins_tried = NEEDED_TWINS_TRIED if slot.needed else 1 if self.crowded else TWINS_TRIED
        for _ in range(twins_tried):
            assert slot.twin is not None
            body = self.pool.body(slot.twin.twin_id)
            poses = _poses(slot, slot.twin, body)
            put = None
            if poses:
                put = place_on_surface(
                    body, poses, self.patches[slot.number], obstacles, gap_m=self.level.min_gap_m,
                    tries=max(1, self.settings.poses_tried // PLACES_A_TWIN), rng=self.rng,
                )  # fmt: skip
            if put is not None:
                return put
            tried |= {slot.twin.twin_id}
            self._another_twin(slot, tried)
        return None

    def _place_on_or_in(self, slot: Slot) -> SupportedPose | None:
        parent = slot.parent
        assert parent is not None and parent.twin is not None
        if parent.put is None:
            return None
        placed = [each.put.parts for each in self.slots if each is not slot and each.put is not None]
        obstacles = Obstacles(self.boxes, placed).above(-np.inf)
        base, surface = parent.put.parts, parent.put.surface
        mouth = container_opening(self.pool.body(parent.twin.twin_id), base.pose) if slot.role == "in" else None
        for _ in range(self.settings.poses_tried):
            slot.twin = sample_twin(self.pool, slot, self.slots, self.rng)
            body = self.pool.body(slot.twin.twin_id)
            if slot.role == "on":
                put = place_on_object(slot.twin, body, surface, base, obstacles, self.rng)
            else:
                put = (
                    None if mouth is None else place_in_container(slot.twin, body, surface, mouth, obstacles, self.rng)
                )
            if put is not None:
                return put
        return None


def _poses(slot: Slot, twin: PoolTwin, body: PoolBody) -> Sequence[StandingPose]:
    """Return the placements that a slot allows: any, or those in which it can hold or support something."""
    if slot.vessel:
        return open_poses(twin, body)
    return level_poses(twin, body) if slot.base else twin.poses


def _extent(pool: Pool, slots: list[Slot], judgement: LayoutValidation) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper corner ``(3,)`` of the bounding box of all objects in the world."""
    points = np.concatenate(
        [
            transform_points(pose, np.concatenate(pool.body(slot.twin.twin_id).body.hulls))
            for slot, pose in zip(slots, judgement.object_to_world, strict=True)
            if slot.twin is not None
        ]
    )
    return points.min(0), points.max(0)


def _radius(slot: Slot) -> float:
    """Return the mean collision radius of a twin's placements, weighted by probability."""
    assert slot.twin is not None
    weights = [pose.probability + 1e-6 for pose in slot.twin.poses]
    return float(np.average([pose.collision_radius_m for pose in slot.twin.poses], weights=weights))


def _objects(slots: list[Slot], judgement: LayoutValidation) -> tuple[SceneObject, ...]:
    names = {slot.number: f"object_{i:02d}" for i, slot in enumerate(slots)}
    found = []
    for slot, pose in zip(slots, judgement.object_to_world, strict=True):
        assert slot.twin is not None and slot.put is not None
        x, y, z = (float(v) for v in pose[:3, 3])
        w, i, j, k = (float(v) for v in quaternion_wxyz(pose[:3, :3]))
        found.append(
            SceneObject(
                name=names[slot.number],
                twin_id=slot.twin.twin_id,
                revision=slot.twin.revision,
                category=slot.twin.category,
                placement=slot.put.placement,
                position_m=(x, y, z),
                quaternion_wxyz=(w, i, j, k),
                supported_by=None if slot.parent is None else names[slot.parent.number],
                relation="in" if slot.role == "in" else "on",
                surface=slot.put.surface,
                body_sha256=slot.twin.body_sha256,
            )
        )
    return tuple(found)
