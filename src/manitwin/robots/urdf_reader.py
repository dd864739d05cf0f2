"""URDF reader with validation, for robots, hands and assets: every element that the caller's rules use is checked.

Source: the URDF specification (http://wiki.ros.org/urdf/XML).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from lxml import etree  # type: ignore[import-untyped]

from manitwin.errors import ConfigError, ManiTwinError, unknown_name_message
from manitwin.formats.xml_file import MAX_NUMBER, read_xml
from manitwin.robots.urdf import MOMENTS, UrdfTree, child_of, values_of

XACRO = ("http://www.ros.org/wiki/xacro", "http://wiki.ros.org/xacro", "http://ros.org/wiki/xacro")
"""Namespaces of xacro elements."""
JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed")
_COUNTS: dict[tuple[str, str], tuple[int, ...]] = {
    ("origin", "xyz"): (3,),
    ("origin", "rpy"): (3,),
    ("axis", "xyz"): (3,),
    ("mass", "value"): (1,),
    ("box", "size"): (3,),
    ("mesh", "scale"): (3,),
    ("color", "rgba"): (4,),
    **{("inertia", key): (1,) for key in MOMENTS},
    **{("limit", key): (1,) for key in ("lower", "upper", "velocity", "effort")},
    **{(shape, key): (1,) for shape in ("cylinder", "sphere", "capsule") for key in ("radius", "length")},
    **{("mimic", key): (1,) for key in ("multiplier", "offset")},
}
_REQUIRED = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "mesh": ("filename",),
    "mass": ("value",),
    "inertia": ("ixx", "iyy", "izz"),
    "axis": ("xyz",),
    "color": ("rgba",),
}
_SIZES = ("box", "sphere", "cylinder", "capsule")


@dataclass(frozen=True)
class UrdfRules:
    """Requirements on a URDF; ``error`` is raised for a file that does not meet them.

    ``shapes`` are the link elements that are read and checked. If ``simulated``, all links must form one tree, joints move
    and inertials are complete. Otherwise the file describes one rigid object: links may be unconnected, inertials may be
    incomplete, a single number may scale a mesh, and comments are kept.
    """

    error: type[ManiTwinError] = ConfigError
    joint_types: tuple[str, ...] = JOINT_TYPES
    geometries: tuple[str, ...] = ("box", "cylinder", "sphere", "mesh")
    shapes: tuple[str, ...] = ("visual", "collision")
    simulated: bool = True


ROBOT = UrdfRules()
HAND = UrdfRules(shapes=("collision",))
"""Visuals are not read, because many hand URDFs name visual mesh files that do not exist."""


def read_urdf(
    path: Path,
    rules: UrdfRules = ROBOT,
    name: str | None = None,
    prepare: Callable[[etree._Element], None] | None = None,
) -> UrdfTree:
    """Read a URDF and check everything that the rules use; ``prepare`` may modify its root element first.

    Raises the rules' error, which names the file (``name`` in messages, by default its path), the element, the cause and the
    remedy.
    """
    name = name or str(path)
    root = read_xml(path, "robot", name=name, refusal=rules.error, comments=not rules.simulated)
    if prepare is not None:
        prepare(root)
    tree = UrdfTree(name, root, rules.error)
    if rules.simulated and (macro := _first_macro(root)) is not None:
        raise tree.make_error(
            f"<{macro}>", "is a xacro file, not a URDF", "run 'xacro FILE > FILE.urdf' and give the result"
        )
    _check_tree(tree, rules)
    for link_name, link in tree.links.items():
        _check_link(tree, rules, f"link {link_name!r}", link)
    for joint_name, joint in tree.joints.items():
        read = ("origin", "axis", "limit", "mimic") if rules.simulated else ("origin",)
        _check_attributes(tree, rules, f"joint {joint_name!r}", joint, read)
        if (
            rules.simulated
            and joint.get("type") != "fixed"
            and not all(values_of(a, "xyz").any() for a in joint.findall("axis"))
        ):
            raise tree.make_error(f"the axis of joint {joint_name!r}", "has no direction", "give it one")
    for material in tree.element.findall("material"):
        _check_attributes(tree, rules, f"material {material.get('name')!r}", material, ("color",))
    return tree


def _first_macro(root: etree._Element) -> str | None:
    """Return the qualified name of the first xacro element, or None."""
    for element in root.iter(etree.Element):
        if etree.QName(element).namespace in XACRO:
            return f"{element.prefix}:{etree.QName(element).localname}"
    return None


def _check_tree(tree: UrdfTree, rules: UrdfRules) -> None:
    """Check that links and joints have unique names and that the links form a tree."""
    if tree.element.find("link") is None:
        raise tree.make_error("", "it has no <link>", "give a URDF with one")
    for tag in ("link", "joint"):
        names = Counter(element.get("name") for element in tree.element.findall(tag))
        for name, count in names.items():
            if not name:
                raise tree.make_error(f"a <{tag}>", "has no name", "give it one")
            if count > 1:
                raise tree.make_error(f"{tag} {name!r}", f"occurs {count} times", "give each its own name")
    links, holders = tree.links, dict[str, str]()
    for name, joint in tree.joints.items():
        for end in ("parent", "child"):
            link = joint.find(end)
            if link is None or not link.get("link"):
                raise tree.make_error(f"joint {name!r}", f"has no {end} link", f"name one of {', '.join(links)}")
            if link.get("link") not in links:
                unknown = unknown_name_message("link", link.get("link"), links)
                raise tree.error(f"{tree.name}: the {end} of joint {name!r} is an {unknown}")
        if joint.get("type") not in rules.joint_types:
            kinds = ", ".join(rules.joint_types)
            raise tree.make_error(f"joint {name!r}", f"is of the type {joint.get('type')!r}", f"valid are {kinds}")
        other = holders.setdefault(child_of(joint), name)
        if other != name:
            two = f"is the child of two joints, {other!r} and {name!r}"
            raise tree.make_error(f"link {child_of(joint)!r}", two, "the links must form a tree: remove one")
    roots = tree.roots()
    reached = set(tree.subtree_links(*roots))
    if circle := [name for name in links if name not in reached]:
        remedy = "the links must form a tree: remove one"
        raise tree.make_error(f"the joints of {', '.join(circle)}", "form a loop", remedy)
    if rules.simulated and len(roots) > 1:
        remedy = "the links must form a tree with one root: join them"
        raise tree.make_error(f"the links {', '.join(roots)}", "all have no parent", remedy)


def _check_link(tree: UrdfTree, rules: UrdfRules, where: str, link: etree._Element) -> None:
    """Check a link's shapes, each with one supported geometry, and its mass properties."""
    for tag in rules.shapes:
        for index, shape in enumerate(link.findall(tag)):
            at = f"{where} {tag} {index}"
            _check_attributes(tree, rules, at, shape, ("origin", "material/color"))
            geometries = list(shape.iterfind("geometry/*"))
            one = len(geometries) == 1 == len(shape.findall("geometry"))
            if not one or geometries[0].tag not in rules.geometries:
                named = ", ".join(f"<{geometry.tag}>" for geometry in geometries) or "nothing"
                valid = f"give it one of {', '.join(rules.geometries)}"
                raise tree.make_error(at, f"has {named[:80]} as its <geometry>", valid)
            _check_attributes(tree, rules, at, shape, ("geometry/*",))
    for inertial in link.findall("inertial"):
        if rules.simulated and (inertial.find("mass") is None or inertial.find("inertia") is None):
            raise tree.make_error(f"the inertial of {where}", "lacks <mass> or <inertia>", "give both, or leave it out")
        _check_attributes(tree, rules, f"the inertial of {where}", inertial, ("origin", "mass", "inertia"))
        if rules.simulated and float(inertial.find("mass").get("value")) < 0:
            raise tree.make_error(f"the mass of {where}", "is negative", "mend it")


