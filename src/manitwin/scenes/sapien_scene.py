"""Scene in SAPIEN 3: bodies and furniture, with render shapes if the scene has a renderer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import sapien
from sapien import physx

from manitwin.geometry.poses import quaternion_wxyz
from manitwin.geometry.rigid_body import PlacedObject, StaticBox
from manitwin.physics.sapien.body import CONTACT_OFFSET_M, SOLVER_ITERATIONS, add_body, iterations_beside, static_box
from manitwin.physics.sapien.visuals import box_visual
from manitwin.scenes.scene import SceneRecord
from manitwin.twin.loaded_twin import Twin

PLAIN_COLORS: dict[str, tuple[float, float, float]] = {
    "wood": (0.45, 0.28, 0.15),
    "metal": (0.56, 0.57, 0.58),
    "marble": (0.85, 0.84, 0.82),
    "cloth": (0.35, 0.42, 0.55),
}
"""Linear RGB of furniture materials without a texture."""


@dataclass(frozen=True)
class SapienEntities:
    """The entities of a scene by the names in its record."""

    objects: dict[str, Any]
    furniture: dict[str, Any]


def add_to_sapien(
    scene: Any,
    record: SceneRecord,
    boxes: Sequence[StaticBox],
    placed_objects: Sequence[PlacedObject],
    twin: Callable[[str], Twin],
    *,
    visual: bool = True,
) -> SapienEntities:
    """Add a recorded layout to a SAPIEN scene: the ``boxes`` of its furniture, and its objects, looked up by ``twin``.

    With ``visual``: textured meshes, plainly coloured furniture and lights.
    """
    materials = {box.name: box.material for box in record.furniture.boxes}
    furniture = {}
    for box in boxes:
        entity = static_box(box, contact_offset_m=CONTACT_OFFSET_M)
        if visual:
            entity.add_component(box_visual(box.half_extents_m, PLAIN_COLORS[materials[box.name]]))
        scene.add_entity(entity)
        furniture[box.name] = entity
    objects = {}
    counts = iterations_beside([placed.body.mass_kg for placed in placed_objects], SOLVER_ITERATIONS)
    for placed, count in zip(placed_objects, counts, strict=True):
        its_twin = twin(placed.twin_id)
        entity = add_body(
            scene,
            placed.body,
            restitution=its_twin.physical.restitution.value,
            pose=sapien.Pose(placed.object_to_world[:3, 3], quaternion_wxyz(placed.object_to_world[:3, :3])),
            contact_offset_m=CONTACT_OFFSET_M,
            visual_glb=its_twin.folder / "visual.glb" if visual else None,
            name=placed.name,
        )
        component = entity.find_component_by_type(physx.PhysxRigidDynamicComponent)
        component.set_solver_position_iterations(count)
        objects[placed.name] = entity
    if visual:
        scene.set_ambient_light(list(record.ambient))
        for light in record.lights:
            scene.add_directional_light(list(light.direction), list(light.color), shadow=light.casts_shadow)
    return SapienEntities(objects, furniture)
