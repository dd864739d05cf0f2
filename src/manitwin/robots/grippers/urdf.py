"""A hand's links, joints and collision shapes as its URDF has them, and where the links are at given joints.

Only what a trial needs is read: visuals, materials, transmissions and plugins are left, since many a hand's URDF names
files for them that are not there.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]
from scipy.spatial.transform import Rotation

from manitwin.errors import UsageError
from manitwin.geometry.poses import rotation_between, transform
from manitwin.geometry.rigid_body import principal_frame

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed")
PACKAGE = "package://"


@dataclass(frozen=True)
class LinkShape:
    """A convex collision shape of a link: a box (``half_extents_m``), a sphere (``radius_m``) or ``corners_m (V, 3)``."""

    shape_to_link: np.ndarray
    half_extents_m: np.ndarray | None = None
    radius_m: float | None = None
    corners_m: np.ndarray | None = None

    def bounding_box(self) -> tuple[np.ndarray, np.ndarray]:
        """Return ``(box_to_link (4, 4), half_extents_m (3,))`` of a box around the shape."""
        if self.half_extents_m is not None:
            return self.shape_to_link, self.half_extents_m
        if self.radius_m is not None:
            return self.shape_to_link, np.full(3, self.radius_m)
        if self.corners_m is None:
            raise AssertionError("a shape is a box, a sphere or corners")
        low, high = self.corners_m.min(0), self.corners_m.max(0)
        return self.shape_to_link @ transform(translation=(low + high) / 2), (high - low) / 2


@dataclass(frozen=True)
class Link:
    """A link with the joint that holds it.

    ``parent`` is the index of its parent (-1: the root), ``joint_to_parent`` the joint's frame, whose X axis is the joint's
    axis, in the parent's, and ``joint_to_link`` the same frame in the link's own. ``limits`` are rad, or m for a
    prismatic joint.
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


def read_urdf(path: Path, root: Path) -> tuple[Link, ...]:
    """Read a URDF's links, parents before children; meshes become their convex hulls.

    Meshes lie below ``root``. Raises UsageError naming the file where it is no URDF of a tree, or a mesh is not there.
    """
    try:
        robot = etree.parse(path, etree.XMLParser(remove_comments=True, resolve_entities=False)).getroot()
    except (OSError, etree.XMLSyntaxError) as error:
        raise UsageError(f"{path}: not a URDF: {error}") from error
    elements = {link.get("name"): link for link in robot.findall("link")}
    holders = {joint.find("child").get("link"): joint for joint in robot.findall("joint")}
    roots = [name for name in elements if name not in holders]
    if len(roots) != 1:
        raise UsageError(f"{path}: not a URDF of one tree: {len(roots)} links have no parent")
    order = [roots[0]]
    for name in order:
        order += [c for c, j in holders.items() if j.find("parent").get("link") == name]
    return tuple(_link(path, root, elements[name], holders.get(name), order) for name in order)


def _link(path: Path, root: Path, element: etree._Element, joint: etree._Element | None, order: list[str]) -> Link:
    shapes = tuple(_shape(path, root, collision) for collision in element.findall("collision"))
    mass_kg, center_m, inertia = _inertial(element.find("inertial"))
    moments, axes = principal_frame(inertia)
    common = (mass_kg, center_m, moments, axes, shapes)
    if joint is None:
        return Link(element.get("name"), -1, "", "fixed", np.eye(4), np.eye(4), (0.0, 0.0), *common)
    kind, limit = joint.get("type"), joint.find("limit")
    if kind not in JOINT_TYPES:
        raise UsageError(f"{path}: joint {joint.get('name')} is {kind}; a hand's are {', '.join(JOINT_TYPES)}")
    limits = (-np.inf, np.inf)
    if kind in ("revolute", "prismatic"):
        limits = float(limit.get("lower")), float(limit.get("upper"))
    axis = joint.find("axis")
    direction = np.array([1.0, 0, 0] if axis is None else _numbers(axis.get("xyz")))
    along_axis = transform(rotation_between(np.array([1.0, 0, 0]), direction / np.linalg.norm(direction)))
    return Link(
        element.get("name"),
        order.index(joint.find("parent").get("link")),
        joint.get("name"),
        kind,
        _origin(joint) @ along_axis,
        along_axis,
        limits,
        *common,
    )


def _numbers(text: str) -> list[float]:
    return [float(part) for part in text.split()]


def _origin(element: etree._Element) -> np.ndarray:
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    rotation = Rotation.from_euler("xyz", _numbers(origin.get("rpy", "0 0 0"))).as_matrix()
    return transform(rotation, np.array(_numbers(origin.get("xyz", "0 0 0"))))


def _inertial(element: etree._Element | None) -> tuple[float, np.ndarray, np.ndarray]:
    if element is None:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    pose, values = _origin(element), element.find("inertia")
    xx, xy, xz, yy, yz, zz = (float(values.get(k)) for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    inertia = pose[:3, :3] @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ pose[:3, :3].T
    return float(element.find("mass").get("value")), pose[:3, 3], inertia


def _shape(path: Path, root: Path, collision: etree._Element) -> LinkShape:
    pose, shape = _origin(collision), collision.find("geometry")[0]
    if shape.tag == "box":
        return LinkShape(pose, half_extents_m=np.array(_numbers(shape.get("size"))) / 2)
    if shape.tag == "sphere":
        return LinkShape(pose, radius_m=float(shape.get("radius")))
    if shape.tag == "cylinder":
        cylinder = trimesh.creation.cylinder(float(shape.get("radius")), float(shape.get("length")), sections=24)
        return LinkShape(pose, corners_m=np.asarray(cylinder.vertices))
    if shape.tag == "mesh":
        mesh = trimesh.load_mesh(_mesh_path(path, root, shape.get("filename")))
        scale = np.array(_numbers(shape.get("scale", "1 1 1")))
        return LinkShape(pose, corners_m=np.asarray(trimesh.convex.convex_hull(mesh).vertices) * scale)
    raise UsageError(f"{path}: a collision shape is a {shape.tag}; a hand's are box, sphere, cylinder or mesh")


def _mesh_path(path: Path, root: Path, name: str) -> Path:
    """Return where a mesh is: beside the URDF, or for ``package://`` below the nearest folder above it that has it."""
    relative = name.removeprefix(PACKAGE).removeprefix("file://")
    folders = [path.parent, *path.parent.parents] if name.startswith(PACKAGE) else [path.parent]
    for folder in folders:
        found = (folder / relative).resolve()
        if found.is_relative_to(root.resolve()) and found.is_file():
            return found
    raise UsageError(f"{path}: mesh {name} is not below {root}; put it there")


def link_poses(links: tuple[Link, ...], joints: dict[str, float]) -> np.ndarray:
    """Return the poses ``(L, 4, 4)`` of all links in the root's frame, at joint angles (rad, or m) by name, else zero."""
    poses = np.empty((len(links), 4, 4))
    for index, link in enumerate(links):
        moved = np.eye(4)
        value = joints.get(link.joint, 0.0)
        if link.joint_type == "prismatic":
            moved[0, 3] = value
        elif link.joint_type != "fixed":
            moved[:3, :3] = Rotation.from_rotvec([value, 0, 0]).as_matrix()
        # rotation axis X of the joint's frame, which the link carries along
        link_to_parent = link.joint_to_parent @ moved @ np.linalg.inv(link.joint_to_link)
        poses[index] = link_to_parent if link.parent < 0 else poses[link.parent] @ link_to_parent
    return poses
