"""True surface of objects for suction cups, because hulls smooth over features that a lip must follow."""

from __future__ import annotations

from dataclasses import replace

import trimesh

from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.suction import SuctionGripper
from manitwin.twin.loaded_twin import Twin


def with_surface(placed: PlacedObject, twin: Twin, gripper: Gripper) -> PlacedObject:
    """Return the object with its twin's visual surface if the gripper is a suction cup, otherwise unchanged."""
    if not isinstance(gripper, SuctionGripper):
        return placed
    vertices, faces = trimesh.util.append_faces([m.vertices for m in twin.visual], [m.faces for m in twin.visual])
    surface = RayCaster(trimesh.Trimesh(vertices, faces, process=False))
    return replace(placed, body=replace(placed.body, surface=surface))