def _check_attributes(
    tree: UrdfTree, rules: UrdfRules, where: str, parent: etree._Element, paths: tuple[str, ...]
) -> None:
    """Check the required attributes of the elements at ``paths`` below ``parent``, and the ranges of their numbers."""
    for element in (found for path in paths for found in parent.iterfind(path)):
        required = MOMENTS if element.tag == "inertia" and rules.simulated else _REQUIRED.get(element.tag, ())
        for key in required:
            if not element.get(key):
                raise tree.make_error(f"the <{element.tag}> of {where}", f"lacks {key}", "give it")
        for key, text in element.attrib.items():
            counts = _COUNTS.get((element.tag, key))
            if counts is None:
                continue
            if element.tag == "mesh" and not rules.simulated:
                counts = (*counts, 1)  # older exporters write one factor for all axes
            try:
                values = [float(word) for word in text.split()]
            except ValueError:
                values = []
            least = 0.0 if element.tag in _SIZES else -MAX_NUMBER
            if len(values) not in counts or not all(math.isfinite(v) and least <= v <= MAX_NUMBER for v in values):
                wanted = f"needs {counts[0]} usable number{'s' if counts[0] > 1 else ''}"
                raise tree.make_error(where, f"has <{element.tag} {key}={text[:40]!r}>, which {wanted}", "mend it")
