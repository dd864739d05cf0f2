"""Layout from a located view: twins at their located poses, settled in physics, and boxes for other visible obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.geometry.hull_distance import least_distance
from manitwin.geometry.poses import quaternion_wxyz, rotation_angle_rad, transform_points
from manitwin.physics.sapien.settle import SettledScene, settle_scene
from manitwin.scenes.layouts.surroundings import make_cameras, make_lights
from manitwin.scenes.loaded_scene import furniture_boxes
from manitwin.scenes.locate.depth_view import DepthView
from manitwin.scenes.locate.located_furniture import located_furniture, triple
from manitwin.scenes.locate.located_objects import LocatedObject, located_objects
from manitwin.scenes.locate.recognition import ViewedObject
from manitwin.scenes.locate.world_frame import WorldFrame
from manitwin.scenes.scene import SCENE_SCHEMA_VERSION, Furniture, SceneMeasures, SceneObject, SceneRecord
from manitwin.scenes.settings import LayoutSettings
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.record_digests import body_sha256

LOCATED = "located"
"""The ``clutter`` of a scene that was observed instead of sampled."""
GIVE_UP = 3.0  # multiple of the motion limit beyond which the simulation is stopped


@dataclass(frozen=True)
class LocatedScene:
    """The layout (None if nothing stays where it was found) with its furniture and objects.

    ``rest (N, 4, 4)`` are the settled poses of the objects. ``left_out`` counts obstacle boxes that overlapped an object.
    ``as_boxes`` are the objects that did not stay, with the reason; the layout represents them by boxes like unknown obstacles.
    """

    record: SceneRecord | None
    world: WorldFrame
    furniture: Furniture | None
    objects: tuple[LocatedObject, ...]
    rest: np.ndarray
    left_out: int
    as_boxes: tuple[tuple[LocatedObject, str], ...]

    @property
    def motions(self) -> list[tuple[float, float]]:
        """Displacement of each object from where it was found: of its centre of mass, m, and its rotation, rad."""
        return [_motion(each, each.seen, end) for each, end in zip(self.objects, self.rest, strict=True)]

    def place_of(self, thing: ViewedObject) -> int | None:
        """Return the index of a located object; None if it is not in the layout."""
        return next((number for number, each in enumerate(self.objects) if each.thing is thing), None)


def scene_id_of(seed: int) -> str:
    """Return the id of the scene of a located view."""
    return f"{LOCATED}_{seed}_000000"


def located_scene(
    view: DepthView, things: Sequence[tuple[ViewedObject, Twin]], world: WorldFrame, robot: str | None, seed: int
) -> LocatedScene:
    """Return the layout of the objects found in a view, at least one of which has a pose.

    All objects are released at once in PhysX, with the limits of ``manitwin layout``. Among those that move by more than 1 cm,
    turn by more than 5 degrees, or do not come to rest, the one that moves most is replaced by boxes, and the others are
    released again. The result is deterministic.
    """
    objects, settings = located_objects(things, world), LayoutSettings()
    as_boxes: list[tuple[LocatedObject, str]] = []
    while objects:
        furniture, left_out = located_furniture(view, objects, world)
        settled = settle_scene(
            [each.placed for each in objects],
            furniture_boxes(furniture),
            seconds=settings.settle_s,
            give_up_m=[GIVE_UP * settings.max_moved_m] * len(objects),
        )
        reasons = [_motion_defect(place, each, settled, settings) for place, each in enumerate(objects)]
        if not any(reasons):
            record = _record(objects, settled, furniture, robot, seed)
            return LocatedScene(record, world, furniture, objects, settled.object_to_world, left_out, tuple(as_boxes))
        moved = [
            _motion(each, each.placed.object_to_world, end)[0] if reason else -1.0
            for each, end, reason in zip(objects, settled.object_to_world, reasons, strict=True)
        ]
        worst = int(np.argmax(moved))
        as_boxes.append((objects[worst], reasons[worst]))
        objects = objects[:worst] + objects[worst + 1 :]
    return LocatedScene(None, world, None, (), np.zeros((0, 4, 4)), 0, tuple(as_boxes))


def _motion_defect(place: int, each: LocatedObject, settled: SettledScene, settings: LayoutSettings) -> str:
    """Return why an object does not stay after its release; empty if it stays."""
    moved_m, turned_rad = _motion(each, each.placed.object_to_world, settled.object_to_world[place])
    when = "when it is let go where it was found"
    if settled.lost[place] or moved_m > settings.max_moved_m:
        return f"moves by {1000 * moved_m:.0f} mm {when}"
    if turned_rad > np.radians(settings.max_turned_deg):
        return f"turns by {np.degrees(turned_rad):.0f} degrees {when}"
    return "" if settled.at_rest[place] else f"does not come to rest {when}"


def _record(
    objects: Sequence[LocatedObject], settled: SettledScene, furniture: Furniture, robot: str | None, seed: int
) -> SceneRecord:
    rested = list(zip(objects, settled.object_to_world, strict=True))
    bearers = [_supporting_object(place, objects, settled) for place in range(len(objects))]
    names, parts = [each.placed.name for each in objects], [each.parts_at(end) for each, end in rested]
    gap_m = least_distance(
        [
            (parts[i], parts[j])
            for i in range(len(parts))
            for j in range(i)
            if bearers[i] != names[j] and bearers[j] != names[i]
        ]
    )
    corners = np.concatenate([transform_points(end, np.concatenate(each.placed.body.hulls)) for each, end in rested])
    motions = [_motion(each, each.placed.object_to_world, end) for each, end in rested]
    ambient, lights = make_lights(np.random.default_rng([seed, 0]))
    return SceneRecord(
        schema_version=SCENE_SCHEMA_VERSION,
        scene_id=scene_id_of(seed),
        seed=seed,
        number=0,
        robot=robot,
        clutter=LOCATED,
        furniture=furniture,
        objects=tuple(_scene_object(each, end, bearer) for (each, end), bearer in zip(rested, bearers, strict=True)),
        ambient=ambient,
        lights=lights,
        cameras=make_cameras("table", corners.min(0), corners.max(0), np.random.default_rng([seed, 0, 1])),
        measures=SceneMeasures(
            max_moved_m=max(moved for moved, _ in motions),
            max_turned_rad=max(turned for _, turned in motions),
            max_penetration_m=max(settled.touching.values(), default=0.0),
            min_gap_m=gap_m if np.isfinite(gap_m) else None,
        ),
        repairs=0,
    )


def _supporting_object(place: int, objects: Sequence[LocatedObject], settled: SettledScene) -> str | None:
    """Return the located object that supports an object; None for the table or an unknown obstacle."""
    own = objects[place].placed.name
    touched = settled.neighbours(own)
    if "table" in touched:
        return None
    height = {each.placed.name: settled.object_to_world[i][2, 3] for i, each in enumerate(objects)}
    below = [name for name in touched if name in height and height[name] < height[own]]
    return min(below, key=lambda name: (height[name], name), default=None)


def _scene_object(each: LocatedObject, pose: np.ndarray, bearer: str | None) -> SceneObject:
    record = each.twin.record
    w, i, j, k = (float(v) for v in quaternion_wxyz(pose[:3, :3]))
    return SceneObject(
        name=each.placed.name,
        twin_id=record.twin_id,
        revision=record.revision,
        category=record.language.category if record.language else "unknown",
        placement=each.placement,
        position_m=triple(pose[:3, 3]),
        quaternion_wxyz=(w, i, j, k),
        supported_by=bearer,
        body_sha256=body_sha256(record.model_dump(mode="json")),
    )


def _motion(each: LocatedObject, before: np.ndarray, after: np.ndarray) -> tuple[float, float]:
    """Return the displacement of the centre of mass, m, and the rotation of the object, rad."""
    first, second = (transform_points(pose, each.placed.body.center_of_mass_m[None])[0] for pose in (before, after))
    return float(np.linalg.norm(second - first)), rotation_angle_rad(after[:3, :3] @ before[:3, :3].T)
