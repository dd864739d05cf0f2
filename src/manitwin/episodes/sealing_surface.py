"""The true surface of what a suction cup is to hold: hulls smooth over what a lip must follow."""

from __future__ import annotations

from dataclasses import replace

import trimesh

from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.suction import SuctionGripper
from manitwin.twin.loaded_twin import Twin


def with_surface(placed: PlacedObject, twin: Twin, gripper: Gripper) -> PlacedObject:
    """Return an object with the surface that its twin shows, where a cup is to seal on it; for other grippers, as it is."""
    if not isinstance(gripper, SuctionGripper):
        return placed
    vertices, faces = trimesh.util.append_faces([m.vertices for m in twin.visual], [m.faces for m in twin.visual])
    surface = RayCaster(trimesh.Trimesh(vertices, faces, process=False))
    return replace(placed, body=replace(placed.body, surface=surface))
