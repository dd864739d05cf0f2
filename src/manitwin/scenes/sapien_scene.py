"""A scene in SAPIEN 3: bodies, furniture, and their visuals where the scene has a renderer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sapien
from sapien import physx

from manitwin.geometry.poses import quaternion_wxyz
from manitwin.physics.sapien.body import CONTACT_OFFSET_M, SOLVER_ITERATIONS, add_body, iterations_beside, static_box
from manitwin.physics.sapien.visuals import box_visual
from manitwin.scenes.loaded_scene import Scene

PLAIN_COLORS: dict[str, tuple[float, float, float]] = {
    "wood": (0.45, 0.28, 0.15),
    "metal": (0.56, 0.57, 0.58),
    "marble": (0.85, 0.84, 0.82),
    "cloth": (0.35, 0.42, 0.55),
}
"""Linear RGB of the materials of furniture, where they have no texture."""


@dataclass(frozen=True)
class SapienEntities:
    """The entities of a scene by the names in its record."""

    objects: dict[str, Any]
    furniture: dict[str, Any]


def add_to_sapien(scene: Any, layout: Scene, *, visual: bool = True) -> SapienEntities:
    """Add a layout to a SAPIEN scene; with ``visual`` textured meshes, plainly coloured furniture and the lights."""
    materials = {box.name: box.material for box in layout.record.furniture.boxes}
    furniture = {}
    for box in layout.static_boxes():
        entity = static_box(box, contact_offset_m=CONTACT_OFFSET_M)
        if visual:
            entity.add_component(box_visual(box.half_extents_m, PLAIN_COLORS[materials[box.name]]))
        scene.add_entity(entity)
        furniture[box.name] = entity
    objects, placed_objects = {}, list(layout.placed_objects())
    counts = iterations_beside([placed.body.mass_kg for placed in placed_objects], SOLVER_ITERATIONS)
    for placed, count in zip(placed_objects, counts, strict=True):
        twin = layout.twin(placed.twin_id)
        entity = add_body(
            scene,
            placed.body,
            restitution=twin.physical.restitution.value,
            pose=sapien.Pose(placed.object_to_world[:3, 3], quaternion_wxyz(placed.object_to_world[:3, :3])),
            contact_offset_m=CONTACT_OFFSET_M,
            visual_glb=twin.folder / "visual.glb" if visual else None,
            name=placed.name,
        )
        component = entity.find_component_by_type(physx.PhysxRigidDynamicComponent)
        component.set_solver_position_iterations(count)
        objects[placed.name] = entity
    if visual:
        scene.set_ambient_light(list(layout.record.ambient))
        for light in layout.record.lights:
            scene.add_directional_light(list(light.direction), list(light.color), shadow=light.casts_shadow)
    return SapienEntities(objects, furniture)
