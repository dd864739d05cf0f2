"""URDF reader: the first rigid object of a file, with links on fixed joints merged, and optionally its movable joints."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.articulation import Articulation, AssetLink, LinkTree
from manitwin.assets.asset import Asset, CollisionShape, Contact, Inertial, combined_inertial
from manitwin.assets.asset_files import MESH_LIMITS, AssetFiles
from manitwin.assets.filled_hulls import filled_hulls
from manitwin.assets.joints import Joints
from manitwin.assets.licence_text import stated_licence
from manitwin.assets.read import only_file
from manitwin.assets.readers.drake_friction import drake_contact
from manitwin.assets.readers.joint_elements import urdf_joints
from manitwin.assets.readers.partnet_mobility import with_category
from manitwin.assets.readers.upright import Shapes, concatenate_links, upright_shapes
from manitwin.assets.readers.urdf_links import Placed, chosen_links
from manitwin.assets.readers.urdf_shapes import LinkShapes
from manitwin.assets.root import root_of
from manitwin.errors import AssetError
from manitwin.formats.meshes.source import MeshLimits
from manitwin.formats.xml_file import comments_before, number, text_of
from manitwin.robots.urdf import UrdfTree, inertial_of
from manitwin.robots.urdf_reader import JOINT_TYPES, UrdfRules, read_urdf

_TRIPLES = frozenset({"xyz", "rpy", "rgba", "size", "scale"})
_AXES, _RGBA, _SOFT = 3, 4, "deformable"
_WORLD = "world"
"""A link that Drake and Gazebo know without a <link> element."""

_OF_PYBULLET = ("plane", "cdf")

_OF_SOME_LOADERS = ("spherical", "ball", "screw", "universal")
"""Joint types of PyBullet and MuJoCo (the first) and Drake that are not in the specification."""

RULES = UrdfRules(
    error=AssetError,
    joint_types=(*JOINT_TYPES, "floating", "planar", *_OF_SOME_LOADERS),
    geometries=("box", "capsule", "cylinder", "mesh", "sphere"),
    simulated=False,
)


@dataclass(frozen=True)
class UrdfObject:
    """The selected object of a URDF: its links with their poses in the frame of the first, and its joint tree."""

    file: Path
    tree: UrdfTree
    links: tuple[Placed, ...]
    files: AssetFiles
    moving: LinkTree | None = None


def read(path: Path, root: Path | None = None, limits: MeshLimits = MESH_LIMITS, *, joints: Joints = "part") -> Asset:
    """Read a URDF, or the only one in a folder; the asset's axes are those of the first link of the object.

    Meshes are looked up in the folder of the file and in those above it up to ``root`` (default: ``root_of`` the path); those
    of ``package://`` first in the folder with the name of the package. Links behind movable joints are left out with a remark,
    locked in the pose of the file, or kept (``joints``). Raises AssetError naming what is broken. Source: the URDF XML
    specification of ROS.
    """
    found = open_urdf(path, root, limits, joints=joints)
    return with_category(asset_of(found, path), found.file, found.files)


def open_urdf(
    path: Path, root: Path | None = None, limits: MeshLimits = MESH_LIMITS, *, joints: Joints = "part"
) -> UrdfObject:
    """Parse a URDF and select the object in it; raises AssetError."""
    file = only_file(path) if path.is_dir() else path
    files = AssetFiles(root or root_of(path), file.resolve().parent, limits)
    tree = read_urdf(file, RULES, file.name, partial(_rewrite_leniently, files=files, name=file.name))
    files.used.add(file.resolve())
    links, moving = chosen_links(tree, files, joints)
    return UrdfObject(file, tree, links, files, moving)


def _rewrite_leniently(root: etree._Element, files: AssetFiles, name: str) -> None:
    """Rewrite a URDF as lenient loaders read it: without extensions of other tools, and with links that only joints name."""
    _remove_namespace(root)
    _number_repeated_joints(root, files)
    for soft in root.findall(_SOFT):
        said = f"<{_SOFT}> {(soft.get('name') or '')[:60]!r} is PyBullet's for what bends: it is no rigid body"
        if root.find("link") is None:
            raise AssetError(
                f"{name}: its only body, {said}, and only rigid ones are read from URDF; give a URDF with a <link>"
            )
        files.remark(f"{said} and was left out")
    _remove_pybullet_shapes(root, files)
    for geometry in root.iter("geometry"):
        for foreign in [child for child in geometry.iterchildren("*") if etree.QName(child).namespace]:
            geometry.remove(foreign)
        first, *others = [*geometry.iterchildren("*")] or [None]
        misplaced = others if first is not None and first.tag in RULES.geometries else []
        for other in misplaced:
            geometry.remove(other)
            files.remark_leniency(f"a <geometry> holds <{str(other.tag)[:40]}> beside its shape, which was left out")
    for mesh in root.iter("mesh"):
        factors = (mesh.get("scale") or "").replace(",", " ").split()
        if len(factors) > _AXES:
            mesh.set("scale", " ".join(factors[:_AXES]))
            files.remark_leniency(f"a mesh has {len(factors)} factors of scale, of which the first three were taken")
    for color in root.iter("color"):
        numbers = (color.get("rgba") or "").replace(",", " ").split()
        if len(numbers) > _RGBA:  # urdfdom drops such a colour, and no loader refuses the file
            color.set("rgba", " ".join(numbers[:_RGBA]))
            files.remark_leniency(f"a colour has {len(numbers)} numbers, of which the first four were taken")
    for element in root.iter("origin", "color", "box", "mesh"):
        for key in _TRIPLES.intersection(element.attrib):  # "0.1, 0, 0.2" is read as three numbers
            element.set(key, element.get(key).replace(",", " "))
    _add_absent_parents(root, files)


def _remove_pybullet_shapes(root: etree._Element, files: AssetFiles) -> None:
    """Remove collision shapes that only PyBullet supports: an infinite plane, and a distance field in a file."""
    for collision in [*root.iter("collision")]:
        shapes = [shape for name in _OF_PYBULLET for shape in collision.iterfind(f"geometry/{name}")]
        if shapes:
            collision.getparent().remove(collision)
            files.remark_leniency(f"a <collision> is <{shapes[0].tag}>, which PyBullet alone knows, and was left out")


def _remove_namespace(root: etree._Element) -> None:
    """Remove the namespace of the whole document from its elements; Drake's descriptions have one, and loaders ignore it."""
    namespace = etree.QName(root).namespace
    for element in root.iter(etree.Element) if namespace else ():
        name = etree.QName(element)
        if name.namespace == namespace:
            element.tag = name.localname


