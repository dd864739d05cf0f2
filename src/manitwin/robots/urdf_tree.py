"""A URDF that others wrote, as a tree of links and joints that can be cut, completed and checked.

URDF specification: http://wiki.ros.org/urdf/XML. Kept are links with their shapes and inertias, joints, and materials;
transmissions, plugins and controllers are dropped. Mesh names become absolute paths.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from lxml import etree  # type: ignore[import-untyped]

from manitwin.errors import UsageError, choose_from
from manitwin.robots.urdf_files import UrdfFiles

MAX_NUMBER = 1e6  # no length, mass, moment or limit of an arm comes near
JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed")
GEOMETRIES = ("box", "cylinder", "sphere", "mesh")
_KEPT = ("link", "joint", "material")
_NUMBERS = {
    ("origin", "xyz"): 3,
    ("origin", "rpy"): 3,
    ("axis", "xyz"): 3,
    ("mass", "value"): 1,
    ("box", "size"): 3,
    ("mesh", "scale"): 3,
    ("color", "rgba"): 4,
    **{("inertia", key): 1 for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")},
    **{("limit", key): 1 for key in ("lower", "upper", "velocity", "effort")},
    **{(shape, key): 1 for shape in ("cylinder", "sphere") for key in ("radius", "length")},
    ("mimic", "multiplier"): 1,
    ("mimic", "offset"): 1,
}
_REQUIRED = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "mesh": ("filename",),
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "axis": ("xyz",),
}
_SIZES = ("box", "sphere", "cylinder")


@dataclass
class UrdfTree:
    """A ``<robot>`` element whose links form one tree; ``name`` is what messages call it."""

    name: str
    element: etree._Element

    @property
    def links(self) -> dict[str, etree._Element]:
        """The links by name, in the file's order."""
        return {link.get("name"): link for link in self.element.findall("link")}

    @property
    def joints(self) -> dict[str, etree._Element]:
        """The joints by name, in the file's order."""
        return {joint.get("name"): joint for joint in self.element.findall("joint")}

    def link(self, name: str) -> etree._Element:
        """Return a link; raises UsageError naming those there are."""
        if name not in self.links:
            raise UsageError(f"{self.name}: {choose_from('link', name, self.links)}")
        return self.links[name]

    def joint(self, name: str) -> etree._Element:
        """Return a joint; raises UsageError naming the movable ones there are."""
        if name not in self.joints:
            movable = [key for key, joint in self.joints.items() if joint.get("type") != "fixed"]
            raise UsageError(f"{self.name}: {choose_from('joint', name, movable)}")
        return self.joints[name]

    def below(self, link: str) -> tuple[str, ...]:
        """Return a link and all that hang from it, parents first; raises UsageError where the link is not there."""
        self.link(link)
        children: dict[str, list[str]] = {}
        for joint in self.joints.values():
            children.setdefault(parent_of(joint), []).append(child_of(joint))
        order = [link]
        for name in order:
            order += children.get(name, [])
        return tuple(order)

    def keep_below(self, link: str) -> None:
        """Drop every link that does not hang from ``link``, with its joint."""
        kept = set(self.below(link))
        for name, element in self.links.items():
            if name not in kept:
                self.element.remove(element)
        for joint in self.joints.values():
            if child_of(joint) not in kept or child_of(joint) == link:
                self.element.remove(joint)

    def use_meshes(self, files: UrdfFiles) -> None:
        """Write the meshes' absolute paths; raises UsageError where one is missing or outside the robot's folder."""
        for mesh in self.element.iter("mesh"):
            mesh.set("filename", str(files.mesh(mesh.get("filename", ""))))

    def collision_meshes(self) -> list[Path]:
        """Return the files of the collision meshes, in order."""
        return [Path(mesh.get("filename")) for part in self.element.iter("collision") for mesh in part.iter("mesh")]

    def text(self) -> str:
        """Return the tree as XML."""
        return etree.tostring(self.element, encoding="unicode")


def parent_of(joint: etree._Element) -> str:
    """Return the name of a joint's parent link."""
    return str(joint.find("parent").get("link"))


def child_of(joint: etree._Element) -> str:
    """Return the name of a joint's child link."""
    return str(joint.find("child").get("link"))


