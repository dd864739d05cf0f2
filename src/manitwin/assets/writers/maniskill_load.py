"""Load the objects in this folder into ManiSkill 3 or plain SAPIEN 3, with their true mass, inertia and friction.

    from load import object_builder, object_names
    builder = object_builder(scene, object_names()[0])
    actor = builder.build(name="object")

``scene`` is a ManiSkillScene (``self.scene`` in a task's ``_load_scene``) or a sapien.Scene. ManiSkill's own loaders use one
density for all shapes; these objects have a measured or estimated mass, centre of mass and inertia instead.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import sapien
from sapien import physx

FOLDER = Path(__file__).resolve().parent
Y_UP_TO_Z_UP_WXYZ = [0.5**0.5, 0.5**0.5, 0.0, 0.0]  # the GLB is Y-up; SAPIEN does not turn it


def object_names() -> list[str]:
    """Return the names of the objects in this folder."""
    return sorted(_info())


def object_builder(scene: Any, name: str, *, visual: bool = True) -> Any:
    """Return the actor builder of an object, whose frame is +Z up with the origin at the bottom centre.

    The initial pose is upright on z = 0; change it with ``builder.initial_pose`` before ``build``. ``visual`` requires a render
    system.
    """
    info = _info()[name]
    folder = FOLDER / "models" / name
    builder = scene.create_actor_builder()
    builder.add_multiple_convex_collisions_from_file(
        filename=str(folder / "collision.ply"),
        material=physx.PhysxMaterial(info["friction_static"], info["friction_dynamic"], info["restitution"]),
        density=info["density"],
    )
    if visual:
        builder.add_visual_from_file(filename=str(folder / "visual.glb"), pose=sapien.Pose(q=Y_UP_TO_Z_UP_WXYZ))
    center_of_mass = sapien.Pose(info["center_of_mass_m"], info["principal_axes_quaternion_wxyz"])
    builder.set_mass_and_inertia(info["mass_kg"], center_of_mass, info["principal_moments_kg_m2"])
    builder.initial_pose = sapien.Pose()
    return builder


def resting_poses(name: str) -> list[sapien.Pose]:
    """Return the stable poses on the plane z = 0, most probable first."""
    return [sapien.Pose(rest["position_m"], rest["quaternion_wxyz"]) for rest in _info()[name]["resting_poses"]]


def _info() -> dict[str, Any]:
    content: dict[str, Any] = json.loads((FOLDER / "info_raw.json").read_text(encoding="utf-8"))
    return content