def _number_repeated_joints(root: etree._Element, files: AssetFiles) -> None:
    """Number joints of the same name: PyBullet and MuJoCo programs identify them by index, while urdfdom refuses them."""
    seen: set[str] = set()
    for joint in root.findall("joint"):
        name = joint.get("name") or ""
        if name in seen:
            number = next(n for n in itertools.count(2) if f"{name}_{n}" not in seen)
            joint.set("name", f"{name}_{number}")
            files.remark_leniency(f"two joints are called {name[:60]!r}, which urdfdom refuses; both were read")
        seen.add(joint.get("name") or "")


def _add_absent_parents(root: etree._Element, files: AssetFiles) -> None:
    links = {link.get("name") for link in root.findall("link")}
    parents = dict.fromkeys(parent.get("link") for parent in root.iterfind("joint/parent"))
    for name in [name for name in parents if links and name and name not in links]:
        root.insert(0, etree.Element("link", name=name))
        if name != _WORLD:
            files.remark_leniency(
                f"a joint hangs from the link {name[:60]!r}, which is nowhere; it was read as one without a shape"
            )


def asset_of(found: UrdfObject, path: Path, contact: Contact | None = None) -> Asset:
    """Return the asset that the URDF elements describe; ``contact`` replaces their friction."""

    def shapes(turn: bool) -> list[Shapes]:
        read = LinkShapes(found.tree, found.file, found.files, turn_gltf=turn)
        return [read.shapes([link]) for link in found.links]

    by_link = upright_shapes(shapes, found.files)
    visual, collision, owners = concatenate_links(by_link)
    if not visual and not collision and not found.files.missing:
        raise found.tree.make_error("", "no link of it has a shape", "give it a visual or a collision shape")
    licence, attribution = stated_licence(comments_before(found.tree.element))
    return Asset(
        format="urdf",
        path=path,
        name=found.tree.element.get("name") or found.file.stem,
        visual=tuple(visual),
        collision=tuple(collision),
        up="z",
        unit_m=1.0,
        inertial=_inertial(found, collision),
        contact=contact or _declared_contact(found),
        license=licence,
        attribution=attribution,
        files=found.files.sorted_files(),
        missing_files=found.files.missing_names(),
        remarks=tuple(found.files.remarks),
        lenient=tuple(found.files.lenient),
        joints=urdf_joints(found.tree),
        partial=found.files.partial,
        articulation=None if found.moving is None else _articulation(found, found.moving, owners),
    )


