"""A stationary arm as an obstacle for another one: each link as convex hulls at given joint positions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh

from manitwin.geometry.boxes import box_corners
from manitwin.geometry.poses import transform_points
from manitwin.geometry.rigid_body import PlacedObject, RigidBody
from manitwin.robots.links import Link, LinkShape, poses_at, read_urdf_links
from manitwin.robots.robot import Robot


class ArmObstacles:
    """Links of one of two arms as bodies, built once and named like the robot's links."""

    def __init__(self, arm: Robot):
        """Take the shapes of the arm's links."""
        self._arm, self._links = arm, read_urdf_links(arm.urdf)
        self._bodies = {link.name: _body_of(link) for link in self._links if link.shapes}

    def at(self, joints_rad: np.ndarray, openings_m: Sequence[float]) -> tuple[PlacedObject, ...]:
        """Return the arm at joints ``(n,)``, with a copy of its fingers at each of the openings, which covers their motion."""
        placed = list[PlacedObject]()
        for number, opening_m in enumerate(openings_m):
            joints = dict(zip(self._arm.arm_joints, np.asarray(joints_rad, float).tolist(), strict=True))
            joints |= dict.fromkeys(self._arm.finger_joints, opening_m / 2)
            poses = poses_at(self._links, joints)
            placed += [
                PlacedObject(name, name, body, poses[name])
                for name, body in self._bodies.items()
                if number == 0 or name in self._arm.finger_links
            ]
        return tuple(placed)


def _body_of(link: Link) -> RigidBody:
    """Return a link's shapes as a body for planning, which uses only the hulls."""
    hulls = tuple(_corners_of(shape) for shape in link.shapes)
    return RigidBody(hulls, max(link.mass_kg, 1.0), np.zeros(3), np.eye(3), 0.5, 0.5)


def _corners_of(shape: LinkShape) -> np.ndarray:
    """Return the vertices ``(V, 3)`` of a shape's convex hull in the link frame; spheres become icospheres of 80 triangles."""
    if shape.half_extents_m is not None:
        return box_corners(shape.half_extents_m, shape.shape_to_link)
    if shape.radius_m is not None:
        ball = trimesh.creation.icosphere(subdivisions=1, radius=shape.radius_m)
        return transform_points(shape.shape_to_link, np.asarray(ball.vertices))
    if shape.corners_m is None:
        raise AssertionError("a shape is a box, a sphere or corners")
    return transform_points(shape.shape_to_link, shape.corners_m)
