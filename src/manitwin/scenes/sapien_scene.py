"""A scene in SAPIEN 3: bodies, furniture, and their looks where the scene has a renderer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sapien
from sapien import physx

from manitwin.geometry.placed_object import StaticBox
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.physics.sapien.body import add_body
from manitwin.scenes.loaded_scene import Scene

FURNITURE_FRICTION = 0.5
"""Static and dynamic, of every piece of furniture."""

CONTACT_OFFSET_M = 0.002
"""As in physics/sapien/settle.py. At SAPIEN's own 10 mm PhysX may take two thin things 14 mm apart for deep in each other,
and throws them across the room: 1 of 250 layouts of real twins."""

SOLVER_ITERATIONS = 20

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
        entity = static_entity(box, contact_offset_m=CONTACT_OFFSET_M)
        if visual:
            entity.add_component(_looks(box, PLAIN_COLORS[materials[box.name]]))
        scene.add_entity(entity)
        furniture[box.name] = entity
    objects = {}
    for placed in layout.placed_objects():
        twin = layout.twin(placed.twin_id)
        entity = add_body(
            scene,
            placed.body,
            restitution=twin.physical.restitution.value,
            pose=sapien.Pose(placed.object_to_world[:3, 3], quaternion_wxyz(placed.object_to_world[:3, :3])),
            visual_glb=twin.folder / "visual.glb" if visual else None,
            name=placed.name,
        )
        component = entity.find_component_by_type(physx.PhysxRigidDynamicComponent)
        component.set_solver_position_iterations(SOLVER_ITERATIONS)
        for shape in component.collision_shapes:
            shape.contact_offset = CONTACT_OFFSET_M
        objects[placed.name] = entity
    if visual:
        scene.set_ambient_light(list(layout.record.ambient))
        for light in layout.record.lights:
            scene.add_directional_light(list(light.direction), list(light.color), shadow=light.casts_shadow)
    return SapienEntities(objects, furniture)


def static_entity(box: StaticBox, *, contact_offset_m: float) -> sapien.Entity:
    """Return a box of furniture as an entity that no scene has yet."""
    material = physx.PhysxMaterial(FURNITURE_FRICTION, FURNITURE_FRICTION, 0.0)
    shape = physx.PhysxCollisionShapeBox(box.half_extents_m, material)
    shape.contact_offset = contact_offset_m
    component = physx.PhysxRigidStaticComponent()
    component.attach(shape)
    entity = sapien.Entity()
    entity.name = box.name
    entity.add_component(component)
    entity.pose = sapien.Pose(box.box_to_world[:3, 3], quaternion_wxyz(box.box_to_world[:3, :3]))
    return entity


def _looks(box: StaticBox, color: tuple[float, float, float]) -> Any:
    from sapien import render

    material = render.RenderMaterial()
    material.base_color = [*color, 1.0]
    material.roughness, material.metallic = 0.7, 0.0
    component = render.RenderBodyComponent()
    component.attach(render.RenderShapeBox(box.half_extents_m, material))
    return component
