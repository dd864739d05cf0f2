"""Links of a robot or hand for simulation: joints, mass properties and convex collision shapes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]

from manitwin.formats.xml_file import read_xml
from manitwin.geometry.poses import inverse, rotation_between, transform, transform_points
from manitwin.geometry.rigid_body import principal_frame
from manitwin.robots.urdf import UrdfTree, child_of, geometry_of, inertial_of, origin_of, parent_of, values_of

MESH_SUFFIXES = (".stl", ".obj", ".dae", ".ply", ".glb", ".gltf")


@dataclass(frozen=True)
class LinkShape:
    """Convex collision shape of a link: a box (``half_extents_m``), a sphere (``radius_m``) or a hull (``corners_m (V, 3)``)."""

    shape_to_link: np.ndarray
    half_extents_m: np.ndarray | None = None
    radius_m: float | None = None
    corners_m: np.ndarray | None = None

    def bounding_box(self) -> tuple[np.ndarray, np.ndarray]:
        """Return ``(box_to_link (4, 4), half_extents_m (3,))`` of the shape's bounding box."""
        if self.half_extents_m is not None:
            return self.shape_to_link, self.half_extents_m
        if self.radius_m is not None:
            return self.shape_to_link, np.full(3, self.radius_m)
        if self.corners_m is None:
            raise AssertionError("a shape is a box, a sphere or corners")
        low, high = self.corners_m.min(0), self.corners_m.max(0)
        return self.shape_to_link @ transform(translation=(low + high) / 2), (high - low) / 2

    def to_mesh(self) -> trimesh.Trimesh:
        """Return the shape as a mesh in the link frame; a sphere as an inscribed icosphere of 1280 triangles."""
        if self.half_extents_m is not None:
            mesh = trimesh.creation.box(2 * self.half_extents_m)
        elif self.radius_m is not None:
            mesh = trimesh.creation.icosphere(3, self.radius_m)
        elif self.corners_m is not None:
            mesh = trimesh.convex.convex_hull(self.corners_m)
        else:
            raise AssertionError("a shape is a box, a sphere or corners")
        return mesh.apply_transform(self.shape_to_link)


@dataclass(frozen=True)
class Link:
    """A link with its parent joint.

    ``parent`` is the index of the parent link (-1 for the root). ``joint_to_parent`` is the joint frame, whose X axis is the
    joint axis, in the parent's frame; ``joint_to_link`` is the same frame in the link's own. ``limits`` are in rad, or m for
    a prismatic joint. ``moments_kg_m2 (3,)`` are the principal moments about ``center_of_mass_m (3,)``,
    ``principal_axes (3, 3)`` their axes in the link frame.
    """

    name: str
    parent: int
    joint: str
    joint_type: str
    joint_to_parent: np.ndarray
    joint_to_link: np.ndarray
    limits: tuple[float, float]
    mass_kg: float
    center_of_mass_m: np.ndarray
    moments_kg_m2: np.ndarray
    principal_axes: np.ndarray
    shapes: tuple[LinkShape, ...]

    @cached_property
    def link_to_joint(self) -> np.ndarray:
        """The link frame in the joint frame, ``(4, 4)``."""
        return np.linalg.inv(self.joint_to_link)


def read_links(tree: UrdfTree, find_mesh: Callable[[str], Path]) -> tuple[Link, ...]:
    """Return the links of a checked URDF, parents before children; ``find_mesh`` maps mesh names to files.

    Meshes become their convex hulls; visuals are ignored. Raises the tree's error if a joint has no limits or a mesh has no
    convex hull.
    """
    holders = {child_of(joint): joint for joint in tree.joints.values()}
    links, order = tree.links, tree.subtree_links(*tree.roots())
    return tuple(_link(tree, find_mesh, links[name], holders.get(name), order) for name in order)


def _link(
    tree: UrdfTree,
    find_mesh: Callable[[str], Path],
    element: etree._Element,
    joint: etree._Element | None,
    order: tuple[str, ...],
) -> Link:
    name = element.get("name")
    shapes = tuple(
        _shape(tree, find_mesh, collision, f"link {name!r} collision {index}")
        for index, collision in enumerate(element.findall("collision"))
    )
    mass_kg, center_m, inertia = _mass_properties(element)
    moments, axes = principal_frame(inertia)
    common = (mass_kg, center_m, moments, axes, shapes)
    if joint is None:
        return Link(name, -1, "", "fixed", np.eye(4), np.eye(4), (0.0, 0.0), *common)
    holder = joint.get("name")
    limits, axis = (-np.inf, np.inf), joint.find("axis")
    if joint.get("type") in ("revolute", "prismatic"):
        limit = joint.find("limit")
        if limit is None or limit.get("lower") is None or limit.get("upper") is None:
            raise tree.make_error(f"joint {holder!r}", "lacks lower or upper of its <limit>", "give both")
        limits = float(limit.get("lower")), float(limit.get("upper"))
    direction = np.zeros(3) if axis is None else values_of(axis, "xyz")
    if not direction.any():  # the default axis is X; a fixed joint may have zeros
        direction = np.array([1.0, 0, 0])
    along_axis = transform(rotation_between(np.array([1.0, 0, 0]), direction / np.linalg.norm(direction)))
    parent = order.index(parent_of(joint))
    return Link(name, parent, holder, joint.get("type"), origin_of(joint) @ along_axis, along_axis, limits, *common)


