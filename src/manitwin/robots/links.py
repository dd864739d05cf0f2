"""The links of a whole robot with their collision shapes as convex hulls, read once per process."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]

from manitwin.errors import UsageError
from manitwin.geometry.poses import inverse, transform_points
from manitwin.geometry.rigid_body import principal_frame
from manitwin.robots.grippers.urdf import Link, link_poses, read_urdf
from manitwin.robots.urdf_tree import UrdfTree


@lru_cache(maxsize=16)
def links_of_urdf(urdf: str) -> tuple[Link, ...]:
    """Return the links of a robot's URDF text, parents first; meshes, named by absolute path, as their convex hulls.

    Raises UsageError where a mesh cannot be read.
    """
    with tempfile.TemporaryDirectory(prefix="manitwin_robot_") as folder:
        path = Path(folder) / "robot.urdf"
        path.write_text(urdf)
        try:
            return read_urdf(path, Path(path.anchor))
        except UsageError:
            raise
        except Exception as error:  # mesh readers raise whatever they stumble over, without the file's name
            reason = " ".join(str(error).split())[:120]
            name = _unreadable_mesh(urdf)
            raise UsageError(f"{name}: no mesh that has a convex hull ({reason}); mend or replace it") from error


def _unreadable_mesh(urdf: str) -> str:
    """Return the first collision mesh that has no hull."""
    meshes = UrdfTree("robot", etree.fromstring(urdf)).collision_meshes()
    for path in meshes:
        try:
            trimesh.convex.convex_hull(trimesh.load_mesh(path))
        except Exception:  # as above
            return str(path)
    return "a collision mesh"


def poses_at(links: tuple[Link, ...], joints: dict[str, float]) -> dict[str, np.ndarray]:
    """Return each link's pose ``(4, 4)`` in the root's frame at joint positions by name (rad, or m), else zero."""
    return {link.name: pose for link, pose in zip(links, link_poses(links, joints), strict=True)}


@lru_cache(maxsize=16)
def bodies_of_urdf(urdf: str, palm: str) -> tuple[tuple[Link, ...], dict[str, tuple[str, np.ndarray]]]:
    """Return the robot's bodies: every link with all that is fixed to it, but the palm apart from the wrist.

    Each joint less saves a simulation time; the palm is a body of its own since it may touch what the wrist may not. Also
    returns for every link the name of the body it is part of, and its pose ``(4, 4)`` in that.
    """
    links = links_of_urdf(urdf)
    part_of: dict[str, tuple[str, np.ndarray]] = {}
    members: dict[str, list[tuple[Link, np.ndarray]]] = {}
    for link in links:
        if link.parent < 0 or link.joint_type != "fixed" or link.name == palm:
            part_of[link.name] = (link.name, np.eye(4))
        else:
            owner, parent_to_owner = part_of[links[link.parent].name]
            part_of[link.name] = (owner, parent_to_owner @ link.joint_to_parent @ inverse(link.joint_to_link))
        owner, pose = part_of[link.name]
        members.setdefault(owner, []).append((link, pose))
    order = list(members)
    return tuple(_joined(links, members[name], part_of, order) for name in order), part_of


def _joined(
    links: tuple[Link, ...],
    members: list[tuple[Link, np.ndarray]],
    part_of: dict[str, tuple[str, np.ndarray]],
    order: list[str],
) -> Link:
    """Return the first of the members as one body with the others (the parallel axis theorem)."""
    first = members[0][0]
    shapes = tuple(
        replace(shape, shape_to_link=pose @ shape.shape_to_link) for link, pose in members for shape in link.shapes
    )
    masses = np.array([link.mass_kg for link, _ in members])
    centers = np.array([transform_points(pose, link.center_of_mass_m[None])[0] for link, pose in members])
    mass_kg = float(masses.sum())
    center = masses @ centers / mass_kg if mass_kg > 0 else np.zeros(3)
    inertia = np.zeros((3, 3))
    for (link, pose), mass, point in zip(members, masses, centers, strict=True):
        axes, arm = pose[:3, :3] @ link.principal_axes, point - center
        inertia += axes @ np.diag(link.moments_kg_m2) @ axes.T + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    moments, axes = principal_frame(inertia)
    parent, joint_to_parent = -1, first.joint_to_parent
    if first.parent >= 0:
        owner, parent_to_owner = part_of[links[first.parent].name]
        parent, joint_to_parent = order.index(owner), parent_to_owner @ first.joint_to_parent
    return replace(
        first,
        parent=parent,
        joint_to_parent=joint_to_parent,
        mass_kg=mass_kg,
        center_of_mass_m=center,
        moments_kg_m2=moments,
        principal_axes=axes,
        shapes=shapes,
    )