def _articulation(found: UrdfObject, moving: LinkTree, owners: list[int]) -> Articulation:
    """Return links and joints; ``owners`` are the indices of the links of each visual part, before merging."""
    links = []
    for place, head in enumerate(moving.heads):
        mine = tuple(link for link, of in zip(found.links, moving.link_of, strict=True) if of == place)
        links.append(AssetLink(str(found.links[head][0].get("name")), declared_inertial(mine)))
    return Articulation(tuple(links), moving.joints, tuple(moving.link_of[owner] for owner in owners))


def _inertial(found: UrdfObject, collision: list[CollisionShape]) -> Inertial:
    """Return the declared inertial, or that of the collision hulls filled with Isaac Gym's <density>."""
    declared = declared_inertial(found.links)
    said = [link.find("inertial/density") for link, _ in found.links]
    if declared.mass_kg is not None or all(each is None for each in said):
        return declared
    densities = {_value(found, each) for each in said if each is not None}
    density = next(iter(densities))
    if len(densities) > 1 or not density or density < 0:
        return declared
    found.files.remark("its mass follows from a density, which is Isaac Gym's, and the hulls of its collision shapes")
    return filled_hulls((shape.vertices, density) for shape in collision)


def declared_inertial(links: tuple[tuple[etree._Element, np.ndarray], ...]) -> Inertial:
    """Return mass, centre of mass, and inertia about it, of links with their poses ``(4, 4)``, as declared.

    Links without <inertial> are ignored; the inertia is None if a link with a mass has none.
    """
    found = []
    for link, link_to_asset in links:
        declared = inertial_of(link)
        if declared is not None:
            mass_kg, inertial_to_link, tensor = declared
            pose = link_to_asset @ inertial_to_link
            turned = None if tensor is None else pose[:3, :3] @ tensor @ pose[:3, :3].T
            found.append(Inertial(mass_kg, pose[:3, 3], turned))
    with_mass = [entry for entry in found if entry.mass_kg is not None]
    if not with_mass:
        return found[0] if found else Inertial()
    return combined_inertial(with_mass)


def _declared_contact(found: UrdfObject) -> Contact:
    """Return the first declaration of Drake's friction, PyBullet's <contact>, a <gazebo> in a link, or a <gazebo reference>.

    PyBullet's lateral_friction is the single coefficient of a body, for static and dynamic friction. Gazebo's mu1 and mu2 apply
    to two directions (SDF specification, friction/ode): the first is used, with a remark if they differ.
    """
    drake = drake_contact((link for link, _ in found.links), found.files, found.file.name)
    if drake is not None:
        return drake
    for link, _ in found.links:
        contact = link.find("contact")
        if contact is not None:
            friction, restitution = (_value(found, contact.find(tag)) for tag in ("lateral_friction", "restitution"))
            return Contact(friction, friction, restitution)
    gazebo = gazebo_friction(found)
    if gazebo is None:
        root = found.tree.element
        return Contact(of_others=next(root.iter("lateral_friction", "mu1"), None) is not None)
    first, second = gazebo
    if second is not None and second != first:
        found.files.remark(f"mu1 {first} and mu2 {second} are two directions in Gazebo; the first was taken")
    return Contact(first, None)


def gazebo_friction(found: UrdfObject) -> tuple[float, float | None] | None:
    """Return mu1 and mu2 of the first <gazebo> element of the object's links that has mu1, None if there is none."""
    names = {link.get("name") for link, _ in found.links}
    inside = [element for link, _ in found.links for element in link.iter("gazebo")]
    beside = [element for element in found.tree.element.findall("gazebo") if element.get("reference") in names]
    for element in [*inside, *beside]:
        first, second = text_of(element, "mu1"), text_of(element, "mu2")
        if first is not None:
            return (
                number(first, f"{found.file.name}: mu1"),
                None if second is None else number(second, f"{found.file.name}: mu2"),
            )
    return None


def _value(found: UrdfObject, element: etree._Element | None) -> float | None:
    return None if element is None else number(element.get("value"), f"{found.file.name}: {element.tag}")