def parse_xml(path: Path, tag: str = "robot") -> etree._Element:
    """Parse a file without document type, entities and network; raises UsageError naming the file and what is wrong."""
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, remove_comments=True)
    try:
        root = etree.fromstring(path.read_bytes(), parser)
    except (OSError, etree.XMLSyntaxError) as error:
        raise UsageError(f"{path}: not a URDF: {' '.join(str(error).split())[:120]}; mend it") from error
    if root.getroottree().docinfo.doctype:
        raise UsageError(f"{path}: its XML declares a document type, which is not read; remove it")
    if root.tag != tag:
        raise UsageError(f"{path}: its XML is <{str(root.tag)[:40]}>, not <{tag}>; give a URDF")
    return root


def read_tree(path: Path) -> UrdfTree:
    """Read a URDF as it is; raises UsageError where it is not one tree, or a number or shape is none that can be used."""
    tree = UrdfTree(str(path), parse_xml(path))
    for element in list(tree.element):
        if element.tag not in _KEPT:
            tree.element.remove(element)
    _check_names(tree)
    _check_one_tree(tree)
    for element in tree.element.iter():
        _check_numbers(tree, element)
    _check_shapes(tree)
    return tree


def _check_names(tree: UrdfTree) -> None:
    for tag, found in (("link", tree.links), ("joint", tree.joints)):
        if len(found) != len(tree.element.findall(tag)) or None in found:
            raise UsageError(f"{tree.name}: two {tag}s have one name, or one has none; give each its own")


def _check_one_tree(tree: UrdfTree) -> None:
    held = []
    for name, joint in tree.joints.items():
        for end in ("parent", "child"):
            if joint.find(end) is None:
                raise UsageError(f"{tree.name}: joint {name} has no {end} link; name one of {', '.join(tree.links)}")
            tree.link(joint.find(end).get("link", ""))
        if joint.get("type") not in JOINT_TYPES:
            raise UsageError(f"{tree.name}: joint {name} is {joint.get('type')!r}, not one of {', '.join(JOINT_TYPES)}")
        held.append(child_of(joint))
    roots = [name for name in tree.links if name not in held]
    if len(roots) != 1 or len(held) != len(set(held)) or len(tree.below(roots[0])) != len(tree.links):
        raise UsageError(f"{tree.name}: its links are no tree with one root: roots are {', '.join(roots) or 'none'}")


def _check_shapes(tree: UrdfTree) -> None:
    """Every shape has one geometry that is known, every inertial a mass that is not negative and a tensor."""
    for shape in tree.element.iter("visual", "collision"):
        geometry = shape.find("geometry")
        if geometry is None or len(geometry) != 1 or geometry[0].tag not in GEOMETRIES:
            raise UsageError(f"{tree.name}: a {shape.tag} has no geometry that is one of {', '.join(GEOMETRIES)}")
    for inertial in tree.element.iter("inertial"):
        link = inertial.getparent().get("name")
        if inertial.find("mass") is None or inertial.find("inertia") is None:
            raise UsageError(
                f"{tree.name}: the inertial of {link} lacks <mass> or <inertia>; give both, or leave it out"
            )
        if float(inertial.find("mass").get("value")) < 0:
            raise UsageError(f"{tree.name}: the mass of {link} is negative; mend it")
    for axis in tree.element.iter("axis"):
        if not any(float(word) for word in axis.get("xyz").split()):
            raise UsageError(f"{tree.name}: the axis of {axis.getparent().get('name')} has no direction; give it one")


def _check_numbers(tree: UrdfTree, element: etree._Element) -> None:
    missing = [key for key in _REQUIRED.get(element.tag, ()) if element.get(key) is None]
    if missing:
        raise UsageError(f"{tree.name}: a <{element.tag}> lacks {', '.join(missing)}; give it")
    for key, text in _attributes(element):
        count = _NUMBERS[element.tag, key]
        try:
            values = [float(word) for word in text.split()]
        except ValueError:
            values = []
        least = 0.0 if element.tag in _SIZES else -MAX_NUMBER
        if len(values) != count or not all(math.isfinite(value) and least <= value <= MAX_NUMBER for value in values):
            raise UsageError(
                f"{tree.name}: <{element.tag} {key}={text[:40]!r}> wants {count} usable number(s); mend it"
            )


def _attributes(element: etree._Element) -> Iterator[tuple[str, str]]:
    return ((key, text) for key, text in element.attrib.items() if (element.tag, key) in _NUMBERS)
