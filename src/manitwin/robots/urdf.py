"""URDF as a tree of links and joints, with accessors for its elements; ``urdf_reader`` validates a tree before use.

Source: the URDF specification (http://wiki.ros.org/urdf/XML).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lxml import etree  # type: ignore[import-untyped]
from scipy.spatial.transform import Rotation

from manitwin.errors import ConfigError, ManiTwinError, unknown_name_message
from manitwin.formats.xml_file import add, parse_xml, xml_text
from manitwin.geometry.poses import transform

MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


@dataclass
class UrdfTree:
    """A ``<robot>`` element with links and joints; ``name`` identifies it in messages, ``error`` is the exception raised."""

    name: str
    element: etree._Element
    error: type[ManiTwinError] = ConfigError

    @classmethod
    def of_text(cls, urdf: str) -> UrdfTree:
        """Parse a URDF text written by ``text``."""
        element = parse_xml(urdf, "robot", "robot", refusal=ConfigError, comments=False)
        return cls(f"robot {element.get('name')}", element)

    @property
    def links(self) -> dict[str, etree._Element]:
        """The links by name, in the file's order."""
        return {link.get("name"): link for link in self.element.findall("link")}

    @property
    def joints(self) -> dict[str, etree._Element]:
        """The joints by name, in the file's order."""
        return {joint.get("name"): joint for joint in self.element.findall("joint")}

    def make_error(self, where: str, cause: str, remedy: str) -> ManiTwinError:
        """Return the exception for an invalid part of the file, with a one-line message."""
        return self.error(f"{self.name}: {where}{' ' if where else ''}{cause}; {remedy}")

    def link(self, name: str) -> etree._Element:
        """Return a link; raises the tree's error naming the existing links."""
        if name not in self.links:
            raise self.error(f"{self.name}: {unknown_name_message('link', name, self.links)}")
        return self.links[name]

    def joint(self, name: str) -> etree._Element:
        """Return a joint; raises the tree's error naming the existing movable joints."""
        if name not in self.joints:
            movable = [key for key, joint in self.joints.items() if joint.get("type") != "fixed"]
            raise self.error(f"{self.name}: {unknown_name_message('joint', name, movable)}")
        return self.joints[name]

    def roots(self) -> list[str]:
        """Return the links without a parent joint, in the file's order."""
        held = {child_of(joint) for joint in self.joints.values()}
        return [name for name in self.links if name not in held]

    def subtree_links(self, *links: str) -> tuple[str, ...]:
        """Return the given links and all their descendants, parents first; raises the tree's error for an unknown link."""
        for name in set(links) - set(self.links):
            self.link(name)
        children: dict[str, list[str]] = {}
        for joint in self.joints.values():
            children.setdefault(parent_of(joint), []).append(child_of(joint))
        order = list(links)
        for name in order:
            order += children.get(name, [])
        return tuple(order)

    def keep_subtree(self, link: str) -> None:
        """Remove every link that is not ``link`` or one of its descendants, with its joint."""
        kept = set(self.subtree_links(link))
        for name, element in self.links.items():
            if name not in kept:
                self.element.remove(element)
        for joint in self.joints.values():
            if child_of(joint) not in kept or child_of(joint) == link:
                self.element.remove(joint)

    def set_mesh_paths(self, find_mesh: Callable[[str], Path]) -> None:
        """Replace mesh names by the absolute paths that ``find_mesh`` returns."""
        for mesh in self.element.iter("mesh"):
            mesh.set("filename", str(find_mesh(mesh.get("filename"))))

    def collision_meshes(self) -> list[Path]:
        """Return the paths of the collision meshes, in document order."""
        return [Path(mesh.get("filename")) for part in self.element.iter("collision") for mesh in part.iter("mesh")]

    def text(self) -> str:
        """Return the tree as XML text."""
        return xml_text(self.element)


def parent_of(joint: etree._Element) -> str:
    """Return the name of a joint's parent link."""
    return str(joint.find("parent").get("link"))


def child_of(joint: etree._Element) -> str:
    """Return the name of a joint's child link."""
    return str(joint.find("child").get("link"))


def values_of(element: etree._Element, key: str, default: str = "") -> np.ndarray:
    """Return the numbers of a validated attribute, ``(n,)``."""
    return np.array([float(word) for word in element.get(key, default).split()])


def origin_of(element: etree._Element) -> np.ndarray:
    """Return an element's ``<origin>`` as a pose ``(4, 4)``; identity if it has none.

    Roll, pitch and yaw are rotations about the fixed axes x, y, z in that order.
    """
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    rotation = Rotation.from_euler("xyz", values_of(origin, "rpy", "0 0 0")).as_matrix()
    return transform(rotation, values_of(origin, "xyz", "0 0 0"))


def set_origin(element: etree._Element, pose: np.ndarray) -> None:
    """Write a pose ``(4, 4)`` as an element's ``<origin>``."""
    origin = element.find("origin")
    if origin is None:
        origin = add(element, "origin")
    rpy = roll_pitch_yaw(pose[:3, :3])
    origin.set("xyz", " ".join(repr(float(value)) for value in pose[:3, 3]))
    origin.set("rpy", " ".join(repr(float(value)) for value in rpy))


def roll_pitch_yaw(rotation: np.ndarray) -> np.ndarray:
    """Return the angles about fixed x, y, z (rad) of a rotation; in gimbal lock (pitch of a quarter turn) the yaw is 0."""
    if np.hypot(rotation[0, 0], rotation[1, 0]) > 1e-6:
        return np.asarray(Rotation.from_matrix(rotation).as_euler("xyz"))
    sign = -float(np.sign(rotation[2, 0]))
    return np.array([np.arctan2(sign * rotation[0, 1], sign * rotation[0, 2]), sign * np.pi / 2, 0.0])


def geometry_of(shape: etree._Element) -> etree._Element:
    """Return the single geometry of a validated visual or collision element."""
    return next(shape.iterfind("geometry/*"))


def inertial_of(link: etree._Element) -> tuple[float | None, np.ndarray, np.ndarray | None] | None:
    """Return a link's declared mass (kg), the pose ``(4, 4)`` of its inertial frame, and its tensor (kg m^2) ``(3, 3)``.

    The tensor is along the axes of the inertial frame. Returns None without ``<inertial>``; mass or tensor is None if it is
    omitted.
    """
    inertial = link.find("inertial")
    if inertial is None:
        return None
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    tensor = None
    if inertia is not None:
        xx, xy, xz, yy, yz, zz = (float(inertia.get(key, "0")) for key in MOMENTS)
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return None if mass is None else float(mass.get("value")), origin_of(inertial), tensor
