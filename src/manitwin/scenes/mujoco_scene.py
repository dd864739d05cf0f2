"""Scene in MuJoCo: bodies with their own mass properties, furniture of boxes, contacts with MuJoCo's default softness."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco

from manitwin.geometry.rigid_body import FURNITURE_FRICTION, PlacedObject, StaticBox
from manitwin.physics.mujoco.body import (
    SOFT_SOLREF,
    TIMESTEP_S,
    add_body,
    add_box,
    add_hulls,
    contact_parameters,
    new_spec,
)


def to_mujoco(boxes: Iterable[StaticBox], placed_objects: Iterable[PlacedObject]) -> mujoco.MjModel:
    """Return a model of furniture and objects, each a body with a free joint of its name; ``qpos0`` has the given poses.

    MuJoCo uses the larger friction of two touching bodies, whereas PhysX uses the mean.
    """
    spec = new_spec(TIMESTEP_S)
    contact = contact_parameters(FURNITURE_FRICTION, SOFT_SOLREF)
    for box in boxes:
        add_box(spec.worldbody, box.box_to_world, box.half_extents_m, contact, name=box.name)
    meshes: dict[str, list[str]] = {}
    for placed in placed_objects:
        body = placed.body
        if placed.twin_id not in meshes:
            meshes[placed.twin_id] = add_hulls(spec, placed.twin_id, body)
        own = contact_parameters(body.friction_static, SOFT_SOLREF)
        add_body(spec, placed.name, body, meshes[placed.twin_id], own, object_to_world=placed.object_to_world)
    return spec.compile()