def _mass_properties(link: etree._Element) -> tuple[float, np.ndarray, np.ndarray]:
    """Return a link's mass, centre of mass and inertia tensor about it along the link's axes; zeros without ``<inertial>``."""
    declared = inertial_of(link)
    if declared is None:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    mass_kg, pose, tensor = declared
    assert mass_kg is not None and tensor is not None, "checked when the URDF was read"
    return mass_kg, pose[:3, 3], pose[:3, :3] @ tensor @ pose[:3, :3].T


def _shape(tree: UrdfTree, find_mesh: Callable[[str], Path], collision: etree._Element, where: str) -> LinkShape:
    pose, shape = origin_of(collision), geometry_of(collision)
    if shape.tag == "box":
        return LinkShape(pose, half_extents_m=values_of(shape, "size") / 2)
    if shape.tag == "sphere":
        return LinkShape(pose, radius_m=float(shape.get("radius")))
    if shape.tag == "cylinder":
        cylinder = trimesh.creation.cylinder(float(shape.get("radius")), float(shape.get("length")), sections=24)
        return LinkShape(pose, corners_m=np.asarray(cylinder.vertices))
    hull = _hull(tree, find_mesh(shape.get("filename")), where)
    return LinkShape(pose, corners_m=hull * values_of(shape, "scale", "1 1 1"))


def _hull(tree: UrdfTree, path: Path, where: str) -> np.ndarray:
    """Return the vertices ``(V, 3)`` of a mesh's convex hull."""
    if path.suffix.lower() not in MESH_SUFFIXES:
        raise tree.make_error(f"the mesh of {where}", f"is {path}", f"valid are {', '.join(MESH_SUFFIXES)}")
    if path.suffix.lower() == ".dae":
        # refuses XML entities before the mesh library reads it
        read_xml(path, "COLLADA", name=str(path), refusal=tree.error)
    try:
        return np.asarray(trimesh.convex.convex_hull(trimesh.load_mesh(path)).vertices)
    except Exception as error:  # mesh readers raise arbitrary exceptions
        reason = " ".join(str(error).split())[:120]
        raise tree.make_error(
            f"the mesh of {where}, {path},", f"has no convex hull ({reason})", "repair or replace it"
        ) from error


@lru_cache(maxsize=16)
def read_urdf_links(urdf: str) -> tuple[Link, ...]:
    """Return the links of a URDF text, parents first; meshes, named by absolute path, become their convex hulls.

    Raises ConfigError if a mesh cannot be read.
    """
    return read_links(UrdfTree.of_text(urdf), Path)


def link_poses(links: tuple[Link, ...], joints: dict[str, float]) -> np.ndarray:
    """Return the poses ``(L, 4, 4)`` of all links in the root frame at joint positions by name (rad or m; zero if omitted)."""
    poses = np.empty((len(links), 4, 4))
    for index, link in enumerate(links):
        moved = np.eye(4)
        value = joints.get(link.joint, 0.0)
        if link.joint_type == "prismatic":
            moved[0, 3] = value
        elif link.joint_type != "fixed":  # rotation about X of the joint frame
            moved[1, 1] = moved[2, 2] = math.cos(value)
            moved[2, 1] = math.sin(value)
            moved[1, 2] = -moved[2, 1]
        link_to_parent = link.joint_to_parent @ moved @ link.link_to_joint
        poses[index] = link_to_parent if link.parent < 0 else poses[link.parent] @ link_to_parent
    return poses


def poses_at(links: tuple[Link, ...], joints: dict[str, float]) -> dict[str, np.ndarray]:
    """Return each link's pose ``(4, 4)`` in the root frame at joint positions by name (rad or m; zero if omitted)."""
    return {link.name: pose for link, pose in zip(links, link_poses(links, joints), strict=True)}


@lru_cache(maxsize=16)
def read_rigid_bodies(urdf: str, palm: str) -> tuple[tuple[Link, ...], dict[str, tuple[str, np.ndarray]]]:
    """Return the robot's bodies: each link merged with the links fixed to it, except the palm, which stays separate.

    Fewer joints make the simulation faster. The palm is a separate body because it may touch objects that the wrist may not.
    Also returns, for every link, the name of its body and its pose ``(4, 4)`` in that body.
    """
    links = read_urdf_links(urdf)
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
    return tuple(_merge_links(links, members[name], part_of, order) for name in order), part_of


def _merge_links(
    links: tuple[Link, ...],
    members: list[tuple[Link, np.ndarray]],
    part_of: dict[str, tuple[str, np.ndarray]],
    order: list[str],
) -> Link:
    """Return the first member merged with the others into one body (parallel axis theorem)."""
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
